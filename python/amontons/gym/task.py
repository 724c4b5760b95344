"""The task of an environment: the start of its worlds, the observation and the reward.

Everything is written for many worlds at once, one per row: an environment of Gymnasium has one row.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from ..checks import Array
from ..io import load_model
from ..model.model import Model
from ..simulation.simulation import Simulation

MODELS = Path(__file__).parent / "models"


@dataclass(frozen=True)
class Moment:
    """Worlds at one instant, one per row of every array.

    >>> zeros = np.zeros((3, 2))  # of three worlds
    >>> now = gym.Moment(q=zeros, qd=zeros, action=zeros[:, :1], goal=zeros[:, :0], time=zeros[:, 0])
    >>> now.rows([0, 2]).q.shape
    (2, 2)
    """

    q: Array
    """(worlds, nq), as `Simulation.q`"""
    qd: Array
    """(worlds, nv), as `Simulation.qd`"""
    action: Array
    """(worlds, actions), the one that led here; zeros at the start of an episode"""
    goal: Array
    """(worlds, n), what `Task.start` chose"""
    seen: Mapping[str, Array] = field(default_factory=dict)
    """what `Task.look` found, by name"""
    time: Array = field(default_factory=lambda: np.zeros(0))
    """(worlds,), since the start of the episode (s)"""

    def rows(self, rows: Any) -> Moment:
        """Some of the worlds."""
        seen = {name: values[rows] for name, values in self.seen.items()}
        return Moment(self.q[rows], self.qd[rows], self.action[rows], self.goal[rows], seen, self.time[rows])


@dataclass(frozen=True)
class Outcome:
    """The reward of a step of the environment, one entry per world.

    >>> outcome = gym.Outcome(np.ones(3), np.zeros(3, bool), {})
    >>> float(outcome.reward.sum())
    3.0
    """

    reward: Array
    terminated: Array
    """bool: the task has failed"""
    info: dict[str, Array]
    """the terms of the reward, and what else is of interest"""


class Task(ABC):
    """A model, and what to do with it.

    >>> class Slow(gym.CartPole):
    ...     repeat = 8  # steps per action
    >>> round(Slow().interval, 9)
    0.04
    """

    file: ClassVar[str]
    """of the model, in `folder`"""
    folder: ClassVar[Path] = MODELS
    dt: ClassVar[float] = 5e-3
    """time step of the simulation (s)"""
    repeat: ClassVar[int] = 4
    """steps per action"""
    options: ClassVar[Mapping[str, Any]] = MappingProxyType({"recovery": "velocity", "recovery_speed": 1.0})
    """others of the `Simulation`. Velocities of up to 1 m/s correct errors of position. A step then takes
    half of the time that it takes with "projection", and smooth motion is of first order in dt."""
    noise: ClassVar[tuple[float, float]] = (0.02, 0.05)
    """largest change of each entry of q (m, rad) and qd (m/s, rad/s) at the start"""

    @cached_property
    def model(self) -> Model:
        return load_model(self.folder / self.file)

    @property
    def interval(self) -> float:
        """Time between two actions (s)."""
        return self.dt * self.repeat

    @property
    def action_limits(self) -> tuple[Array, Array]:
        """The least and the largest action, (actions,) each; by default the limits of the controls."""
        lower, upper = np.array(self.model.control_limits, np.float64).reshape(-1, 2).T
        return lower, upper

    def act(self, action: Array, now: Moment) -> Array:
        """Returns the controls, (worlds, controls), of an action, (worlds, actions), from the instant `now`.

        Called once per action; the controls are clipped to their limits and held for `repeat` steps. By
        default actions are controls. Other actions need `action_limits` too.
        """
        return action

    def vary(self, model: Model, random: np.random.Generator) -> Model:
        """Returns the model of one world for the episode that begins, by default the task's own, `model`.

        For `model.with_(friction={"foot*": random.uniform(0.3, 1.0)})`, for example: other numbers, the same
        coordinates and controls. Called before `start`, with the same random numbers.
        """
        return model

    def start(self, q: Array, random: np.random.Generator) -> tuple[Array, Array, Array]:
        """q, qd and goal of one world that begins; q: the model's own start."""
        low, high = self.noise
        moved = q + random.uniform(-low, low, q.shape)
        return moved, random.uniform(-high, high, self.model.nv), np.zeros(0)

    def look(self, simulations: Sequence[Simulation]) -> dict[str, Array]:
        """Further quantities for the reward beside q and qd, a row per world; called after every action."""
        return {}

    def observe(self, now: Moment) -> Array:
        """Returns the observation, (worlds, n)."""
        return np.concatenate([now.q, now.qd], axis=1)

    @abstractmethod
    def judge(self, before: Moment, now: Moment) -> Outcome:
        """Returns the reward of the action between two instants."""

    def locate(self, now: Moment) -> dict[str, Array]:
        """Where the worlds are: a part of `info` after a step, and all of it after a reset."""
        return {}

    def column(self, name: str) -> int:
        """Where a coordinate begins in q."""
        return self.model.coordinates[name].q.start


def sum_of_squares(values: Array) -> Array:
    return np.square(values).sum(axis=1)
