"""Simulated scenes: how fast they run, where the time goes, and how well each step is solved.

    python benchmarks/simulation.py [--quick] [--out FOLDER]

Writes simulation.csv, a row per scene on one core: real-time factor, wall clock per step by phase, sizes,
residuals, errors of position; and how many times faster its first steps are on all cores, where they must end
in the same bits. A scene ends when its simulated time has passed, or after 60 s.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from statistics import median
from time import perf_counter
from typing import Any

import amontons
import amontons.scenes
import numpy as np
from amontons import Report
from common import Row, arguments, begin, fill, task_row

MOST_WALL_CLOCK, QUICK_WALL_CLOCK = 60.0, 4.0  # s, of one scene
AGAIN = 8.0
"""s on one core of the first steps, which are run again on all cores"""


@dataclass(frozen=True)
class Task:
    """One row: a scene with its own time step and settings but for those given."""

    name: str
    scene: str
    duration: float
    """simulated time (s)"""
    parameters: dict[str, Any] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)
    target: float = 0.0
    """steps per second that are wanted; 0: none"""
    cores: int = 1
    """on which"""

    def simulation(self, **more: Any) -> amontons.Simulation:
        scene = amontons.scenes.get(self.scene)
        settings = {"dt": scene.dt, "on_failure": "ignore", **scene.options, **self.options, **more}
        return amontons.Simulation(scene.make(**self.parameters), **settings)


# To the default tolerance where forces are what one looks at, to 1e-3 where motion is.
TASKS = (
    Task("B1 network", "network", 3.0),
    Task("B2 spheres in a box", "spheres_in_box", 2.0, options={"tolerance": 1e-3}),
    Task(
        "spheres with friction, 10 ms", "spheres_in_box", 2.0, {"mu": 0.5}, {"dt": 1e-2, "tolerance": 1e-3},
        target=15,
    ),
    Task("B3 plates 1:100", "plates", 10.0),
    Task("B4 wall at rest", "wall_at_rest", 1.0, target=50),
    Task("B4 wall under impact", "wall", 2.0, options={"tolerance": 1e-3}, target=15),
    Task("B4 wall under impact, 1e-2", "wall", 2.0, options={"tolerance": 1e-2}, target=40),
    Task("tracked vehicle", "tracked_vehicle", 4.0, target=800),
    Task("hopper", "hopper", 4.0, options={"tolerance": 1e-3}),
    Task(
        "10000 spheres", "spheres_in_box", 0.5, {"count": 10000, "mu": 0.3}, {"tolerance": 1e-3},
        target=8, cores=2,
    ),
)  # fmt: skip


def simulate(task: Task, most: float) -> tuple[amontons.Simulation, list[Report], float]:
    """The simulation at its end, the reports of all steps, and the wall clock of stepping (s)."""
    simulation = task.simulation()
    reports: list[Report] = []
    start = perf_counter()
    simulation.run(
        task.duration, after_step=lambda _, report: reports.append(report) or perf_counter() - start > most
    )
    return simulation, reports, perf_counter() - start


def on_all_cores(task: Task, allowed: set[int]) -> dict[str, Any]:
    """Steps per second of the first steps on one core and on all, the one right after the other."""
    one, reports, alone = simulate(task, AGAIN)
    bound = os.sched_getaffinity(0)
    os.sched_setaffinity(0, allowed)
    again, _, together = simulate(replace(task, duration=one.time), np.inf)
    os.sched_setaffinity(0, bound)
    if not np.array_equal(one.state.positions, again.state.positions):
        raise SystemExit(f"simulation: {task.name}: other bits on {len(allowed)} cores")
    return {
        "cores": len(allowed), "first_steps": len(reports), "steps_per_second_one": len(reports) / alone,
        "steps_per_second_all": len(reports) / together,
    }  # fmt: skip


def row(task: Task, most: float) -> dict[str, Any]:
    simulation, reports, wall = simulate(task, most)
    steps = len(reports)

    def mean(name: str) -> float:
        return sum(getattr(r, name) for r in reports) / steps

    def worst(name: str) -> float:
        return max(getattr(r, name) for r in reports)

    totals = [r.timings.total for r in reports]
    phases = {
        name: sum(getattr(r.timings, name) for r in reports) / steps
        for name in ("collision", "assembly", "solve", "integration")
    }
    return task_row(task.name, "amontons", sum(totals) / steps, worst("residual")) | {
        "scene": task.scene, "law": simulation.options["law"],
        "tolerance": simulation.options["tolerance"], "dt": simulation.dt,
        "bodies": len(simulation.model.bodies), "steps": steps, "simulated": simulation.time, "wall": wall,
        "real_time_factor": simulation.time / wall, "step_median": median(totals),
        "step_longest": max(totals), **phases, "contacts": mean("contacts"),
        "most_contacts": worst("contacts"), "joint_rows": mean("joint_rows"),
        "iterations": mean("iterations"), "converged": sum(r.converged for r in reports),
        "residual_median": median(r.residual for r in reports), "penetration": worst("penetration"),
        "joint_error": worst("joint_error"),
        "steps_per_second": steps / wall, "target": task.target, "target_cores": task.cores,
    }  # fmt: skip


def main() -> None:
    allowed = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    options = begin(arguments(__doc__).parse_args())

    def rows(task: Task) -> list[Row]:
        more = on_all_cores(task, allowed) if len(allowed) > 1 and not options.quick else {}
        return [row(task, QUICK_WALL_CLOCK if options.quick else MOST_WALL_CLOCK) | more]

    show = "task real_time_factor time contacts converged steps error"
    fill(options.out / "simulation.csv", TASKS, rows, show)


if __name__ == "__main__":
    main()
