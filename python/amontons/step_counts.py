"""Counts the steps and solves of a piece of a program while it runs; `sweep` uses it for its runs.

`with watched() as watch:` counts in the thread of the block; who has done a step or a solve calls `saw`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


class OverdueError(BaseException):
    """The time that `watched` allows has passed; raised between two steps, past all `except Exception`."""


@dataclass
class Watch:
    """Steps of simulations and solves of problems so far."""

    steps: int = 0
    missed: int = 0
    """how many did not converge"""
    worst_residual: float | None = None
    """natural residual; None before the first step"""
    deadline: float = float("inf")
    """of time.perf_counter (s)"""


_current: ContextVar[Watch | None] = ContextVar("amontons_watch", default=None)


@contextmanager
def watched(seconds: float | None = None) -> Iterator[Watch]:
    """Counts what the block does; OverdueError from the first step that ends later than `seconds`."""
    watch = Watch()
    if seconds is not None:
        watch.deadline = time.perf_counter() + seconds
    token = _current.set(watch)
    try:
        yield watch
    finally:
        _current.reset(token)


def saw(residual: float, *, steps: int = 1, missed: int = 0) -> bool:
    """Steps were made, the worst with this residual. Whether anybody watches: steps missed are then counted
    instead of warned of."""
    watch = _current.get()
    if watch is None:
        return False
    watch.steps += steps
    watch.missed += missed
    if watch.worst_residual is None or not residual <= watch.worst_residual:  # NaN is the worst
        watch.worst_residual = residual
    if time.perf_counter() > watch.deadline:
        raise OverdueError
    return True
