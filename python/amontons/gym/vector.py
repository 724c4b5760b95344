"""Vectors of environments of Gymnasium."""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode

from ..checks import Array, integer
from ..errors import InputError
from .task import Task
from .worlds import Worlds, action_space, checked_actions, observation_space

AUTORESET_MODES = (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP)


class VectorEnvironment(gymnasium.vector.VectorEnv[Array, Array, Array]):
    """Many worlds of a task, stepped side by side in C++ threads; each is as it would be by itself.

    World k of `reset(seed=s)` has the episode of `Environment.reset(seed=s + k)`.

    threads: worlds at a time, by default as many as there are cores to use.
    max_episode_steps: after which an episode is truncated, None for no limit.
    autoreset_mode: when a world whose episode has ended begins the next. NEXT_STEP: at the next step, whose
        action does not count. SAME_STEP: within the step that ended it, which returns the first observation
        of the next episode; info["final_obs"] and info["final_info"] hold the last observation and info, as
        in Gymnasium.
    render_mode: None; InputError otherwise, because a page or a picture shows one world.

    >>> worlds = gym.VectorEnvironment(gym.CartPole(), 8)
    >>> seen, info = worlds.reset(seed=1)
    >>> len(seen)
    8
    """

    metadata: ClassVar = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}

    def __init__(
        self,
        task: Task,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = None,
        threads: int | None = None,
        autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
    ) -> None:
        if render_mode is not None:
            raise InputError(
                f"render_mode = {render_mode!r} for {num_envs} worlds; "
                "give it to gymnasium.make, which makes one world"
            )
        if autoreset_mode not in AUTORESET_MODES:
            names = " or ".join(str(mode) for mode in AUTORESET_MODES)
            raise InputError(f"autoreset_mode = {autoreset_mode}; give {names}")
        self.task = task
        self.num_envs = integer("num_envs", num_envs, 1)
        self._limit, self._threads = max_episode_steps, threads
        self.autoreset_mode = autoreset_mode
        self.metadata = {**self.metadata, "autoreset_mode": autoreset_mode}
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
        self._start(np.arange(self.num_envs))
        return self._worlds.observe(), self._whole(self._worlds.locate(), np.arange(self.num_envs))

    def _start(self, rows: Array) -> None:
        self._worlds.start(rows, self._random)
        self._steps[rows] = 0
        self._ended[rows] = False

    def _whole(self, info: dict[str, Array], rows: Array) -> dict[str, Any]:
        """Infos of some worlds as arrays over all: zeros elsewhere; `_name` says which worlds have values."""
        has = np.zeros(self.num_envs, dtype=bool)
        has[rows] = True
        infos: dict[str, Any] = {}
        for name, values in info.items():
            whole = np.zeros((self.num_envs, *values.shape[1:]), dtype=values.dtype)
            whole[rows] = values
            infos |= {name: whole, f"_{name}": has}
        return infos

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
            infos = self._whole(info, going)
        truncated = np.zeros(self.num_envs, dtype=bool)
        if self._limit is not None:
            truncated = self._steps >= self._limit
        self._ended = terminated | truncated
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._ended.any():
            infos = self._begin_again(np.flatnonzero(self._ended), infos)
        return self._worlds.observe(), rewards, terminated, truncated, infos

    def _begin_again(self, rows: Array, infos: dict[str, Any]) -> dict[str, Any]:
        """Worlds whose episode has ended begin the next; the infos then, with those of the end."""
        has = self._ended.copy()
        final = np.full(self.num_envs, None, dtype=object)
        seen = self._worlds.observe()
        for k in rows:
            final[k] = seen[k]
        self._start(rows)
        start, others = self._worlds.locate(), ~has
        ends, begun = {}, {}
        for name in [name for name in infos if not name.startswith("_")]:
            values = infos[name]
            ends |= {name: np.zeros_like(values), f"_{name}": has}
            ends[name][rows] = values[rows]
            begun |= {name: values, f"_{name}": infos[f"_{name}"] & (others | (name in start))}
            values[rows] = start[name][rows] if name in start else 0
        last = {"final_obs": final, "_final_obs": has, "final_info": ends, "_final_info": has}
        return begun | last
