"""Whether budgets of steps are kept, and what steps that are stopped by the clock still do.

    python benchmarks/budgets.py [--quick] [--out FOLDER]

Writes budgets.csv, a row per scene and budget: how late the steps were, how deep bodies overlapped, how far
joints came apart, how much energy a step made from nothing. All on one core, in processor time, as what other
programs take is not the solver's.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from statistics import median
from time import thread_time
from typing import Any

import amontons
import amontons.scenes
from common import arguments, tracked, use_one_core, with_folders, write_csv


@dataclass(frozen=True)
class Scene:
    name: str
    scene: str
    parameters: dict[str, Any] = field(default_factory=dict)
    dt: float = 0.0
    """s; 0: that of the scene"""
    budgets: tuple[float, ...] = ()
    """s"""
    steps: int = 0

    def simulation(self, **options: Any) -> amontons.Simulation:
        scene = amontons.scenes.get(self.scene)
        settings = {
            "dt": self.dt or scene.dt,
            **scene.options,
            "threads": 1,
            "on_failure": "ignore",
            **options,
        }
        return amontons.Simulation(scene.make(**self.parameters), **settings)


SPHERES = Scene("1000 spheres", "spheres_in_box", {"mu": 0.5}, 1e-2, (5e-3, 1e-2, 2e-2), 120)
FEW = Scene("50 spheres", "spheres_in_box", {"mu": 0.5, "count": 50}, 1e-2, (1e-3, 5e-3), 120)
WALL = Scene("wall under impact", "wall", {}, 0.0, (2.5e-2, 5e-2, 1e-1), 200)


def allowed(limit: float) -> float:
    """How late a step may be (s)."""
    return max(0.2 * limit, 1e-3)


def lateness(limit: float, work: Callable[[], Any]) -> tuple[float, Any]:
    """How much later than asked something ended (s of processor time; negative: sooner), and its result."""
    start = thread_time()
    result = work()
    return thread_time() - start - limit, result


def columns(limit: float, late: list[float]) -> dict[str, Any]:
    return {
        "limit": limit, "times": len(late), "in_time": sum(beyond <= allowed(limit) for beyond in late),
        "late_median": median(late), "late_worst": max(late),
    }  # fmt: skip


def steps(scene: Scene, budget: float, count: int) -> dict[str, Any]:
    simulation = scene.simulation(budget=budget)
    runs = [lateness(budget, simulation.step) for _ in range(count)]
    reports = [report for _, report in runs]
    return columns(budget, [late for late, _ in runs]) | {
        "most_contacts": max(r.contacts for r in reports),
        "iterations_median": median(r.iterations for r in reports),
        "residual_median": median(r.residual for r in reports),
        "penetration": max(r.penetration for r in reports),
        "joint_gap": max(r.joint_error for r in reports),
        "energy_gain": max(0.0, *(r.energy_balance for r in reports)),
        "unbalanced": sum(not r.balanced for r in reports),
    }


def write_budgets(out: Any, quick: bool) -> list[dict[str, Any]]:
    rows = []
    tasks = [(scene, budget) for scene in (FEW, SPHERES, WALL) for budget in scene.budgets]
    for scene, budget in tracked(tasks, "budgets"):
        rows.append({"scene": scene.name} | steps(scene, budget, 10 if quick else scene.steps))
    write_csv(out / "budgets.csv", rows)
    return rows


def main() -> None:
    options = with_folders(arguments(__doc__).parse_args())
    use_one_core()
    warnings.simplefilter("ignore", amontons.StepWarning)
    for r in write_budgets(options.out, options.quick):
        print(f"budgets: {r['scene']}: {told(r)}, {1e3 * r['penetration']:.2g} mm deep")


def told(row: dict[str, Any]) -> str:
    ended = f"{row['in_time']} of {row['times']} in the time of {1e3 * row['limit']:.3g} ms"
    return f"{ended}, the last {1e3 * row['late_worst']:.2g} ms late"


if __name__ == "__main__":
    main()
