"""Environments of Gymnasium."""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.utils import seeding

from ..checks import Array
from .picture import Painter
from .tasks import Task
from .worlds import Worlds, action_space, checked_actions, observation_space


class Environment(gymnasium.Env[Array, Array]):
    """One world of a task. The same seed gives the same episodes, bit for bit.

    render_mode: None or "rgb_array".
    """

    metadata: ClassVar = {"render_modes": ["rgb_array"], "render_fps": 50}

    def __init__(self, task: Task, render_mode: str | None = None) -> None:
        self.task = task
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": round(1 / task.interval)}
        self._worlds = Worlds(task, 1)
        self._painter: Painter | None = None
        self.action_space = action_space(task)
        self.observation_space = observation_space(task, self._worlds)

    @property
    def simulation(self) -> Any:
        """The `Simulation` that is stepped."""
        return self._worlds.simulations[0]

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode; the model's start with a little noise. options: none."""
        super().reset(seed=seed)
        self._worlds.start([0], [self.np_random])
        return self._worlds.observe()[0], {}

    def step(self, action: Any) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold the action for `task.repeat` steps of the simulation."""
        actions = checked_actions(action, self.action_space.shape)[None]
        reward, terminated, info = self._worlds.step(actions, [0], 1)
        values = {name: value[0].item() for name, value in info.items()}
        return self._worlds.observe()[0], float(reward[0]), bool(terminated[0]), False, values

    def render(self) -> Any:
        """A picture, (height, width, 3), with render_mode="rgb_array"."""
        if self.render_mode is None:
            return None
        if self._painter is None:
            self._painter = Painter(self.task.model)
        return self._painter.paint(self.simulation)


class VectorEnvironment(gymnasium.vector.VectorEnv[Array, Array, Array]):
    """Many worlds of a task, stepped side by side in C++ threads; each is as it would be by itself.

    World k of `reset(seed=s)` has the episode of `Environment.reset(seed=s + k)`. An episode that has ended
    begins again at the next step, whose action does not count (AutoresetMode.NEXT_STEP).

    threads: worlds at a time, by default as many as there are cores to use.
    max_episode_steps: after which an episode is truncated, None for no limit.
    """

    metadata: ClassVar = {"autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP, "render_modes": []}

    def __init__(
        self,
        task: Task,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = None,
        threads: int | None = None,
    ) -> None:
        self.task = task
        self.num_envs = num_envs
        self._limit, self._threads = max_episode_steps, threads
        self._worlds = Worlds(task, num_envs)
        self.single_action_space = action_space(task)
        self.single_observation_space = observation_space(task, self._worlds)
        batch = gymnasium.vector.utils.batch_space
        self.action_space = batch(self.single_action_space, num_envs)
        self.observation_space = batch(self.single_observation_space, num_envs)
        self._random = [seeding.np_random()[0] for _ in range(num_envs)]
        self._steps = np.zeros(num_envs, dtype=int)
        self._ended = np.zeros(num_envs, dtype=bool)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode in every world. seed: of world 0, the others count on; or one of each."""
        if seed is not None:
            seeds = [seed + k for k in range(self.num_envs)] if isinstance(seed, int) else seed
            for k, own in enumerate(seeds):
                if own is not None:
                    self._random[k] = seeding.np_random(own)[0]
        self._start(range(self.num_envs))
        return self._worlds.observe(), {}

    def _start(self, rows: Any) -> None:
        self._worlds.start(rows, self._random)
        self._steps[rows] = 0
        self._ended[rows] = False

    def step(self, actions: Any) -> tuple[Array, Array, Array, Array, dict[str, Any]]:
        actions = checked_actions(actions, self.action_space.shape)
        rewards = np.zeros(self.num_envs)
        terminated = np.zeros(self.num_envs, dtype=bool)
        going, ended = np.flatnonzero(~self._ended), np.flatnonzero(self._ended)
        self._start(ended)
        infos: dict[str, Any] = {}
        if len(going):
            rewards[going], terminated[going], info = self._worlds.step(actions[going], going, self._threads)
            self._steps[going] += 1
            for name, values in info.items():
                whole = np.zeros(self.num_envs, dtype=values.dtype)
                whole[going] = values
                infos |= {name: whole, f"_{name}": ~np.isin(np.arange(self.num_envs), ended)}
        truncated = np.zeros(self.num_envs, dtype=bool)
        if self._limit is not None:
            truncated = self._steps >= self._limit
        self._ended = terminated | truncated
        return self._worlds.observe(), rewards, terminated, truncated, infos
