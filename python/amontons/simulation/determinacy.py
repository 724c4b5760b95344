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
from ..model.groups import connected
from ..model.model import Model
from ..model.parts import WORLD, Dof
from ..model.turns import conjugate, exponential, product, rotate
from .step_report import Table

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
    """a joint, or the joints and then a pair of geoms"""
    along_normal: float = 0.0
    """of a contact: the part of the force along the normal"""


def determined(model: Model, pose: Pose, contacts: Table) -> Determined:
    """For each joint of a model and each pair of geoms in touch.

    The cost is that of a singular value decomposition of all unknowns of each loop or pile.
    """
    joints = len(model.joints)
    touching = contacts[contacts["state"] != "open"]
    geoms = np.stack([touching["geom_a"], touching["geom_b"]], axis=1)
    found, of = np.unique(geoms, axis=0, return_inverse=True)
    pairs = [(a, b) for a, b in found.tolist()]
    bonds = [*_joint_bonds(model), *_pair_bonds(model, pairs, np.bincount(of.ravel(), minlength=len(pairs)))]
    result = Determined(np.ones((joints, 6), bool), np.ones(model.dofs, bool), {})
    result.contacts.update({pair: np.ones(4, bool) for pair in pairs})
    for island in _islands(len(model.bodies), _without_branches(joints, bonds)):
        if sum(bond.unknowns for bond in island) > MOST:
            for bond in island:
                if bond.owner < joints:
                    result.reactions[bond.owner] = False
                    result.efforts[_dofs(model, bond.owner)] = False
                else:
                    result.contacts[pairs[bond.owner - joints]][:] = False
            continue
        columns: list[_Column] = []
        for bond in island:
            if bond.owner < joints:
                columns += _of_joint(model, pose, bond.owner)
            else:
                columns += _of_pair(touching[of.ravel() == bond.owner - joints], bond.owner)
        free = _null_space(model, pose, columns)
        _mark_joints(result, model, pose, columns, free)
        changes: dict[int, Array] = {}
        for k, c in enumerate(columns):
            if c.owner >= joints:
                change = np.outer([c.along_normal, *c.force], free[k])
                changes[c.owner] = changes.get(c.owner, 0.0) + change
        for owner, change in changes.items():
            result.contacts[pairs[owner - joints]] &= np.linalg.norm(change, axis=1) < SINGULAR
    return result


def _dofs(model: Model, joint: int) -> slice:
    first = model.core.first_dof(joint)
    return slice(first, first + len(model.joints[joint].dofs))


def _mark_joints(result: Determined, model: Model, pose: Pose, columns: list[_Column], free: Array) -> None:
    """Components of reactions and efforts that change along the null space are not determined."""
    of_joint: dict[int, Array] = {}
    for k, c in enumerate(columns):
        if c.owner < len(model.joints):
            change = np.outer([*c.force, *c.torque], free[k])
            of_joint[c.owner] = of_joint.get(c.owner, 0.0) + change
    for j, change in of_joint.items():
        joint, frame = model.joints[j], _frame_b(model, pose, j)
        both = change.reshape(2, 3, -1).swapaxes(1, 2)  # force and torque
        turned = rotate(conjugate(frame), both).swapaxes(1, 2).reshape(6, -1)
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
    return own if joint.body_b == WORLD else product(pose.orientations[joint.body_b], own)


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
        by = exponential(value * axis)
        moved = anchor + rotate(by, moved - anchor)
        turned = product(by, turned)
    if joint.spherical:
        columns += [np.array([0, 0, 0, *row]) for row in length * np.eye(3)]
    return np.array(columns).T if columns else np.zeros((6, 0))


def _origin_a_in_b(model: Model, pose: Pose, j: int) -> Array:
    joint = model.joints[j]
    origin = np.array(joint.frame_b.position)
    if joint.body_b != WORLD:
        origin = pose.positions[joint.body_b] + rotate(pose.orientations[joint.body_b], origin)
    return rotate(conjugate(_frame_b(model, pose, j)), _held_at(model, pose, j) - origin)


def _of_joint(model: Model, pose: Pose, j: int) -> Iterator[_Column]:
    """Locked directions, and degrees of freedom whose effort is not known: exact motors, limits, dry friction
    that sticks."""
    joint = model.joints[j]
    point, frame = _held_at(model, pose, j), _frame_b(model, pose, j)
    if joint.kind == "distance":
        way = rotate(frame, _origin_a_in_b(model, pose, j))
        size = float(np.linalg.norm(way))
        if size:
            if _at_limit(size, joint.lower_distance, joint.upper_distance, model.length):
                yield _Column((joint.body_a, joint.body_b), point, way / size, np.zeros(3), j)
            return
    twists = _twists(model, pose, j) if joint.kind == "chain" else np.eye(6)[:, 3:]
    left, values, _ = np.linalg.svd(twists) if twists.shape[1] else (np.eye(6), np.zeros(0), None)
    rank = int(np.sum(values > SINGULAR * values.max(initial=0.0)))
    for wrench in (*left[:, rank:].T, *_unknown_efforts(model, pose, j, twists)):
        force, torque = rotate(frame, wrench.reshape(2, 3))
        yield _Column((joint.body_a, joint.body_b), point, force, torque, j)


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
    return rotate(conjugate(frame), total.reshape(2, 3)).ravel()


def _is_unknown(dof: Dof, value: float, rate: float, unit: float) -> bool:
    motor = dof.motor
    exact = (motor.kind == "velocity" and not motor.kd) or (motor.kind == "position" and not motor.kp)
    sticks = dof.friction > 0 and abs(rate) < SLIDING
    stopped = _at_limit(value, dof.lower / unit, dof.upper / unit, 1.0)
    return exact or sticks or stopped


def _at_limit(value: float, lower: float, upper: float, unit: float) -> bool:
    return value <= lower + SINGULAR * unit or value >= upper - SINGULAR * unit


def _of_pair(points: Table, owner: int) -> Iterator[_Column]:
    """The force of a point that sticks is free in all directions, that of one that slides along its own."""
    for row in points:
        size = float(np.linalg.norm(row["force"]))
        if row["friction"] == 0 or size == 0:
            directions = [row["normal"]]
        elif row["state"] == "slip":
            directions = [row["force"] / size]
        else:
            directions = list(np.eye(3))
        bodies = int(row["body_a"]), int(row["body_b"])
        for direction in directions:
            along = float(direction @ row["normal"])
            yield _Column(bodies, row["point"], direction, np.zeros(3), owner, along)


def _compliance(model: Model, a: int, b: int) -> float:
    for pair in model.pair_materials:
        if {pair.geom_a, pair.geom_b} == {a, b}:
            return pair.material.compliance
    return model.geoms[a].material.compliance + model.geoms[b].material.compliance


@dataclass(frozen=True)
class _Bond:
    """A joint or a pair of geoms that touch: its number as owner of unknowns, the dynamic bodies that it acts
    on, and the largest number of its unknowns."""

    owner: int
    bodies: tuple[int, ...]
    unknowns: int


def _moving(model: Model, *bodies: int) -> tuple[int, ...]:
    return tuple(b for b in bodies if b != WORLD and model.bodies[b].motion == "dynamic")


def _joint_bonds(model: Model) -> Iterator[_Bond]:
    """All but those with compliance: it makes a force a function of the motion, so it is no unknown."""
    for j, joint in enumerate(model.joints):
        if not joint.compliance:
            yield _Bond(j, _moving(model, joint.body_a, joint.body_b), 6)  # type: ignore[arg-type]


def _pair_bonds(model: Model, pairs: list[tuple[int, int]], points: Array) -> Iterator[_Bond]:
    """The same of pairs of geoms; a point has three unknowns."""
    for k, ((a, b), count) in enumerate(zip(pairs, points.tolist(), strict=True)):
        if not _compliance(model, a, b):
            bodies = _moving(model, model.geoms[a].body, model.geoms[b].body)
            yield _Bond(len(model.joints) + k, bodies, 3 * count)


def _without_branches(joints: int, bonds: list[_Bond]) -> list[_Bond]:
    """Bonds without joints that alone hold a body: its balance determines them, as the wrenches of one joint
    are independent. Then the next body may hang on one joint; of trees nothing is left."""
    of_body: dict[int, set[int]] = {}
    left = {bond.owner: bond for bond in bonds}
    for bond in bonds:
        for body in bond.bodies:
            of_body.setdefault(body, set()).add(bond.owner)
    leaves = [body for body, owners in of_body.items() if len(owners) == 1]
    while leaves:
        owners = of_body[leaves.pop()]
        if len(owners) != 1 or min(owners) >= joints:
            continue
        (owner,) = owners
        for body in left.pop(owner).bodies:
            of_body[body].discard(owner)
            if len(of_body[body]) == 1:
                leaves.append(body)
    return list(left.values())


def _islands(bodies: int, bonds: list[_Bond]) -> list[list[_Bond]]:
    """Bonds by bodies that hang together; fixed bodies and the world hold nothing together."""
    root = connected(bodies, (bond.bodies for bond in bonds if len(bond.bodies) == 2))
    found: dict[int, list[_Bond]] = {}
    for bond in bonds:
        found.setdefault(root[bond.bodies[0]] if bond.bodies else WORLD, []).append(bond)
    return list(found.values())


def _null_space(model: Model, pose: Pose, columns: list[_Column]) -> Array:
    """Changes of the unknowns that put no sum on any body: an orthonormal basis, (unknowns, n)."""
    sides = np.array([c.bodies for c in columns], dtype=int).reshape(-1, 2)
    dynamic = np.array([body.motion == "dynamic" for body in model.bodies] + [False])  # the world comes last
    bodies = np.unique(sides[dynamic[sides]])
    if not len(bodies):
        return np.eye(len(columns))
    points, forces, torques = (np.array([getattr(c, name) for c in columns]) for name in _PARTS)
    centres = np.array([model.bodies[b].centre_of_mass for b in bodies])
    centres = pose.positions[bodies] + rotate(pose.orientations[bodies], centres)
    matrix = np.zeros((len(bodies), 6, len(columns)))
    for side, sign in enumerate((1, -1)):
        on = np.flatnonzero(dynamic[sides[:, side]])
        at = np.searchsorted(bodies, sides[on, side])
        arms = (points[on] - centres[at]) / model.length
        matrix[at, :3, on] += sign * forces[on]
        matrix[at, 3:, on] += sign * (np.cross(arms, forces[on]) + torques[on])
    _, values, right = np.linalg.svd(matrix.reshape(-1, len(columns)))
    rank = int(np.sum(values > SINGULAR * values.max(initial=0.0)))
    return right[rank:].T


_PARTS = ("point", "force", "torque")
