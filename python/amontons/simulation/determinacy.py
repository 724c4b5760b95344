"""Which forces of a step follow from equilibrium, and which are one choice among many.

The equations of motion fix D' x, the sum of the impulses on each body, and no more. If D' n = 0, x + n moves
the bodies as x does. A component is determined if it is the same for all such n. docs/algorithm.md
derives this.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..checks import Array
from ..model.model import Model
from ..model.parts import WORLD, Dof
from .outcome import Table

SINGULAR = 1e-6
"""Singular values below this part of the largest are zero: joints of a loop fit each other to 1e-6 of a
length."""
MOST = 300
"""Unknowns of a loop or a pile; with more of them the search would take longer than many steps."""
SLIDING = 1e-6
"""Velocity of a degree of freedom, in lengths or radians per second, from which dry friction slides."""


@dataclass(frozen=True)
class Pose:
    """Bodies of a model at one instant: arrays as in `State`, coordinates as in `joint_efforts`."""

    positions: Array
    orientations: Array
    linear_velocities: Array
    angular_velocities: Array
    coordinates: Array
    """(dofs,) (m, rad)"""


@dataclass(frozen=True)
class Determined:
    """Whether components are determined: of reactions in the axes of frame B, of efforts, of contacts."""

    reactions: Array
    """(joints, 6) of bool: force, torque about the origin of frame A"""
    efforts: Array
    """(dofs,) of bool"""
    contacts: dict[tuple[int, int], Array]
    """by pair of geoms, (4,) of bool: the normal force, and the sum of forces along x, y and z"""


@dataclass
class _Column:
    """One unknown: a unit force and torque (over a length) on body A at a point, and opposite on B."""

    bodies: tuple[int, int]
    point: Array
    force: Array
    torque: Array
    owner: int
    """a joint, or the joints and then a contact"""


def rotate(q: Array, v: Array) -> Array:
    """Vectors turned by unit quaternions (w, x, y, z); both may be rows."""
    q, v = np.asarray(q, dtype=float), np.asarray(v, dtype=float)
    w, axis = q[..., :1], q[..., 1:]
    return v + 2 * np.cross(axis, np.cross(axis, v) + w * v)


def back(q: Array, v: Array) -> Array:
    """Vectors turned by the inverse rotations."""
    return rotate(np.asarray(q) * np.array([1.0, -1.0, -1.0, -1.0]), v)


def determined(model: Model, pose: Pose, contacts: Table) -> Determined:
    """For each joint of a model and each pair of geoms in touch.

    The cost is that of a singular value decomposition of all unknowns of a loop or a pile.
    """
    joints = len(model.joints)
    result = Determined(np.ones((joints, 6), bool), np.ones(model.dofs, bool), {})
    columns = [*_of_joints(model, pose), *_of_contacts(model, contacts, joints)]
    columns = _without_branches(model, columns)
    pairs = list(zip(contacts["geom_a"].tolist(), contacts["geom_b"].tolist(), strict=True))
    result.contacts.update({pair: np.ones(4, bool) for pair in pairs})
    changes: dict[tuple[int, int], Array] = {}
    for island in _islands(model, columns):
        if len(island) > MOST:
            for c in island:
                _mark_all(result, model, joints, pairs, c.owner)
            continue
        free = _null_space(model, pose, island)
        for k, c in enumerate(island):
            if c.owner >= joints:
                normal = contacts["normal"][c.owner - joints]
                change = np.outer([normal @ c.force, *c.force], free[k])
                pair = pairs[c.owner - joints]
                changes[pair] = changes.get(pair, 0.0) + change
        _mark_joints(result, model, pose, island, free)
    for pair, change in changes.items():
        result.contacts[pair] &= np.linalg.norm(change, axis=1) < SINGULAR
    return result


def _mark_all(
    result: Determined, model: Model, joints: int, pairs: list[tuple[int, int]], owner: int
) -> None:
    if owner >= joints:
        result.contacts[pairs[owner - joints]][:] = False
    else:
        result.reactions[owner] = False
        result.efforts[_dofs(model, owner)] = False


def _dofs(model: Model, joint: int) -> slice:
    first = model.core.first_dof(joint)
    return slice(first, first + len(model.joints[joint].dofs))


def _mark_joints(result: Determined, model: Model, pose: Pose, island: list[_Column], free: Array) -> None:
    """Components of reactions and efforts that change along the null space are not determined."""
    of_joint: dict[int, Array] = {}
    for k, c in enumerate(island):
        if c.owner < len(model.joints):
            change = np.outer([*c.force, *c.torque], free[k])
            of_joint[c.owner] = of_joint.get(c.owner, 0.0) + change
    for j, change in of_joint.items():
        joint, frame = model.joints[j], _frame_b(model, pose, j)
        turned = np.concatenate([back(frame, change[:3].T).T, back(frame, change[3:].T).T])
        twists = _twists(model, pose, j)
        duals = np.linalg.pinv(twists)[: len(joint.dofs)]
        efforts = twists[:, : len(joint.dofs)].T @ turned
        locked = turned - duals.T @ efforts if len(joint.dofs) else turned
        result.reactions[j] &= np.linalg.norm(locked, axis=1) < SINGULAR
        result.efforts[_dofs(model, j)] &= np.linalg.norm(efforts, axis=1) < SINGULAR


def _frame_b(model: Model, pose: Pose, j: int) -> Array:
    """Orientation of frame B of a joint in the world."""
    joint = model.joints[j]
    own = np.array(joint.frame_b.rotation)
    if joint.body_b == WORLD:
        return own
    w1, w2 = pose.orientations[joint.body_b, 0], own[0]
    a, b = pose.orientations[joint.body_b, 1:], own[1:]
    return np.array([w1 * w2 - a @ b, *(w1 * b + w2 * a + np.cross(a, b))])


def _held_at(model: Model, pose: Pose, j: int) -> Array:
    """The origin of frame A of a joint in the world (m)."""
    joint = model.joints[j]
    origin = np.array(joint.frame_a.position)
    return pose.positions[joint.body_a] + rotate(pose.orientations[joint.body_a], origin)


def _twists(model: Model, pose: Pose, j: int) -> Array:
    """Free motions of a joint in the axes of frame B, (6, n): velocity at the origin of frame A, then angular
    velocity times `Model.length`. Those of degrees of freedom come first, then those of a ball.

    A degree of freedom moves with those before it: its axis and anchor are turned by their coordinates.
    """
    joint, length = model.joints[j], model.length
    first = model.core.first_dof(j)
    at = _origin_a_in_b(model, pose, j)
    turned, moved = np.array([1.0, 0, 0, 0]), np.zeros(3)
    columns: list[Array] = []
    for k, dof in enumerate(joint.dofs):
        axis, value = rotate(turned, np.array(dof.axis)), pose.coordinates[first + k]
        if dof.kind == "slide":
            columns.append(np.array([*axis, 0, 0, 0]))
            moved = moved + value * axis
            continue
        anchor = rotate(turned, np.array(dof.anchor)) + moved
        columns.append(np.array([*np.cross(axis, at - anchor), *(length * axis)]))
        by = np.array([np.cos(value / 2), *(np.sin(value / 2) * axis)])
        moved = anchor + rotate(by, moved - anchor)
        w, v = turned[0], turned[1:]
        turned = np.array([by[0] * w - by[1:] @ v, *(by[0] * v + w * by[1:] + np.cross(by[1:], v))])
    if joint.spherical:
        columns += [np.array([0, 0, 0, *row]) for row in length * np.eye(3)]
    return np.array(columns).T if columns else np.zeros((6, 0))


def _origin_a_in_b(model: Model, pose: Pose, j: int) -> Array:
    joint = model.joints[j]
    origin = np.array(joint.frame_b.position)
    if joint.body_b != WORLD:
        origin = pose.positions[joint.body_b] + rotate(pose.orientations[joint.body_b], origin)
    return back(_frame_b(model, pose, j), _held_at(model, pose, j) - origin)


def _of_joints(model: Model, pose: Pose) -> Iterator[_Column]:
    """Locked directions, and degrees of freedom whose effort is not known: exact motors, limits, dry friction
    that sticks. A compliance makes a reaction a function of the motion, so it is no unknown."""
    for j, joint in enumerate(model.joints):
        if joint.compliance:
            continue
        point, frame = _held_at(model, pose, j), _frame_b(model, pose, j)
        if joint.kind == "distance":
            way = rotate(frame, _origin_a_in_b(model, pose, j))
            size = float(np.linalg.norm(way))
            if size and _at_limit(size, joint.lower_distance, joint.upper_distance, model.length):
                yield _Column((joint.body_a, joint.body_b), point, way / size, np.zeros(3), j)
                continue
            if size:
                continue
        twists = _twists(model, pose, j) if joint.kind == "chain" else np.eye(6)[:, 3:]
        left, values, _ = np.linalg.svd(twists) if twists.shape[1] else (np.eye(6), np.zeros(0), None)
        rank = int(np.sum(values > SINGULAR * values.max(initial=0.0)))
        wrenches = [*left[:, rank:].T, *_unknown_efforts(model, pose, j, twists)]
        for wrench in wrenches:
            yield _Column(
                (joint.body_a, joint.body_b), point, rotate(frame, wrench[:3]), rotate(frame, wrench[3:]), j
            )


def _unknown_efforts(model: Model, pose: Pose, j: int, twists: Array) -> Iterator[Array]:
    """Wrenches along degrees of freedom, in the axes of frame B."""
    joint, first = model.joints[j], model.core.first_dof(j)
    if not joint.dofs:
        return
    duals = np.linalg.pinv(twists)
    rates = duals @ _relative_twist(model, pose, j)
    for k, dof in enumerate(joint.dofs):
        unit = 1.0 if dof.kind == "hinge" else model.length
        if _is_unknown(dof, pose.coordinates[first + k] / unit, rates[k] / unit, unit):
            yield duals[k]


def _relative_twist(model: Model, pose: Pose, j: int) -> Array:
    """Motion of A from B in the axes of frame B: velocity at the origin of frame A, spin times length."""
    joint, at = model.joints[j], _held_at(model, pose, j)
    total = np.zeros(6)
    for body, sign in ((joint.body_a, 1), (joint.body_b, -1)):
        if body != WORLD:
            spin = pose.angular_velocities[body]
            velocity = pose.linear_velocities[body] + np.cross(spin, at - pose.positions[body])
            total += sign * np.array([*velocity, *(model.length * spin)])
    frame = _frame_b(model, pose, j)
    return np.concatenate([back(frame, total[:3]), back(frame, total[3:])])


def _is_unknown(dof: Dof, value: float, rate: float, unit: float) -> bool:
    motor = dof.motor
    exact = (motor.kind == "velocity" and not motor.kd) or (motor.kind == "position" and not motor.kp)
    sticks = dof.friction > 0 and abs(rate) < SLIDING
    stopped = _at_limit(value, dof.lower / unit, dof.upper / unit, 1.0)
    return exact or sticks or stopped


def _at_limit(value: float, lower: float, upper: float, unit: float) -> bool:
    return value <= lower + SINGULAR * unit or value >= upper - SINGULAR * unit


def _of_contacts(model: Model, contacts: Table, joints: int) -> Iterator[_Column]:
    """Forces of points that stick are free in all directions, those that slide along their present one."""
    for k, row in enumerate(contacts):
        if row["state"] == "open" or _compliance(model, int(row["geom_a"]), int(row["geom_b"])):
            continue
        size = float(np.linalg.norm(row["force"]))
        if row["friction"] == 0 or size == 0:
            directions = [row["normal"]]
        elif row["state"] == "slip":
            directions = [row["force"] / size]
        else:
            directions = list(np.eye(3))
        for direction in directions:
            yield _Column(
                (int(row["body_a"]), int(row["body_b"])), row["point"], direction, np.zeros(3), joints + k
            )


def _compliance(model: Model, a: int, b: int) -> float:
    for pair in model.pair_materials:
        if {pair.geom_a, pair.geom_b} == {a, b}:
            return pair.material.compliance
    return model.geoms[a].material.compliance + model.geoms[b].material.compliance


def _moving(model: Model, column: _Column) -> list[int]:
    return [b for b in column.bodies if b != WORLD and model.bodies[b].motion == "dynamic"]


def _without_branches(model: Model, columns: list[_Column]) -> list[_Column]:
    """Unknowns without those of joints that alone hold a body: its balance determines them, as the wrenches
    of one joint are independent. Then the next body may hang on one joint; of trees nothing is left."""
    of_body: dict[int, set[int]] = {}
    of_owner: dict[int, list[_Column]] = {}
    for c in columns:
        of_owner.setdefault(c.owner, []).append(c)
        for body in _moving(model, c):
            of_body.setdefault(body, set()).add(c.owner)
    leaves = [body for body, owners in of_body.items() if len(owners) == 1]
    while leaves:
        owners = of_body[leaves.pop()]
        if len(owners) != 1:
            continue
        (owner,) = owners
        if owner >= len(model.joints):
            continue
        for body in {b for c in of_owner.pop(owner) for b in _moving(model, c)}:
            of_body[body].discard(owner)
            if len(of_body[body]) == 1:
                leaves.append(body)
    return [c for c in columns if c.owner in of_owner]


def _islands(model: Model, columns: list[_Column]) -> list[list[_Column]]:
    """Unknowns by bodies that hang together; fixed bodies and the world hold nothing together."""
    root = list(range(len(model.bodies)))

    def find(body: int) -> int:
        while root[body] != body:
            root[body] = root[root[body]]
            body = root[body]
        return body

    moving = [_moving(model, c) for c in columns]
    for bodies in moving:
        if len(bodies) == 2:
            root[find(bodies[0])] = find(bodies[1])
    found: dict[int, list[_Column]] = {}
    for c, bodies in zip(columns, moving, strict=True):
        found.setdefault(find(bodies[0]) if bodies else WORLD, []).append(c)
    return list(found.values())


def _null_space(model: Model, pose: Pose, island: list[_Column]) -> Array:
    """Changes of the unknowns that put no sum on any body: an orthonormal basis, (unknowns, n)."""
    bodies = sorted({b for c in island for b in _moving(model, c)})
    place = {b: k for k, b in enumerate(bodies)}
    matrix = np.zeros((6 * len(bodies), len(island)))
    for k, c in enumerate(island):
        for b, sign in zip(c.bodies, (1, -1), strict=True):
            if b in place:
                centre = rotate(pose.orientations[b], np.array(model.bodies[b].centre_of_mass))
                arm = (c.point - pose.positions[b] - centre) / model.length
                at = 6 * place[b]
                matrix[at : at + 3, k] += sign * c.force
                matrix[at + 3 : at + 6, k] += sign * (np.cross(arm, c.force) + c.torque)
    if not bodies:
        return np.eye(len(island))
    _, values, right = np.linalg.svd(matrix)
    rank = int(np.sum(values > SINGULAR * values.max(initial=0.0)))
    return right[rank:].T
