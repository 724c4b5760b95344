"""Forces along qd of what a mechanism has without drives: springs, dampers and drag."""

from __future__ import annotations

import math

import numpy as np

from .. import _core
from ..checks import Array
from ..errors import InputError
from ..model.coordinates import AXES
from ..model.model import Model
from ..model.parts import WORLD, Joint
from ..model.transforms import Transform, rotate
from .tables import tendon_table


def passive_forces_of(core: _core.Simulation, model: Model) -> Array:
    """See `Simulation.forces.passive_forces`."""
    q, qd = model.tree.coordinates(core)
    forces = np.zeros(model.nv)
    in_tree = set()
    for _, _, j, _, first_q, _, first, _ in model.tree.links:
        if j < 0:
            continue
        in_tree.add(j)
        joint = model.joints[j]
        for d, dof in enumerate(joint.dofs):
            stretch = q[first_q + d] - dof.rest
            forces[first + d] -= dof.stiffness * stretch + dof.damping * qd[first + d]
        if joint.spherical:
            n = len(joint.dofs)
            turn = rotation_vector(q[first_q + n : first_q + n + 4])
            ball = slice(first + n, first + n + 3)
            forces[ball] -= joint.ball_stiffness * turn + joint.ball_damping * qd[ball]
    _add_loops(core, model, in_tree, qd, forces)
    _add_tendons(core, model, qd, forces)
    _add_drag(core, model, forces)
    return forces


def rotation_vector(turn: Array) -> Array:
    """Axis times angle, of at most half a turn, of a quaternion (w, x, y, z)."""
    w, axis = turn[0], turn[1:]
    size = float(np.linalg.norm(axis))
    if size < 1e-300:
        return np.zeros(3)
    angle = 2 * math.atan2(size, abs(w))
    return axis * (angle / size * (1 if w >= 0 else -1))


def _is_passive(joint: Joint) -> bool:
    return any(dof.stiffness or dof.damping for dof in joint.dofs) or bool(
        joint.spherical and (joint.ball_stiffness or joint.ball_damping)
    )


def _add_loops(core: _core.Simulation, model: Model, in_tree: set[int], qd: Array, forces: Array) -> None:
    """Adds those of joints that close loops, one hinge or slide each."""
    values = model.tree.joint_coordinates(core)
    for j, joint in enumerate(model.joints):
        if j in in_tree or not _is_passive(joint):
            continue
        if len(joint.dofs) != 1 or joint.spherical:
            raise InputError(
                f'joint "{joint.name}" closes a loop with a spring or damper on several degrees of freedom, '
                "of which passive_forces knows nothing; let it be in the tree, or remove these"
            )
        dof = joint.dofs[0]
        row = _row(core, model, joint)
        stretch = values[model.dof_index(j)] - dof.rest
        forces -= row * (dof.stiffness * stretch + dof.damping * float(row @ qd))


def _row(core: _core.Simulation, model: Model, joint: Joint) -> Array:
    """(nv,): the rate of the only degree of freedom of a joint, over qd."""
    dof, a, b = joint.dofs[0], int(joint.body_a), int(joint.body_b)  # type: ignore[arg-type]
    pose = Transform() if b == WORLD else _pose(core, b)
    frame = pose @ joint.frame_b
    axis = np.array(rotate(frame.rotation, dof.axis))
    if dof.kind == "hinge":
        return axis @ (_jacobian(core, model, a, (0, 0, 0))[3:] - _jacobian(core, model, b, (0, 0, 0))[3:])
    at = _pose(core, a) @ Transform(joint.frame_a.position)
    there = pose.inverse() @ at  # the point of B where A is held
    return axis @ (
        _jacobian(core, model, a, joint.frame_a.position)[:3] - _jacobian(core, model, b, there.position)[:3]
    )


def _pose(core: _core.Simulation, body: int) -> Transform:
    return Transform(tuple(core.positions[body]), tuple(core.orientations[body]))


def _jacobian(core: _core.Simulation, model: Model, body: int, point: object) -> Array:
    if body == WORLD:
        return np.zeros((6, model.nv))
    return model.tree.jacobian(core, body, point)


def _add_tendons(core: _core.Simulation, model: Model, qd: Array, forces: Array) -> None:
    if not any(tendon.stiffness or tendon.damping for tendon in model.tendons):
        return
    lengths = tendon_table(core)["length"]
    for k, tendon in enumerate(model.tendons):
        row = model.tree.tendon_jacobian(core, k)
        stretch = lengths[k] - np.clip(lengths[k], tendon.rest_lower, tendon.rest_upper)
        forces -= row * (tendon.stiffness * stretch + tendon.damping * float(row @ qd))


def _add_drag(core: _core.Simulation, model: Model, forces: Array) -> None:
    """The laws of `FluidBox`."""
    fluid = model.fluid
    if not (fluid.density or fluid.viscosity):
        return
    _, qd = model.tree.coordinates(core)
    for box in model.fluid_boxes:
        pose = _pose(core, box.body) @ box.frame
        axes = np.array([rotate(pose.rotation, axis) for axis in AXES])  # rows: axes of the box in the world
        rows = _jacobian(core, model, box.body, box.frame.position)
        motion = rows @ qd
        v, w = axes @ (motion[:3] - np.array(fluid.wind)), axes @ motion[3:]
        b = np.array(box.size)
        d, (j, k) = float(b.mean()), (np.roll(b, -1), np.roll(b, -2))
        force = -(3 * math.pi * d * fluid.viscosity + fluid.density / 2 * j * k * np.abs(v)) * v
        torque = -(math.pi * d**3 * fluid.viscosity + fluid.density / 64 * b * (j**4 + k**4) * np.abs(w)) * w
        forces += rows[:3].T @ (axes.T @ force) + rows[3:].T @ (axes.T @ torque)
