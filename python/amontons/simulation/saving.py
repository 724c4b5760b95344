"""Functions behind `Simulation.save` and `load`, which amontons.io supplies: it is above this package."""

from __future__ import annotations

from os import PathLike
from typing import Any

from ..hooks import supplied_by


@supplied_by("amontons.io")
def save_file(simulation: Any, path: str | PathLike[str]) -> None:
    """Function behind `Simulation.save`; amontons.io supplies it."""
    raise NotImplementedError


@supplied_by("amontons.io")
def load_file(path: str | PathLike[str], options: dict[str, Any]) -> Any:
    """Function behind `Simulation.load`; amontons.io supplies it."""
    raise NotImplementedError
