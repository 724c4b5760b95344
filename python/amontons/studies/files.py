"""Studies written as TOML files."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import integer, number, suggestion
from ..errors import FileError, InputError
from ..io.files import existing, told_at
from .points import MOST_RUNS
from .subjects import named_run

KEYS = ("run", "out", "grid", "points", "fixed", "seeds", "processes", "retries", "timeout", "patience")
RANGE = ("from", "to", "count", "scale")


@dataclass(frozen=True)
class Study:
    """Arguments of `sweep`."""

    run: Any
    grid: Any
    out: Path
    options: dict[str, Any] = field(default_factory=dict)
    """executor, seeds, retries, timeout, patience, those that the file has"""


def read_study(path: Path, module: str | None = None) -> Study:
    """The study in a TOML file; its paths are relative to the file. FileError names what cannot be used.

    module: for a file of somebody else, which is a program: it may name scenes and functions of this module
    alone, and its rows stay in its folder.
    """
    existing(path, "a TOML file")
    try:
        told = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FileError(f"{path}: is not TOML ({error})") from None
    except RecursionError:
        raise FileError(f"{path}: has lists or tables within each other, too many to be read") from None
    with told_at(path):
        return _study(path, told, module)


def _study(path: Path, told: Mapping[str, Any], module: str | None) -> Study:
    for key in told:
        if key not in KEYS:
            raise InputError(f"unknown key {key!r}{suggestion(key, KEYS)}; known are {', '.join(KEYS)}")
    if not isinstance(told.get("run"), str):
        raise InputError(
            'run is missing: write run = "SCENE", "MODEL.xml", "FILE.py:FUNCTION" or "MODULE:FUNCTION"'
        )
    if not isinstance(told.get("out", ""), str):
        raise InputError(f"out = {told['out']!r}; write the name of a .parquet file")
    if ("grid" in told) == ("points" in told):
        raise InputError("give one of [grid], of which all combinations are run, and [[points]]")
    options = {key: told[key] for key in ("seeds", "retries", "timeout", "patience") if key in told}
    if "processes" in told:
        options["executor"] = integer("processes", told["processes"], 0)
    out = path.parent / told["out"] if "out" in told else path.with_suffix(".parquet")
    if module is not None and not out.resolve().is_relative_to(path.parent.resolve()):
        raise InputError(f"out = {told['out']!r} lies outside of its folder; give another with --out")
    return Study(named_run(told["run"], path.parent, module), _grid(told), out, options)


def _grid(told: Mapping[str, Any]) -> Any:
    fixed = told.get("fixed", {})
    if not isinstance(fixed, Mapping):
        raise InputError("fixed must be a table: [fixed] and below it NAME = VALUE")
    if "points" in told:
        points = told["points"]
        if not isinstance(points, list) or not all(isinstance(point, Mapping) for point in points):
            raise InputError("points must be a list of tables: [[points]] and below it NAME = VALUE")
        for point in points:
            _require_apart(fixed, point)
        return [{**fixed, **point} for point in points]
    grid = told["grid"]
    if not isinstance(grid, Mapping):
        raise InputError("grid must be a table: [grid] and below it NAME = [VALUE, ...]")
    _require_apart(fixed, grid)
    single = {name: [value] for name, value in fixed.items()}
    return {**single, **{name: _range(name, value) for name, value in grid.items()}}


def _require_apart(fixed: Mapping[str, Any], varied: Mapping[str, Any]) -> None:
    for name in fixed:
        if name in varied:
            raise InputError(f"{name!r} stands in [fixed] and is varied too; keep one")


def _range(name: str, value: Any) -> Any:
    """{from, to, count}: evenly spaced numbers, ends included; scale = "log": with even ratios."""
    if not isinstance(value, Mapping):
        return value
    for key in value:
        if key not in RANGE:
            raise InputError(
                f"grid.{name}: unknown key {key!r}{suggestion(key, RANGE)}; known are {', '.join(RANGE)}"
            )
    for key in RANGE[:3]:
        if key not in value:
            raise InputError(f"grid.{name}: {key} is missing; a range has from, to and count")
    ends = [number(f"grid.{name}.{key}", value[key]) for key in ("from", "to")]
    count = integer(f"grid.{name}.count", value["count"], 2, MOST_RUNS)
    scale = value.get("scale", "linear")
    if scale not in ("linear", "log"):
        raise InputError(f'grid.{name}.scale = {scale!r}; it must be "linear" or "log"')
    if scale == "log" and min(ends) <= 0:
        raise InputError(f"grid.{name}: the ends of a logarithmic range must be positive")
    # Decimal numbers as they are meant: 0.3, not 0.30000000000000004.
    spaced = np.linspace(*ends, count) if scale == "linear" else np.geomspace(*ends, count)
    return [float(f"{x:.12g}") for x in spaced]
