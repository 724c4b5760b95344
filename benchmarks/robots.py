"""Every model file of a folder beside MuJoCo: does it load, run, and move alike?

    python benchmarks/robots.py [FOLDER] [--duration 2] [--dt 5e-3] [--only PART ...] [--jobs N] [--check]
                                [--trees none|auto|both] [--fall] [--scenes]

Finds MJCF (files with the root <mujoco> that no other includes) and URDF files, runs each with the defaults
in a process of its own with a limit of wall clock, writes robots.csv, a row per model, and prints which
models do what none should. Of the data folder's own, without options, it also writes robots_2ms.csv, the
same with a step of 2 ms.
With --trees both each model runs with both forms of joints and in MuJoCo, in turns, with steps of 2 ms: a
row per model in robots_forms.csv; with --scenes those of amontons.scenes that have joints in place of files,
in scenes_forms.csv. With --fall robots lie and move on the floor (robot/fall_cases.py), and the work of their
steps is counted: robots_fall.csv; with --trees both that of large islands, with trees and with rows:
robots_large.csv. Speeds are comparable with --jobs 1 only.

Columns of robots_forms.csv: rows, trees, mujoco: medians (s) of a step; run_trees_to_rows: ratio of the sums
over the run; rows_..., trees_...: joint_error (m), means of joint_rows and contacts over the steps.

Columns of robots.csv:
- not_read: elements that the loader left out; outcome: a refusal, or a run that did not end.
- contacts, missed: largest number; steps whose residual stayed above the tolerance, also in percent.
- penetration_start, penetration: deepest in the first 0.2 s, and after it (m).
- energy_gain: largest excess of the energy of a step (kinetic with armatures, gravity, springs) over the
  energy of the last step plus the work of motors and moving surfaces. Blank where kinematic bodies drive,
  or where soft contacts and tendons store energy. energy_gain_relative: the larger of this and of
  energy_balance over weight times Model.length plus the largest kinetic energy.
- joint_error: largest after the first 0.2 s; angles are multiplied by Model.length.
- free: largest distance of bases and end effectors from MuJoCo's after 0.5 s at 2 ms, rotations times
  Model.length added. Contacts, limits and dry friction are off on both sides; equalities are closed at the
  start. All joints have an initial velocity and all actuators a control. MuJoCo uses its implicit
  integrator at 0.25 ms. free_in_errors: over the error of the step, the larger of ours (twice the change
  when the step is halved) and MuJoCo's.
- step_median, longest_in_medians: processor time of a step, or its wall-clock time in a second run,
  whichever is shorter. longest, longest_again: that processor time and that wall-clock time.
- keyframe_in_lengths: largest distance of bodies and links from MuJoCo's. keyframe_missed_percent: in 0.1
  s after.
- driven_...: one second with random controls, or with random targets in half of their range for a servo on
  every joint if there are no actuators (of the inertia that it moves, 20 rad/s, critically damped).
- steps_per_second: the first run repeated in a bare loop, in processor time; mujoco_...: with the file's
  step.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import amontons
import amontons.scenes
from common import Row, arguments, fill, with_folders
from robot import falls

HERE = Path(__file__).resolve().parent
WORKER: tuple[str | Path, ...] = ("-m", "robot.run")
MISSED, MEDIANS, GAIN, ERRORS, APART = 1.0, 10.0, 0.01, 3.0, 0.01
"""From where on a row counts: missed steps (%), longest step (medians), relative gain of a step, difference
of free motion (errors of the step), joints that are apart (lengths of the model)."""
SAME = 1e-6
"""Lengths of the model by which a keyframe may be off MuJoCo's."""
SHORT = 2e-3
"""A step below this (s) is not long, however short the median: memory that is new costs as much."""
SHORT_STEP = 2e-3
"""s: with it the run whose results are kept is done again. What is rare shows in one of the two."""


def content(path: Path) -> tuple[str, str]:
    """The text of a file without comments, and the name of its root element."""
    text = re.sub(r"<!--.*?-->", "", path.read_text(errors="replace"), flags=re.DOTALL)
    root = re.search(r"<([A-Za-z]\w*)", text)
    return text, root[1] if root else ""


def models(folder: Path) -> list[Path]:
    """MJCF, URDF and our own files below the folder, without those that another one includes."""
    found, included = sorted(folder.rglob("*.json")), set()
    for path in sorted(p for p in folder.rglob("*") if p.suffix in (".xml", ".mjcf", ".urdf")):
        text, root = content(path)
        if root not in ("mujoco", "robot"):
            continue
        found.append(path)
        names = re.findall(r"<include\s[^>]*?file\s*=\s*[\"']([^\"']+)[\"']", text)
        included |= {(path.parent / name).resolve() for name in names}
    return [path for path in found if path.resolve() not in included]


def write_scenes(folder: Path) -> None:
    for name in amontons.scenes.names():
        model = amontons.scenes.make(name)
        if model.joints:
            amontons.write_model(model, folder / f"{name}.json")


def run(path: Path, options: Any) -> Row:
    """The last line that the worker printed, and how it ended."""
    command = [sys.executable, *WORKER, path.resolve(), "--trees", options.trees]
    command += ["--duration", options.duration, "--limit", options.limit]
    command += ["--dt", options.dt] if options.dt else []
    command += ["--urdf"] if content(path)[1] == "robot" else []
    with (
        tempfile.TemporaryFile("w+") as out,
        tempfile.TemporaryFile("w+") as err,
        tempfile.TemporaryDirectory() as folder,  # where MuJoCo leaves its log
    ):
        around = {**os.environ, "PYTHONPATH": str(HERE)}
        arguments = {"stdout": out, "stderr": err, "cwd": folder, "timeout": options.limit, "env": around}
        try:
            code = subprocess.run(list(map(str, command)), **arguments).returncode
        except subprocess.TimeoutExpired:
            code = None
        out.seek(0)
        err.seek(0)
        lines, errors = out.read().splitlines(), err.read().splitlines()
    row: Row = {}
    for line in lines:  # the last one may be cut off
        try:
            row |= json.loads(line)
        except json.JSONDecodeError:
            break
    name = path.relative_to(options.folder).as_posix()
    return {"model": name, "outcome": outcome(row, code, errors), **row}


def outcome(row: Row, code: int | None, errors: list[str]) -> str:
    if code not in (0, None):
        return f"crashed ({code}): {errors[-1] if errors else 'no message'}"[:200]
    if "load" not in row:
        return "loading did not end"
    if row["load"] == "refused":
        return "refused, by MuJoCo too" if row.get("mujoco_refuses") else "refused"
    if row.get("stopped") or row.get("steps", 0) < row.get("wanted_steps", 1):
        return "unfinished"
    return "finished"


def long(row: Row) -> bool:
    return row.get("longest_in_medians", 0) * row.get("step_median", 0) > SHORT


def above(key: str, bound: float) -> Callable[[Row], bool]:
    return lambda row: row.get(key) is not None and not row[key] <= bound


NOTES: tuple[tuple[str, Callable[[Row], bool]], ...] = (
    ("refused by MuJoCo, not by us", lambda r: r.get("load") == "ok" and bool(r.get("mujoco_refuses"))),
    ("something not read that changes the motion", lambda r: bool(r.get("changes_motion"))),
)
FAULTS: tuple[tuple[str, Callable[[Row], bool]], ...] = (
    ("refused, not by MuJoCo", lambda r: r["outcome"] == "refused"),
    ("unfinished or crashed", lambda r: not r["outcome"].startswith(("finished", "refused"))),
    (f"more than {MISSED:g} % of the steps missed", above("missed_percent", MISSED)),
    (f"longest step above {MEDIANS:g} medians", lambda r: long(r) and r["longest_in_medians"] > MEDIANS),
    (f"a step gains more than {100 * GAIN:g} % of the energy's scale", above("energy_gain_relative", GAIN)),
    (f"free motion further off than {ERRORS:g} errors of the step", above("free_in_errors", ERRORS)),
    (f"joints apart by more than {APART:g} lengths", above("joint_error_relative", APART)),
    ("keyframes that fail or are another pose",
     lambda r: bool(r.get("keyframes_failed")) or above("keyframe_in_lengths", SAME)(r)),
    (f"keyframes: more than {MISSED:g} % of the steps missed", above("keyframe_missed_percent", MISSED)),
    (f"driven: more than {MISSED:g} % of the steps missed, or stopped",
     lambda r: bool(r.get("driven_stopped")) or above("driven_missed_percent", MISSED)(r)),
    (f"driven: joints apart by more than {APART:g} lengths", above("driven_joint_error", APART)),
    (f"driven: a step gains more than {100 * GAIN:g} %", above("driven_gain_relative", GAIN)),
    ("free motion not compared", lambda r: r["outcome"] == "finished" and not r.get("compared")),
)  # fmt: skip
"""What no model should do."""


def sums(rows: list[Row]) -> Iterator[str]:
    """How many models do what none should, and which."""
    yield f"models: {len(rows)}, loaded {sum('bodies' in row for row in rows)}"
    for what, test in NOTES + FAULTS:
        names = [row["model"] for row in rows if test(row)]
        yield f"{what}: {len(names)}" + (f" ({', '.join(names)})" if names else "")
    faulty = sum(any(test(row) for _, test in FAULTS) for row in rows)
    yield f"models without a fault: {len(rows) - faulty} of {len(rows)}"


def fall(options: Any) -> None:
    file = options.out / ("robots_large.csv" if options.trees == "both" else "robots_fall.csv")
    with tempfile.TemporaryDirectory() as folder:
        runs = list(falls.runs(options.folder, Path(folder), options))
        fill(file, runs, lambda run: [falls.fall(*run, options)], "case control trees ratio missed stalled")


def run_all(options: Any, file: Path, show: str = "") -> list[Row]:
    paths = [p for p in models(options.folder) if not options.only or any(s in str(p) for s in options.only)]
    return fill(file, paths, lambda path: [run(path, options)], show, options.jobs)


def main() -> int:
    parser = arguments(__doc__)
    parser.add_argument("folder", type=Path, nargs="?", help="of models (default: robots in the data folder)")
    parser.add_argument("--duration", type=float, help="simulated time of a run (default: 2 s)")
    parser.add_argument("--dt", type=float, help="time step (default: that of Simulation)")
    parser.add_argument("--trees", choices=("none", "auto", "both"), default="auto", help="form of joints")
    parser.add_argument("--fall", action="store_true", help="count the work of robots on the floor")
    parser.add_argument("--scenes", action="store_true", help="with --trees both: scenes in place of files")
    parser.add_argument("--only", nargs="+", metavar="PART", help="models whose path holds one of these")
    parser.add_argument("--jobs", type=int, default=1, help="models at a time")
    parser.add_argument("--limit", type=float, help="wall clock of a model (default: 60 s)")
    parser.add_argument("--check", action="store_true", help="exit with 1 if a model has a fault")
    options = parser.parse_args()
    ours = options.folder is None
    kept = ours and not (options.only or options.duration or options.dt or options.trees == "none")
    with_folders(options, sample=not kept)
    options.folder = (options.data / "robots" if ours else options.folder).resolve()
    options.duration = options.duration or (0.2 if options.quick else 2.0)
    options.limit = options.limit or (20.0 if options.quick else 60.0)
    if not options.folder.is_dir():
        print(f"robots: skipped, there is no folder {options.folder}; name one with models")
        return 0 if ours else 1
    if options.fall:
        fall(options)
        return 0
    if options.trees == "both":
        with tempfile.TemporaryDirectory() as folder:
            if options.scenes:
                options.folder = Path(folder).resolve()
                write_scenes(options.folder)
            file = options.out / f"{'scenes' if options.scenes else 'robots'}_forms.csv"
            run_all(options, file, "model run_trees_to_rows trees_to_mujoco rows_missed trees_missed")
        return 0
    rows = run_all(options, options.out / "robots.csv")
    print(*sums(rows), sep="\n")
    if kept:
        options.dt = SHORT_STEP
        rows += run_all(options, options.out / "robots_2ms.csv")
        print(*sums(rows[len(rows) // 2 :]), sep="\n")
    return int(options.check and any(test(row) for row in rows for _, test in FAULTS))


if __name__ == "__main__":
    sys.exit(main())
