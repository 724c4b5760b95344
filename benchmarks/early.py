"""Steps that are stopped early: what a wall that is hit still does, and how fast it runs.

    python benchmarks/early.py [--quick] [--out FOLDER]

Writes early.csv, a row per limit of the solve, all on one core: processor time per step, deepest overlap,
largest gap of the ball's chain, energy that a step made from nothing, and where the bricks are beside those
of the run to the tightest tolerance.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from time import thread_time
from typing import Any

import amontons
import amontons.scenes
import numpy as np
from common import arguments, tracked, use_one_core, with_folders, write_csv

DURATION, QUICK_DURATION = 1.0, 0.45  # s; the ball strikes at about 0.4 s
BRICK = 0.05  # m: what is further from where it stood has moved


@dataclass(frozen=True)
class Limit:
    """How a solve ends."""

    name: str
    options: dict[str, Any] = field(default_factory=dict)


LIMITS = (
    Limit("tolerance 1e-4", {"tolerance": 1e-4}),
    Limit("tolerance 1e-3", {"tolerance": 1e-3}),
    Limit("tolerance 1e-2", {"tolerance": 1e-2}),
    Limit("200 iterations", {"tolerance": 1e-4, "max_iterations": 200}),
    Limit("50 iterations", {"tolerance": 1e-4, "max_iterations": 50}),
    Limit("20 iterations", {"tolerance": 1e-4, "max_iterations": 20}),
)


def run(limit: Limit, duration: float) -> tuple[dict[str, Any], np.ndarray[Any, Any]]:
    """The row of a limit, and where the bodies are at the end."""
    scene = amontons.scenes.get("wall")
    settings = {"dt": scene.dt, "on_failure": "ignore", **scene.options, **limit.options}
    simulation = amontons.Simulation(scene.make(), **settings)
    before = simulation.state.positions.copy()
    reports: list[amontons.Report] = []
    start = thread_time()
    simulation.run(duration, after_step=lambda _, report: reports.append(report))
    step = (thread_time() - start) / len(reports)
    after = simulation.state.positions.copy()
    residuals = [report.residual for report in reports]
    facts = {
        "limit": limit.name, "steps": len(reports), "step": step, "steps_per_s": 1 / step,
        "residual_median": float(np.median(residuals)), "residual_worst": max(residuals),
        "penetration": max(r.penetration for r in reports), "joint_gap": max(r.joint_error for r in reports),
        "energy_gain": max(0.0, *(r.energy_balance for r in reports)),
        "unbalanced": sum(not r.balanced for r in reports),
        "moved": int((np.linalg.norm(after - before, axis=1) > BRICK).sum()),
    }  # fmt: skip
    return facts, after


def main() -> None:
    options = with_folders(arguments(__doc__).parse_args())
    use_one_core()
    warnings.simplefilter("ignore", amontons.StepWarning)
    rows: list[dict[str, Any]] = []
    reference = None
    for limit in tracked(LIMITS, "limits"):
        facts, positions = run(limit, QUICK_DURATION if options.quick else DURATION)
        reference = positions if reference is None else reference
        distance = float(np.median(np.linalg.norm(positions - reference, axis=1)))
        rows.append(facts | {"distance": distance})
        write_csv(options.out / "early.csv", rows)
    for r in rows:
        print(
            f"early: {r['limit']}: {r['steps_per_s']:.3g} steps/s, {1e3 * r['penetration']:.2g} mm deep, "
            f"chain {1e3 * r['joint_gap']:.2g} mm apart, {r['energy_gain']:.2g} J gained in a step, "
            f"{r['moved']} bodies moved, {1e3 * r['distance']:.2g} mm beside the first row (median)"
        )


if __name__ == "__main__":
    main()
