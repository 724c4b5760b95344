"""One run of a study, where it is carried out: a worker process, a thread, a machine of a cluster."""

from __future__ import annotations

import platform
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from ..errors import InputError
from ..step_counts import OverdueError, Watch, watched
from .points import RESERVED, plain

Row = dict[str, Any]
STATUSES = ("done", "failed", "timeout", "died")


@dataclass(frozen=True)
class Task:
    """The message to a worker."""

    run: Callable[..., Any]
    arguments: dict[str, Any]
    timeout: float | None
    """s"""


def perform(task: Task) -> Row:
    """The row of a run without its parameters: its results, or what went wrong. Lets only interrupts out."""
    row: Row = {"started": datetime.now(UTC), **machine()}
    start = time.perf_counter()
    watch = Watch()
    try:
        with watched(task.timeout) as watch:
            returned = task.run(**task.arguments)
        row |= _results(returned, task.arguments) | {"status": "done"}
    except OverdueError:
        row |= overdue(task.timeout)
    except Exception as error:  # whatever the user's function raises is a row
        row |= {"status": "failed", "error": " ".join(f"{type(error).__name__}: {error}".split())}
        own = error.__traceback__.tb_next if error.__traceback__ else None  # from the user's function on
        row["traceback"] = "".join(traceback.format_exception(type(error), error, own))
    row["wall"] = time.perf_counter() - start
    return row | {"steps": watch.steps, "missed": watch.missed, "worst_residual": watch.worst_residual}


def overdue(timeout: float | None) -> Row:
    """Message in the row of a run that took too long."""
    return {"status": "timeout", "error": f"not done after {timeout:g} s"}


def machine() -> Row:
    """Where, and with what."""
    try:
        own = version("amontons")
    except PackageNotFoundError:  # a build folder on the path, not installed
        own = "unknown"
    return {
        "host": platform.node(),
        "amontons": own,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def _results(returned: Any, arguments: Mapping[str, Any]) -> Row:
    if returned is None:
        return {}
    if not isinstance(returned, Mapping):
        raise InputError(
            f"the run returned a {type(returned).__name__}; return a mapping, name -> number, text or array "
            "of them"
        )
    results: Row = {}
    for name, value in returned.items():
        if not isinstance(name, str) or name in RESERVED or name in arguments:
            raise InputError(f"the result {name!r} has the name of another column; call it otherwise")
        results[name] = plain(f"result {name!r}", value)
    return results
