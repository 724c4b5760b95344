"""Functions that a package declares and one above it supplies, so that imports only go upwards.

`Problem.write` and `Simulation.save` offer what only `amontons.io` can do, which itself handles problems and
simulations. So `problem` declares the function with its signature (`@hook`), and `io` hands in the body when
the package is imported (`write_file.supply(...)`), which the first call does: extras load when they are used.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import update_wrapper
from importlib import import_module
from typing import Generic, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


class hook(Generic[P, R]):
    """A function of the decorated signature, called through to the one that `supply` hands in.

    home: the module that supplies it when it is imported; the first call imports it.
    """

    def __init__(self, declared: Callable[P, R], home: str) -> None:
        self._home = home
        self._supplied: Callable[P, R] | None = None
        update_wrapper(self, declared)

    def supply(self, function: Callable[P, R]) -> None:
        """Let `function` be what calls run."""
        self._supplied = function

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        if self._supplied is None:
            import_module(self._home)
        assert self._supplied is not None, f"{self._home} supplies no {self.__name__}"
        return self._supplied(*args, **kwargs)


def supplied_by(home: str) -> Callable[[Callable[P, R]], hook[P, R]]:
    """Decorator: the function is a hook that the module `home` supplies."""
    return lambda declared: hook(declared, home)
