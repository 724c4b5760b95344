"""Time steps of whole scenes with the defaults of the simulation: what each solve costs and reaches.

    python benchmarks/sequences.py [--quick] [--out FOLDER]

Writes sequences.csv: per scene the solve time of a step (median, 95 %, largest), its iterations and the
largest residual, cold at the first step and warm afterwards, on one core.
"""

from __future__ import annotations

from typing import Any

import amontons
import numpy as np
from amontons import scenes
from common import arguments, tracked, use_one_core, with_folders, write_csv

# name, steps, dt (s), options of the simulation
SEQUENCES: tuple[tuple[str, int, float, dict[str, Any]], ...] = (
    ("plates", 200, 1e-2, {}),
    ("chain", 400, 5e-3, {}),
    ("wall_at_rest", 100, 5e-3, {}),
    ("wall", 160, 5e-3, {"tolerance": 1e-4}),
    ("wall", 160, 5e-3, {}),
    ("tracked_vehicle", 200, 5e-3, {"tolerance": 1e-4}),
    ("tracked_vehicle", 200, 5e-3, {}),
)
QUICK_STEPS = 10


def sequence(name: str, steps: int, dt: float, options: dict[str, Any]) -> dict[str, Any]:
    simulation = amontons.Simulation(scenes.make(name), dt=dt, on_failure="ignore", **options)
    reports = [simulation.step() for _ in range(steps)]
    times = np.array([r.timings.solve for r in reports])
    residuals = np.array([r.residual for r in reports])
    return {
        "scene": name, "steps": steps, "dt": dt, "tolerance": options.get("tolerance", 1e-6),
        "contacts": max(r.contacts for r in reports), "joint_rows": max(r.joint_rows for r in reports),
        "first": times[0], "median": float(np.median(times)), "p95": float(np.quantile(times, 0.95)),
        "largest": times.max(), "iterations": float(np.mean([r.iterations for r in reports])),
        "factorizations": float(np.mean([r.factorizations for r in reports])),
        "residual": float(np.median(residuals)), "largest_residual": residuals.max(),
    }  # fmt: skip


def main() -> None:
    options = with_folders(arguments(__doc__).parse_args())
    if not use_one_core():
        print("sequences: this system cannot bind a process to a core; times may include other cores")
    rows = []
    for name, steps, dt, extra in tracked(SEQUENCES, "sequences"):
        row = sequence(name, QUICK_STEPS if options.quick else steps, dt, extra)
        rows.append(row)
        print(
            f"sequences: {name} to {row['tolerance']:.0e}: median {1e3 * row['median']:.2f} ms, 95 % "
            f"{1e3 * row['p95']:.1f} ms, largest residual {row['largest_residual']:.1e}"
        )
    write_csv(options.out / "sequences.csv", rows)


if __name__ == "__main__":
    main()
