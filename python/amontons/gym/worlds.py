"""The worlds of an environment: one of Gymnasium's environments has one, a vector of them many."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import gymnasium
import numpy as np

from ..checks import Array
from ..errors import InputError, SimulationError
from ..model.model import Model, no_model
from ..model.variants import same_structure
from ..simulation.driving import clipped
from ..simulation.rollout import advance_worlds
from ..simulation.simulation import Simulation
from .task import Moment, Task


class Worlds:
    """Simulations of a task, side by side."""

    now: Moment
    """of all worlds"""

    def __init__(self, task: Task, count: int) -> None:
        self.task = task
        first = Simulation(task.model, dt=task.dt, on_failure="ignore", **task.options)
        self.simulations = [first, *(first.copy() for _ in range(count - 1))]
        self.home = first.q
        goal = task.start(self.home, np.random.default_rng(0))[2]
        self.now = Moment(
            np.tile(first.q, (count, 1)),
            np.tile(first.qd, (count, 1)),
            np.zeros((count, len(task.action_limits[0]))),
            np.tile(goal, (count, 1)),
            task.look(self.simulations),
            np.zeros(count),
        )

    def start(self, rows: Sequence[int], random: Sequence[np.random.Generator]) -> None:
        """Begin again in some worlds, each by its own random numbers."""
        if len(rows) == 0:
            return
        now = self.now
        for k in rows:
            self._vary(k, random[k])
            q, qd, now.goal[k] = self.task.start(self.home, random[k])
            self.simulations[k].reset(q=q, qd=qd)
            now.q[k], now.qd[k], now.action[k] = self.simulations[k].q, self.simulations[k].qd, 0.0
            now.time[k] = 0.0
        seen = self.task.look([self.simulations[k] for k in rows])
        for name, values in seen.items():
            now.seen[name][rows] = values

    def _vary(self, k: int, random: np.random.Generator) -> None:
        """Gives a world the model of its next episode."""
        task, old = self.task, self.simulations[k]
        model = task.vary(task.model, random)
        if model is old.model:
            return
        if not isinstance(model, Model):
            raise no_model("what Task.vary returned", model)
        if difference := same_structure([task.model, model]):
            raise InputError(f"Task.vary: {difference}")
        old._take_model(model)

    def observe(self) -> Array:
        return self.task.observe(self.now)

    def locate(self) -> dict[str, Array]:
        return self.task.locate(self.now)

    def step(
        self,
        actions: Array,
        rows: Sequence[int],
        threads: int | None,
        watch: Callable[[], None] | None = None,
    ) -> tuple[Array, Array, dict[str, Array]]:
        """Rewards, terminations and infos of some worlds; one whose step fails stays as it is and ends.

        watch: called before each step of the only world, with what its viewer asks for.
        """
        before, now = self.now.rows(rows), self.now
        acting = [self.simulations[k] for k in rows]
        controls = self._controls(actions, before)
        if watch is not None:
            now.q[rows], now.qd[rows], failed = self._step_watched(acting[0], controls[0], watch)
        else:
            course = advance_worlds(acting, controls[:, None], self.task.repeat, threads)
            failed = np.array([bool(failure) for failure in course.failures])
            now.q[rows] = np.where(failed[:, None], before.q, course.q[:, -1])
            now.qd[rows] = np.where(failed[:, None], before.qd, course.qd[:, -1])
        now.action[rows] = actions
        now.time[rows] += self.task.interval
        for name, values in self.task.look(acting).items():
            now.seen[name][rows] = values
        after = now.rows(rows)
        outcome = self.task.judge(before, after)
        info = {**outcome.info, **self.task.locate(after), "failed": failed}
        return outcome.reward, outcome.terminated | failed, info

    def _controls(self, actions: Array, before: Moment) -> Array:
        """The controls that the task makes of actions, checked."""
        controls = np.asarray(self.task.act(actions, before), dtype=np.float64)
        shape = len(actions), len(self.task.model.control_names)
        if controls.shape != shape:
            raise InputError(
                f"Task.act returned the shape {controls.shape}; it must be (worlds, controls) = {shape}"
            )
        if not np.isfinite(controls).all():
            world, entry = np.argwhere(~np.isfinite(controls))[0]
            raise InputError(
                f"Task.act returned {controls[world, entry]} for control {entry} of world {world}; return "
                "finite numbers: look for a division by zero"
            )
        return controls

    def _step_watched(
        self, simulation: Simulation, controls: Array, watch: Callable[[], None]
    ) -> tuple[Array, Array, Array]:
        """q, qd and whether it failed: the same steps one by one, with the callbacks of the viewer."""
        simulation.controls = clipped(simulation.model, controls)
        try:
            for _ in range(self.task.repeat):
                watch()
                simulation.step()
        except SimulationError:
            return simulation.q, simulation.qd, np.array([True])
        return simulation.q, simulation.qd, np.array([False])


def action_space(task: Task) -> gymnasium.spaces.Box:
    lower, upper = (np.array(limit, np.float32) for limit in task.action_limits)
    return gymnasium.spaces.Box(lower, upper, dtype=np.float32)


def observation_space(task: Task, worlds: Worlds) -> gymnasium.spaces.Box:
    size = worlds.observe().shape[1]
    return gymnasium.spaces.Box(-np.inf, np.inf, (size,), dtype=np.float64)


def checked_actions(actions: object, shape: tuple[int, ...]) -> Array:
    array = np.asarray(actions, dtype=np.float64)
    if array.shape != shape:
        raise InputError(f"the action has the shape {array.shape}; the environment asks for {shape}")
    if not np.isfinite(array).all():
        at = np.argwhere(~np.isfinite(array))[0].tolist()
        raise InputError(f"the action is {array[tuple(at)]} at {at}; give finite numbers: check the policy")
    return array
