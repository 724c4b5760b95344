"""Equalities: connect and weld close loops, joint couples two coordinates."""

from __future__ import annotations

import math

from numpy.polynomial import Polynomial

from ...model.parts import Coupling, Joint
from ...model.transforms import IDENTITY, Transform, conjugate, multiply
from .bodies import Bodies
from .compiled import Compiled, transform
from .joints import Joints
from .softness import is_soft


def read_equalities(
    compiled: Compiled, bodies: Bodies, joints: Joints, tendon_of: dict[int, int]
) -> list[Coupling]:
    """Adds the joints of connect and weld; returns the couplings."""
    m, kinds = compiled.model, compiled.mujoco.mjtEq
    couplings: list[Coupling] = []
    names = {joint.name for joint in joints.joints}
    if not compiled.enabled("equality"):
        return couplings
    for e in range(m.neq):
        if not m.eq_active0[e]:
            continue  # listed already
        if is_soft(m.eq_solref[e], m.eq_solimp[e]):
            compiled.refuse("eq", e, "a soft equality; equalities are hard here", "none")
        kind = int(m.eq_type[e])  # enums compare with int, not with NumPy's integers
        name = compiled.name("eq", e) or f"equality_{e}"
        if kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
            while name in names:
                name += "_"
            names.add(name)
            joint = _loop(compiled, bodies, e, name, ball=kind == kinds.mjEQ_CONNECT)
            if joint is not None:
                joints.joints.append(joint)
        elif kind == kinds.mjEQ_JOINT:
            couplings += _coupling(compiled, joints, e, name)
        elif kind == kinds.mjEQ_TENDON:
            couplings += _tendon_coupling(compiled, tendon_of, e, name)
    return couplings


def _loop(compiled: Compiled, bodies: Bodies, e: int, name: str, *, ball: bool) -> Joint | None:
    """A joint between the frames that the equality brings together; None between two static bodies."""
    m = compiled.model
    ends = _site_frames(compiled, e) if _has_sites(compiled, e) else _anchors(compiled, e, ball=ball)
    ball = ball or m.eq_data[e, 10] == 0  # torquescale 0: the weld leaves the rotation free
    (body_a, frame_a), (body_b, frame_b) = ((body, bodies.frame[body] @ frame) for body, frame in ends)
    if bodies.at(body_a) == bodies.at(body_b) or (bodies.is_static(body_a) and bodies.is_static(body_b)):
        return None
    if bodies.is_static(body_a):
        body_a, frame_a, body_b, frame_b = body_b, frame_b, body_a, frame_a
    if ball:  # the rotation is free; begin it at zero
        at = [
            bodies.bodies[i].pose.rotation if i >= 0 else IDENTITY for i in map(bodies.at, (body_a, body_b))
        ]
        relative = multiply(conjugate(at[1]), multiply(at[0], frame_a.rotation))
        frame_b = transform(frame_b.position, relative)
    return Joint(
        name=name,
        body_a=bodies.at(body_a),
        body_b=bodies.at(body_b),
        frame_a=frame_a,
        frame_b=frame_b,
        link_a=bodies.link[body_a],
        link_b=bodies.link[body_b],
        spherical=ball,
        collide=True,
        closes_loop=True,
    )


def _has_sites(compiled: Compiled, e: int) -> bool:
    return compiled.model.eq_objtype[e] == compiled.mujoco.mjtObj.mjOBJ_SITE


def _site_frames(compiled: Compiled, e: int) -> list[tuple[int, Transform]]:
    m = compiled.model
    sites = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
    return [(int(m.site_bodyid[s]), transform(m.site_pos[s], m.site_quat[s])) for s in sites]


def _anchors(compiled: Compiled, e: int, *, ball: bool) -> list[tuple[int, Transform]]:
    """eq_data of connect: the anchor in body 1, in body 2; of weld: the anchor in body 2, the one in body 1,
    and the orientation of body 2 in body 1 (MuJoCo, API reference, mjEQ_CONNECT and mjEQ_WELD)."""
    m = compiled.model
    data = m.eq_data[e]
    first, second = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
    if ball:
        return [(first, transform(data[:3], IDENTITY)), (second, transform(data[3:6], IDENTITY))]
    return [(first, transform(data[3:6], data[6:10])), (second, transform(data[:3], IDENTITY))]


def _coupling(compiled: Compiled, joints: Joints, e: int, name: str) -> list[Coupling]:
    """q_a - ref_a = p(q_b - ref_b)."""
    m = compiled.model
    first, second = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
    if first not in joints.dof or (second >= 0 and second not in joints.dof):
        compiled.refuse("eq", e, "an equality of joints that are not supported", "large")
        return []
    joint_a, dof_a = joints.dof[first]
    joint_b, dof_b = joints.dof[second] if second >= 0 else (-1, 0)
    shifts = [float(m.qpos0[m.jnt_qposadr[j]]) if j >= 0 else None for j in (first, second)]
    coefficients = _polynomial(compiled, e, shifts[0] or 0.0, shifts[1])
    return [Coupling(name, joint_a, dof_a, joint_b, dof_b, coefficients)] if coefficients else []


def _tendon_coupling(compiled: Compiled, tendon_of: dict[int, int], e: int, name: str) -> list[Coupling]:
    """l_a - l_a0 = p(l_b - l_b0), with the lengths at the initial configuration."""
    m = compiled.model
    first, second = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
    if first not in tendon_of or (second >= 0 and second not in tendon_of):
        compiled.refuse("eq", e, "an equality of tendons that are not supported", "large")
        return []
    shift = float(m.tendon_length0[second]) if second >= 0 else None
    coefficients = _polynomial(compiled, e, float(m.tendon_length0[first]), shift)
    ends = {"tendon_a": tendon_of[first], "tendon_b": tendon_of[second] if second >= 0 else -1}
    return [Coupling(name, coefficients=coefficients, **ends)] if coefficients else []


def _polynomial(compiled: Compiled, e: int, shift_a: float, shift_b: float | None) -> tuple[float, ...]:
    """a - shift_a = p(b - shift_b), p of degree four, as a polynomial in b; empty if it is not finite."""
    polynomial = Polynomial(compiled.model.eq_data[e, :5])
    if shift_b is None:
        polynomial = Polynomial(compiled.model.eq_data[e, :1])
    else:
        polynomial = polynomial(Polynomial([-shift_b, 1.0]))
    coefficients = tuple(map(float, (polynomial + shift_a).trim().coef))
    if all(map(math.isfinite, coefficients)):
        return coefficients
    compiled.refuse("eq", e, "coefficients that are not finite")
    return ()
