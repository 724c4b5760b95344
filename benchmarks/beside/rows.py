"""The table of results: its order, what a new run replaces, and that no tuned row repeats its default."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .engine import NAMES, adapter
from .scenes import keys

Row = Mapping[str, Any]
STATES = ("penetration", "creep", "lift", "joint_error", "energy_rise", "energy_drift")
"""Columns that settings should change."""

TIMES = ("time", "cost", "ratio", "timed", "machine", "load", "timed_on")


def key(row: Row) -> tuple[str, str, str]:
    return row["task"], row["method"], str(row["steps_per_dt"])


def merged(before: Iterable[Row], found: Sequence[Row]) -> list[Any]:
    """New rows replace those of the same scene, engine and step, and all of a setting that is no more. A
    column that older rows lack is blank there."""
    order = {scene: k for k, scene in enumerate(keys())}
    names = [v.name for n in NAMES for v in adapter(n).VARIANTS]
    rows = {key(r): r for r in before if r["task"] in order and r["method"] in names}
    rows |= {key(r): r for r in found}
    columns = dict.fromkeys(column for r in [*found, *rows.values()] for column in r)
    return sorted(
        ({column: r.get(column, "") for column in columns} for r in rows.values()),
        key=lambda r: (order[r["task"]], names.index(r["method"]), int(r["steps_per_dt"])),
    )


def put_times(rows: Iterable[dict[str, Any]], found: Iterable[Row]) -> None:
    """The times of a new run of the same scene, engine, step and version go into the rows."""
    new = {key(r): r for r in found}
    for row in rows:
        if (fresh := new.get(key(row))) is None:
            continue
        if fresh["version"] == row["version"]:
            row.update({column: fresh[column] for column in TIMES})
        else:
            name, here, there = row["method"], fresh["version"], row["version"]
            print(f"beside: {name} is {here} here, {there} in the table: run it whole")


def unlike_defaults(rows: Iterable[Row]) -> list[str]:
    """A complaint for each tuned setting that moves bodies like the default in all of its contacts."""
    tables: dict[tuple[str, str], dict[tuple[str, str], tuple[str, ...]]] = {}
    default: dict[str, str] = {}
    for r in rows:
        state = tuple(f"{float(r[c]):.6g}" if str(r[c]) not in ("", "inf") else str(r[c]) for c in STATES)
        tables.setdefault((r["family"], r["method"]), {})[r["task"], str(r["steps_per_dt"])] = state
        if str(r["tuned"]) == "False":
            default.setdefault(r["family"], r["method"])
    complaints = []
    for (family, engine), table in tables.items():
        first = default.get(family)
        if first is None or engine == first:
            continue
        both = table.keys() & tables[family, first].keys()
        # Most settings are of contacts, and only bodies that touch can tell them apart.
        moving = [k for k in both if table[k][0] not in ("", "0")]
        several = len({scene for scene, _ in moving}) > 1  # one may leave nothing to improve
        if several and all(table[k] == tables[family, first][k] for k in moving):
            complaints.append(
                f"{engine} moves bodies like {first}, to six digits, in all of {len(moving)} runs"
            )
    return complaints
