"""Other engines on the same scenes at the same step: what a step costs, and what is left of the law.

    python benchmarks/engines.py [--quick] [--out FOLDER] [--only PART ...] [--check engines.csv]

MuJoCo, PyBullet and Drake, where they are installed, each with its default settings and with tuned ones, get
the bodies, joints and coefficients of our scenes, and model files of robots, which they read by themselves.
All run in turns, part by part, on one core, so that whatever slows the machine slows all of them. Their
motion is judged by us: overlap, creep, gaps of joints, energy. Writes engines.csv, a row per scene and
engine, and the figure engines.png: cost against what is off.

--check: the exit status is 1 if our time over that of MuJoCo is more than twice what it is in a file of
results, for any scene of both, and still so when that is run again.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import amontons
from beside import in_amontons, in_drake, in_mujoco, in_pybullet
from beside.cases import CASES, Case, robots
from beside.engine import Engine, Running, Unsupported
from beside.figure import draw
from beside.judge import Judge
from common import SAMPLE, arguments, read_csv, tracked, use_one_core, with_folders, write_csv

PARTS = 20
"""A run is so many parts, after each of which the others have their turn."""
LIMIT, QUICK_LIMIT = 8.0, 4.0
"""s of processor time of one engine for one scene; then it makes no further part."""
REFERENCE, OURS = "MuJoCo", "amontons, 1e-6"
Row = dict[str, Any]


def engines() -> Iterator[Engine]:
    """Those that are installed."""
    for module in (in_amontons, in_mujoco, in_pybullet, in_drake):
        yield from module.engines()


@dataclass
class Entry:
    """An engine with a scene under way."""

    engine: Engine
    running: Running
    judge: Judge
    times: list[float] = field(default_factory=list)
    """s per step of each part"""
    why: str = ""
    """it made no further part"""


def enter(case: Case, chosen: Iterable[Engine]) -> list[Entry]:
    subject = case.subject()
    entries = []
    for engine in chosen:
        try:
            running = engine.start(subject, case.dt)
        except Unsupported as missing:
            print(f"engines: {case.name}: {engine.name} has no {missing}")
            continue
        entries.append(Entry(engine, running, Judge(case, subject.model, PARTS)))
    return entries


def compete(case: Case, chosen: Iterable[Engine], limit: float) -> list[Row]:
    """A row per engine; the parts of all are made in turns."""
    entries = enter(case, chosen)
    steps = max(1, round(case.duration / case.dt / PARTS))
    for _ in range(PARTS):
        for entry in entries:
            if entry.why:
                continue
            start = process_time()
            try:
                entry.running.advance(steps)
            except Unsupported as missing:
                entry.why = f"no {missing}"
                continue
            entry.times.append((process_time() - start) / steps)
            entry.judge.look(entry.running.motion())
            if sum(entry.times) * steps > limit:
                entry.why = f"{limit:g} s of processor time"
            if entry.judge.lost:
                entry.why = "lost its bodies"
    reference = next((e.times for e in entries if e.engine.name == REFERENCE), [])
    for entry in entries:
        entry.running.close()
    return [row(case, entry, steps, reference) for entry in entries if entry.times]


def row(case: Case, entry: Entry, steps: int, reference: Sequence[float]) -> Row:
    """`step`: the mean (s); `ratio`: to the reference, the median of equal parts, so that a disturbance of
    some parts does not count."""
    pairs = list(zip(entry.times, reference, strict=False))
    return {
        "case": case.name, "engine": entry.engine.name, "tuned": entry.engine.tuned, "dt": case.dt,
        "steps": steps * len(entry.times), "step": sum(entry.times) / len(entry.times),
        "ratio": median(a / b for a, b in pairs) if pairs else "",
        **entry.judge.verdict(len(entry.times) / PARTS),
    }  # fmt: skip


def ratios(rows: Iterable[Mapping[str, Any]]) -> dict[str, float]:
    """Our time over MuJoCo's by scene, both as they are by default."""
    return {r["case"]: float(r["ratio"]) for r in rows if r["engine"] == OURS and r["ratio"] != ""}


def slower(rows: Iterable[Mapping[str, Any]], before: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Scenes whose ratio has more than doubled, and what to say of each."""
    now, then = ratios(rows), ratios(before)
    return {
        case: f"{case}: {now[case]:.2g} times MuJoCo's time, it was {then[case]:.2g}"
        for case in now
        if case in then and now[case] > 2 * then[case]
    }


def checked(rows: list[Row], before: Sequence[Mapping[str, Any]], cases: Iterable[Case], limit: float) -> int:
    """Complains of the scenes that are slower now, and again when they alone are run once more."""
    suspects = slower(rows, before)
    again: list[Row] = []
    for case in cases:
        if case.name in suspects:
            again += compete(case, [e for e in engines() if e.name in (OURS, REFERENCE)], limit)
    complaints = slower(again, before)
    for complaint in complaints.values():
        print(f"engines: slower than twice: {complaint}")
    return bool(complaints)


def shown(r: Row) -> str:
    text = f"{r['case']}, {r['engine']}: {1e6 * r['step']:.3g} us a step, off by {1e3 * r['off']:.2g} mm"
    return text + ("" if r["complete"] and not r["lost"] else ", not complete")


def main() -> int:
    parser = arguments(__doc__)
    parser.add_argument("--check", type=Path, help="engines.csv of an earlier run")
    parser.add_argument("--only", nargs="*", default=[], help="scenes whose names contain one of these")
    options = parser.parse_args()
    if options.only or options.check:  # not the run whose results are kept
        options.out = options.out or SAMPLE
    with_folders(options)
    use_one_core()
    warnings.simplefilter("ignore", amontons.StepWarning)
    limit = QUICK_LIMIT if options.quick else LIMIT
    cases = [c for c in (*CASES, *robots()) if c.quick or not options.quick]
    cases = [c for c in cases if not options.only or any(part in c.name for part in options.only)]
    chosen = [e for e in engines() if not options.check or e.name in (OURS, REFERENCE)]
    rows: list[Row] = []
    for case in tracked(cases, "engines"):
        rows += compete(case, chosen, limit)
        write_csv(options.out / "engines.csv", rows)
    for r in rows:
        print(f"engines: {shown(r)}")
    draw(rows, options.figures / "engines.png")
    return checked(rows, read_csv(options.check), cases, limit) if options.check else 0


if __name__ == "__main__":
    sys.exit(main())
