"""Full-size time steps: the default method against its targets, and every method at one deadline.

    python benchmarks/steps.py [--quick] [--data FOLDER] [--out FOLDER] [--figures FOLDER]

Writes steps.csv (median of 5 runs after one that warms up), methods.csv (what each method reaches by a
deadline, and the products and time it takes to 1e-3 and 1e-6) and methods-<law>.png (the curves), all on
one core.
"""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter, process_time

import amontons
from amontons.report.comparison import Run, compare, single_methods
from amontons.report.figures import convergence_figures
from common import Row, arguments, begin, fill, read, shrink, task_row, tracked, write_csv

SCENES = ("B1_s30", "B3_s10", "B3T_s10", "B4_s60", "B4_impact+5")
REPEATS = 5
METHODS_TOLERANCE = 1e-8
METHODS_DEADLINE, QUICK_DEADLINE = 2.0, 0.2  # s
LEVELS = (1e-3, 1e-6)
INTERIOR_DEADLINE = 20.0  # s; far above every target


@dataclass(frozen=True)
class Task:
    """One row of steps.csv: a scene, how it is solved, and the time that is wanted (s)."""

    scene: str
    method: str
    law: str
    tolerance: float
    target: float

    @property
    def name(self) -> str:
        return f"{self.scene} {self.law}"


TASKS = (
    Task("B1_s30", "auto", "associated", 1e-8, 0.1),
    Task("B3_s10", "auto", "associated", 1e-6, 0.01),
    Task("B3_s10", "auto", "associated", 1e-10, 0.001),
    Task("B3T_s10", "auto", "associated", 1e-6, 0.01),
    Task("B4_s60", "auto", "associated", 1e-6, 0.3),
    Task("B4_impact+5", "auto", "associated", 1e-3, 0.5),
    Task("B4_impact+5", "auto", "associated", 1e-8, 0.2),
    Task("B4_impact+5", "interior-point", "associated", 1e-8, 1.0),
    Task("B4_s60", "auto", "coulomb", 1e-3, 0.3),
    Task("B4_s60", "auto", "coulomb", 1e-4, 1.5),
    Task("B4_impact+5", "auto", "coulomb", 1e-3, 0.25),
    Task("B4_impact+5", "auto", "coulomb", 1e-4, 1.0),
)


def timed(problem: amontons.vi.Problem, task: Task, repeats: int) -> Row:
    walls, times, processor = [], [], []
    for run in range(repeats + 1):
        start, busy = perf_counter(), process_time()
        s = problem.solve(
            law=task.law, method=task.method, tolerance=task.tolerance, deadline=INTERIOR_DEADLINE
        )
        if run:
            walls.append(perf_counter() - start)
            times.append(s.time)
            processor.append(process_time() - busy)
    return task_row(task.scene, task.method, median(times), s.residual) | {
        "law": task.law, "tolerance": task.tolerance, "used": s.method, "status": s.status,
        "iterations": s.iterations, "products": s.products, "factorizations": s.factorizations,
        "objective": s.objective, "wall": median(walls), "processor_time": median(processor),
        "fastest": min(walls), "target": task.target,
    }  # fmt: skip


def method_row(run: Run, law: str) -> Row:
    """Products and time are also those of the first iterate with a residual at or below each level."""
    s = run.solution
    if s is None:
        return task_row(run.problem, run.method) | {"law": law, "status": "not applicable"}
    row = task_row(run.problem, run.method, s.time, s.residual) | {"law": law}
    row |= {field: getattr(s, field) for field in ("status", "objective", "iterations", "products")}
    for level in LEVELS:
        reached = [] if s.history is None else s.history[s.history["residual"] <= level]
        for field, kind in (("products", int), ("time", float)):
            row[f"{field}_{level:.0e}"] = kind(reached[field][0]) if len(reached) else ""
    return row


def main() -> None:
    options = begin(arguments(__doc__).parse_args())
    folder = options.data / "chrono"
    if not (folder / f"{SCENES[0]}.hdf5").exists():
        print(f"steps: skipped, there is no {SCENES[0]}.hdf5 in {folder}")
        return
    problems = {scene: read(folder / f"{scene}.hdf5") for scene in SCENES}
    repeats = 2 if options.quick else REPEATS
    fill(options.out / "steps.csv", TASKS, lambda task: [timed(problems[task.scene], task, repeats)],
         "task law tolerance used error wall target")  # fmt: skip
    compare_methods(problems, options.quick, options.out, options.figures)


def compare_methods(problems: dict[str, amontons.vi.Problem], quick: bool, out: Path, figures: Path) -> None:
    """methods.csv and a figure per law; under coulomb only what has contacts."""
    deadline = QUICK_DEADLINE if quick else METHODS_DEADLINE
    rows = []
    for law in ("associated", "coulomb"):
        scenes = [scene for scene, p in problems.items() if law == "associated" or p.contacts]
        runs: list[Run] = []
        for scene, method in tracked([(s, m) for s in scenes for m in single_methods()], law):
            runs += compare(
                scene, problems[scene], [method], law=law, tolerance=METHODS_TOLERANCE, deadline=deadline
            )
        rows += [method_row(run, law) for run in runs]
        with tempfile.TemporaryDirectory() as folder:  # figures/ may hold a file of its name
            (drawn,) = convergence_figures(runs, Path(folder), tolerance=METHODS_TOLERANCE, law=law)
            shrink(Path(shutil.copy(drawn, figures / f"methods-{law}.png")))
    write_csv(out / "methods.csv", rows)


if __name__ == "__main__":
    main()
