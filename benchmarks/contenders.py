"""Which contenders the race of `auto` needs: fields with some of them switched off, beside today's field.

    python benchmarks/contenders.py [--quick] [--only SET ...] [--every 6] [--data FOLDER] [--out FOLDER]

Writes contenders.csv, a row per set and field, over the corpus (both halves), the FCLIB files, the full-size
steps (steps.py), problems of random scenes, and robots beside a pile. A field is today's with numbers of the
policy changed: an expectation that is infinite keeps a contender out. The fields take turns on each problem.
Cost is the nominal work of a solve, which depends on no clock, and beside it processor time. Means are
geometric, over the solves that both fields do and that the direct way alone does not end: there all fields
are the same. Simulations of robots beside a pile compare products and factorisations of all steps.
"""

from __future__ import annotations

import argparse
import math
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from statistics import fmean
from time import process_time
from typing import Any

import amontons
import corpus
import files
import performance_profile
import steps
from amontons import _core
from amontons.model.builder import ModelBuilder
from common import ROOT, arguments, read, tracked, use_one_core, with_folders, write_csv
from sensitivity_runs import RANDOM_SCENES, SEED, Counts

sys.path[:0] = [str(ROOT), str(ROOT / "tools")]

NEVER = math.inf
FIELDS: dict[str, dict[str, float]] = {
    "today": {},
    "without the held term": {"choice.frozen_ratio": NEVER},
}
"""Numbers of the policy that are changed. Until 881917a9 there were fields without p-spg-fb, too."""
PILES = (("unitree_go1/go1.xml", 40), ("ufactory_xarm7/xarm7_nohand.xml", 80))
"""Robots, and the numbers of bodies in the pile beside them."""
PILE_STEPS = 150


@dataclass(frozen=True)
class Solve:
    """A solve of a set."""

    group: str
    problem: amontons.vi.Problem
    law: str
    tolerance: float
    x0: Any = None

    @property
    def name(self) -> str:
        return f"{self.problem.name}, {self.law}, {self.tolerance:g}"


class Field:
    """A field is in force inside the block."""

    def __init__(self, changes: dict[str, float]) -> None:
        self.changes = changes

    def __enter__(self) -> None:
        today = _core.policy()
        self.before = {name: today[name] for name in self.changes}
        for name, value in self.changes.items():
            _core.set_policy(name, value)

    def __exit__(self, *_: object) -> None:
        for name, value in self.before.items():
            _core.set_policy(name, value)


# Sets


def of_corpus(every: int) -> Iterator[Solve]:
    for task in performance_profile.tasks(islice(corpus.load(corpus.FOLDER), 0, None, every)):
        half = "held-out" if corpus.held_out(task.step.sequence) else "tuning"
        x0 = task.step.x0 if task.warm else None
        yield Solve(f"corpus, {half}", task.step.problem(), task.law, task.tolerance, x0)


def of_files(data: Path) -> Iterator[Solve]:
    for path in sorted((data / "fclib").glob("*.hdf5")):
        problem = read(path)
        for law, tolerance in files.RUNS:
            yield Solve("FCLIB files", problem, law, tolerance)


def of_steps(data: Path) -> Iterator[Solve]:
    for task in steps.TASKS:
        if task.method == "auto":
            group = "walls" if task.scene.startswith("B4") else "full-size steps"
            problem = read(data / "chrono" / f"{task.scene}.hdf5")
            yield Solve(f"{group}, {task.law}", problem, task.law, task.tolerance)


def of_random_scenes(folder: Path) -> Iterator[Solve]:
    """Steps of random scenes, as bodies: in coordinates of joints A is a matrix."""
    from tools.soak.family import Case
    from tools.soak.odd_scenes import Scene

    for index in range(RANDOM_SCENES):
        try:
            scene = Scene(Case("scenes", SEED, index, folder))
            sequence = corpus.Sequence(
                f"random {index}", lambda s=scene: s.model, scene.options["dt"], (5, 20, 60)
            )
            for step in corpus.steps_of(sequence):
                for law, tolerance in (("associated", 1e-6), ("coulomb", 1e-3), ("coulomb", 1e-8)):
                    yield Solve("random scenes", step.problem(), law, tolerance, step.x0)
        except (amontons.InputError, amontons.SimulationError):
            continue


def beside_a_pile(path: Path, count: int, trees: str) -> amontons.Model:
    """A robot two metres beside a pile of bodies of every shape, on one floor."""
    b = ModelBuilder(friction_rule="maximum", trees=trees)
    b.add_model(corpus.pile("mixed", 0.5, count, 3), position=(0, 0, 0), prefix="pile ")
    b.add_model(amontons.load_model(path), position=(0, 2.5, 0), prefix="robot ")
    return b.build()


# Runs


def solve(task: Solve) -> dict[str, Any]:
    begun = process_time()
    s = task.problem.solve(law=task.law, tolerance=task.tolerance, x0=task.x0, threads=1)
    return {
        "solved": s.converged, "work": s.work, "time": process_time() - begun, "reason": s.reason,
    }  # fmt: skip


RACED = ("apgd (", "p-spg-fb (", "interior-point (", "newton (", "cg (")


def raced(rows: dict[str, dict[str, Any]]) -> bool:
    """Whether a contender ran in some field."""
    return any(method in row["reason"] for row in rows.values() for method in RACED)


def mean(ratios: list[float]) -> float:
    return math.exp(fmean(map(math.log, ratios))) if ratios else math.nan


def rows_of(group: str, all_rows: list[tuple[str, dict[str, dict[str, Any]]]]) -> list[dict[str, Any]]:
    """A row per field."""
    chosen = [(name, rows) for name, rows in all_rows if raced(rows)]
    return [
        {"set": group, "field": field, "solves": len(all_rows), "raced": len(chosen)}
        | {"solved": sum(rows[field]["solved"] for _, rows in all_rows)}
        | beside([(name, rows[field], rows["today"]) for name, rows in chosen])
        for field in FIELDS
    ]


def beside(solves: list[tuple[str, dict[str, Any], dict[str, Any]]]) -> dict[str, Any]:
    """A field beside that of today."""
    lost = [name for name, now, today in solves if today["solved"] and not now["solved"]]
    both = [solve for solve in solves if solve[1]["solved"] and solve[2]["solved"]]
    ratios = {name: max(now["work"], 1) / max(today["work"], 1) for name, now, today in both}
    worst = max(ratios, key=ratios.__getitem__, default="")
    return {
        "lost": len(lost),
        "won": sum(now["solved"] and not today["solved"] for _, now, today in solves),
        "work": mean([*ratios.values()]),
        "total_work": sum(n["work"] for _, n, _ in both) / max(1, sum(t["work"] for _, _, t in both)),
        "time": mean([now["time"] / today["time"] for _, now, today in both]),
        "worst": ratios.get(worst, math.nan),
        "worst_solve": worst,
        "lost_solves": "; ".join(lost[:6]),
    }


def pile_rows(data: Path, count: int) -> list[dict[str, Any]]:
    table = []
    for name, bodies in PILES:
        for trees in ("auto", "none"):
            model = beside_a_pile(data / "robots" / name, bodies, trees)
            base: dict[str, float] = {}
            for field, changes in FIELDS.items():
                counts, begun = Counts(), process_time()
                counts.until += 1e3
                with Field(changes):
                    simulation = amontons.Simulation(model, dt=2e-3, threads=1, on_failure="ignore")
                    for _ in range(count):
                        counts.add(simulation.step(), model.length)
                found = counts.row | {"time": process_time() - begun}
                found["work"] = found["products"] + 20 * found["factorizations"]
                base = base or found
                ratio = found["work"] / max(base["work"], 1)
                row = {"set": f"{name}, {bodies} bodies, trees {trees}", "field": field}
                row |= {"solves": count, "raced": count, "solved": count - found["missed"]}
                row |= {"lost": found["missed"] - base["missed"], "won": 0, "work": ratio}
                row |= {"total_work": ratio, "time": found["time"] / base["time"]}
                table.append(row | {"worst": math.nan, "worst_solve": "", "lost_solves": ""})
    return table


def parsed() -> argparse.Namespace:
    parser = arguments(__doc__)
    parser.add_argument("--only", nargs="+", default=[], help="sets whose names contain one of these")
    parser.add_argument("--every", type=int, default=5, help="take every so many step of the corpus")
    return with_folders(parser.parse_args())


def main() -> None:
    options = parsed()
    use_one_core()
    warnings.simplefilter("ignore")
    every = 40 if options.quick else options.every
    sets = {
        "full-size steps and walls": lambda: of_steps(options.data),
        "corpus": lambda: of_corpus(every),
        "FCLIB files": lambda: of_files(options.data),
        "random scenes": lambda: of_random_scenes(options.out),
    }
    table: list[dict[str, Any]] = []
    for name, tasks in sets.items():
        if options.only and not any(part in name for part in options.only):
            continue
        found: dict[str, list[tuple[str, dict[str, dict[str, Any]]]]] = {}
        for task in tracked(list(tasks()), name[:10]):
            rows = {}
            for field, changes in FIELDS.items():
                with Field(changes):
                    rows[field] = solve(task)
            found.setdefault(task.group, []).append((task.name, rows))
        for group, all_rows in found.items():
            table += rows_of(group, all_rows)
        write_csv(options.out / "contenders.csv", table)
    if not options.only or any("piles" in part for part in options.only):
        table += pile_rows(options.data, 20 if options.quick else PILE_STEPS)
        write_csv(options.out / "contenders.csv", table)
    for row in table:
        print(
            f"{row['set']:45s} {row['field']:26s} solved {row['solved']:4d} of {row['solves']:4d},"
            f" lost {row['lost']:3d}, won {row['won']:3d}, work {row['work']:.2f}, time {row['time']:.2f},"
            f" worst {row['worst']:.1f}"
        )


if __name__ == "__main__":
    main()
