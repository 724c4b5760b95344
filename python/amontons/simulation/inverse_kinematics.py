"""Inverse kinematics: coordinates that bring a frame of a body to a place.

Damped least squares (Levenberg and Marquardt; Nakamura and Hanafusa 1986, Wampler 1986): each step minimises
|J dq - e|^2 + damping |dq|^2, angles as lengths by `Model.length`. A coordinate at a limit that the step
would pass is left out. Where loops are closed J is that along the motions that they allow.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from .. import _core
from ..checks import Array, suggestion
from ..errors import InputError
from ..model.coordinates import known
from ..model.links import frame_rows
from ..model.model import Model
from ..model.parts import WORLD
from ..model.transforms import Transform
from ..model.turns import conjugate, logarithm, product
from .sensors import Frames
from .tangent import angles, integrate

FIRST_DAMPING = 1e-3
"""relative to the largest entry of J^T J"""
LESS, MORE = 0.2, 4.0
"""by which the damping changes after a step that came nearer, and after one that did not"""
NO_DAMPING, MOST_DAMPING = 1e-12, 1e8
STILL = 1e-10
"""relative to the squared error: a step that gains less has not come nearer"""
LONGEST = 1.0
"""rad, or Model.length: no coordinate changes by more in one step, where J says little any more"""
SEED = 1
"""of the poses from which attempts after the first begin"""


@dataclass(frozen=True)
class IkSolution:
    """The result of `Simulation.kinematics.solve_ik`.

    >>> simulation = Simulation(load_model(examples.path("arm.xml")))
    >>> found = simulation.kinematics.solve_ik("hand", position=(0.4, 0, 0.9))
    >>> found.converged
    True
    """

    q: Array
    """(nq,): the nearest that was found, within the limits of joints"""
    converged: bool
    """whether both errors are within the tolerance"""
    position_error: float
    """distance from the position that was asked for (m); 0 if none was"""
    angle_error: float
    """angle from the orientation that was asked for (rad); 0 if none was"""
    iterations: int
    """of all attempts"""


@dataclass(frozen=True)
class Goal:
    """Where a frame on a body is to go."""

    body: int
    frame: Transform
    position: Array | None
    orientation: Array | None
    """unit quaternion"""


@dataclass(frozen=True)
class Effort:
    """How much is tried."""

    tolerance: float
    """m; of angles by Model.length"""
    iterations: int
    """of an attempt, at most"""
    attempts: int


class Arm:
    """A copy of a simulation whose coordinates may be moved, as far as limits and loops let them."""

    def __init__(self, core: _core.Simulation, model: Model, moving: Array) -> None:
        self.core, self.model, self.moving = core, model, moving
        core.linear_velocities[...] = core.angular_velocities[...] = 0.0  # of kinematic bodies, too
        self.looped = bool(model.tree.loops or model.couplings)
        self.turning = angles(model)
        self.units = np.where(self.turning, model.length, 1.0)
        """m by which each coordinate counts"""
        self.lower, self.upper, self.at = np.full(model.nv, -np.inf), np.full(model.nv, np.inf), {}
        for c in model.coordinates.values():
            if c.dof >= 0:
                dof = model.joints[c.joint].dofs[c.dof]
                self.lower[c.qd], self.upper[c.qd] = dof.lower, dof.upper
                self.at[c.qd.start] = c.q.start

    @property
    def q(self) -> Array:
        return self.model.tree.coordinates(self.core)[0]

    def place(self, q: Array) -> bool:
        """Move there, limits and loops permitting; False, with nothing changed, if a loop does not close."""
        q = q.copy()
        for k, at in self.at.items():
            if self.moving[k]:
                q[at] = min(max(q[at], self.lower[k]), self.upper[k])
        try:
            self.model.tree.set_q(self.core, q, (~self.moving).astype(np.uint8))
        except InputError:
            return False
        return True

    def beyond(self) -> float:
        """By how much the worst limit is passed, which only closing loops can do (m)."""
        q = self.q
        passed = [max(self.lower[k] - q[at], q[at] - self.upper[k]) * self.units[k]
                  for k, at in self.at.items() if self.moving[k]]  # fmt: skip
        return max(0.0, *passed) if passed else 0.0

    def blocked(self, change: Array) -> Array:
        """Which coordinates are at a limit that the change would pass, (nv,)."""
        q, found = self.q, np.zeros(self.model.nv, dtype=bool)
        for k, at in self.at.items():
            slack = 1e-12 * max(1.0, abs(q[at]))
            low, high = q[at] <= self.lower[k] + slack, q[at] >= self.upper[k] - slack
            found[k] = (low and change[k] < 0) or (high and change[k] > 0)
        return found

    def directions(self, free: Array) -> Array:
        """(nv, k): the velocities that the free coordinates stand for, with what loops make of them."""
        columns = np.eye(self.model.nv)[:, free]
        if self.looped:
            held = (~free).astype(np.uint8)
            for k in range(columns.shape[1]):
                self.model.tree.set_qd(self.core, np.ascontiguousarray(columns[:, k]), held)
                columns[:, k] = self.model.tree.coordinates(self.core)[1]
            self.model.tree.set_qd(self.core, np.zeros(self.model.nv), held)
        return columns


def moving_entries(model: Model, names: Iterable[str] | None) -> Array:
    """(nv,) of bool: the entries of qd that may move; by default all but those of floating bases."""
    moving = np.zeros(model.nv, dtype=bool)
    if isinstance(names, str):
        names = (names,)
    wanted = (
        [c.name for c in model.coordinates.values() if c.kind != "free"] if names is None else list(names)
    )
    for name in wanted:
        if name not in model.coordinates:
            near = suggestion(name, model.coordinates)
            raise InputError(
                f"coordinates: there is no {name!r}{near}; known are {known(tuple(model.coordinates))}"
            )
        moving[model.coordinates[name].qd] = True
    if not moving.any():
        raise InputError(
            "there is nothing that solve_ik may move: name floating bases in coordinates=(...) if they may"
        )
    return moving


def frame_of(model: Model, site: int | str) -> tuple[int, Transform]:
    """The body and the frame of a site, or else of a link or body of this name."""
    links = model.link_names
    if isinstance(site, str) and site not in model.site_names and site in links:
        k = links.index(site) - len(model.bodies)
        return (k + len(model.bodies), Transform()) if k < 0 else (model.links[k].body, model.links[k].frame)
    if isinstance(site, str) and site not in model.site_names:
        near = suggestion(site, (*model.site_names, *links))
        raise InputError(
            f'there is no site, link or body "{site}"{near}; known are {known((*model.site_names, *links))}'
        )
    found = model.sites[model.site_index(site)]
    return found.body, found.frame


def solve(arm: Arm, goal: Goal, effort: Effort) -> IkSolution:
    """The best of some attempts: the first begins at the present pose, others anywhere within the limits."""
    if goal.body == WORLD:
        raise InputError(
            "the site is on the world, which does not move; name a site or link of a moving body"
        )
    rng, start = np.random.default_rng(SEED), arm.q
    best, iterations = _descend(arm, goal, effort), 0
    iterations += best.iterations
    for _ in range(effort.attempts - 1):
        if best.converged:
            break
        if not arm.place(_anywhere(arm, start, rng)):
            continue
        found = _descend(arm, goal, effort)
        iterations += found.iterations
        if found.converged or _size(arm, found) < _size(arm, best):
            best = found
    q = best.q if arm.looped else _unwound(arm, start, best.q)
    return IkSolution(q, best.converged, best.position_error, best.angle_error, iterations)


def _unwound(arm: Arm, start: Array, q: Array) -> Array:
    """The same pose with hinges as few turns from the start as their limits leave."""
    q = q.copy()
    for k, at in arm.at.items():
        if arm.turning[k] and arm.moving[k]:
            near = q[at] - 2 * np.pi * round((q[at] - start[at]) / (2 * np.pi))
            q[at] = near if arm.lower[k] <= near <= arm.upper[k] else q[at]
    return q


def _size(arm: Arm, found: IkSolution) -> float:
    return float(np.hypot(found.position_error, arm.model.length * found.angle_error))


def _anywhere(arm: Arm, start: Array, rng: np.random.Generator) -> Array:
    """Hinges and slides anywhere within their limits; else within pi or Model.length of the start."""
    reach = np.where(arm.turning, np.pi, arm.model.length)
    q = start.copy()
    for k, at in arm.at.items():
        if arm.moving[k]:
            low, high = max(arm.lower[k], start[at] - reach[k]), min(arm.upper[k], start[at] + reach[k])
            q[at] = rng.uniform(low, high) if low < high else low
    return q


def _descend(arm: Arm, goal: Goal, effort: Effort) -> IkSolution:
    damping, steps = FIRST_DAMPING, 0
    left = _error(arm, goal)
    while steps < effort.iterations and damping <= MOST_DAMPING:
        if _worst(arm, goal, left) <= effort.tolerance:
            break
        steps += 1
        before, change = arm.q, _step(arm, goal, left, damping)
        if arm.place(integrate(arm.model, before, change)):
            now = _error(arm, goal)
            gain = float(left @ left) - float(now @ now)
            if gain > STILL * float(left @ left):
                left, damping = now, max(LESS * damping, NO_DAMPING)
                continue
            arm.place(before)
        damping *= MORE
    position, angle = _norms(arm, goal, left)
    reached = max(position, arm.model.length * angle, arm.beyond()) <= effort.tolerance
    return IkSolution(arm.q, reached, position, angle, steps)


def _seen(arm: Arm, goal: Goal) -> Frames:
    """The frame as it is now."""
    bodies = np.array([goal.body], dtype=np.int32)
    rows, _ = arm.model.tree.observe(arm.core, np.zeros(arm.model.nv), bodies, frame_rows([goal.frame]))
    return Frames(rows)


def _error(arm: Arm, goal: Goal) -> Array:
    """(3,) or (6,): what is left of the way and of the turn, world axes, both in m."""
    seen, parts = _seen(arm, goal), []
    if goal.position is not None:
        parts.append(goal.position - seen.position[0])
    if goal.orientation is not None:
        turn = logarithm(product(goal.orientation, conjugate(seen.orientation[0])))
        parts.append(arm.model.length * turn)
    return np.concatenate(parts)


def _norms(arm: Arm, goal: Goal, left: Array) -> tuple[float, float]:
    """Distance (m) and angle (rad) that are left."""
    position = float(np.linalg.norm(left[:3])) if goal.position is not None else 0.0
    turn = left[-3:] if goal.orientation is not None else np.zeros(3)
    return position, float(np.linalg.norm(turn)) / arm.model.length


def _worst(arm: Arm, goal: Goal, left: Array) -> float:
    position, angle = _norms(arm, goal, left)
    return max(position, arm.model.length * angle)


def _step(arm: Arm, goal: Goal, left: Array, damping: float) -> Array:
    """The change of coordinates, (nv,), that goes against the error, with those at their limits left out."""
    whole, free = _jacobian(arm, goal), arm.moving.copy()
    change = np.zeros(arm.model.nv)
    while free.any():
        directions = arm.directions(free) / arm.units[free]
        columns = whole @ directions
        most = float(np.abs(columns).max()) if columns.size else 0.0
        damped = np.concatenate([columns, np.sqrt(damping) * (most or 1.0) * np.eye(columns.shape[1])])
        wanted = np.concatenate([left, np.zeros(columns.shape[1])])
        change = directions @ np.linalg.lstsq(damped, wanted, rcond=None)[0]
        blocked = arm.blocked(change) & free
        if not blocked.any():
            break
        free &= ~blocked
        change = np.zeros(arm.model.nv)
    longest = (np.abs(change) / np.where(arm.turning, 1.0, arm.model.length)).max(initial=0.0)
    return change / max(1.0, float(longest) / LONGEST)


def _jacobian(arm: Arm, goal: Goal) -> Array:
    """The rows of the goal, angles by Model.length."""
    jacobian = arm.model.tree.jacobian(arm.core, goal.body, goal.frame.position)
    parts = [] if goal.position is None else [jacobian[:3]]
    parts += [] if goal.orientation is None else [arm.model.length * jacobian[3:]]
    return np.concatenate(parts)
