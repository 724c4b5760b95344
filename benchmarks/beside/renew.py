"""Times alone: the runs of a table once more, without a look at their motion."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import date
from statistics import median
from typing import Any

from common import processor

from .compete import PARTS, REFERENCE
from .engine import Engine, Running
from .plain import Unsupported
from .scenes import Case

LIMIT = 1.0
"""s of processor time of a setting on a scene; one that needs more tells the mean of its first steps."""
Row = dict[str, Any]


@dataclass
class _Timed:
    row: Row
    running: Running
    steps: int
    """of a part"""
    times: list[float] = field(default_factory=list)
    """s per step of each part"""
    ended: bool = False
    """it makes no further part"""


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
            found.append(_Timed(row, running, min(steps, fitting), ended=not same_version(row, running)))
    for _ in range(PARTS):
        for one in found:
            if not one.ended:
                _advance(one, limit)
    others = next((one.times for one in found if one.row["engine"] == REFERENCE), [])
    for one in found:
        one.running.close()
        if one.times:
            one.row.update(_columns(one, dt, others))


def same_version(row: Row, running: Running) -> bool:
    """Whether the errors of a row are of this version; says so if not."""
    if running.version == row["version"]:
        return True
    print(f"beside: {row['engine']} is {running.version} here, {row['version']} in the table: run it whole")
    return False


def _advance(one: _Timed, limit: float) -> None:
    try:
        one.times.append(one.running.advance(one.steps) / one.steps)
    except Unsupported as missing:
        print(f"beside: {one.row['case']}: {one.row['engine']}: no {missing}")
        one.ended = True
        return
    # A run that ended early did so for a reason: bodies that are lost cost nothing, or too much.
    one.ended = _made(one) >= int(one.row["steps"]) or sum(one.times) * one.steps > limit


def _made(one: _Timed) -> int:
    return one.steps * len(one.times)


def _columns(one: _Timed, dt: float, others: Sequence[float]) -> Row:
    mean = sum(one.times) / len(one.times)
    pairs = list(zip(one.times, others, strict=False))
    return {
        "step": mean, "cost": mean / dt, "ratio": median(a / b for a, b in pairs) if pairs else "",
        "timed": _made(one), "machine": processor(), "load": round(os.getloadavg()[0], 1),
        "timed_on": date.today().isoformat(),
    }  # fmt: skip
