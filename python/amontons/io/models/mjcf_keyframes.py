"""Keyframes of a model in MuJoCo's coordinates."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from ...checks import Array
from ...model.parts import Joint
from ...model.presets import Keyframe
from ...model.transforms import Quaternion, conjugate, multiply, rotate
from ...simulation.simulation import Simulation
from .mjcf_draft import Draft, words

Rows = tuple[Array, Array]
"""Entries of qpos and qvel."""


def write_keyframes(draft: Draft) -> None:
    model = draft.model
    if not model.keyframes:
        return
    simulation = Simulation(model)
    start = simulation.q
    for keyframe in model.keyframes:
        simulation.apply_keyframe(keyframe)
        entries = _entries(draft, simulation, start)
        if entries is None:
            draft.lose(f'keyframe "{keyframe.name}"', "of joints that are none here", "none")
            continue
        made = ET.SubElement(draft.sections["keyframe"], "key", name=keyframe.name)
        if keyframe.time:
            made.set("time", words(keyframe.time))
        for tag, index in (("qpos", 0), ("qvel", 1)):
            if entries:
                made.set(tag, words(*np.concatenate([rows[index] for rows in entries])))
        _drives(draft, made, keyframe)
        _moving_scenery(draft, made, keyframe)


def _entries(draft: Draft, simulation: Simulation, start: Array) -> list[Rows] | None:
    """In the order of the file; None where a joint of the file is no coordinate of the model."""
    q, qd = simulation.q, simulation.qd
    found = {}
    for coordinate in draft.model.coordinates.values():
        at = np.array(q[coordinate.q]), np.array(qd[coordinate.qd])
        if coordinate.kind == "free":
            place = coordinate.body, coordinate.joint
            names = [name for name, there in draft.placed.items() if there == place]
        else:
            names = [draft.names.get((coordinate.joint, coordinate.dof), "")]
        if coordinate.kind == "ball":
            joint = draft.model.joints[coordinate.joint]
            turned = draft.placed.get(names[0], (-1, -1))[0] != joint.body_a
            at = _ball(joint, start[coordinate.q], *at, turned=turned)
        for name in names[:1]:
            found[name] = at
    file = [e.get("name", "") for e in draft.root.iter() if e.tag in ("joint", "freejoint") and e.get("name")]
    own = [name for name in file if name in draft.placed]
    if any(name not in found for name in own):
        return None
    return [found[name] for name in own]


def _ball(joint: Joint, start: Array, q: Array, qd: Array, *, turned: bool) -> Rows:
    """MuJoCo's rotation is one from the initial pose, in the axes of the body that the joint carries."""
    first, now = (tuple(map(float, values)) for values in (start, q))
    if turned:
        frame = joint.frame_b.rotation
        change = multiply(first, conjugate(now))  # type: ignore[arg-type]
        rate = tuple(-x for x in rotate(now, tuple(qd.tolist())))  # type: ignore[arg-type]
    else:
        frame = joint.frame_a.rotation
        change = multiply(conjugate(first), now)  # type: ignore[arg-type]
        rate = tuple(qd.tolist())
    turn: Quaternion = multiply(multiply(frame, change), conjugate(frame))
    return np.array(turn), np.array(rotate(frame, rate))  # type: ignore[arg-type]


def _drives(draft: Draft, made: ET.Element, keyframe: Keyframe) -> None:
    """Controls and activations of the actuators that the file has, in its order."""
    places = draft.model.core.controls
    if keyframe.controls and draft.drives:
        made.set("ctrl", words([keyframe.controls[places.index(key)] for key in draft.drives]))
    if keyframe.activations:
        with_state = [a for a, _, _ in draft.drives if a >= 0 and draft.model.actuators[a].dynamics != "none"]
        if with_state:
            made.set("act", words([keyframe.activations[a] for a in with_state]))


def _moving_scenery(draft: Draft, made: ET.Element, keyframe: Keyframe) -> None:
    bodies = [b.body for b in draft.trees.branches if draft.model.bodies[b.body].motion == "kinematic"]
    if bodies:
        made.set("mpos", words([keyframe.positions[b] for b in bodies]))
        made.set("mquat", words([keyframe.orientations[b] for b in bodies]))
