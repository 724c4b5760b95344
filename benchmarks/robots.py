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
import math
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import fmean
from typing import Any

import amontons
import amontons.scenes
from common import SAMPLE, arguments, progress, with_folders, write_csv
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
COLUMNS = (
    "model", "outcome", "load", "changes_motion", "not_read", "what", "mujoco_refuses", "floor", "bodies",
    "load_time", "steps", "wanted_steps", "simulated", "contacts", "mujoco_contacts", "missed",
    "missed_percent", "residual", "penetration_start", "penetration", "joint_error", "joint_error_relative",
    "energy_gain", "energy_balance", "energy_gain_relative", "free",
    "free_error", "free_in_errors", "free_time", "free_kicked", "compared",
    "step_median", "longest_in_medians", "longest", "longest_again", "keyframes", "keyframe_error",
    "keyframe_in_lengths", "keyframe_missed_percent", "keyframes_failed", "driven", "driven_time",
    "driven_missed_percent", "driven_residual", "driven_joint_error", "driven_gain", "driven_gain_relative",
    "driven_stopped", "steps_per_second", "mujoco_steps_per_second", "stopped",
)  # fmt: skip
FORMS_COLUMNS = (
    "model", "outcome", "load", "what", "mujoco_refuses", "steps", "wanted_steps", "rows", "trees", "mujoco",
    "trees_to_rows", "trees_to_mujoco", "run_trees_to_rows", "rows_missed", "trees_missed", "rows_residual",
    "trees_residual", "rows_joint_error", "trees_joint_error", "rows_joint_rows", "trees_joint_rows",
    "rows_contacts", "trees_contacts", "rows_longest", "trees_longest", "stopped",
)  # fmt: skip
"""Of robots_forms.csv. Times are medians, s; run_trees_to_rows compares sums over the run. Joint errors are
in m; rows and contacts are means over steps."""
SLOWER = 1.1
"""Times the time of the run with rows, from where on trees count as slower."""
Row = dict[str, Any]


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
    """Models of scenes with joints, as files."""
    for name in amontons.scenes.names():
        model = amontons.scenes.make(name)
        if model.joints:
            amontons.write_model(model, folder / f"{name}.json")


def run(path: Path, options: Any) -> Row:
    """The last line that the worker printed, and how it ended."""
    both = options.trees == "both"
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
    row = dict.fromkeys(FORMS_COLUMNS if both else COLUMNS)
    for line in lines:  # the last one may be cut off
        try:
            row |= json.loads(line)
        except json.JSONDecodeError:
            break
    row["model"] = path.relative_to(options.folder).as_posix()
    row["outcome"] = outcome(row, code, errors)
    return row


def outcome(row: Row, code: int | None, errors: list[str]) -> str:
    if code not in (0, None):
        return f"crashed ({code}): {errors[-1] if errors else 'no message'}"[:200]
    if row["load"] is None:
        return "loading did not end"
    if row["load"] == "refused":
        return "refused" if not row["mujoco_refuses"] else "refused, by MuJoCo too"
    if row["stopped"] or (row["steps"] or 0) < (row["wanted_steps"] or 1):
        return "unfinished"
    return "finished"


def long(row: Row) -> bool:
    return (row["longest_in_medians"] or 0) * (row["step_median"] or 0) > SHORT


def above(key: str, bound: float) -> Callable[[Row], bool]:
    return lambda row: row[key] is not None and not row[key] <= bound


NOTES: tuple[tuple[str, Callable[[Row], bool]], ...] = (
    ("refused by MuJoCo, not by us", lambda r: r["load"] == "ok" and bool(r["mujoco_refuses"])),
    ("something not read that changes the motion", lambda r: bool(r["changes_motion"])),
)
FAULTS: tuple[tuple[str, Callable[[Row], bool]], ...] = (
    ("refused, not by MuJoCo", lambda r: r["load"] == "refused" and not r["mujoco_refuses"]),
    ("unfinished or crashed", lambda r: not r["outcome"].startswith(("finished", "refused"))),
    (f"more than {MISSED:g} % of the steps missed", above("missed_percent", MISSED)),
    (f"longest step above {MEDIANS:g} medians", lambda r: long(r) and r["longest_in_medians"] > MEDIANS),
    (f"a step gains more than {100 * GAIN:g} % of the energy's scale", above("energy_gain_relative", GAIN)),
    (f"free motion further off than {ERRORS:g} errors of the step", above("free_in_errors", ERRORS)),
    (f"joints apart by more than {APART:g} lengths", above("joint_error_relative", APART)),
    (
        "keyframes that fail or are another pose",
        lambda r: bool(r["keyframes_failed"]) or above("keyframe_in_lengths", SAME)(r),
    ),
    (f"keyframes: more than {MISSED:g} % of the steps missed", above("keyframe_missed_percent", MISSED)),
    (
        f"driven: more than {MISSED:g} % of the steps missed, or stopped",
        lambda r: bool(r["driven_stopped"]) or above("driven_missed_percent", MISSED)(r),
    ),
    (f"driven: joints apart by more than {APART:g} lengths", above("driven_joint_error", APART)),
    (f"driven: a step gains more than {100 * GAIN:g} %", above("driven_gain_relative", GAIN)),
    ("free motion not compared", lambda r: r["outcome"] == "finished" and not r["compared"]),
)
"""What no model should do."""


def sums(rows: list[Row]) -> Iterator[str]:
    """How many models do what none should, and which."""
    yield f"models: {len(rows)}, loaded {sum(row['bodies'] is not None for row in rows)}"
    for what, test in NOTES + FAULTS:
        names = [row["model"] for row in rows if test(row)]
        yield f"{what}: {len(names)}" + (f" ({', '.join(names)})" if names else "")
    faulty = sum(any(test(row) for _, test in FAULTS) for row in rows)
    yield f"models without a fault: {len(rows) - faulty} of {len(rows)}"


def geometric_mean(rows: list[Row], key: str) -> float:
    values = [row[key] for row in rows if row[key]]
    return math.exp(fmean(map(math.log, values))) if values else math.nan


def forms_sums(rows: list[Row]) -> Iterator[str]:
    """Whether trees win: means over the models in which they remove rows, and which models lose."""
    run = [row for row in rows if row["trees_to_rows"]]
    planted = [row for row in run if row["trees_joint_rows"] < row["rows_joint_rows"]]
    yield f"models: {len(rows)}, run {len(run)}, with trees {len(planted)}"
    for what, some in (("all", run), ("with trees", planted)):
        if some:
            keys = ("trees_to_rows", "run_trees_to_rows", "trees_to_mujoco")
            step, whole, theirs = (geometric_mean(some, key) for key in keys)
            yield f"{what}: {step:.2f} of a step with rows, {whole:.2f} of the run, {theirs:.2f} of MuJoCo's"
    slower = [row["model"] for row in planted if row["run_trees_to_rows"] > SLOWER]
    yield f"slower by more than {SLOWER:g}: {len(slower)}" + (f" ({', '.join(slower)})" if slower else "")
    lost = [row["model"] for row in planted if row["trees_missed"] > row["rows_missed"]]
    yield f"more steps missed than with rows: {len(lost)}" + (f" ({', '.join(lost)})" if lost else "")


def fall(options: Any) -> int:
    """A row per robot and control, written as they come."""
    found: list[Row] = []
    file = options.out / ("robots_large.csv" if options.trees == "both" else "robots_fall.csv")
    with progress() as bar:
        task = bar.add_task("falls", total=None, item="")
        for row in falls.rows(options.folder, options):
            bar.update(task, item=f"{row['case']}, {row['control']}", advance=1)
            found.append(row)
            write_csv(file, found)
    print(*falls.sums(found), f"written to {file}", sep="\n")
    return 0


def run_all(options: Any, file: Path) -> list[Row]:
    """A row per model, written as they come."""
    paths = [p for p in models(options.folder) if not options.only or any(s in str(p) for s in options.only)]
    rows = []
    with progress() as bar, ThreadPoolExecutor(options.jobs) as pool:
        task = bar.add_task("robots", total=len(paths), item="")
        for path, row in zip(paths, pool.map(lambda p: run(p, options), paths), strict=True):
            bar.update(task, item=path.name, advance=1)
            rows.append(row)
            columns = FORMS_COLUMNS if options.trees == "both" else COLUMNS
            write_csv(file, [{key: r[key] for key in columns} for r in rows])
    print(*(forms_sums if options.trees == "both" else sums)(rows), f"written to {file}", sep="\n")
    return rows


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
    if not kept:
        options.out = options.out or SAMPLE
    with_folders(options)
    options.folder = (options.data / "robots" if ours else options.folder).resolve()
    options.duration = options.duration or (0.2 if options.quick else 2.0)
    options.limit = options.limit or (20.0 if options.quick else 60.0)
    if not options.folder.is_dir():
        print(f"robots: skipped, there is no folder {options.folder}; name one with models")
        return 0 if ours else 1
    if options.fall:
        return fall(options)
    if options.trees == "both":
        with tempfile.TemporaryDirectory() as folder:
            if options.scenes:
                options.folder = Path(folder).resolve()
                write_scenes(options.folder)
            run_all(options, options.out / f"{'scenes' if options.scenes else 'robots'}_forms.csv")
        return 0
    rows = run_all(options, options.out / "robots.csv")
    if kept:
        options.dt = SHORT_STEP
        rows += run_all(options, options.out / "robots_2ms.csv")
    return int(options.check and any(test(row) for row in rows for _, test in FAULTS))


if __name__ == "__main__":
    sys.exit(main())
