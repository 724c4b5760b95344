"""The points of a study: from a grid to parameters, and keys and seeds that follow from them alone."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import integer
from ..errors import InputError

MOST_RUNS = 1_000_000
"""Largest number of runs of a study: each is a row in memory, and a line in the table."""
RESERVED = (
    "key", "repetition", "seed", "status", "error", "traceback", "attempts", "wall", "steps", "missed",
    "worst_residual", "started", "host", "amontons", "python", "numpy",
)  # fmt: skip
"""Columns that a study adds by itself."""


@dataclass(frozen=True)
class Point:
    """One run of a study."""

    parameters: dict[str, Any]
    repetition: int | None
    seed: int | None
    key: str
    """hexadecimal; equal for equal parameters, repetitions and given seeds, in any order, on any machine"""

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of the run."""
        return self.parameters if self.seed is None else {**self.parameters, "seed": self.seed}


def points(
    grid: Mapping[str, Iterable[Any]] | Sequence[Mapping[str, Any]],
    seeds: int | Sequence[int] | None,
    *,
    seeded: bool,
) -> list[Point]:
    """The runs of a grid in its order, the last parameter fastest; seeded: every run gets a seed."""
    places = _product(grid) if isinstance(grid, Mapping) else _listed(grid)
    repeated = (
        len(seeds) if isinstance(seeds, Sequence) else integer("seeds", 1 if seeds is None else seeds, 1)
    )
    _require_few(len(places) * repeated, f"{len(places)} points, {repeated} seeds")
    _require_kinds(places)
    made: list[Point] = []
    for place in places:
        if seeds is None:
            made.append(_point(place, None, None, seeded=seeded))
        elif isinstance(seeds, Sequence):
            made += [
                _point(place, None, integer(f"seeds[{k}]", s, 0, 2**63 - 1), seeded=True)
                for k, s in enumerate(seeds)
            ]
        else:
            made += [_point(place, k, None, seeded=True) for k in range(integer("seeds", seeds, 1))]
    first: dict[str, Point] = {}
    for point in made:
        if point.key in first:
            raise InputError(
                f"grid: {_text(point)} stands in it twice; for several runs of a point give seeds"
            )
        first[point.key] = point
    return made


def _product(grid: Mapping[str, Iterable[Any]]) -> list[dict[str, Any]]:
    axes: dict[str, list[Any]] = {}
    for name, values in grid.items():
        if isinstance(values, str | bytes | Mapping) or not isinstance(values, Iterable):
            raise InputError(
                f"grid[{name!r}] is {values!r}; give a list of values, [{values!r}] for a single one"
            )
        listed = list(itertools.islice(values, MOST_RUNS + 1))  # of what has no end, too
        _require_few(len(listed), f"{name} has more values")
        axes[_parameter(name)] = [plain(f"grid[{name!r}][{k}]", value) for k, value in enumerate(listed)]
        if not axes[name]:
            raise InputError(f"grid[{name!r}] is empty; give at least one value")
    told = " x ".join(f"{name} {len(values)}" for name, values in axes.items())
    _require_few(math.prod(map(len, axes.values())), told)
    return [dict(zip(axes, place, strict=True)) for place in itertools.product(*axes.values())]


def _require_few(runs: int, told: str) -> None:
    if runs > MOST_RUNS:
        raise InputError(f"grid: it makes {runs:.4g} runs ({told:.300}); a study has at most {MOST_RUNS}")


def _listed(grid: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    if (
        isinstance(grid, str)
        or not isinstance(grid, Sequence)
        or not all(isinstance(p, Mapping) for p in grid)
    ):
        raise InputError("grid must be a mapping, name -> values, or a list of mappings, name -> value")
    for k, place in enumerate(grid):
        if set(place) != set(grid[0]):
            odd = sorted(set(place) ^ set(grid[0]))[0]
            raise InputError(
                f"grid[{k}] and grid[0] do not both have {odd!r}; give all points the same parameters"
            )
    return [
        {_parameter(name): plain(f"grid[{k}][{name!r}]", p[name]) for name in grid[0]}
        for k, p in enumerate(grid)
    ]


def _parameter(name: object) -> str:
    if not isinstance(name, str) or not name:
        raise InputError(f"grid: the parameter {name!r} must have a name")
    if name == "seed":
        raise InputError(
            "grid: the seeds of a study are given apart from its grid: seeds=[1, 2, 3], or how many"
        )
    if name in RESERVED:
        raise InputError(
            f"grid: {name!r} is the name of a column that every study has; call the parameter otherwise"
        )
    return name


def plain(what: str, value: Any) -> Any:
    """`value` as what a cell holds: None, bool, int, float, str, or a list of such, nested at will."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, int):
        if not -(2**63) <= value < 2**63:
            raise InputError(f"{what} is {value}; it must fit in 64 bits: give a float")
        return int(value)
    if isinstance(value, float):
        return float(value)
    if isinstance(value, list | tuple):
        return [plain(f"{what}[{k}]", entry) for k, entry in enumerate(value)]
    raise InputError(
        f"{what} is a {type(value).__name__}; a table holds numbers, texts, and arrays of them: "
        "give its name or a number that stands for it"
    )


def kind(value: Any) -> str:
    """Type of a column of such values: "" for None, else flag, number, text, or a list of one of them."""
    if value is None:
        return ""
    if isinstance(value, list):
        inner = sorted({kind(entry) for entry in value} - {""})
        return f"list of {' and '.join(inner)}".removesuffix(" of ")
    return "flag" if isinstance(value, bool) else "text" if isinstance(value, str) else "number"


def agree(one: str, other: str) -> bool:
    """Whether values of both kinds can stand in one column."""
    if one.startswith("list") and other.startswith("list"):
        return agree(
            one.removeprefix("list").removeprefix(" of "), other.removeprefix("list").removeprefix(" of ")
        )
    return one == other or not one or not other


def _require_kinds(places: list[dict[str, Any]]) -> None:
    kinds: dict[str, str] = {}
    for place in places:
        for name, value in place.items():
            if isinstance(value, float) and math.isnan(value):
                raise InputError(f"grid: {name} is NaN; give a number")
            mine, theirs = kind(value), kinds.get(name, "")
            if not agree(mine, theirs) or " and " in mine:
                raise InputError(
                    f"grid: {name} is {mine} in one run, {theirs or mine} in another; use one kind"
                )
            kinds[name] = theirs or mine


def _point(parameters: dict[str, Any], repetition: int | None, seed: int | None, *, seeded: bool) -> Point:
    told = {"parameters": parameters, "repetition": repetition, "seed": seed}
    digest = hashlib.sha256(
        json.dumps(_canonical(told), sort_keys=True, separators=(",", ":")).encode()
    ).digest()
    if seeded and seed is None:
        seed = (
            int.from_bytes(digest[8:16], "big") >> 1
        )  # fits a signed column; independent of the key's bytes
    return Point(parameters, repetition, seed, digest[:8].hex())


def _canonical(value: Any) -> Any:
    """Equal numbers are written alike: 1 and 1.0, 0.0 and -0.0."""
    if isinstance(value, dict):
        return {name: _canonical(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_canonical(entry) for entry in value]
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value


def _text(point: Point) -> str:
    return ", ".join(f"{name} = {value!r}" for name, value in point.parameters.items()) or "the point"
