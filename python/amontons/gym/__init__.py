"""Environments of Gymnasium: amontons/Ant-v0, amontons/Walker-v0, amontons/CartPole-v0, amontons/Pusher-v0.

Importing this package registers them; `gymnasium.make("amontons.gym:amontons/Ant-v0")` imports it by itself,
and `gymnasium.make_vec` of the same name steps many worlds in C++ threads.
"""

from __future__ import annotations

from typing import Any

try:
    import gymnasium
except ImportError as error:
    raise ImportError(f"amontons.gym needs Gymnasium ({error}): pip install amontons[gym]") from None

from .environment import Environment, VectorEnvironment
from .tasks import Ant, CartPole, Outcome, Pusher, Task, Walker

__all__ = ["Ant", "CartPole", "Environment", "Outcome", "Pusher", "Task", "VectorEnvironment", "Walker"]

TASKS: dict[str, tuple[type[Task], int]] = {
    "amontons/Ant-v0": (Ant, 1000),
    "amontons/Walker-v0": (Walker, 1000),
    "amontons/CartPole-v0": (CartPole, 500),
    "amontons/Pusher-v0": (Pusher, 200),
}
"""What is registered, and the steps after which an episode ends."""


def make(*, task: str, **options: Any) -> Environment:
    """The entry point of the environments that are registered."""
    return Environment(TASKS[task][0](), **options)


def make_vector(*, task: str, **options: Any) -> VectorEnvironment:
    """The same of many worlds at once."""
    return VectorEnvironment(TASKS[task][0](), **options)


for _name, (_, _steps) in TASKS.items():
    if _name not in gymnasium.registry:
        gymnasium.register(
            _name,
            entry_point=f"{__name__}:make",
            vector_entry_point=f"{__name__}:make_vector",
            max_episode_steps=_steps,
            kwargs={"task": _name},
        )
