"""Worlds side by side for the algorithms of Stable-Baselines3 (pip install stable-baselines3)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from ..checks import Array
from ..errors import InputError
from .vector import VectorEnvironment

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as error:
    raise ImportError(
        f"amontons.gym.sb3 needs Stable-Baselines3 ({error}): pip install stable-baselines3"
    ) from None


def make(name: str, num_envs: int, **options: Any) -> SB3Worlds:
    """The worlds of a registered environment; options: those of `gymnasium.make_vec` and of the task."""
    vector = gymnasium.make_vec(name, num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
    return SB3Worlds(vector.unwrapped)


class SB3Worlds(VecEnv):
    """A `VectorEnvironment` with autoreset_mode=SAME_STEP as a `VecEnv` of Stable-Baselines3.

    Where an episode ends, the observation is the first of the next episode, and info["terminal_observation"]
    is the last of the one that ended.
    Wrap it in `VecMonitor` for returns of episodes, in `VecNormalize` for observations of like size.
    Raises InputError for another vector.
    """

    def __init__(self, worlds: gymnasium.vector.VectorEnv[Any, Any, Any]) -> None:
        if not isinstance(worlds, VectorEnvironment) or worlds.autoreset_mode != AutoresetMode.SAME_STEP:
            raise InputError(
                "SB3Worlds takes a VectorEnvironment with autoreset_mode=AutoresetMode.SAME_STEP; "
                "amontons.gym.sb3.make(name, num_envs) makes one"
            )
        self.worlds = worlds
        self._actions = np.zeros(worlds.action_space.shape)
        super().__init__(worlds.num_envs, worlds.single_observation_space, worlds.single_action_space)

    def reset(self) -> Array:
        """Begin an episode in every world; with the seeds of `seed`, where they were not used yet."""
        observations, infos = self.worlds.reset(
            seed=self._seeds if any(s is not None for s in self._seeds) else None
        )
        self._reset_seeds()
        self.reset_infos = one_by_one(infos, self.num_envs)
        return observations

    def step_async(self, actions: Array) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[Array, Array, Array, list[dict[str, Any]]]:  # type: ignore[override]
        observations, rewards, terminated, truncated, infos = self.worlds.step(self._actions)
        ended = terminated | truncated
        final_observations, final = infos.pop("final_obs", None), infos.pop("final_info", None)
        told = one_by_one(infos, self.num_envs)
        if final is not None:
            finals = one_by_one(final, self.num_envs)
            for k in np.flatnonzero(ended):
                self.reset_infos[k] = {name: v for name, v in told[k].items() if infos[f"_{name}"][k]}
                told[k] = {**finals[k], "terminal_observation": final_observations[k]}
        for k, info in enumerate(told):
            info["TimeLimit.truncated"] = bool(truncated[k] and not terminated[k])
        return observations, rewards, ended, told

    def close(self) -> None:
        self.worlds.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the vector, for each world."""
        return [getattr(self.worlds, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise InputError(f"set_attr({attr_name!r}): worlds side by side have no attributes of their own")

    def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **named: Any) -> list[Any]:
        raise InputError(f"env_method({method_name!r}): worlds side by side have no methods of their own")

    def env_is_wrapped(self, wrapper_class: type[gymnasium.Wrapper], indices: Any = None) -> list[bool]:
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[Array | None]:
        raise InputError("worlds side by side have no pictures; gymnasium.make makes one that has")


def one_by_one(infos: dict[str, Any], count: int) -> list[dict[str, Any]]:
    """The info of each world, without the masks."""
    names = [name for name in infos if not name.startswith("_")]
    columns = [infos[name].tolist() for name in names]
    rows = zip(*columns, strict=True) if names else [()] * count
    return [dict(zip(names, row, strict=True)) for row in rows]
