"""All figures and tables in one folder, with a page that says what they show."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from amontons import __version__
from amontons.io.files import write_whole
from amontons.report.comparison import Run, compare, single_methods, write_csv
from amontons.report.complete_files import csv_bytes
from amontons.report.figures import convergence_figures
from amontons.report.picture import View
from amontons.report.snapshots import snapshots_figure
from common import processor

from . import cases
from .cases import Case, Plan
from .figures import cost_figure, objective_figure
from .measure import (
    LEVEL,
    PRODUCTS,
    SWEPT,
    SWEPT_BILATERAL,
    TOLERANCE,
    Before,
    Trace,
    first_below,
    sweep,
    trace,
)

VIEW = View(azimuth=50, elevation=18)


def reproduce(plan: Plan, folder: Path, *, law: str, command: str, before: Before) -> list[Path]:
    """Make everything in `folder`; returns the files, the page last. before: told what begins."""
    before("B1, B2 and B3 run up to their steps")
    found = [cases.network(plan.network), cases.spheres(plan.spheres, plan.settle), cases.plates(plan.plates)]
    before("the ball of B4 swings")
    wall = cases.wall(*plan.wall, after=plan.after)
    found.append(wall)
    assert wall.simulation is not None
    snapshots_figure(
        wall.simulation.model, wall.frames, folder / "snapshots.png", view=VIEW, width=plan.pixels
    )
    before("the objective of P-SPG-FB")
    traced = trace(wall.problem, plan.iterations, plan.deadline)
    objective_figure(traced, folder / "objective.png", f"{wall.name}, {wall.title}")
    _write(folder / "objective.csv", _objective_rows(traced))

    runs: list[Run] = []
    for case in found:
        runs += compare(
            f"{case.name}, {case.title}, {case.bodies} bodies, {case.problem.rows} rows",
            case.problem,
            single_methods(),
            law=law,
            tolerance=TOLERANCE,
            deadline=plan.deadline,
            before=lambda name, method: before(f"{name[:2]}: {method}"),
        )
    convergence_figures(runs, folder, tolerance=LEVEL, law=law, against=("iterations", "products", "time"))
    write_csv(runs, folder)

    by_size = _by_size(plan, law, before)
    cost_figure(by_size, folder / "size.png", "bodies")
    _write(folder / "size.csv", (row for rows in by_size.values() for row in rows))
    ratios = [(ratio, lambda ratio=ratio: cases.plates(plan.plates, ratio)) for ratio in plan.ratios]
    by_ratio = list(sweep(ratios, SWEPT, law=law, deadline=plan.sweep_deadline, before=before))
    cost_figure({"B3, mass ratio": by_ratio}, folder / "ratio.png", "mass ratio")
    _write(folder / "ratio.csv", by_ratio)

    page = folder / "README.md"
    text = "\n".join(_page(found, traced, runs, plan, law, command)) + "\n"
    write_whole({page: text.encode()}, own={page})
    made = ["objective", "convergence", "size", "ratio", "snapshots"]
    tables = ["objective", "summary", "curves", "size", "ratio"]
    return [*(folder / f"{name}.png" for name in made), *(folder / f"{name}.csv" for name in tables), page]


def _by_size(plan: Plan, law: str, before: Before) -> dict[str, list[dict[str, Any]]]:
    makers: dict[str, list[Callable[[], Case]]] = {
        "B1, network": [lambda n=n: cases.network(n) for n in plan.network_sizes],
        "B2, spheres": [lambda n=n: cases.spheres(n, plan.settle) for n in plan.sphere_sizes],
        "B3, plates": [lambda n=n: cases.plates(n) for n in plan.plate_sizes],
        "B4, bricks": [lambda n=n: cases.wall(*n) for n in plan.wall_sizes],
    }
    found = {}
    for title, sizes in makers.items():
        methods = SWEPT_BILATERAL if title.startswith("B1") else SWEPT
        listed = [(0.0, make) for make in sizes]
        rows = list(sweep(listed, methods, law=law, deadline=plan.sweep_deadline, before=before))
        found[title] = [row | {"value": row["bodies"]} for row in rows]
    return found


def steps(plan: Plan) -> int:
    """How often `reproduce` calls `before`."""
    sizes = (plan.network_sizes, plan.sphere_sizes, plan.plate_sizes, plan.wall_sizes, plan.ratios)
    return 3 + 4 * len(single_methods()) + sum(map(len, sizes))


def _objective_rows(found: Trace) -> Iterable[dict[str, Any]]:
    kept = zip(found.objectives.tolist(), found.residuals.tolist(), strict=True)
    fallback = dict(zip(found.stops.tolist(), kept, strict=True))
    for record in found.history:
        k = int(record["iteration"])
        yield {
            "iteration": k,
            "objective": float(record["objective"]),
            "residual": float(record["residual"]),
            "fallback_objective": fallback.get(k, ("", ""))[0],
            "fallback_residual": fallback.get(k, ("", ""))[1],
        }


def _write(path: Path, rows: Iterable[dict[str, Any]]) -> None:
    rows = list(rows)
    write_whole({path: csv_bytes(list(rows[0]) if rows else [], (row.values() for row in rows))}, own={path})


def _page(
    found: Sequence[Case], traced: Trace, runs: Sequence[Run], plan: Plan, law: str, command: str
) -> Iterable[str]:
    yield "# The benchmarks of the P-SPG-FB paper\n"
    yield f"Made by `{command}`, amontons {__version__}, {_machine()}."
    yield (
        f"Law `{law}`, one thread, {plan.deadline:g} s per method and problem; each is one time "
        "step of a scene, solved from zero impulses. Residuals are natural residuals, relative to that of "
        "zero impulses.\n"
    )
    yield "| | Step | Bodies | Rows | Contacts |\n|---|---|---|---|---|"
    for case in found:
        sizes = (case.bodies, case.problem.rows, case.problem.contacts)
        yield f"| {case.name} | {case.title} | {' | '.join(map(str, sizes))} |"
    yield "\n## Objective\n"
    yield (
        f"P-SPG-FB as published on B4 under impact: the line search is nonmonotone, the objective rises in "
        f"{traced.rises} of {len(traced.history) - 1} iterations. The fallback is the iterate that would be "
        "returned.\n"
    )
    yield "![Objective of the iterates and of the fallback](objective.png)\n"
    yield "## Residual\n"
    yield "Thick: the best residual so far, that of the vector a method returns; thin: that of the iterate.\n"
    yield "![Residual against iterations, products and time](convergence.png)\n"
    yield from _levels(runs)
    yield "\n## Size and mass ratio\n"
    yield f"Products and time until the residual is {LEVEL:g}, where a run that did not reach it within"
    yield f"{plan.sweep_deadline:g} s has an open circle; best residual after {PRODUCTS} products with A.\n"
    yield "![Cost against the number of bodies](size.png)\n"
    yield "![Cost against the mass ratio of the plates](ratio.png)\n"
    yield "## The wall\n"
    yield "![B4 before, in and after the impact](snapshots.png)\n"
    yield "Numbers: objective.csv, summary.csv and curves.csv (all runs), size.csv, ratio.csv."


def _levels(runs: Sequence[Run]) -> Iterable[str]:
    """Products and time to two levels, by problem and method."""
    yield "| Problem | Method | Status | Residual | Products to 1e-3 | ms | Products to 1e-6 | ms |"
    yield "|---|---|---|---:|---:|---:|---:|---:|"
    for run in runs:
        if run.solution is None:
            continue
        s = run.solution
        cells = [run.problem[:2], f"`{run.method}`", s.status, f"{s.residual:.1e}"]
        for level in (1e-3, 1e-6):
            at = first_below(run, level)
            cells += [str(at[0]), f"{1e3 * at[1]:.3g}"] if at else ["", ""]
        yield f"| {' | '.join(cells)} |"


def _machine() -> str:
    return f"{processor()}, Python {platform.python_version()}, NumPy {np.__version__}"
