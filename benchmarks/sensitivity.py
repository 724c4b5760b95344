"""What each tuned number is worth: it is halved, doubled and switched off, and a sample runs again.

    python benchmarks/sensitivity.py [--only ROOM ...] [--numbers NAME ...] [--values KIND ...] [--quick]
        [--starts 3] [--seconds 8] [--details FOLDER] [--data FOLDER] [--out FOLDER]

Writes sensitivity.csv, a row per number and value; "worse" and "better" name what differs by more than its
noise. The value that switches a number off stands in policy.hpp ("Off: 1."). Each value has a process of its
own, a fork of one that has loaded all models. Its results are kept in --details, per build and sample, so
that a sweep that was stopped goes on where it was.

Runs start from states that are perturbed by 1e-9. Sensitivity is the mean difference from today's value over
--starts of them. Noise is three standard errors of this difference, from what today's value gives over all
starts: verdicts within it say "flat". A run that keeps its bits from the first start is not repeated from the
others. Counts are steps (unsolved problems), lost bodies and broken promises, products and factorisations,
and the deepest overlap; no seconds, so that other programs do not matter. Sums of steps and bodies are per
start; percentages are changes of the geometric mean.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, variance

from amontons import _core
from common import ROOT, arguments, with_folders, write_csv
from sensitivity_runs import Row, Run, all_runs

sys.path[:0] = [str(ROOT), str(ROOT / "tools")]

from check_policy import constants_of  # noqa: E402

Results = dict[str, list[Row]]
"""Of each run, a row per start."""

BASELINE_STARTS = 8
"""Starts from which today's values run, to know their noise."""
ERRORS = 3.0
"""Standard errors within which a difference is noise."""
LONGEST = 0.2
"""s of processor time: longer runs are left out."""
SLOWEST = 20.0
"""Times the time of today's values, after which a process is ended."""


@dataclass(frozen=True)
class Measure:
    """A cost: more of it is worse."""

    of: Callable[[float], float]
    relative: bool
    """as a mean over all runs, in percent, instead of a sum"""
    least: float
    """Differences up to it are noise, however small that of the starts is."""


MEASURES = {
    "missed": Measure(float, False, 1.0),
    "broken": Measure(float, False, 0.5),
    "products": Measure(math.log1p, True, 1.0),
    "factorizations": Measure(math.log1p, True, 1.0),
    "overlap": Measure(lambda depth: math.log(1e-6 + depth), True, 2.0),
}


@dataclass(frozen=True)
class Value:
    number: str
    kind: str
    value: float

    @property
    def name(self) -> str:
        return f"{self.number} {self.kind}"


KINDS = ("off", "half", "twice")


def values(
    rooms: Sequence[str] = (), numbers: Sequence[str] = (), kinds: Sequence[str] = KINDS
) -> Iterator[Value]:
    """Those that are tried, number by number; by default of all."""
    off = {}
    for path in sorted((ROOT / "src").rglob("policy.hpp")):
        text = path.read_text()
        room = text.split("namespace amontons::", 1)[1].split()[0]
        off |= {f"{room}.{c.name}": c.off for c in constants_of(str(path), text)}
    for number, today in _core.policy().items():
        if (rooms and number.split(".")[0] not in rooms) or (numbers and number not in numbers):
            continue
        tried = {"off": off.get(number), "half": today / 2, "twice": 2 * today}
        for kind, value in tried.items():
            if value is not None and kind in kinds:
                yield Value(number, kind, float(round(value)) if isinstance(today, int) else value)


# Runs


def results_of(runs: Sequence[Run], starts: Sequence[int]) -> Results:
    found: Results = {}
    for run in runs:
        for start in starts:
            begun = time.process_time()
            try:
                row = run.do(start)
            except Exception as error:  # a fault of the engine is a result
                row = {"broken": 1, "bits": f"{type(error).__name__}: {error}"[:100]}
            found.setdefault(run.name, []).append(row | {"time": time.process_time() - begun})
    return found


def changed(found: Results, base: Results) -> set[str]:
    return {name for name, rows in found.items() if rows[0]["bits"] != base[name][0]["bits"]}


def in_fork(file: Path, do: Callable[[], Results], limit: float) -> Results | None:
    """What a process of its own found, perhaps earlier, as the file tells; None: it did not end."""
    if file.exists():
        return json.loads(file.read_text()) or None
    child = os.fork()
    if child == 0:
        part = file.with_suffix(".part")
        part.write_text(json.dumps(do()))
        part.rename(file)
        os._exit(0)
    until = time.monotonic() + limit
    while os.waitpid(child, os.WNOHANG) == (0, 0):
        time.sleep(0.02)
        if time.monotonic() > until:
            os.kill(child, 9)
            os.waitpid(child, 0)
    if not file.exists():
        file.write_text("{}")
    return json.loads(file.read_text()) or None


def sample(runs: Sequence[Run], first: Results, seconds: float) -> list[Run]:
    """Those that are not long, of every group about as much time."""
    chosen: list[Run] = []
    for group in dict.fromkeys(run.group for run in runs):
        left = seconds / 4
        mine = [run for run in runs if run.group == group and first[run.name][0]["time"] <= LONGEST]
        for run in sorted(mine, key=lambda run: hashlib.sha256(run.name.encode()).digest()):
            if (took := first[run.name][0]["time"]) <= left:
                chosen.append(run)
                left -= took
    return chosen


def with_value(value: Value, runs: Sequence[Run], base: Results, starts: int) -> Results:
    _core.set_policy(value.number, value.value)
    found = results_of(runs, [0])
    again = [run for run in runs if run.name in changed(found, base)]
    more = results_of(again, range(1, starts))
    return {name: rows + more.get(name, []) for name, rows in found.items()}


# Tables


def differences(found: Results, base: Results, groups: dict[str, list[str]]) -> dict[tuple[str, str], Row]:
    """Sensitivity and noise of each group and measure."""
    table: dict[tuple[str, str], Row] = {}
    for group, names in groups.items():
        for key, measure in MEASURES.items():
            total = spread = 0.0
            for name in names:
                if name not in found:
                    continue
                today = [measure.of(row.get(key, 0)) for row in base[name]]
                then = [measure.of(row.get(key, 0)) for row in found[name]]
                total += fmean(t - b for t, b in zip(then, today, strict=False))
                spread += variance(today) * 2 / len(then) if len(today) > 1 else 0.0
            scale = 100 / len(names) if measure.relative else 1.0
            noise = max(ERRORS * math.sqrt(spread) * scale, measure.least)
            table[group, key] = {"sensitivity": total * scale, "noise": noise}
    return table


def row_of(value: Value, found: Results | None, base: Results, groups: dict[str, list[str]]) -> Row:
    row: Row = {"number": value.number, "value": value.kind, "is": value.value}
    if found is None:
        return row | {"runs_changed": "", "worse": "does not end"}
    moved = {name: rows for name, rows in found.items() if name in changed(found, base)}
    row["runs_changed"] = len(moved)
    table = differences(moved, base, groups)
    for key, measure in MEASURES.items():
        cells = [table[group, key] for group in groups]
        combine = fmean if measure.relative else math.fsum
        row[key] = combine(c["sensitivity"] for c in cells)
        row[f"{key}_noise"] = max(
            measure.least, math.hypot(*(c["noise"] for c in cells)) / (len(cells) if measure.relative else 1)
        )
    beyond = {k: c for k, c in table.items() if abs(c["sensitivity"]) > c["noise"]}
    for sign, column in ((1, "worse"), (-1, "better")):
        row[column] = "; ".join(
            f"{group}: {key} {c['sensitivity']:+.3g}{' %' * MEASURES[key].relative} (noise {c['noise']:.2g})"
            for (group, key), c in beyond.items() if sign * c["sensitivity"] > 0
        )  # fmt: skip
    return row


def verdict(rows: Sequence[Row]) -> str:
    told = [
        f"{row['value']} is {word}: {row[word]}"
        for word in ("worse", "better")
        for row in rows
        if row.get(word)
    ]
    if told:
        return "; ".join(told)
    return "flat" if any(row["runs_changed"] for row in rows) else "no run changes"


def parsed() -> argparse.Namespace:
    parser = arguments(__doc__)
    parser.add_argument("--only", nargs="+", default=[], help="rooms: step, trees, direct, curve")
    parser.add_argument("--numbers", nargs="+", default=[], help="names as step.closing")
    parser.add_argument("--values", nargs="+", default=KINDS, choices=KINDS, help="that are tried")
    parser.add_argument("--starts", type=int, default=3, help="from which each value runs")
    parser.add_argument(
        "--seconds", type=float, default=8.0, help="processor time of the sample from a start"
    )
    parser.add_argument(
        "--details", type=Path, default=ROOT / "out" / "sensitivity", help="folder for results"
    )
    options = with_folders(parser.parse_args())
    if options.quick:
        options.starts, options.seconds = 2, 0.4
    module = hashlib.sha256(Path(_core.__file__).read_bytes()).hexdigest()[:12]
    options.details /= f"{module}-{options.starts}-{options.seconds:g}"
    options.details.mkdir(parents=True, exist_ok=True)
    return options


def main() -> None:
    options = parsed()
    runs = list(all_runs(options.data))
    first = in_fork(options.details / "first.json", lambda: results_of(runs, [0]), 3600.0)
    if first is None:
        raise SystemExit("the runs with today's values do not end")
    runs = sample(runs, first, options.seconds)
    groups: dict[str, list[str]] = {}
    for run in runs:
        groups.setdefault(run.group, []).append(run.name)
    starts = 2 if options.quick else BASELINE_STARTS
    base = in_fork(options.details / "today.json", lambda: results_of(runs, range(starts)), 3600.0)
    if base is None:
        raise SystemExit("the runs with today's values do not end")
    limit = 60 + SLOWEST * options.starts * options.seconds
    rows: list[Row] = []
    for value in values(options.only, options.numbers, options.values):
        file = options.details / f"{value.name.replace(' ', '-')}.json"
        found = in_fork(file, lambda v=value: with_value(v, runs, base, options.starts), limit)  # type: ignore[misc]
        rows.append(row_of(value, found, base, groups))
        print(f"{value.name:40s} {rows[-1]['runs_changed']!s:>4s} {verdict(rows[-1:])}", flush=True)
        write_csv(options.out / "sensitivity.csv", rows)


if __name__ == "__main__":
    main()
