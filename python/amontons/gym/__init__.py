"""Environments of Gymnasium: HalfCheetah, Hopper, Walker2d, Ant and Humanoid v5, and four tasks of our own.

Importing this package registers them; `gymnasium.make("amontons.gym:amontons/Ant-v5")` imports it by itself.
`gymnasium.make_vec` of the same name steps many worlds in C++ threads. `amontons.gym.sb3` adapts such a
vector to Stable-Baselines3.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

try:
    import gymnasium
except ImportError as error:
    raise ImportError(f"amontons.gym needs Gymnasium ({error}): pip install amontons[gym]") from None

from ..errors import InputError
from .environment import Environment
from .locomotion import Ant, HalfCheetah, Hopper, Humanoid, Walker2d
from .task import Moment, Outcome, Task
from .tasks import CartPole, Pusher, Quadruped, Walker
from .vector import VectorEnvironment

__all__ = [
    "Ant",
    "CartPole",
    "Environment",
    "HalfCheetah",
    "Hopper",
    "Humanoid",
    "Moment",
    "Outcome",
    "Pusher",
    "Quadruped",
    "Task",
    "VectorEnvironment",
    "Walker",
    "Walker2d",
]

TASKS: dict[str, tuple[Callable[..., Task], int]] = {
    "amontons/HalfCheetah-v5": (HalfCheetah, 1000),
    "amontons/Hopper-v5": (Hopper, 1000),
    "amontons/Walker2d-v5": (Walker2d, 1000),
    "amontons/Ant-v5": (Ant, 1000),
    "amontons/Humanoid-v5": (Humanoid, 1000),
    "amontons/Quadruped-v0": (Quadruped, 1000),
    "amontons/Walker-v0": (Walker, 1000),
    "amontons/CartPole-v0": (CartPole, 500),
    "amontons/Pusher-v0": (Pusher, 200),
}
"""Registered names, and the number of steps after which an episode ends."""

VECTOR_OPTIONS = ("max_episode_steps", "threads", "autoreset_mode", "render_mode")


def make(*, task: str, render_mode: str | None = None, **options: Any) -> Environment:
    """The entry point of the environments that are registered. options: of the task."""
    return Environment(make_task(task, options), render_mode)


def make_vector(*, task: str, num_envs: int = 1, **options: Any) -> VectorEnvironment:
    """The same of many worlds at once."""
    own = {name: options.pop(name) for name in VECTOR_OPTIONS if name in options}
    return VectorEnvironment(make_task(task, options), num_envs, **own)


def make_task(task: str, options: dict[str, Any]) -> Task:
    kind = TASKS[task][0]
    known = tuple(getattr(kind, "__dataclass_fields__", ()))
    if unknown := sorted(set(options) - set(known)):
        raise InputError(f"{task} has no option {unknown[0]!r}; it has {', '.join(known) or 'none'}")
    return kind(**options)


for _name, (_, _steps) in TASKS.items():
    if _name not in gymnasium.registry:
        gymnasium.register(
            _name,
            entry_point=f"{__name__}:make",
            vector_entry_point=f"{__name__}:make_vector",
            max_episode_steps=_steps,
            kwargs={"task": _name},
        )
