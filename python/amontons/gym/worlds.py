"""The worlds of an environment: one of Gymnasium's environments has one, a vector of them many."""

from __future__ import annotations

from collections.abc import Sequence

import gymnasium
import numpy as np

from ..checks import Array
from ..errors import InputError
from ..simulation.rollout import advance_worlds
from ..simulation.simulation import Simulation
from .tasks import Task


class Worlds:
    """Simulations of a task, side by side."""

    def __init__(self, task: Task, count: int) -> None:
        self.task = task
        first = Simulation(task.model, dt=task.dt, on_failure="ignore")
        self.simulations = [first, *(first.copy() for _ in range(count - 1))]
        self.home = first.q
        self.q = np.tile(first.q, (count, 1))
        self.qd = np.tile(first.qd, (count, 1))
        self.goals = np.tile(task.start(self.home, np.random.default_rng(0))[2], (count, 1))

    def start(self, rows: Sequence[int], random: Sequence[np.random.Generator]) -> None:
        """Begin again in some worlds, each by its own random numbers."""
        for k in rows:
            q, qd, self.goals[k] = self.task.start(self.home, random[k])
            self.simulations[k].reset(q=q, qd=qd)
            self.q[k], self.qd[k] = self.simulations[k].q, self.simulations[k].qd

    def observe(self) -> Array:
        return self.task.observe(self.q, self.qd, self.goals)

    def step(
        self, actions: Array, rows: Sequence[int], threads: int | None
    ) -> tuple[Array, Array, dict[str, Array]]:
        """Rewards, terminations and infos of some worlds; one whose step fails stays as it is and ends."""
        before = self.q[rows]
        acting = [self.simulations[k] for k in rows]
        course = advance_worlds(acting, actions[:, None], self.task.repeat, threads)
        failed = np.array([bool(failure) for failure in course.failures])
        self.q[rows] = np.where(failed[:, None], before, course.q[:, -1])
        self.qd[rows] = np.where(failed[:, None], self.qd[rows], course.qd[:, -1])
        outcome = self.task.judge(before, self.q[rows], self.qd[rows], actions, self.goals[rows])
        return outcome.reward, outcome.terminated | failed, {**outcome.info, "failed": failed}


def action_space(task: Task) -> gymnasium.spaces.Box:
    drives, sides = task.model.actuators, ("lower_control", "upper_control")
    lower, upper = (np.array([getattr(d, side) for d in drives], np.float32) for side in sides)
    return gymnasium.spaces.Box(lower, upper, dtype=np.float32)


def observation_space(task: Task, worlds: Worlds) -> gymnasium.spaces.Box:
    size = worlds.observe().shape[1]
    return gymnasium.spaces.Box(-np.inf, np.inf, (size,), dtype=np.float64)


def checked_actions(actions: object, shape: tuple[int, ...]) -> Array:
    array = np.asarray(actions, dtype=np.float64)
    if array.shape != shape:
        raise InputError(f"the action has the shape {array.shape}; the environment asks for {shape}")
    if not np.isfinite(array).all():
        raise InputError("the action is not finite")
    return array
