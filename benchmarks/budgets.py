"""Whether budgets of steps are kept, and what steps that are stopped by the clock still do.

    python benchmarks/budgets.py [--quick] [--out FOLDER]

Writes budgets.csv, a row per scene and budget: how late the steps were, how deep bodies overlapped, how far
joints came apart, how much energy a step made from nothing. All on one core, in processor time, as what other
programs take is not the solver's.
"""

from __future__ import annotations

from statistics import median
from time import thread_time
from typing import Any

from common import arguments, begin, fill
from simulation import Task

RUNS = (
    (Task("50 spheres", "spheres_in_box", 1.2, {"mu": 0.5, "count": 50}, {"dt": 1e-2}), (1e-3, 5e-3)),
    (Task("1000 spheres", "spheres_in_box", 1.2, {"mu": 0.5}, {"dt": 1e-2}), (5e-3, 1e-2, 2e-2)),
    (Task("wall under impact", "wall", 1.0), (2.5e-2, 5e-2, 1e-1)),
)
"""Scenes, and budgets of their steps (s)."""
QUICK = 10
"""Steps of a sample."""


def allowed(limit: float) -> float:
    """How late a step may be (s)."""
    return max(0.2 * limit, 1e-3)


def steps(task: Task, budget: float, most: int | None) -> dict[str, Any]:
    """late_...: how much later than asked a step ended (s of processor time; negative: sooner)."""
    simulation, late, reports = task.simulation(threads=1, budget=budget), [], []
    for _ in range(most or round(task.duration / simulation.dt)):
        start = thread_time()
        reports.append(simulation.step())
        late.append(thread_time() - start - budget)
    return {
        "limit": budget,
        "times": len(late),
        "in_time": sum(beyond <= allowed(budget) for beyond in late),
        "late_median": median(late),
        "late_worst": max(late),
        "most_contacts": max(r.contacts for r in reports),
        "iterations_median": median(r.iterations for r in reports),
        "residual_median": median(r.residual for r in reports),
        "penetration": max(r.penetration for r in reports),
        "joint_gap": max(r.joint_error for r in reports),
        "energy_gain": max(0.0, *(r.energy_balance for r in reports)),
        "unbalanced": sum(not r.balanced for r in reports),
    }


def main() -> None:
    options = begin(arguments(__doc__).parse_args())
    tasks = [(task, budget) for task, budgets in RUNS for budget in budgets]
    most = QUICK if options.quick else None
    show = "scene limit times in_time late_worst penetration"
    fill(options.out / "budgets.csv", tasks, lambda one: [{"scene": one[0].name} | steps(*one, most)], show)


if __name__ == "__main__":
    main()
