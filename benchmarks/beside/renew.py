"""Times alone: the runs of a table once more, without a look at their motion."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from .compete import PARTS, REFERENCE
from .engine import Engine, Running, Timed
from .plain import Unsupported
from .scenes import Case

LIMIT = 1.0
"""s of processor time of a setting on a scene; one that needs more tells the mean of its first steps."""
Row = dict[str, Any]


@dataclass
class _Timed(Timed):
    row: Row
    steps: int
    """of a part"""


def renew(case: Case, rows: Sequence[Row], engines: Iterable[Engine], limit: float) -> None:
    """Writes new times into the rows of a scene at one step size. The parts of all settings are made in
    turns. A setting that is not among the engines, or has another version there, keeps its times."""
    scene, dt = case.scene(case.make()), float(rows[0]["dt"])
    steps = max(1, round(case.duration / dt / PARTS))
    # Shorter parts would time cold caches, so only slow settings get them.
    by_name = {engine.name: engine for engine in engines}
    found = []
    for row in rows:
        if row["engine"] in by_name:
            try:
                running = by_name[row["engine"]].start(scene, dt)
            except Unsupported as lack:
                print(f"beside: {row['case']}: {row['engine']}: no {lack}")
                continue
            fitting = max(1, int(limit / 4 / float(row["step"])))
            found.append(_Timed(running, row, min(steps, fitting), why=other_version(row, running)))
    for _ in range(PARTS):
        for one in found:
            if not one.why:
                _advance(one, limit)
    others = next((one.times for one in found if one.row["engine"] == REFERENCE), [])
    for one in found:
        one.running.close()
        if one.times:
            one.row.update(one.columns(one.steps, dt, others))


def other_version(row: Row, running: Running) -> str:
    """Says so where the errors of a row are not of this version."""
    if running.version == row["version"]:
        return ""
    why = f"{row['engine']} is {running.version} here, {row['version']} in the table: run it whole"
    print(f"beside: {why}")
    return why


def _advance(one: _Timed, limit: float) -> None:
    if not one.go_on(one.steps):
        print(f"beside: {one.row['case']}: {one.row['engine']}: {one.why}")
        return
    made = one.steps * len(one.times)
    # A run that ended early did so for a reason: bodies that are lost cost nothing, or too much.
    if made >= int(one.row["steps"]) or sum(one.times) * one.steps > limit:
        one.why = "its time is known"
