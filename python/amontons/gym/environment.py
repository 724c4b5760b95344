"""Environments of Gymnasium."""

from __future__ import annotations

import time
from typing import Any, ClassVar

import gymnasium
import numpy as np

from ..checks import Array
from ..errors import InputError
from ..viewer import view
from .picture import Painter
from .task import Task
from .worlds import Worlds, action_space, checked_actions, observation_space

RENDER_MODES = ("human", "rgb_array")


class Environment(gymnasium.Env[Array, Array]):
    """One world of a task. The same seed gives the same episodes, bit for bit.

    render_mode: None, "rgb_array", or "human", which shows the world on the page of `amontons.view` in real
        time: `viewer.url` says where, and a desktop opens it. Dragging a body there acts on the world.
    Raises InputError for another render_mode, and where the viewer is not installed.

    >>> world = gym.Environment(gym.CartPole())
    >>> seen, info = world.reset(seed=1)
    >>> seen, reward, terminated, truncated, info = world.step(world.action_space.sample())
    """

    metadata: ClassVar = {"render_modes": list(RENDER_MODES), "render_fps": 50}

    def __init__(self, task: Task, render_mode: str | None = None) -> None:
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise InputError(
                f"render_mode = {render_mode!r}; give None, {' or '.join(map(repr, RENDER_MODES))}"
            )
        self.task = task
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": round(1 / task.interval)}
        self._worlds = Worlds(task, 1)
        self._painter: Painter | None = None
        self.action_space = action_space(task)
        self.observation_space = observation_space(task, self._worlds)
        self.viewer: Any = None
        """of render_mode="human" """
        self._due = 0.0
        if render_mode == "human":
            name = type(task).__name__
            self.viewer = view(self.simulation, play=None, open_browser=True, title=name)
            print(f"{name}: {self.viewer.url}", flush=True)

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
        if self.viewer is not None:
            self.viewer.update()
            self._due = time.perf_counter()
        return self._worlds.observe()[0], first(self._worlds.locate())

    def step(self, action: Any) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold the action for `task.repeat` steps of the simulation."""
        actions = checked_actions(action, self.action_space.shape)[None]
        reward, terminated, info = self._worlds.step(actions, [0], 1, self._watch if self.viewer else None)
        return self._worlds.observe()[0], float(reward[0]), bool(terminated[0]), False, first(info)

    def _watch(self) -> None:
        """Before a step: let the page show the world and change it, then wait for real time."""
        self._due = max(self._due, time.perf_counter() - self.task.interval) + self.task.dt
        self.viewer.update()
        time.sleep(max(0.0, self._due - time.perf_counter()))

    def render(self) -> Any:
        """With render_mode="rgb_array" a picture, (height, width, 3) colours of 8 bits; otherwise None."""
        if self.render_mode != "rgb_array":
            return None
        if self._painter is None:
            self._painter = Painter(self.task.model)
        return self._painter.paint(self.simulation)

    def close(self) -> None:
        if self.viewer is not None:
            self.viewer.close()
            self.viewer = None


def first(values: dict[str, Array]) -> dict[str, Any]:
    """Values of the only world: numbers, and arrays for several values per world."""
    return {name: v[0].item() if np.ndim(v) == 1 else v[0] for name, v in values.items()}
