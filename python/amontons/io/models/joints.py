"""Joints of the kinematic tree: all joints of a MuJoCo body become one chain of degrees of freedom."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ...checks import Vector3
from ...model.parts import Dof, Joint, Motor
from ...model.transforms import IDENTITY, Transform, axis_angle, conjugate, rotate, subtract
from .bodies import Bodies
from .compiled import Compiled, transform
from .softness import is_soft
from .urdf import judge_limits, urdf_range

SMALL_ANGLE = 1e-6
"""rad: what is left of the range of a ball joint at least"""


@dataclass
class Joints:
    """Ours, and where each of MuJoCo's went."""

    joints: list[Joint]
    dof: dict[int, tuple[int, int]]
    """(joint, dof) of ours by MuJoCo joint, hinges and slides only."""
    free: dict[int, int]
    """Our joint by MuJoCo's free joint, of those that are a joint here: with springs, dampers and so on."""


def read_joints(compiled: Compiled, bodies: Bodies) -> Joints:
    m = compiled.model
    judge_limits(compiled.root, compiled.issues)
    joints = Joints([], {}, {})
    taken = {compiled.name("jnt", j) for j in range(m.njnt)}
    for body, ours in bodies.index.items():
        if body == 0 or bodies.bodies[ours].motion != "dynamic":
            continue
        own = range(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body])
        if any(m.jnt_type[j] == compiled.mujoco.mjtJoint.mjJNT_FREE for j in own):
            if (free := _free(compiled, bodies, body, own[0])) is not None:
                joints.free[own[0]] = len(joints.joints)
                joints.joints.append(free)
            continue
        joint = _chain(compiled, bodies, body, list(own), joints)
        name = "+".join(filter(None, (compiled.name("jnt", j) for j in own)))
        if not name or len(own) > 1:  # not a name of MuJoCo's, which are unique
            kind = "joint" if own else "fixed"
            name = name or f"{bodies.bodies[ours].name}_{kind}"
            while name in taken:
                name += "_"
        taken.add(name)
        joints.joints.append(replace(joint, name=name))
    return joints


def _free(compiled: Compiled, bodies: Bodies, body: int, j: int) -> Joint | None:
    """A free joint with a spring, damper, friction or armature: three slides along the axes of the world and
    a ball, with MuJoCo's coordinates. Without any the body just moves freely: None."""
    m = compiled.model
    v, q = int(m.jnt_dofadr[j]), int(m.jnt_qposadr[j])
    acting = _acting(compiled, j)
    if not any(acting.values()):
        return None
    # The spring of the rotation is at rest where the frames coincide.
    rest = transform(m.qpos_spring[q : q + 3], m.qpos_spring[q + 3 : q + 7])
    turn = rest.rotation if acting["stiffness"] else IDENTITY
    name = compiled.name("jnt", j) or f"{bodies.bodies[bodies.index[body]].name}_free"
    dofs = tuple(
        Dof(
            "slide",
            rotate(conjugate(turn), axis),
            rest=rest.position[k],
            name=f"{name}.{'xyz'[k]}",
            **acting,
        )
        for k, axis in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    )
    rotation = {f"ball_{key}": float(value) for key, value in _acting(compiled, j, v + 3).items()}
    return Joint(
        name=name,
        body_a=bodies.index[body],
        frame_b=Transform((0.0, 0.0, 0.0), turn),
        dofs=dofs,
        spherical=True,
        collide=True,
        **rotation,
    )


def _acting(compiled: Compiled, j: int, v: int | None = None) -> dict[str, float]:
    """Spring, damper, dry friction and armature of a joint, as far as they are switched on. v: of which of
    its velocities, the first by default."""
    m = compiled.model
    v = int(m.jnt_dofadr[j]) if v is None else v
    return {
        "stiffness": float(m.jnt_stiffness[j]) if compiled.enabled("spring") else 0.0,
        "damping": float(m.dof_damping[v]) if compiled.enabled("damper") else 0.0,
        "friction": float(m.dof_frictionloss[v]) if compiled.enabled("frictionloss") else 0.0,
        "armature": float(m.dof_armature[v]),
    }


def _chain(compiled: Compiled, bodies: Bodies, body: int, own: list[int], joints: Joints) -> Joint:
    """The joint that moves `body` against its parent.

    With d_i = q_i - ref_i and E_i(d) the motion of joint i by d in the frame of the body, MuJoCo's kinematics
    are X_body = X_parent T E_1(d_1) ... E_n(d_n), where T is the body's frame in the parent (MuJoCo,
    Computation, Kinematics). So that coordinates are MuJoCo's q, E_i(q_i - ref_i) = E_i(q_i) E_i(-ref_i) and
    the constant parts move to the right: with C_i = E_1(-ref_1) ... E_i(-ref_i),
    X_body = X_parent T [C_0 E_1(q_1) C_0^-1] ... [C_n-1 E_n(q_n) C_n-1^-1] C_n.
    """
    m, kinds = compiled.model, compiled.mujoco.mjtJoint
    parent = int(m.body_parentid[body])
    in_parent = bodies.frame[parent] @ compiled.body_frame(body)
    # The origin of frame_a is a point of the last axis: joint forces are small and errors felt there.
    origin = Transform(_vector(m.jnt_pos[own[-1]]) if own else (0.0, 0.0, 0.0))
    shift = Transform()  # C_i
    axes: list[tuple[int, Vector3, Vector3]] = []  # joint, axis and anchor in T
    ball = None
    for j in own:
        if m.jnt_type[j] == kinds.mjJNT_BALL:
            ball = j
            continue
        axis, anchor = _vector(m.jnt_axis[j]), _vector(m.jnt_pos[j])
        if ball is not None:
            compiled.refuse("jnt", ball, "a ball joint before other joints of the body; put it last", "large")
            continue
        axes.append((j, rotate(shift.rotation, axis), shift(anchor)))
        shift = shift @ _exponential(
            m.jnt_type[j] == kinds.mjJNT_SLIDE, axis, anchor, -_reference(compiled, j)
        )
    frame = shift @ origin  # of frame_b in T
    back = frame.inverse()
    dofs = tuple(_dof(compiled, j, rotate(back.rotation, axis), back(anchor)) for j, axis, anchor in axes)
    for k, (j, _, _) in enumerate(axes):
        joints.dof[j] = (len(joints.joints), k)
    joint = Joint(
        body_a=bodies.index[body],
        body_b=bodies.at(parent),
        link_b=bodies.link[parent],
        frame_a=origin,
        frame_b=in_parent @ frame,
        dofs=dofs,
        collide=True,  # exclusions say who does not touch
    )
    return joint if ball is None else _with_ball(compiled, joint, ball)


def _vector(values) -> Vector3:  # noqa: ANN001
    return tuple(values.tolist())


def _reference(compiled: Compiled, joint: int) -> float:
    return float(compiled.model.qpos0[compiled.model.jnt_qposadr[joint]])


def _exponential(slides: bool, axis: Vector3, anchor: Vector3, by: float) -> Transform:
    if slides:
        return Transform((by * axis[0], by * axis[1], by * axis[2]))
    rotation = axis_angle(axis, by)
    return Transform(subtract(anchor, rotate(rotation, anchor)), rotation)


def _limits(compiled: Compiled, j: int) -> tuple[float, float]:
    """Limits of a hinge or slide; <joint margin> is the distance before a limit at which it acts."""
    m = compiled.model
    if (locked := urdf_range(compiled.element("jnt", j))) is not None:
        return locked, locked
    if not m.jnt_limited[j] or not compiled.enabled("limit"):
        return -math.inf, math.inf
    if is_soft(m.jnt_solref[j], m.jnt_solimp[j]):
        compiled.refuse("jnt", j, "a soft limit; limits are hard here", "none")
    lower, upper = m.jnt_range[j].tolist()
    margin = min(float(m.jnt_margin[j]), 0.5 * (upper - lower))
    return lower + margin, upper - margin


def _dof(compiled: Compiled, j: int, axis: Vector3, anchor: Vector3) -> Dof:
    m = compiled.model
    q = m.jnt_qposadr[j]
    slides = m.jnt_type[j] == compiled.mujoco.mjtJoint.mjJNT_SLIDE
    if not slides and abs(m.qpos0[q]) > math.pi:
        compiled.refuse("jnt", j, f"ref of {m.qpos0[q]:g} rad, more than half a turn; take turns off it")
    lower, upper = _limits(compiled, j)
    return Dof(
        kind="slide" if slides else "hinge",
        axis=axis,
        anchor=anchor,
        lower=lower,
        upper=upper,
        rest=float(m.qpos_spring[q]),
        motor=Motor(),
        **_acting(compiled, j),
        name=compiled.name("jnt", j),
    )


def _with_ball(compiled: Compiled, joint: Joint, j: int) -> Joint:
    m = compiled.model
    limited = m.jnt_limited[j] and compiled.enabled("limit")
    return replace(
        joint,
        spherical=True,
        ball_limit=max(float(m.jnt_range[j, 1] - m.jnt_margin[j]), SMALL_ANGLE) if limited else math.inf,
        **{f"ball_{key}": value for key, value in _acting(compiled, j).items()},
    )
