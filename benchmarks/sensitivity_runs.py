"""The runs of sensitivity.py: problems, robots, scenes and random scenes, each from any of its starts."""

from __future__ import annotations

import hashlib
import math
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import process_time
from typing import Any

import amontons
import numpy as np
from amontons import scenes
from common import Row, read
from robot.loading import our_model, with_floor
from robots import models

PERTURBATION = 1e-9
"""of a start: relative to b of a problem, to the length of a model, to the velocity of a fall from it."""
LONG = 5.0
"""s of processor time after which a run stops"""
PROBLEM_ROWS = 3000
"""Larger problems take seconds."""
STEPS, RANDOM_SCENES, SEED = 60, 40, 1
SCENES: tuple[tuple[str, Row, Row], ...] = (
    ("plates", {"ratio": 1e3}, {}),
    ("plates", {"ratio": 1e3}, {"tolerance": 1e-3}),
    ("stack", {"boxes": 15}, {}),
    ("wall", {"columns": 4, "rows": 4}, {"tolerance": 1e-4}),
    ("wall_at_rest", {}, {"tolerance": 1e-3}),
    ("spheres_in_box", {"count": 60, "mu": 0.5}, {"tolerance": 1e-3}),
    ("hopper", {"count": 60}, {"max_iterations": 30}),
)
"""Scenes with other parameters: large mass ratios, stacks, piles, loose tolerances, few iterations."""


@dataclass(frozen=True)
class Run:
    """One run: `do(start)` tells its counts; all that takes long beforehand is done."""

    group: str
    name: str
    do: Callable[[int], Row]


def generator(name: str, start: int) -> np.random.Generator:
    seed = hashlib.sha256(f"{name} {start}".encode()).digest()
    return np.random.default_rng(int.from_bytes(seed[:8], "little"))


def digest(*arrays: Any) -> str:
    """Tells whether a run has other bits."""
    return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays)).hexdigest()[:12]


def problem_runs(data: Path) -> Iterator[Run]:
    def solve(start: int, problem: Any, law: str, tolerance: float, name: str) -> Row:
        b = problem.b * (1 + PERTURBATION * generator(name, start).normal(size=problem.rows))
        moved = amontons.vi.Problem(problem.A, b, problem.cones)
        s = moved.solve(law=law, tolerance=tolerance, threads=1)
        counts = {"products": s.products, "factorizations": s.factorizations}
        return {"missed": int(s.status != "converged"), **counts, "bits": digest(s.x)}

    for path in [*sorted((data / "fclib").glob("*.hdf5")), *sorted((data / "chrono").glob("*.hdf5"))]:
        problem = read(path)
        if problem.rows <= PROBLEM_ROWS:
            for law, tolerance in (("associated", 1e-8), ("coulomb", 1e-4), ("coulomb", 1e-8)):
                how = {"problem": problem, "law": law, "tolerance": tolerance, "name": path.stem}
                yield Run("problems", f"{path.stem} {law} {tolerance:g}", partial(solve, **how))


def perturb(simulation: amontons.Simulation, name: str, start: int) -> None:
    """Moves and pushes each dynamic body at random."""
    model, rng = simulation.model, generator(name, start)
    fall = math.sqrt(float(np.linalg.norm(model.gravity)) * model.length)
    free = np.array([body.motion == "dynamic" for body in model.bodies])[:, None]
    state = simulation.state
    state.positions[:] += PERTURBATION * model.length * free * rng.normal(size=state.positions.shape)
    velocities = state.linear_velocities
    velocities[:] += PERTURBATION * fall * free * rng.normal(size=velocities.shape)


class Counts:
    """What the steps of a run come to."""

    def __init__(self) -> None:
        self.row: Row = {"missed": 0, "broken": 0, "products": 0, "factorizations": 0, "overlap": 0.0}
        self.until = process_time() + LONG

    def add(self, report: amontons.Report, length: float) -> bool:
        """Whether the run may go on."""
        row = self.row
        row["missed"] += report.status != "converged"
        row["products"] += report.products
        row["factorizations"] += report.factorizations
        row["overlap"] = max(row["overlap"], report.penetration / length)
        return process_time() < self.until

    def end(self, simulation: amontons.Simulation) -> Row:
        positions = simulation.state.positions
        far = 1e3 * (1 + simulation.model.length)
        lost = ~np.isfinite(positions).all(axis=1) | (np.abs(positions).max(axis=1) > far)
        self.row["broken"] += int(lost.sum()) + (process_time() >= self.until)
        return self.row | {"bits": digest(positions, simulation.state.linear_velocities)}


def simulation_run(group: str, name: str, model: amontons.Model, settings: Row, steps: int) -> Run:
    def run(start: int) -> Row:
        simulation = amontons.Simulation(model, threads=1, on_failure="ignore", **settings)
        perturb(simulation, name, start)
        counts = Counts()
        for _ in range(steps):
            if not counts.add(simulation.step(), model.length):
                break
        return counts.end(simulation)

    return Run(group, name, run)


def robot_runs(data: Path) -> Iterator[Run]:
    folder = data / "robots"
    for path in models(folder):
        model, _ = our_model(path)
        if model is not None and path.suffix == ".urdf":
            model, _ = with_floor(model)
        if model is None:
            continue
        for dt in (2e-3, 5e-3):
            name = f"{path.relative_to(folder)} {1e3 * dt:g} ms"
            yield simulation_run("robots", name, model, {"dt": dt}, STEPS)


def scene_runs() -> Iterator[Run]:
    for name, parameters, options in [*((name, {}, {}) for name in scenes.names()), *SCENES]:
        scene = scenes.get(name)
        settings = {**scene.options, "dt": scene.dt, **options}
        label = " ".join([name, *(f"{k}={v}" for k, v in (parameters | options).items())])
        yield simulation_run("scenes", label, scene.make(**parameters), settings, STEPS)


def random_runs() -> Iterator[Run]:
    """Random scenes with the judge of the soak: a promise that is broken ends a run."""
    from tools.soak.family import Case
    from tools.soak.odd_scenes import Scene

    folder = Path(tempfile.mkdtemp())
    for index in range(RANDOM_SCENES):
        try:
            scene = Scene(Case("scenes", SEED, index, folder))
        except amontons.InputError:
            continue
        yield Run("random", f"scene {index}", lambda start, s=scene, i=index: judged(s, f"scene {i}", start))


def judged(scene: Any, name: str, start: int) -> Row:
    from tools.soak.family import Failure
    from tools.soak.watch import Watch

    simulation = amontons.Simulation(scene.model, **(scene.options | {"threads": 1}))
    perturb(simulation, name, start)
    watch, counts = Watch(scene, simulation), Counts()
    try:
        for _ in range(2 * STEPS):
            report = watch.step()
            if report is None or not counts.add(report, scene.model.length):
                break
        watch.end()
    except (Failure, amontons.SimulationError):
        counts.row["broken"] += 1
    return counts.end(simulation)


def all_runs(data: Path) -> Iterator[Run]:
    with warnings.catch_warnings(action="ignore"):
        for runs in (scene_runs(), random_runs(), robot_runs(data), problem_runs(data)):
            yield from runs
