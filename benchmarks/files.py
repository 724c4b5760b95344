"""The FCLIB files: accuracy of the default method under both laws, and its time beside that of Clarabel.

    python benchmarks/files.py [--quick] [--data FOLDER] [--out FOLDER]

Writes files.csv (residual, objective, time by law and tolerance) and clarabel.csv (time to a residual of
1e-4). Both solvers run in this process, on one core, in turns. Clarabel gets the formulation and the
loosest tolerances with which it is fastest and still reaches 1e-4 in the same measure, the natural residual
of its impulses.
"""

from __future__ import annotations

import gc
import json
from pathlib import Path
from statistics import median
from time import perf_counter

import amontons
import conic
from common import Row, arguments, begin, fill, read, task_row

LEVEL = 1e-4
RUNS = (("associated", 1e-4), ("associated", 1e-8), ("coulomb", 1e-4), ("coulomb", 1e-6), ("coulomb", 1e-8))
DEADLINE = 20.0  # s per solve
LADDER = [10 ** (-k / 2) for k in range(6, 27)]  # 1e-3 to 1e-13, two steps per decade
REPEATS = 9
QUICK_STRIDE = 7


def accuracy(path: Path, problem: amontons.vi.Problem, reference: Row) -> list[Row]:
    """One row per law and tolerance; the time of these single runs is cold."""
    rows = []
    for law, tolerance in RUNS:
        s = problem.solve(law=law, tolerance=tolerance, deadline=DEADLINE)
        row = task_row(path.name, s.method, s.time, s.residual) | {
            "contacts": problem.contacts, "law": law, "tolerance": tolerance, "status": s.status,
            "iterations": s.iterations, "products": s.products, "factorizations": s.factorizations,
            "objective": s.objective,
        }  # fmt: skip
        # The references are those of the associated law.
        if law == "associated" and "associated_objective" in reference:
            objective = float(reference["associated_objective"])
            row |= {"reference": objective, "reference_error": float(reference["associated_error"])}
            row["relative_difference"] = (s.objective - objective) / abs(objective) if objective else ""
        rows.append(row)
    return rows


def calibrated(problem: amontons.vi.Problem) -> tuple[conic.Program, float, conic.Outcome] | None:
    """The formulation and tolerance with which Clarabel reaches LEVEL soonest; None if with none."""
    best: tuple[conic.Program, float, conic.Outcome] | None = None
    # Where there is a velocity form it is usually the faster: tried first, it shortens the other's search.
    for program in reversed(conic.programs(problem)):
        for tolerance in LADDER:
            settings = conic.settings(tolerance)
            outcome = conic.run(program, settings)
            if best is not None and outcome.time > 2 * best[2].time:
                break  # tighter tolerances only take longer
            if problem.residual(outcome.x, law="associated") <= LEVEL:
                outcome = min((conic.run(program, settings) for _ in range(3)), key=lambda o: o.time)
                if best is None or outcome.time < best[2].time:
                    best = (program, tolerance, outcome)
                break
    return best


def duel(path: Path, problem: amontons.vi.Problem, repeats: int) -> list[Row]:
    """Medians of alternating runs of both solvers; no rows where Clarabel does not reach LEVEL. `used`: our
    method, its formulation; `time`: our wall clock, its own clock; `other_clock`: the other of both (s)."""
    found = calibrated(problem)
    if found is None:
        print(f"files: Clarabel does not reach {LEVEL:.0e} with any setting on {path.name}")
        return []
    program, tolerance, outcome = found
    settings = conic.settings(tolerance)
    ours, walls, theirs, their_walls = [], [], [], []
    gc.collect()
    gc.disable()
    for _ in range(repeats):
        start = perf_counter()
        s = problem.solve(tolerance=LEVEL, law="associated")
        walls.append(perf_counter() - start)
        ours.append(s.time)
        outcome = conic.run(program, settings)
        theirs.append(outcome.time)
        their_walls.append(outcome.wall)
    gc.enable()
    error = problem.residual(outcome.x, law="associated")
    return [
        task_row(path.name, "amontons", median(walls), s.residual)
        | {"contacts": problem.contacts, "used": s.method, "other_clock": median(ours)},
        task_row(path.name, "Clarabel", median(theirs), error)
        | {"contacts": problem.contacts, "used": program.formulation, "other_clock": median(their_walls),
           "tolerance": tolerance, "iterations": outcome.iterations},
    ]  # fmt: skip


def main() -> None:
    options = begin(arguments(__doc__).parse_args())
    folder = options.data / "fclib"
    paths = sorted(folder.glob("*.hdf5"))[:: QUICK_STRIDE if options.quick else 1]
    if not paths:
        print(f"files: skipped, there are no *.hdf5 in {folder}")
        return
    references = json.loads((folder / "references.json").read_text())
    problems = {path: read(path) for path in paths}
    repeats = 3 if options.quick else REPEATS
    fill(options.out / "files.csv", paths,
         lambda path: accuracy(path, problems[path], references.get(path.name, {})))  # fmt: skip
    fill(options.out / "clarabel.csv", paths, lambda path: duel(path, problems[path], repeats),
         "task method time error used")  # fmt: skip


if __name__ == "__main__":
    main()
