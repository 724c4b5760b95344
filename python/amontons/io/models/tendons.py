"""Fixed and spatial tendons."""

from __future__ import annotations

import math

from ...model.drives import PathElement, Tendon, TendonTerm
from .bodies import Bodies, unique_names
from .compiled import Compiled, transform
from .joints import Joints
from .sites import site_frame


def read_tendons(compiled: Compiled, bodies: Bodies, joints: Joints) -> tuple[list[Tendon], dict[int, int]]:
    """The tendons, and our index by MuJoCo's."""
    m = compiled.model
    tendons: list[Tendon] = []
    index: dict[int, int] = {}
    names = unique_names(compiled, "tendon", m.ntendon)
    for t in range(m.ntendon):
        first = int(m.tendon_adr[t])
        wraps = range(first, first + int(m.tendon_num[t]))
        if m.wrap_type[first] == compiled.mujoco.mjtWrap.mjWRAP_JOINT:
            missing = [j for w in wraps if (j := int(m.wrap_objid[w])) not in joints.dof]
            if missing:
                what = f'a tendon of the joint "{compiled.name("jnt", missing[0])}", which is not read'
                compiled.refuse("tendon", t, what, "large")
                continue
            shape = {"terms": tuple(_term(compiled, joints, w) for w in wraps)}
        else:
            shape = {"path": tuple(e for w in wraps for e in _stops(compiled, bodies, w))}
        index[t] = len(tendons)
        tendons.append(Tendon(names[t], **shape, **_properties(compiled, t)))
    return tendons, index


def _term(compiled: Compiled, joints: Joints, w: int) -> TendonTerm:
    joint, dof = joints.dof[int(compiled.model.wrap_objid[w])]
    return TendonTerm(joint, dof, float(compiled.model.wrap_prm[w]))


def _stops(compiled: Compiled, bodies: Bodies, w: int) -> list[PathElement]:
    m, kinds = compiled.model, compiled.mujoco.mjtWrap
    kind, thing, parameter = int(m.wrap_type[w]), int(m.wrap_objid[w]), float(m.wrap_prm[w])
    if kind == kinds.mjWRAP_PULLEY:
        return [PathElement("pulley", divisor=parameter)]
    if kind == kinds.mjWRAP_SITE:
        body, frame = site_frame(compiled, bodies, thing)
        return [PathElement("point", body, frame)]
    own = int(m.geom_bodyid[thing])
    frame = bodies.frame[own] @ transform(m.geom_pos[thing], m.geom_quat[thing])
    side = {}
    if (site := round(parameter)) >= 0:
        side_body, place = site_frame(compiled, bodies, site)
        side = {"side": place.position, "side_body": side_body}
    name = "sphere" if kind == kinds.mjWRAP_SPHERE else "cylinder"
    return [PathElement(name, bodies.at(own), frame, float(m.geom_size[thing, 0]), **side)]


def _properties(compiled: Compiled, t: int) -> dict[str, float]:
    m = compiled.model
    lower, upper = -math.inf, math.inf
    if m.tendon_limited[t] and compiled.enabled("limit"):
        lower, upper = m.tendon_range[t].tolist()
        margin = min(float(m.tendon_margin[t]), 0.5 * (upper - lower))  # as of a joint
        lower, upper = lower + margin, upper - margin
    return {
        "lower": lower,
        "upper": upper,
        "stiffness": float(m.tendon_stiffness[t]) if compiled.enabled("spring") else 0.0,
        "rest_lower": float(m.tendon_lengthspring[t, 0]),
        "rest_upper": float(m.tendon_lengthspring[t, 1]),
        "damping": float(m.tendon_damping[t]) if compiled.enabled("damper") else 0.0,
        "friction": float(m.tendon_frictionloss[t]) if compiled.enabled("frictionloss") else 0.0,
        "armature": float(m.tendon_armature[t]),
    }
