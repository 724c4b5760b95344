"""Instructions of a time step by stage, counted by callgrind: figures that do not depend on the load.

    python benchmarks/step_work.py [FILE ...] [--only PART ...] [--functions] [--steps 50] [--dt 2e-3]
                                   [--quick] [--program STEP_WORK] [--beside OTHER.csv] [--out FOLDER]

Models: MJCF, URDF and JSON files. By default they are some of the shared robots, and robots on feet of many
corners, on a height field and beside a pile, which the script builds, a wall at rest, and a pile of spheres.
Controls are random and constant, within a quarter of their range.

A row per model and stage: thousands of instructions per step, and those of MuJoCo (defaults, same step and
controls) for MJCF; "contacts" are those of a step, in thousands. A stage is the sum of functions (STAGES),
each with all that it calls; "step" is the whole, "rest" what no stage has. Bytes that are copied by "rep
movs" count as an instruction each. --functions lists all functions of the library with at least 1 % of the
step instead. --beside prints the ratio to the rows of an earlier run. --program takes the program of
another build. Needs valgrind, and the program: cmake --build build/python --target step_work.
"""

from __future__ import annotations

import argparse
import math
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import amontons
import amontons.scenes
import numpy as np
from amontons.shapes import Box, Cylinder, HeightField, Hull, Plane, Shape, Sphere
from common import ROOT, arguments, random_controls, read_csv, told, with_folders, write_csv

PROGRAM = ROOT / "build" / "python" / "benchmarks" / "step_work"
QUICK = 5
"""Steps that count in a sample."""
LEAST = 0.01
"""of a step: functions with less are not listed"""
WHOLE = "counted_steps"
STAGES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "frames, M": (
        ("place_trees", "place_frames", "begin_in_the_middle", "update_coordinates", "place_joints",
         "place_tree_joints", "make_tree_masses"),
        ("mj_fwdKinematics", "mj_makeM", "mj_factorM"),
    ),
    "free velocities": (
        ("make_free_velocities", "add_actuator_loads", "add_fluid_loads", "add_motor_loads"),
        ("mj_fwdVelocity", "mj_fwdActuation", "mj_fwdAcceleration", "mj_transmission"),
    ),
    "collision": (("ContactFinder::find",), ("mj_collision",)),
    "positions": (("correct",), ()),
    "impacts, stiffening": (("resolve_impacts", "end_impacts"), ()),
    "rows": (
        ("append_joint_rows", "reflect_joints", "assemble_system", "warm_start_contacts"),
        ("mj_makeConstraint", "mj_projectConstraint", "mj_referenceConstraint", "mj_island"),
    ),
    "second order": (("find_turns", "foresee_tree_velocities"), ()),
    "solve": (("find_rest", "solve_beside"), ("mj_fwdConstraint",)),
    "look ahead": (("ContactFinder::find_unforeseen",), ()),
    "energy balance": (("along_mean",), ()),
    "motion": (("move_on",), ("mj_implicitSkip", "mj_EulerSkip", "mj_RungeKutta")),
    "copies, checks, report": (
        ("copy_changes", "find_changed", "validate", "begin_with_velocities", "Simulation::keep_results",
         "Simulation::note_touching", "Simulation::finish_report", "add_part"),
        ("mj_checkPos", "mj_checkVel", "mj_checkAcc", "mj_sensorPos", "mj_sensorVel", "mj_sensorAcc",
         "mj_energyPos", "mj_energyVel"),
    ),
}  # fmt: skip
"""Our functions, and MuJoCo's."""
THEIR_STEP = "mj_step"
THEIR_STEPS = """
import sys
import mujoco

file, dt, before, steps, *controls = sys.argv[1:]
model = mujoco.MjModel.from_xml_path(file)
model.opt.timestep = float(dt)
data = mujoco.MjData(model)
data.ctrl[: len(controls)] = [float(value) for value in controls][: model.nu]
for _ in range(int(before)):
    mujoco.mj_step1(model, data)
    mujoco.mj_step2(model, data)
for _ in range(int(steps)):
    mujoco.mj_step(model, data)
"""
"""Callgrind collects in mj_step alone, which the steps before those that count do not call."""
ROBOTS = (
    "unitree_go1/scene.xml", "mujoco/humanoid/humanoid.xml", "dm_walkers/humanoid_CMU_V2020.xml",
    "shadow_hand/scene_right.xml", "ufactory_xarm7/scene.xml", "dm_suite/quadruped.xml", "dm_suite/fish.xml",
    "gymnasium/pusher_v5.xml", "mujoco/sleep/dominos.xml", "gymnasium/ant.xml", "gymnasium/swimmer.xml",
    "bullet3/kuka_iiwa/model.urdf", "bullet3/quadruped/minitaur.urdf",
    "example-robot-data/robots/laikago_description/urdf/laikago.urdf",
)  # fmt: skip
Row = dict[str, object]


@dataclass(frozen=True)
class Pace:
    """How a model is stepped; the steps before those that count let initial overlaps and falls pass."""

    dt: float
    """s"""
    tolerance: float
    before: int
    steps: int


USUAL, OF_PILE = Pace(2e-3, 1e-6, 100, 50), Pace(1e-2, 1e-3, 20, 5)


def on_feet(corners: int, ground: Shape | None = None) -> amontons.Model:
    """A body on four legs whose feet are hulls of so many corners, on a plane or on other ground."""
    rng = np.random.default_rng(corners)
    points = rng.normal(size=(corners, 3))
    points *= np.array((0.1, 0.06, 0.03)) / np.linalg.norm(points, axis=1)[:, None]
    return robot(Hull(points), 0.04, ground or Plane()).build()


WHEELS = (Cylinder(0.1, 0.03), 0.13)


def bumps(points: int) -> HeightField:
    """Random heights up to 2 cm, on 4 m x 4 m."""
    return HeightField(0.02 * np.random.default_rng(points).random((points, points)), 4.0, 4.0)


def beside_a_pile(trees: str, high: int = 3) -> amontons.Model:
    """A body on four wheels, which touch nothing but the floor, beside a pile of cubes that slides."""
    builder, rng = robot(*WHEELS, Plane(), trees), np.random.default_rng(high)
    for x, y, z in np.ndindex(high, high, high):
        corner = np.array((2 + 0.21 * x, 0.21 * y, 0.11 + 0.21 * z)) + 0.02 * rng.random(3)
        builder.add_body(
            shape=Box((0.1, 0.1, 0.1)), density=500.0, position=tuple(corner), linear_velocity=(2, 0, 0)
        )
    return builder.build()


def wall_at_rest(rows: int) -> amontons.Model:
    """A wall of bricks, each on two others, and a ball that rolls far from it."""
    builder = amontons.ModelBuilder()
    builder.add_floor()
    for row in range(rows):
        for k in range(rows - row):
            place = (0.42 * k + 0.21 * row, 0, 0.1 + 0.2 * row)
            builder.add_body(shape=Box((0.2, 0.1, 0.1)), density=1000.0, position=place)
    builder.add_body(
        shape=Sphere(0.1), density=1000.0, position=(30, 0, 0.1), linear_velocity=(1, 0, 0),
        angular_velocity=(0, 10, 0),
    )  # fmt: skip
    return builder.build()


def robot(foot: Shape, height: float, ground: Shape, trees: str | None = None) -> amontons.ModelBuilder:
    """A box of 0.8 m x 0.4 m with a foot or a wheel on a hinge with damping at each corner."""
    builder = amontons.ModelBuilder(trees=trees)
    builder.add_geom(None, ground)
    trunk = builder.add_body(shape=Box((0.4, 0.2, 0.05)), density=300.0, position=(0, 0, height + 0.2))
    for x, y in ((-0.4, -0.3), (-0.4, 0.3), (0.4, -0.3), (0.4, 0.3)):
        # A cylinder's axis is its z axis; a wheel rolls about y.
        turn = (math.sqrt(0.5), math.sqrt(0.5), 0, 0) if isinstance(foot, Cylinder) else (1.0, 0, 0, 0)
        end = builder.add_body(shape=foot, density=1000.0, position=(x, y, height), orientation=turn)
        builder.add_revolute_joint(trunk, end, point=(x, y, height), axis=(0, 1, 0), damping=0.5)
    return builder


PILE = "1000 spheres in a box"
"""Of the steps that growth.py divides into stages."""
SCENES: dict[str, Callable[[], amontons.Model]] = {
    "feet of 50 corners": partial(on_feet, 50),
    "feet of 500 corners": partial(on_feet, 500),
    "feet of 5000 corners": partial(on_feet, 5000),
    "feet of 500 corners on 100 x 100 heights": lambda: on_feet(500, bumps(100)),
    "feet of 500 corners on a slab": lambda: on_feet(500, Box((2.0, 2.0, 1e-3))),
    "wheels on 100 x 100 heights": lambda: robot(*WHEELS, bumps(100)).build(),
    "wheels in a tree beside a pile": partial(beside_a_pile, "auto"),
    "wheels on rows beside a pile": partial(beside_a_pile, "none"),
    "wall of 105 bricks at rest beside a ball": partial(wall_at_rest, 14),
    PILE: lambda: amontons.scenes.get("spheres_in_box").make(count=1000, mu=0.5),
}


def loaded(path: Path) -> amontons.Model:
    """The model of a file as it loads; one that floats without a floor, as those of URDF, on a floor."""
    model = amontons.load_model(path)
    if path.suffix == ".urdf" and any(c.kind == "free" for c in model.coordinates.values()):
        model = amontons.on_floor(model)
    return model


def controls(model: amontons.Model, seed: int) -> list[float]:
    """Random ones of the actuators; motors of joints keep theirs."""
    chosen = [*random_controls(model, np.random.default_rng(seed)).values()]
    return chosen + amontons.Simulation(model).state.controls.tolist()[len(chosen) :]


def pace_of(name: str, options: argparse.Namespace) -> Pace:
    pace = OF_PILE if name == PILE else USUAL
    steps = options.steps or (min(QUICK, pace.steps) if options.quick else pace.steps)
    return Pace(options.dt or pace.dt, pace.tolerance, pace.before, steps)


def profile(name: str, model: amontons.Model, pace: Pace, folder: Path, program: Path) -> tuple[Path, float]:
    """callgrind's profile of the counted steps, and their mean number of contacts."""
    file, out = folder / "model.json", folder / "profile"
    amontons.write_model(model, file)
    given = (pace.dt, pace.tolerance, pace.before, pace.steps, *controls(model, zlib.crc32(name.encode())))
    printed = collect(WHOLE, out, (program, file, *given), folder)
    return out, float(printed.split()[-1])


def their_profile(
    name: str, model: amontons.Model, pace: Pace, folder: Path, options: argparse.Namespace
) -> Path | None:
    """The same of MuJoCo's steps; None if the model is no MJCF file, or MuJoCo cannot step it."""
    path = Path(name) if Path(name).is_file() else options.data / "robots" / name
    if path.suffix != ".xml" or not path.is_file():
        return None
    out = folder / "their_profile"
    given = (pace.dt, pace.before, pace.steps, *controls(model, zlib.crc32(name.encode())))
    try:
        collect(THEIR_STEP, out, (sys.executable, "-c", THEIR_STEPS, path.resolve(), *given), folder)
    except OSError:
        return None
    return out


def collect(within: str, out: Path, program: Sequence[object], folder: Path) -> str:
    """Writes callgrind's profile of what a program does in one function. Returns what the program printed.

    OSError with the last line of its errors if it fails.
    """
    command = [
        "valgrind", "--tool=callgrind", f"--toggle-collect={within}", f"--callgrind-out-file={out}", *program,
    ]  # fmt: skip
    ended = subprocess.run(list(map(str, command)), capture_output=True, text=True, cwd=folder)
    if ended.returncode:
        raise OSError(ended.stderr.strip().splitlines()[-1])
    return ended.stdout


def inclusive_costs(profile: Path) -> dict[str, int]:
    """Instructions of each function of a library with what it calls, summed over overloads."""
    command = ["callgrind_annotate", "--inclusive=yes", "--threshold=100", "--show-percs=no", str(profile)]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    costs: dict[str, int] = {}
    for line in text.splitlines():
        found = re.match(
            r"\s*([\d,]+)\s+[^:]*:(?:void )?(amontons::.*?|counted_steps|mj_\w+)(?: \[\S*\])?$", line
        )
        if found:
            name = plain(found[2])
            costs[name] = costs.get(name, 0) + int(found[1].replace(",", ""))
    return costs


def plain(function: str) -> str:
    """The name of a function without namespace, arguments of templates and arguments."""
    name, inner = function.replace("(anonymous namespace)::", ""), re.compile(r"<[^<>]*>")
    while inner.search(name):
        name = inner.sub("", name)
    return name.split("(")[0].removeprefix("amontons::")


def stages(costs: dict[str, int], whole: str, ours: bool) -> dict[str, int]:
    sums = {stage: sum(costs.get(f, 0) for f in parts[0 if ours else 1]) for stage, parts in STAGES.items()}
    return {"step": costs[whole], **sums, "rest": costs[whole] - sum(sums.values())}


def rows_of(
    name: str, costs: dict[str, int], theirs: dict[str, int] | None, steps: int, functions: bool
) -> Iterator[Row]:
    parts = stages(costs, WHOLE, ours=True)
    if functions:
        listed = {f: c for f, c in costs.items() if f != WHOLE and c >= LEAST * costs[WHOLE]}
        parts = {"step": costs[WHOLE], **dict(sorted(listed.items(), key=lambda part: -part[1]))}
    beside = stages(theirs, THEIR_STEP, ours=False) if theirs else {}
    for part, cost in parts.items():
        mujoco = 1e-3 * beside[part] / steps if part in beside else None
        yield {"model": name, "part": part, "thousands": 1e-3 * cost / steps, "mujoco": mujoco}


def show(rows: list[Row], beside: dict[tuple[str, str], float]) -> None:
    """A line per part and a column per model, beside MuJoCo's, and the ratio to the other run."""
    names = list(dict.fromkeys(str(row["model"]) for row in rows))
    cells: dict[str, dict[str, str]] = {}
    for row in rows:
        model, part, cost = str(row["model"]), str(row["part"]), float(str(row["thousands"]))
        other = beside.get((model, part), 0.0)
        mujoco = "" if row["mujoco"] is None else f" / {float(str(row['mujoco'])):.1f}"
        text = f"{cost:.1f}{mujoco}" + (f" ({cost / other:.2f})" if other else "")
        cells.setdefault(part, {})[model] = text
    told(
        [
            "thousands of instructions per step, ours / MuJoCo's",
            *(name.removesuffix("/scene.xml").split("/")[-1] for name in names),
        ],
        [[part, *(line.get(name, "") for name in names)] for part, line in cells.items()],
    )


def chosen(options: argparse.Namespace) -> dict[str, Callable[[], amontons.Model]]:
    robots = options.data / "robots"
    found = {str(path): partial(loaded, path) for path in options.files} if options.files else dict(SCENES)
    if not options.files and robots.is_dir():
        found = {name: partial(loaded, robots / name) for name in ROBOTS} | found
    elif not options.files:
        print(f"step_work: the robots are skipped, there is no folder {robots}")
    return {
        name: make for name, make in found.items() if not options.only or any(p in name for p in options.only)
    }


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE")
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="PART", help="models whose name holds one of these"
    )
    parser.add_argument("--functions", action="store_true", help="functions instead of stages")
    parser.add_argument("--steps", type=int, help="steps that count (default: 50; of the pile 5)")
    parser.add_argument("--dt", type=float, help="time step (default: 2e-3 s; of the pile 1e-2 s)")
    parser.add_argument("--program", type=Path, default=PROGRAM)
    parser.add_argument("--beside", type=Path, metavar="CSV", help="an earlier run to compare with")
    options = parser.parse_args()
    with_folders(options, sample=bool(options.only or options.files or options.functions))
    missing = [p for p in ("valgrind", "callgrind_annotate", options.program) if not shutil.which(p)]
    if missing:
        print(f"step_work: skipped, there is no {missing[0]}; install valgrind, build the target step_work")
        return
    rows: list[Row] = []
    for name, make in chosen(options).items():
        with warnings.catch_warnings(action="ignore"), tempfile.TemporaryDirectory() as folder:
            pace = pace_of(name, options)
            try:
                model = make()
                ours, contacts = profile(name, model, pace, Path(folder), options.program)
            except (amontons.InputError, OSError) as error:
                print(f"step_work: {name}: skipped, {' '.join(str(error).split())[:200]}")
                continue
            beside = their_profile(name, model, pace, Path(folder), options)
            theirs = inclusive_costs(beside) if beside else None
            rows += rows_of(name, inclusive_costs(ours), theirs, pace.steps, options.functions)
            rows.append({"model": name, "part": "contacts", "thousands": 1e-3 * contacts, "mujoco": None})
    earlier = read_csv(options.beside) if options.beside else []
    show(rows, {(row["model"], row["part"]): float(row["thousands"]) for row in earlier})
    write_csv(options.out / "step_work.csv", rows)
    print(f"written to {options.out / 'step_work.csv'}")


if __name__ == "__main__":
    main()
