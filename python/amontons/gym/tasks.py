"""What the environments are about: where worlds start, what is seen of them, and what counts.

Everything is written for many worlds at once, one per row: an environment of Gymnasium has one row.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from math import cos, sin
from pathlib import Path
from typing import ClassVar

import numpy as np

from ..checks import Array
from ..io import load_model
from ..model.model import Model

MODELS = Path(__file__).parent / "models"


@dataclass(frozen=True)
class Outcome:
    """What a step of the environment was worth, one entry per world."""

    reward: Array
    terminated: Array
    """bool: the task has failed"""
    info: dict[str, Array]


class Task(ABC):
    """A model, and what to do with it. q, qd: (worlds, nq) and (worlds, nv), as in `Simulation`."""

    file: ClassVar[str]
    dt: ClassVar[float] = 5e-3
    """time step of the simulation (s)"""
    repeat: ClassVar[int] = 4
    """steps per action"""
    noise: ClassVar[tuple[float, float]] = (0.02, 0.05)
    """largest change of each entry of q (m, rad) and qd (m/s, rad/s) at the start"""

    @cached_property
    def model(self) -> Model:
        return load_model(MODELS / self.file)

    @property
    def interval(self) -> float:
        """Time between two actions (s)."""
        return self.dt * self.repeat

    def start(self, q: Array, random: np.random.Generator) -> tuple[Array, Array, Array]:
        """q, qd and goal of one world that begins; q: the model's own start."""
        low, high = self.noise
        moved = q + random.uniform(-low, low, q.shape)
        return moved, random.uniform(-high, high, self.model.nv), np.zeros(0)

    def observe(self, q: Array, qd: Array, goal: Array) -> Array:
        """What an agent sees, (worlds, n)."""
        return np.concatenate([q, qd], axis=1)

    @abstractmethod
    def judge(self, before: Array, q: Array, qd: Array, action: Array, goal: Array) -> Outcome:
        """before: q at the start of the action."""

    def column(self, name: str) -> int:
        """Where a coordinate begins in q."""
        return self.model.coordinates[name].q.start


def cosines(angles: Array) -> tuple[Array, Array]:
    """Cosines and sines; the last bit of NumPy's own depends on how many there are."""
    shaped = [np.reshape([f(x) for x in angles.ravel().tolist()], angles.shape) for f in (cos, sin)]
    return shaped[0], shaped[1]


def effort(action: Array) -> Array:
    return np.square(action).sum(axis=1)


class CartPole(Task):
    """Keep a pole upright on a cart that one motor pushes: 1 for every step that it stands."""

    file = "cartpole.xml"

    def judge(self, before: Array, q: Array, qd: Array, action: Array, goal: Array) -> Outcome:
        fallen = (np.abs(q[:, 1]) > 0.4) | (np.abs(q[:, 0]) > 1.5)  # rad, m
        return Outcome(np.where(fallen, 0.0, 1.0), fallen, {})


class Runner(Task):
    """Run along x: the speed, 1 for staying up, less what the motors are used."""

    cost: ClassVar[float]
    """of the sum of the squares of the action"""

    @abstractmethod
    def is_up(self, q: Array) -> Array: ...

    def observe(self, q: Array, qd: Array, goal: Array) -> Array:
        return np.concatenate([q[:, self.hidden :], qd], axis=1)

    hidden: ClassVar[int]
    """first entries of q that tell where it is, which does not matter"""

    def judge(self, before: Array, q: Array, qd: Array, action: Array, goal: Array) -> Outcome:
        speed = (q[:, 0] - before[:, 0]) / self.interval
        up = self.is_up(q)
        reward = speed + up - self.cost * effort(action)
        return Outcome(reward, ~up, {"x": q[:, 0], "speed": speed})


class Ant(Runner):
    """Four legs with two motors each and a free body; it is up while the body is off the ground."""

    file = "ant.xml"
    cost = 0.05
    hidden = 2

    def is_up(self, q: Array) -> Array:
        return (q[:, 2] > 0.17) & (q[:, 2] < 1.0)


class Walker(Runner):
    """Two legs with feet in a vertical plane, six motors; up is hips high and body upright."""

    file = "walker.xml"
    cost = 0.01
    hidden = 1

    def is_up(self, q: Array) -> Array:
        return (q[:, 1] > -0.35) & (q[:, 1] < 0.6) & (np.abs(q[:, 2]) < 1.0)


class Pusher(Task):
    """An arm with three motors pushes a puck over a table to a goal: less the distances to puck and goal."""

    file = "pusher.xml"
    lengths: ClassVar = (0.3, 0.25, 0.12)
    """of the links, the last to the tip (m)"""

    def start(self, q: Array, random: np.random.Generator) -> tuple[Array, Array, Array]:
        at = self.column("puck")
        moved = q.copy()
        moved[:at] += random.uniform(-0.1, 0.1, at)
        # Beside the arm, which lies along x; puck and goal on the same side, apart from each other.
        angle = random.choice((-1.0, 1.0)) * random.uniform(0.6, 1.2, 2)
        distance = random.uniform((0.35, 0.3), (0.5, 0.55))
        places = distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        moved[at : at + 2] = places[0]
        return moved, np.zeros(self.model.nv), places[1]

    def tip(self, q: Array) -> Array:
        """(worlds, 2), from the three angles."""
        along = cosines(np.cumsum(q[:, :3], axis=1))
        return np.stack(
            [sum(c[:, k] * length for k, length in enumerate(self.lengths)) for c in along], axis=1
        )

    def puck(self, q: Array) -> Array:
        at = self.column("puck")
        return q[:, at : at + 2]

    def observe(self, q: Array, qd: Array, goal: Array) -> Array:
        at = self.model.coordinates["puck"].qd.start
        seen = [
            *cosines(q[:, :3]),
            qd[:, :3],
            self.tip(q),
            self.puck(q),
            qd[:, at : at + 2],
            goal,
        ]
        return np.concatenate(seen, axis=1)

    def judge(self, before: Array, q: Array, qd: Array, action: Array, goal: Array) -> Outcome:
        to_goal = np.linalg.norm(self.puck(q) - goal, axis=1)
        to_puck = np.linalg.norm(self.puck(q) - self.tip(q), axis=1)
        reward = -to_goal - 0.5 * to_puck - 0.01 * effort(action)
        return Outcome(reward, np.zeros(len(q), dtype=bool), {"distance": to_goal})
