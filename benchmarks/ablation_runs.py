"""The runs of ablation.py: problems, robots, scenes, budgets and tests, each with what it shows."""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import signal
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import amontons
import numpy as np
import pytest
from amontons import scenes
from common import ROOT, read
from robot.run import Energy, our_model, with_floor
from robots import models

Row = dict[str, Any]

DEADLINE = 2.0
"""s of processor time, of a solve"""
LONG = 15.0
"""s of processor time after which a run stops"""
ROBOT_SECONDS, ROBOT_STEPS = 1.0, (5e-3, 2e-3)
SCENE_STEPS, RANDOM_STEPS, RANDOM_SCENES, SEED, BUDGETED = 60, 200, 60, 1, 80
HARD: tuple[tuple[str, Row, Row, int], ...] = (
    ("plates", {"ratio": 1e3}, {}, 200),
    ("plates", {"ratio": 1e3}, {"tolerance": 1e-3}, 200),
    ("plates", {"ratio": 1e3, "heavy_first": True}, {}, 200),
    ("stack", {"boxes": 30}, {}, 100),
    ("wall", {"columns": 8, "rows": 8}, {}, 60),
    ("wall", {"columns": 8, "rows": 8}, {"tolerance": 1e-4}, 60),
    ("spheres_in_box", {"count": 150, "mu": 0.5}, {}, 80),
    ("spheres_in_box", {"count": 150, "mu": 0.5}, {"tolerance": 1e-3}, 80),
    ("domino_run", {}, {}, 600),
    ("hopper", {"count": 100}, {"max_iterations": 30}, 80),
    ("newtons_cradle", {}, {}, 400),
)
"""Scenes with other parameters: large mass ratios, high stacks, piles, impacts, few iterations."""
PHYSICS = ROOT / "tests" / "physics"
LIMITS = (
    "simulation/test_step_limits.py",
    "model/test_hints_of_errors.py",
    "io/test_load_overlaps.py",
    "io/test_file_limits.py",
)
"""Of tests/python: what else tests single steps."""


@dataclass(frozen=True)
class Run:
    """One run: `do` returns what it came to; all that takes long beforehand is done."""

    kind: str
    name: str
    do: Callable[[], Row]


def digest(*arrays: Any) -> str:
    """Tells whether a run has other bits."""
    return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays)).hexdigest()[:12]


# Problems


def stop_now(signum: int, frame: object) -> None:
    """What Ctrl-C does: the solve ends with its best x."""
    raise KeyboardInterrupt


def solve(problem: amontons.vi.Problem, law: str, tolerance: float) -> Row:
    signal.signal(signal.SIGPROF, stop_now)
    signal.setitimer(signal.ITIMER_PROF, DEADLINE)
    try:
        s = problem.solve(law=law, tolerance=tolerance, threads=1)
    except KeyboardInterrupt:
        return {"unsolved": 1, "bits": "late"}
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    return {"unsolved": int(s.status != "converged"), "bits": digest(s.x)}


def problem_runs(data: Path) -> Iterator[Run]:
    files = [*sorted((data / "fclib").glob("*.hdf5")), *sorted((data / "chrono").glob("*.hdf5"))]
    for path in files:
        problem = read(path)
        for law in ("associated", "coulomb"):
            for tolerance in (1e-4, 1e-8):
                name = f"{path.stem} {law} {tolerance:g}"
                yield Run("problem", name, lambda p=problem, a=law, t=tolerance: solve(p, a, t))


# Simulations


def simulate(simulation: amontons.Simulation, steps: int, whole: bool = True) -> Row:
    """Steps of a simulation; `whole`: with the balance of energy that its own readings tell."""
    energy = Energy(simulation) if whole else None
    row: Row = {"missed": 0, "gain": 0.0, "lost": 0, "error": "", "steps": 0}
    end = process_time() + LONG
    largest = told = 0.0
    for _ in range(steps):
        try:
            report = simulation.step()
        except amontons.SimulationError as error:
            row["error"] = str(error)[:80]
            break
        row["steps"] += 1
        row["missed"] += report.status != "converged"
        largest = max(largest, report.kinetic_energy)
        told = max(told, report.energy_balance)
        if energy:
            energy.add(report)
        if process_time() > end:
            row["error"] = "too long"
            break
    model = simulation.model
    scale = model.total_mass * (float(np.linalg.norm(model.gravity)) + 1e-6 * model.length) * model.length
    row["gain"] = told / max(scale + largest, 1e-300)
    if energy:
        row["gain"] = max(row["gain"], energy.facts()["energy_gain_relative"] or 0.0)
    positions = simulation.state.positions
    bad = ~np.isfinite(positions).all(axis=1) | (np.abs(positions).max(axis=1) > 1e3 * (1 + model.length))
    row["lost"] = int(bad.sum())
    row["bits"] = digest(positions, simulation.state.linear_velocities)
    return row


def robot_runs(data: Path) -> Iterator[Run]:
    folder = data / "robots"
    for path in models(folder):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model, _ = our_model(path)
            if model is not None and path.suffix == ".urdf":
                model, _ = with_floor(model)
        if model is None:
            continue
        for dt in ROBOT_STEPS:

            def run(model: amontons.Model = model, dt: float = dt) -> Row:
                simulation = amontons.Simulation(model, dt=dt, on_failure="ignore", threads=1)
                return simulate(simulation, round(ROBOT_SECONDS / dt), dt == ROBOT_STEPS[0])

            kind = "treadmill" if path.stem == "treadmill" else "robot"
            yield Run(kind, f"{path.relative_to(folder)} {1e3 * dt:g} ms", run)
            if kind == "treadmill":
                yield from keyframes(path, model, dt)


def keyframes(path: Path, model: amontons.Model, dt: float) -> Iterator[Run]:
    """The same robot from starts that overlap."""
    for name in ("rider_squat", "rider_stand"):
        if name not in model.keyframe_names:
            continue

        def run(name: str = name) -> Row:
            simulation = amontons.Simulation(model, dt=dt, on_failure="ignore", threads=1)
            simulation.apply_keyframe(name)
            return simulate(simulation, 200)

        yield Run("treadmill", f"{path.stem} {name} {1e3 * dt:g} ms", run)


def scene_runs() -> Iterator[Run]:
    plain = ((name, {}, {}, SCENE_STEPS) for name in scenes.names())
    for name, parameters, options, steps in [*plain, *HARD]:
        scene = scenes.get(name)
        model = scene.make(**parameters)
        settings = {**scene.options, "dt": scene.dt, "threads": 1, "on_failure": "ignore", **options}

        def run(model: amontons.Model = model, settings: Row = settings, steps: int = steps) -> Row:
            return simulate(amontons.Simulation(model, **settings), steps, False)

        yield Run("scene", " ".join([name, *(f"{k}={v}" for k, v in (parameters | options).items())]), run)


def random_runs(seed: int = SEED) -> Iterator[Run]:
    """Random scenes with the judge of the soak, which ends a scene that breaks a promise."""
    from tools.soak.family import Case
    from tools.soak.odd_scenes import Scene

    folder = Path(tempfile.mkdtemp())
    for index in range(RANDOM_SCENES):
        case = Case("scenes", seed, index, folder)
        try:
            scene = Scene(case)
        except amontons.InputError:
            continue
        yield Run(
            "random", f"scene {index}" + (f" of {seed}" if seed != SEED else ""), lambda s=scene: judged(s)
        )


def judged(scene: Any) -> Row:
    from tools.soak.family import Failure
    from tools.soak.watch import Watch

    simulation = amontons.Simulation(scene.model, **(scene.options | {"threads": 1}))
    watch = Watch(scene, simulation)
    row: Row = {"error": "", "broken": 0}
    deepest = 0.0
    end = process_time() + LONG
    try:
        for _ in range(RANDOM_STEPS):
            report = watch.step()
            if report is None:
                break
            deepest = max(deepest, report.penetration)
            if process_time() > end:
                row["error"] = "too long"
                break
        watch.end()
    except Failure as failure:
        row |= {"error": f"{failure.kind}: {failure}"[:120], "broken": 1}
    except amontons.SimulationError as error:
        row |= {"error": str(error)[:120], "broken": 1}
    positions = simulation.state.positions
    lost = watch.lost + int((~np.isfinite(positions)).any(axis=1).sum())
    lost += "lost body" in row["error"]
    return row | {
        "missed": watch.missed, "lost": lost, "gain": 0.0, "rise": watch.rise,
        "penetration": deepest / scene.model.length,
        "bits": digest(positions, simulation.state.linear_velocities),
    }  # fmt: skip


def budget_runs() -> Iterator[Run]:
    """Scenes with a budget of time per step."""
    from deadlines import FEW, SPHERES, WALL, Scene, steps

    for scene in (FEW, SPHERES, WALL):
        for budget in scene.budgets[:2]:

            def run(scene: Scene = scene, budget: float = budget) -> Row:
                row = steps(scene, budget, BUDGETED)
                late = row["times"] - row["in_time"]
                keys = ("penetration", "joint_gap", "energy_gain", "residual_median")
                return {"late": late, **{key: row[key] for key in keys}}

            yield Run("budget", f"{scene.name} {1e3 * budget:g} ms", run)


DEPTHS: tuple[tuple[str, Row, Row, int], ...] = (
    ("spheres_in_box", {"count": 150, "mu": 0.5}, {"dt": 1e-2}, 150),
    ("spheres_in_box", {"count": 150}, {"tolerance": 1e-3}, 250),
    ("hopper", {"count": 100}, {}, 200),
    ("hopper", {"count": 100}, {"dt": 1e-2, "max_iterations": 20}, 120),
    ("wall", {"columns": 5, "rows": 5}, {"tolerance": 1e-3}, 150),
    ("domino_run", {"count": 15}, {"dt": 5e-3}, 200),
    ("stack", {"boxes": 20}, {}, 100),
    ("rolling_balls", {}, {"dt": 1e-2}, 100),
)
"""Scenes whose overlaps tell what a step did not see or could not take back."""
LARGE: tuple[tuple[str, Row, Row, int], ...] = (
    ("wall_at_rest", {}, {"tolerance": 1e-3}, 200),
    ("tracked_vehicle", {}, {"dt": 2e-3, "method": "auto", "tolerance": 1e-6}, 100),
    ("spheres_in_box", {"count": 1000}, {"tolerance": 1e-4}, 150),
)
"""Scenes that take too long for the table of all repairs."""


def depth_runs() -> Iterator[Run]:
    """The deepest overlap of each scene and of the random ones, in lengths of the model."""
    yield from overlap_runs("depth", DEPTHS)
    yield from random_runs(SEED + 1)


def large_runs() -> Iterator[Run]:
    """Time, iterations and deepest overlap of each large scene."""
    return overlap_runs("large", LARGE)


def overlap_runs(kind: str, of: tuple[tuple[str, Row, Row, int], ...]) -> Iterator[Run]:
    for name, parameters, options, steps in of:
        scene = scenes.get(name)
        settings = {**scene.options, "dt": scene.dt, "threads": 1, "on_failure": "ignore", **options}
        model = scene.make(**parameters)

        def run(model: Any = model, settings: Row = settings, steps: int = steps) -> Row:
            return depths(amontons.Simulation(model, **settings), steps)

        yield Run(kind, " ".join([name, *(f"{k}={v}" for k, v in (parameters | options).items())]), run)


def depths(simulation: amontons.Simulation, steps: int) -> Row:
    reports = [simulation.step() for _ in range(steps)]
    length = simulation.model.length
    return {
        "penetration": max(r.penetration for r in reports) / length,
        "joint_gap": max(r.joint_error for r in reports) / length,
        "missed": sum(r.status != "converged" for r in reports),
        "iterations": sum(r.iterations for r in reports),
        "bits": digest(simulation.state.positions),
    }


# Tests


class Collector:
    """Outcome and time of every test."""

    def __init__(self) -> None:
        self.failed: list[str] = []
        self.times: dict[str, float] = {}
        self.begun = 0.0

    def pytest_runtest_logstart(self) -> None:
        self.begun = process_time()

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.when == "call":
            self.times[report.nodeid] = process_time() - self.begun
        if report.failed:
            self.failed.append(report.nodeid)


def run_tests(skipped: list[str]) -> tuple[list[str], dict[str, float]]:
    """The failing tests, and the time (s) of each."""
    collector = Collector()
    os.chdir(ROOT)
    files = [str(PHYSICS), *(str(ROOT / "tests" / "python" / name) for name in LIMITS)]
    arguments = ["-q", "-p", "no:cacheprovider", "--no-header", "--maxfail=40"]
    arguments += [f"--ignore={PHYSICS / 'test_golden.py'}", f"--ignore={PHYSICS / 'test_determinism.py'}"]
    for name in skipped:
        arguments += ["--deselect", name]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        pytest.main([*files, *arguments], plugins=[collector])
    return collector.failed, collector.times
