"""Joints of a model in equilibrium: hinges, welds, guides, rods and ropes as forces that they can bear."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...checks import Array
from ...errors import InputError
from ...model.model import Model
from ...model.parts import WORLD, Dof, Joint
from ...model.transforms import ORIGIN, Transform, rotation_matrix

CLOSE = 1e-6
"""Distance over the length of the model, or angle (rad), within which a joint is at its limit or at zero"""


@dataclass(frozen=True, eq=False)
class Tie:
    """The forces that one joint can bear between two blocks; made by `ties_of`."""

    name: str
    a: int
    b: int
    """indices of the blocks; -1 is the world"""
    point: Array
    """(3,) about which its moments are (m)"""
    wrenches: Array
    """(k, 6) force (N) and moment (N m) on block a per unit of each row"""
    one_sided: bool = False
    """whether its rows bear only positive multiples: a rope, a joint at its limit"""


def ties_of(model: Model) -> tuple[tuple[Tie, ...], tuple[str, ...]]:
    """The ties of a model in its initial pose, those of both signs first, and notes on what was left out.

    Raises InputError that names the joint, tendon, actuator or coupling which no equilibrium knows.
    """
    for kind, parts, remedy in (
        ("tendon", model.tendons, "replace it by a joint of the kind distance, which is a rope or a rod"),
        ("actuator", model.actuators, "leave it out, or give its force as a point_load"),
        ("coupling", model.couplings, "leave it out"),
    ):
        if parts:
            raise InputError(
                f'stability: {kind} "{parts[0].name}" has no part in a verdict; {remedy}, or ask a Simulation'
            )
    both: list[Tie] = []
    single: list[Tie] = []
    notes = []
    for joint in model.joints:
        _require_rigid(joint)
        if any(dof.friction for dof in joint.dofs) or joint.ball_friction:
            notes.append(f'joint "{joint.name}": its friction is left out, which is on the safe side')
        for tie in _of_joint(model, joint):
            (single if tie.one_sided else both).append(tie)
    return (*both, *single), tuple(notes)


def _require_rigid(joint: Joint) -> None:
    who = f'stability: joint "{joint.name}"'
    if any(dof.stiffness for dof in joint.dofs) or joint.ball_stiffness:
        raise InputError(
            f"{who} has a spring, whose force depends on a displacement; fix it, free it, or ask a Simulation"
        )
    if any(dof.motor.kind != "none" for dof in joint.dofs):
        raise InputError(f"{who} has a motor; fix it by add_fixed_joint, free it, or ask a Simulation")
    if joint.clearance:
        raise InputError(f"{who} has a clearance; give it none, or ask a Simulation")


def _of_joint(model: Model, joint: Joint) -> list[Tie]:
    frames = [
        (ORIGIN if body == WORLD else model.bodies[int(body)].pose) @ frame  # type: ignore[arg-type]
        for body, frame in ((joint.body_a, joint.frame_a), (joint.body_b, joint.frame_b))
    ]
    if joint.kind == "distance":
        return _rod(model, joint, *frames)
    length = model.length
    point = np.array(frames[0].position)
    screws = _screws(joint, *frames, length)
    # The wrenches that do no work on the screws, both in units in which a displacement by `length` is 1 rad.
    size = np.array([1, 1, 1, length, length, length])
    locked = (
        np.linalg.svd(screws / np.array([length] * 3 + [1.0] * 3))[2][len(screws) :]
        if len(screws)
        else np.eye(6)
    )
    ends = (int(joint.body_a or 0), int(joint.body_b if joint.body_b is not None else WORLD))
    ties = [Tie(joint.name, *ends, point, locked * size)] if len(locked) else []
    return ties + [
        Tie(
            f"{joint.name} at its {which} limit",
            *ends,
            point,
            sign * size * _along(screw, length)[None],
            True,
        )
        for dof, screw in zip(joint.dofs, screws, strict=False)
        for which, sign in _closed(joint, dof, *frames, length)
    ]


def _screws(joint: Joint, a: Transform, b: Transform, length: float) -> Array:
    """(k, 6) velocity at the origin of frame a and spin of each freedom, in world axes."""
    axes = np.array(rotation_matrix(b.rotation))
    rows = []
    apart = (
        np.abs(np.array(a.position) - b.position).max() / length
        + np.abs(np.array(rotation_matrix(a.rotation)) - axes).max()
    )
    if len(joint.dofs) > 1 and apart > CLOSE:
        raise InputError(
            f'stability: joint "{joint.name}" has {len(joint.dofs)} degrees of freedom and stands off its '
            "zero; give its frames in the pose of the bodies"
        )
    for dof in joint.dofs:
        axis = axes @ dof.axis
        if dof.kind == "slide":
            rows.append(np.concatenate((axis, np.zeros(3))))
        else:
            arm = np.array(a.position) - np.array(b(dof.anchor))
            rows.append(np.concatenate((np.cross(axis, arm), axis)))
    if joint.spherical:
        rows += [np.concatenate((np.zeros(3), axis)) for axis in np.eye(3)]
    return np.array(rows).reshape(-1, 6)


def _along(screw: Array, length: float) -> Array:
    scaled = screw / np.array([length] * 3 + [1.0] * 3)
    return scaled / np.linalg.norm(scaled)


def _closed(joint: Joint, dof: Dof, a: Transform, b: Transform, length: float) -> list[tuple[str, float]]:
    """The limits of a freedom at which the joint stands."""
    if math.isinf(dof.lower) and math.isinf(dof.upper):
        return []
    there = 0.0
    if len(joint.dofs) == 1 and dof.kind == "slide":
        inwards = np.array(rotation_matrix(b.rotation)).T @ (np.array(a.position) - b.position)
        there = float(inwards @ dof.axis)
    elif len(joint.dofs) == 1:
        w, *v = (b.inverse() @ a).rotation
        there = 2 * math.atan2(float(np.dot(v, dof.axis)), w)
        there = (there + math.pi) % (2 * math.pi) - math.pi
    near = CLOSE * (length if dof.kind == "slide" else 1.0)
    found = []
    if there <= dof.lower + near:
        found.append(("lower", 1.0))
    if there >= dof.upper - near:
        found.append(("upper", -1.0))
    return found


def _rod(model: Model, joint: Joint, a: Transform, b: Transform) -> list[Tie]:
    """A rod bears both signs, a rope at its length pulls, a strut at its length pushes."""
    point, between = np.array(a.position), np.array(a.position) - np.array(b.position)
    far = float(np.linalg.norm(between))
    near = CLOSE * model.length
    if far <= near:
        raise InputError(f'stability: joint "{joint.name}" joins points of one place; use a ball joint')
    push = np.concatenate((between / far, np.zeros(3)))[None]
    ends = (int(joint.body_a or 0), int(joint.body_b if joint.body_b is not None else WORLD))
    if joint.lower_distance == joint.upper_distance:
        return [Tie(joint.name, *ends, point, push)]
    found = []
    if far >= joint.upper_distance - near:
        found.append(Tie(joint.name, *ends, point, -push, True))
    if far <= joint.lower_distance + near and joint.lower_distance > 0:
        found.append(Tie(joint.name, *ends, point, push, True))
    return found
