"""Functions that a package declares and one above it supplies, so that imports only go upwards.

`Problem.write` and `Simulation.save` offer what only `amontons.io` can do, which itself handles problems and
simulations. So `problem` declares the function with its signature (`@hook`), and `io` hands in the body when
the package is imported (`write_file.supply(...)`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import update_wrapper
from typing import Generic, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


class hook(Generic[P, R]):
    """A function of the decorated signature, called through to the one that `supply` hands in."""

    def __init__(self, declared: Callable[P, R]) -> None:
        self._supplied = declared  # whose body says that nothing was supplied
        update_wrapper(self, declared)

    def supply(self, function: Callable[P, R]) -> None:
        """Let `function` be what calls run."""
        self._supplied = function

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        return self._supplied(*args, **kwargs)
