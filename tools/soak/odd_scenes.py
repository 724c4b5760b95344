"""Families of random scenes: what must hold of each of their steps, and of steps with a budget of time."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from typing import Any

import amontons
import numpy as np

from .family import Case, Failure, Family, Measures
from .random_scene import Scene, log_uniform
from .watch import Watch

STEPS = 400


def judge(scene: Scene, sim: amontons.Simulation, steps: int) -> Measures:
    """Makes the steps and holds them to what is promised (watch.py)."""
    seconds, work = [], []
    watch = Watch(scene, sim)
    for _ in range(steps):
        start = time.thread_time()
        report = watch.step()
        if report is None:
            break
        seconds.append(time.thread_time() - start)
        work.append(report.products + 20 * report.factorizations)
    watch.end()
    typical = max(float(np.median(seconds)), 2e-5)
    return {
        "outcome": "ended after misses" if watch.ended else "missed some" if watch.missed else "held",
        "longest step over median": max(seconds) / typical,
        "longest step (s)": max(seconds),
        "most products in a step": max(work),
        "residual": watch.worst,
        "missed steps": watch.missed,
        "energy over allowance": watch.rise,
        "closing speed": watch.closing,
        "lost after a miss": watch.lost,
    }


def run(case: Case) -> Measures:
    rng = case.rng(10_000)
    try:
        scene = Scene(case)
    except amontons.InputError as error:
        return {"outcome": "refused", "why": str(error)}
    again = rng.random() < 0.25
    sim = amontons.Simulation(scene.model, **scene.options)
    half = sim.copy() if again else None
    measures = judge(scene, sim, STEPS)
    if half is not None and sim.steps == STEPS:
        repeat(case, scene, sim, half)
    return measures


def repeat(case: Case, scene: Scene, done: amontons.Simulation, fresh: amontons.Simulation) -> None:
    """The same scene with other threads, saved and loaded in the middle, has the same bits."""
    threads = done.options["threads"] % 3 + 1
    path = case.folder / "half.h5"
    fresh.run(STEPS // 2 * scene.dt)
    fresh.save(path)
    other = amontons.Simulation.load(path, threads=threads)
    while other.steps < done.steps:
        other.step()
    for name in ("positions", "orientations", "linear_velocities", "angular_velocities"):
        if not np.array_equal(getattr(done.state, name), getattr(other.state, name)):
            raise Failure(
                "other bits", f"{name} after {done.steps} steps with {threads} threads and a restart"
            )


def run_budgets(case: Case) -> Measures:
    """The same scenes with a budget of wall clock for each step, and their last step solved with a deadline
    by every method. The processor time is measured, as other programs run here, too; and a case with
    something late is run again, as virtual machines have pauses that count as time of the processor."""
    first = measure_lateness(case)
    if first["outcome"] in ("refused", "in time"):
        return first
    return min(first, measure_lateness(case), key=lambda m: (m["late steps"], m["late solves"]))


def measure_lateness(case: Case) -> Measures:
    rng = case.rng(20_000)
    budget = log_uniform(rng, 1e-3, 2e-2)
    try:
        scene = Scene(case)
    except amontons.InputError as error:
        return {"outcome": "refused", "why": str(error)}
    sim = amontons.Simulation(scene.model, **(scene.options | {"budget": budget, "threads": 1}))
    beyond = [lateness(budget, sim.step) for _ in range(BUDGETED)]
    if not np.isfinite(sim.state.positions).all():
        raise Failure("not finite", f"budget {budget}")
    late = sum(too_late(budget, by) for by in beyond)
    solves = [late_solve(sim.problem(), method, log_uniform(rng, 1e-3, 2e-2)) for method in METHODS]
    return {
        "outcome": "late steps" if late else "late solves" if any(solves) else "in time",
        "most over budget (ms)": 1e3 * max(beyond),
        "late steps": late,
        "late solves": sum(solves),
    }


def lateness(limit: float, work: Callable[[], Any]) -> float:
    start = time.thread_time()
    work()
    return time.thread_time() - start - limit


def too_late(limit: float, by: float) -> bool:
    return by > max(0.2 * limit, 1e-3)


def late_solve(problem: amontons.vi.Problem, method: str, deadline: float) -> bool:
    def solve() -> None:
        # Some methods are for other problems.
        with contextlib.suppress(amontons.InputError):
            problem.solve(method=method, deadline=deadline, tolerance=0, threads=1)

    return too_late(deadline, lateness(deadline, solve))


METHODS = amontons.vi.methods()
BUDGETED = 100

FAMILIES = [
    Family("scenes", "random scenes of 400 steps", run, cpu_s=300.0, memory=2 << 30, share=3.0),
    Family("budgets", "random scenes with a budget of time", run_budgets, cpu_s=60.0, memory=2 << 30),
]
