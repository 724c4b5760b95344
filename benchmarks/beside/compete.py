"""Engines in turns on one scene, and the check of times that CI makes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from common import Row, task_row

from .engine import Engine, Running, Timed, engines
from .measure import Measure
from .pieces import deviation
from .plain import Motion, Scene, Unsupported
from .scenes import Case

PARTS = 20
"""A run is so many parts, after each of which the others have their turn."""
REFERENCE, OURS = "MuJoCo", "amontons, 1e-6"


@dataclass
class Entry(Timed):
    engine: Engine
    measure: Measure
    forces: bool = True
    """whether it tells them"""
    restored: float | str = ""
    repeated: float | str = ""
    deviation: float | str = ""
    early: Motion | None = None
    """after a quarter of the run"""


def compete(case: Case, chosen: Iterable[Engine], limit: float, steps_per_dt: int = 1) -> list[Row]:
    """A row per engine; the parts of all are made in turns."""
    model = case.make()
    scene = case.scene(model)
    dt = case.dt / steps_per_dt
    steps = max(1, round(case.duration / dt / PARTS))
    entries, missing = [], []
    for engine in chosen:
        try:
            running = engine.start(scene, dt)
        except Unsupported as lack:
            missing.append(lacking(case, engine, steps_per_dt, f"no {lack}"))
            continue
        forces = bool(scene.geoms)  # of bodies that touch; a file has none here
        entries.append(Entry(running, engine, Measure(case, model, scene, PARTS), forces=forces))
    for _ in range(PARTS):
        for entry in entries:
            if not entry.why:
                advance(entry, steps, dt, limit)
    reference = next((e.times for e in entries if e.engine.name == REFERENCE), [])
    for entry in entries:
        if not entry.why and steps_per_dt == 1:
            entry.restored = restored(entry.running, steps)
        if case.repeats and entry.early is not None:
            entry.repeated = repeated(entry, scene, dt, steps * PARTS // 4)
        if case.pieces:
            entry.deviation = deviation(entry.engine, scene, case, steps_per_dt)
        entry.running.close()
    missing += [lacking(case, e.engine, steps_per_dt, e.why) for e in entries if not e.times]
    for row in missing:
        print(f"beside: {case.name}: {row['method']}: {row['ended']}")
    return [row_of(case, entry, steps, steps_per_dt, reference) for entry in entries if entry.times]


def advance(entry: Entry, steps: int, dt: float, limit: float) -> None:
    if not entry.go_on(steps):
        return
    try:
        motion = entry.running.motion()
    except Unsupported as missing:
        entry.why = f"no {missing}"
        entry.times.pop()
        return
    entry.measure.look(motion)
    if len(entry.times) == PARTS // 4:
        entry.early = motion
    if entry.forces and not entry.measure.lost:
        try:
            entry.measure.judge(motion, entry.running.contacts(), dt)
        except Unsupported:
            entry.forces = False
    spent = sum(entry.times) * steps
    if spent > limit or spent * PARTS / len(entry.times) > 4 * limit:
        entry.why = f"{limit:g} s of processor time"
    if entry.measure.lost:
        entry.why = "lost its bodies"


def restored(running: Running, steps: int) -> float | str:
    """How far apart bodies come after a saved state, gone on from it at once and after it was restored (m);
    blank where the engine, or our way into it, saves none."""
    try:
        running.save()
        running.advance(steps)
        first = running.motion()
        running.restore()
        running.advance(steps)
    except Unsupported:
        return ""
    return float(np.abs(running.motion().positions - first.positions).max())


def repeated(entry: Entry, scene: Scene, dt: float, steps: int) -> float | str:
    """How far apart bodies are after a quarter of the run, made twice, the second time on two threads where
    an engine has them (m)."""
    assert entry.early is not None
    try:
        again = entry.engine.start(scene, dt, threads=2)
        again.advance(steps)
        found = again.motion()
        again.close()
    except Unsupported:
        return ""
    return float(np.abs(found.positions - entry.early.positions).max())


def lacking(case: Case, engine: Engine, steps_per_dt: int, why: str) -> Row:
    return task_row(case.key, engine.name) | {"steps_per_dt": steps_per_dt, "ended": why}


def row_of(case: Case, entry: Entry, steps: int, steps_per_dt: int, reference: Sequence[float]) -> Row:
    done, dt = len(entry.times) / PARTS, case.dt / steps_per_dt
    timed, verdict = entry.columns(steps, dt, reference), entry.measure.verdict(done)
    variant = entry.engine.variant
    return task_row(case.key, variant.name, timed.pop("time"), verdict.pop("error")) | {
        "case": case.name, "family": entry.engine.key, "version": entry.running.version,
        "options": " ".join(f"{k}={v}" for k, v in variant.options.items()),
        "manual": variant.manual, "tuned": variant.tuned, "steps_per_dt": steps_per_dt, "dt": dt,
        "steps": timed["timed"], "cost": timed.pop("cost"), "ratio": timed.pop("ratio"),
        **verdict, "restored": entry.restored, "repeated": entry.repeated,
        "deviation": entry.deviation, "ended": "" if done == 1 else entry.why,
        **timed, "date": timed["timed_on"],
    }  # fmt: skip


def ratios(rows: Iterable[Mapping[str, Any]]) -> dict[str, float]:
    """Our time over MuJoCo's by scene, both as they are by default, at the scene's step."""
    return {
        r["task"]: float(r["ratio"])
        for r in rows
        if r["method"] == OURS and r["ratio"] != "" and str(r["steps_per_dt"]) == "1"
    }


def slower(rows: Iterable[Mapping[str, Any]], before: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Scenes whose ratio has more than doubled, and what to say of each."""
    now, then = ratios(rows), ratios(before)
    return {
        case: f"{case}: {now[case]:.2g} times MuJoCo's time, it was {then[case]:.2g}"
        for case in now
        if case in then and now[case] > 2 * then[case]
    }


def checked(rows: list[Any], before: Sequence[Mapping[str, Any]], cases: Iterable[Case], limit: float) -> int:
    """Complains of the scenes that are slower now, and again when they alone are run once more."""
    suspects = slower(rows, before)
    again: list[Row] = []
    for case in cases:
        if case.key in suspects:
            both = [e for e in engines("amontons", "mujoco") if e.name in (OURS, REFERENCE)]
            again += compete(case, both, limit)
    complaints = slower(again, before)
    for complaint in complaints.values():
        print(f"beside: slower than twice: {complaint}")
    return bool(complaints)


def shown(r: Mapping[str, Any]) -> str:
    text = (
        f"{r['case']}, {r['method']}, {1e3 * float(r['dt']):g} ms: {1e6 * float(r['time']):.3g} us a step, "
    )
    off = "" if r["error"] == "" else f"off by {1e3 * float(r['error']):.2g} mm"
    return text + off + (f" ({r['ended']})" if r["ended"] else "")
