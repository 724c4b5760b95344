"""What each repair of a step and of its solvers is good for: one is switched off, and everything runs again.

    python benchmarks/ablation.py [--data FOLDER] [--out FOLDER] [--only NAME ...] [--details FOLDER]

Needs a module built with the CMake option AMONTONS_ABLATION, which reads the environment variable
AMONTONS_OFF; a release has no switches. Writes ablation.csv, a row per repair, in the order in which they
are measured, and ablation.md, the same as a table. All runs are on one core and in processor time.

The first two rows are the code as it is, measured twice: what differs between them is noise. Each repair has
a process of its own, a fork of one that has loaded all files. Runs of the code as it is that take longer
than a limit are left out of all rows. The tests run only for a repair without which the other runs lose
nothing: a loss there is reason enough to keep it.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from time import process_time

import amontons
from ablation_runs import (
    Row,
    Run,
    budget_runs,
    depth_runs,
    large_runs,
    problem_runs,
    random_runs,
    robot_runs,
    run_tests,
    scene_runs,
)  # fmt: skip
from common import ROOT, arguments, read_csv, with_folders, write_csv

sys.path.insert(0, str(ROOT))

STEP, SOLVER = "step", "solver"
REPAIRS: dict[str, tuple[str, ...]] = {
    STEP: (
        "closing", "deep", "slack", "damped", "scale impulses", "along motion", "lightness",
        "at rest", "light bodies", "stop bodies", "slow spins", "direct start", "looks",
        "turn contacts", "limit energy", "reflections",
        "positions after turn limit", "positions stop at fixed",
    ),
    SOLVER: ("second search", "curve", "rounds",
             "joints eliminated", "race after elimination"),
}  # fmt: skip
ELSEWHERE = {
    "looks": "1000 spheres overlap by 0.87 % of the length, not by 0.20 %",
    "slack": "a wall at rest takes 105,251 iterations at a tolerance of 1e-3, not 418",
    "joints eliminated": "the tracked vehicle takes 249,740 iterations, not 42,382",
    "positions after turn limit": "an overlap beside a hinge tears the next joint by 38 mm, not by 0.4 mm"
    " (test_overlaps_beside_a_hinge_tear_no_joint)",
    "race after elimination": "auto does not prove that a small problem has no solution (C++ test_status),"
    " test_rolling fails",
}
"""What is lost in runs that this table leaves out: large scenes (--study large) and the named tests."""
LIMITS = {"problem": 0.45, "robot": 1.0, "treadmill": 8.0, "scene": 1.0, "random": 0.75, "test": 0.3,
          "budget": 9.0, "depth": 3.0, "large": 60.0}  # fmt: skip
"""s: runs of the code as it is that take longer are left out."""
STUDIES = {"budgets": budget_runs, "depths": depth_runs, "large": large_runs}
"""Of runs that the table of all repairs leaves out."""
ROUNDS = 2
"""Every run is done so many times, and the fastest counts: other programs make a run slower, never faster."""
SLOWEST = 4.0 * ROUNDS
"""Times the time of the code as it is, after which a repair's process ends."""


def measure(runs: Sequence[Run], budget: float) -> dict[str, Row]:
    """What every run came to, with its time; those that did not fit into the budget (s) are missing."""
    results: dict[str, Row] = {}
    begun = process_time()
    for _ in range(ROUNDS):
        for run in runs:
            before = process_time()
            if before - begun > budget:
                return results
            try:
                row = run.do()
            except Exception as error:  # a fault of the engine is a result
                row = {"error": f"{type(error).__name__}: {error}"[:120], "broken": 1}
            fastest = min(process_time() - before, results.get(run.name, {}).get("time", float("inf")))
            results[run.name] = row | {"kind": run.kind, "time": fastest}
    return results


def in_fork(off: str, runs: Sequence[Run], budget: float, skipped: list[str] | None, file: Path) -> Row:
    """The results of a process of its own in which a repair is off; with tests where `skipped` is a list.

    They are kept in a file of this build, so that a measurement that was stopped goes on where it was.
    """
    if file.exists():
        return dict(json.loads(file.read_text()))
    child = os.fork()
    if child == 0:
        os.environ["AMONTONS_OFF"] = off
        results = measure(runs, budget)
        file.write_text(json.dumps({"runs": results, "failed": None, "times": {}}))
        if skipped is not None:
            failed, times = run_tests(skipped)
            file.write_text(json.dumps({"runs": results, "failed": failed, "times": times}))
        os._exit(0)
    end = time.monotonic() + 8 * budget + 120
    while os.waitpid(child, os.WNOHANG) == (0, 0):
        time.sleep(0.1)
        if time.monotonic() > end:
            os.kill(child, 9)
            os.waitpid(child, 0)
            break
    return dict(json.loads(file.read_text())) if file.exists() else {"runs": {}, "failed": None, "times": {}}


def total(runs: dict[str, Row], key: str, *kinds: str) -> int:
    return sum(int(row.get(key, 0)) for row in runs.values() if row["kind"] in kinds)


SIMULATED = ("robot", "scene", "random")
KINDS = ("problem", *SIMULATED, "treadmill")


def row_of(name: str, room: str, result: Row, base: Row) -> Row:
    """A row of the table."""
    runs, of = result["runs"], base["runs"]
    both = runs.keys() & of.keys()
    failed = sorted(set(result["failed"] or []) - set(base["failed"] or []))
    speed = machine_speed(runs, of)
    gains = {key: row.get("gain", 0.0) for key, row in runs.items()}
    return {
        "repair": name, "room": room,
        "runs_changed": sum(runs[key].get("bits") != of[key].get("bits") for key in both),
        "runs": len(runs),
        "unsolved": total(runs, "unsolved", "problem"),
        "missed_robots": total(runs, "missed", "robot"),
        "missed_scenes": total(runs, "missed", "scene"),
        "missed_random": total(runs, "missed", "random"),
        "missed_treadmill": total(runs, "missed", "treadmill"),
        "lost_bodies": total(runs, "lost", *SIMULATED),
        "broken": total(runs, "broken", *SIMULATED),
        "energy_gained": max(gains.values(), default=0.0),
        "failing_tests": "not run" if result["failed"] is None else len(failed),
        "relative_time": ratio(runs, of, speed, *KINDS),
        "time": sum(row["time"] for row in runs.values()),
        **{f"time_{kind}s": ratio(runs, of, speed, kind) for kind in KINDS if kind != "treadmill"},
        "slower": slower(runs, of, speed),
        "worst": worst(runs, of),
        "tests": "; ".join(name.rsplit("/", 1)[-1] for name in failed),
    }  # fmt: skip


def machine_speed(runs: dict[str, Row], of: dict[str, Row]) -> float:
    """Time of this process over that of the code as it is, for runs whose bits are the same: these did the
    same work, so that only the machine differs."""
    same = [key for key in runs.keys() & of.keys() if runs[key].get("bits") == of[key].get("bits")]
    return sum(runs[key]["time"] for key in same) / max(sum(of[key]["time"] for key in same), 1e-9)


def ratio(runs: dict[str, Row], of: dict[str, Row], speed: float, *kinds: str) -> float:
    """Time over that of the code as it is, at the same speed of the machine."""
    both = [key for key in runs.keys() & of.keys() if runs[key]["kind"] in kinds]
    return sum(runs[key]["time"] for key in both) / speed / max(sum(of[key]["time"] for key in both), 1e-9)


def slower(runs: dict[str, Row], of: dict[str, Row], speed: float) -> str:
    """The runs that take much longer, three at most; random scenes and the treadmill do by chance, and runs
    with the same bits by other programs."""
    least, times = 0.05, 2.0  # s, of the code as it is
    both = [key for key in runs.keys() & of.keys() if of[key]["kind"] in ("problem", "robot", "scene")]
    both = [key for key in both if runs[key].get("bits") != of[key].get("bits")]
    more = {key: runs[key]["time"] / speed / max(of[key]["time"], 1e-3) for key in both}
    found = [k for k in both if more[k] > times and runs[k]["time"] / speed > of[k]["time"] + least]
    return "; ".join(f"{k}: {more[k]:.1f} times" for k in sorted(found, key=lambda k: -more[k])[:3])


def worst(runs: dict[str, Row], of: dict[str, Row]) -> str:
    """The runs that lost most: what each has that it does not have with the repair."""
    losses: Counter[str] = Counter()
    for key in runs.keys() & of.keys():
        row, before = runs[key], of[key]
        for what in ("unsolved", "missed", "lost", "broken"):
            more = int(row.get(what, 0)) - int(before.get(what, 0))
            if more > 0:
                losses[f"{key}: {what} +{more}"] += more * (1 if what == "missed" else 100)
    return "; ".join(key for key, _ in losses.most_common(4))


def chosen(runs: list[Run], base: Row) -> list[Run]:
    """Those that take no longer than the limits."""
    found = base["runs"]
    return [r for r in runs if r.name in found and found[r.name]["time"] <= LIMITS[r.kind]]


def write_tables(rows: list[Row], out: Path) -> None:
    """ablation.csv and ablation.md."""
    base = rows[0]
    for row in rows:
        row["verdict"] = verdict(row, base)
    write_csv(out / "ablation.csv", rows)
    lines = [
        "| Switched off | Room | Runs changed | Unsolved | Missed steps | Treadmill | Lost bodies | Broken |"
        " Energy gained | Failing tests | Time | Verdict |",
        "|" + "---|" * 12,
    ]
    for row in rows:
        missed = sum(int(row[key]) for key in MISSED)
        lines.append(
            f"| {row['repair']} | {row['room']} | {row['runs_changed']} | {row['unsolved']} | {missed} "
            f"| {row['missed_treadmill']} | {row['lost_bodies']} | {row['broken']} "
            f"| {float(row['energy_gained']):.2g} | {row['failing_tests']} "
            f"| {float(row['relative_time']):.2f} | {row['verdict']} |"
        )
    (out / "ablation.md").write_text("\n".join(lines) + "\n")


MISSED = ("missed_robots", "missed_scenes", "missed_random")
CHAOS = 15
"""Missed steps of random scenes, and of the treadmill, by which chaos alone changes their sums."""
SLOWER = 1.1
"""Times the time of the code as it is: a loss; of one kind of runs, three times as much."""


def verdict(row: Row, base: Row) -> str:
    """Whether the repair can go, or what is lost without it."""
    if not row["room"]:
        return ""
    lost = []
    for key, allowed in (
        ("unsolved", 0),
        ("missed_robots", 1),
        ("missed_scenes", 3),
        ("missed_random", CHAOS),
        ("missed_treadmill", CHAOS),
    ):
        if (more := int(row[key]) - int(base[key])) > allowed:
            lost.append(f"{key.replace('_', ' steps of ')} +{more}")
    for key in ("lost_bodies", "broken"):
        if int(row[key]) > int(base[key]):
            lost.append(f"{key.replace('_', ' ')} +{int(row[key]) - int(base[key])}")
    if float(row["energy_gained"]) > 2 * float(base["energy_gained"]):
        lost.append(f"gains {float(row['energy_gained']):.2g} of the energy")
    if row["failing_tests"] not in (0, "0", "not run"):
        lost.append(f"{row['failing_tests']} tests")
    if float(row["relative_time"]) > SLOWER:
        lost.append(f"{float(row['relative_time']):.2f} times slower")
    kinds = {key: float(row[key]) for key in row if key.startswith("time_")}
    lost += [f"{key[5:]} {v:.2f} times slower" for key, v in kinds.items() if v > 1 + 3 * (SLOWER - 1)]
    if row["slower"]:
        lost.append(f"slower: {row['slower']}")
    if more := ELSEWHERE.get(row["repair"]):
        lost.append(more)
    if lost:
        return "keep: " + ", ".join(lost)
    return "delete" if int(row["runs_changed"]) else "delete: no run changes"


def parsed() -> argparse.Namespace:
    parser = arguments(__doc__)
    parser.add_argument("--only", nargs="+", help="names of repairs, several at once with commas")
    parser.add_argument("--details", type=Path, default=ROOT / "out" / "ablation", help="folder for results")
    parser.add_argument(
        "--study", choices=tuple(STUDIES), help="budgets of time, deep overlaps, large scenes"
    )
    parser.add_argument("--no-tests", action="store_true", help="leave the tests out")
    parser.add_argument("--append", type=Path, help="a CSV file that gets every row when it is known")
    options = with_folders(parser.parse_args())
    module = Path(amontons._core.__file__)
    options.details /= hashlib.sha256(module.read_bytes()).hexdigest()[:12]  # another build has other results
    options.details.mkdir(parents=True, exist_ok=True)
    return options


def study(options: argparse.Namespace, what: str, runs: list[Run], names: Sequence[str]) -> None:
    """ablation_<what>.csv: a row per repair and run, of those that other runs show nothing of."""
    rows: list[Row] = []
    of: dict[str, Row] = {}
    for name in ("none", "none again", *names):
        file = options.details / f"{what}-{name.replace(' ', '-')[:100]}.json"
        found = in_fork(name, runs, 300.0, None, file)["runs"]
        if not of:
            runs = [r for r in runs if r.name in found and found[r.name]["time"] <= LIMITS[r.kind]]
            found = {r.name: found[r.name] for r in runs}
            of = found
        rows += [{"repair": name, "run": key, **row} for key, row in found.items()]
        print(name, compared(found, of), flush=True)
    keys = dict.fromkeys(key for row in rows for key in row)
    write_csv(options.out / f"ablation_{what}.csv", [dict.fromkeys(keys, "") | row for row in rows])


def compared(found: dict[str, Row], of: dict[str, Row]) -> str:
    """What differs from the code as it is: sums, and overlaps that are more than a tenth deeper."""
    both = found.keys() & of.keys()
    told = [f"{sum(found[k].get('bits') != of[k].get('bits') for k in both)} of {len(both)} changed"]
    for key in ("missed", "late", "lost", "broken"):
        if more := sum(int(found[k].get(key, 0)) - int(of[k].get(key, 0)) for k in both):
            told.append(f"{key} {more:+}")
    deeper = {k: (of[k].get("penetration", 0.0), found[k].get("penetration", 0.0)) for k in sorted(both)}
    told += [f"{k}: {a:.2g} -> {b:.2g} deep" for k, (a, b) in deeper.items() if b > 1.1 * a + 1e-4]
    return "; ".join(told)


def main() -> None:
    options = parsed()
    if options.study:
        return study(options, options.study, list(STUDIES[options.study]()), options.only or REPAIRS[STEP])
    runs = [*robot_runs(options.data), *random_runs(), *scene_runs(), *problem_runs(options.data)]
    first = options.details / "baseline.json"
    if not first.exists():
        in_fork("", runs, 600.0, None if options.no_tests else [], first)
    base = json.loads(first.read_text())
    kept = chosen(runs, base)
    skipped = [name for name, seconds in base["times"].items() if seconds > LIMITS["test"]]
    base["runs"] = {run.name: base["runs"][run.name] for run in kept}
    budget = SLOWEST * sum(row["time"] for row in base["runs"].values())
    rows: list[Row] = [row_of("none", "", base, base)]
    every = [name for room in (SOLVER, STEP) for name in REPAIRS[room]]
    for name in options.only or ["none again", *every]:
        rooms = [room for room, all_of in REPAIRS.items() if set(name.split(",")) & set(all_of)]
        file = options.details / f"{name.replace(' ', '-')[:100]}.json"
        result = in_fork(name, kept, budget, None, file)
        rows.append(row_of(name, " and ".join(rooms), result, base))
        if not options.no_tests and verdict(rows[-1], rows[0]).startswith("delete"):
            tests = in_fork(name, [], budget, skipped, file.with_suffix(".tests.json"))
            rows[-1] = row_of(name, " and ".join(rooms), result | {"failed": tests["failed"]}, base)
        if options.append:
            append(options.append, rows[-1:] if options.append.exists() else rows)
        print({k: v for k, v in rows[-1].items() if k not in ("worst", "tests")}, flush=True)
    write_tables(rows, options.out)


def append(path: Path, rows: Sequence[Row]) -> None:
    earlier = read_csv(path) if path.exists() else []
    write_csv(path, [*earlier, *rows])


if __name__ == "__main__":
    main()
