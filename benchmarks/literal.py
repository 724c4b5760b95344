"""P-SPG-FB as published: nonmonotone objective, monotone fallback, near Krylov methods on bilateral problems.

    python benchmarks/literal.py [--quick] [--data FOLDER] [--out FOLDER] [--figures FOLDER]

literal_summary.csv: how often and how far the objective rises, whether the residual of the vector that would
be returned falls. literal_fallback.csv: that vector, x_FB, after so many iterations. literal_curves.csv:
objective and residual of the iterates on two walls, thinned. literal_bilateral.csv: products and time to 1e-3
and 1e-6 of both variants, CG and MINRES on a network of joints. paper.png draws all of it. Where the data
folder is absent, the problems that ship with the repository stand in.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import amontons
import numpy as np
from amontons.report.comparison import thinned
from amontons.report.figures import STYLES
from common import EXAMPLES, arguments, read, shrink, use_one_core, with_folders, write_csv
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from steps import first_at

ITERATIONS, QUICK_ITERATIONS = 1000, 200
TOLERANCE = 1e-8
STOPS = 40
CURVE_ROWS = 300
BILATERAL = ("p-spg-fb-literal", "p-spg-fb", "cg", "minres")
SCENES = ("B4_s60", "B4_impact+5", "B3_s10", "B3T_s10", "B1_s30")
STAND_INS = ("wall_at_rest", "wall_impact", "plates", "lattice")


@dataclass
class Trace:
    """What the literal variant does on one problem."""

    name: str
    optimum: float
    """objective of a solution (J)"""
    history: np.ndarray
    returned: list[dict[str, Any]] = field(default_factory=list)
    """iterations, objective and residual of the vector returned when the method is stopped there"""


def literal(problem: amontons.Problem, iterations: int) -> np.ndarray:
    s = problem.solve(
        law="associated",
        method="p-spg-fb-literal",
        tolerance=TOLERANCE,
        max_iterations=iterations,
        history=True,
    )
    assert s.history is not None
    return s.history


def trace(name: str, problem: amontons.Problem, iterations: int) -> Trace:
    found = Trace(
        name, problem.solve(law="associated", tolerance=1e-6).objective, literal(problem, iterations)
    )
    for stop in np.unique(np.geomspace(1, iterations, STOPS).round().astype(int)):
        s = problem.solve(
            law="associated", method="p-spg-fb-literal", tolerance=TOLERANCE, max_iterations=int(stop)
        )
        row = {"problem": name, "iterations": int(stop), "objective": s.objective, "residual": s.residual}
        found.returned.append(row)
    return found


def summary(found: Trace) -> dict[str, Any]:
    history, rise = found.history, np.diff(found.history["objective"])
    returned = [row["residual"] for row in found.returned]
    return {
        "problem": found.name,
        "iterations": len(history) - 1,
        "residual": returned[-1],
        "rises": int((rise > 0).sum()),
        "largest_rise": float(max(rise.max(), 0) / np.ptp(history["objective"])),
        "rises_of_residual": int((np.diff(history["residual"]) > 0).sum()),
        "backtracks": int(history["backtracks"].sum()),
        # Of the vectors actually returned; the running minimum in the history is monotone in any case.
        "fallback_monotone": bool((np.diff(returned) <= 0).all()),
    }


def bilateral(problem: amontons.Problem, name: str) -> tuple[list[dict[str, Any]], dict[str, np.ndarray]]:
    rows, histories = [], {}
    for method in BILATERAL:
        for _ in range(2):  # the first run warms up
            s = problem.solve(method=method, tolerance=TOLERANCE, history=True, deadline=20.0)
        assert s.history is not None
        histories[method] = s.history
        row: dict[str, Any] = {"problem": name, "method": method, "status": s.status, "residual": s.residual}
        for level in (1e-3, 1e-6):
            products, time = first_at(s.history, level)
            row |= {f"products_{level:.0e}": products, f"time_{level:.0e}": time}
        rows.append(row)
    return rows, histories


def draw(path: Path, walls: list[Trace], network: str, histories: dict[str, np.ndarray]) -> None:
    figure, panels = plt.subplots(2, 2, figsize=(11, 7), layout="constrained")
    for axes, wall in zip(panels[0], walls, strict=True):
        _iterates(axes, wall, "objective", wall.optimum)
        _label(axes, f"{wall.name}: objective above its minimum (J)", "iterations")
    _iterates(panels[1, 0], walls[-1], "residual", 0.0)
    _label(panels[1, 0], f"{walls[-1].name}: residual", "iterations")
    krylov = panels[1, 1]
    for method, history in histories.items():
        colour, line = STYLES[method]
        h = thinned(history)
        krylov.plot(h["products"], h["residual"], color=colour, linestyle=line, linewidth=0.5, alpha=0.5)
        krylov.plot(h["products"], h["best_residual"], color=colour, linestyle=line, label=method)
    krylov.axhline(1e-3, color="black", linewidth=0.6, linestyle=(0, (1, 2)))
    _label(krylov, f"{network}: residual", "products with A")
    figure.savefig(path, dpi=110)
    plt.close(figure)
    shrink(path)


def _iterates(axes: Axes, wall: Trace, what: str, zero: float) -> None:
    orange, _ = STYLES["p-spg-fb-literal"]
    h = wall.history[1:]
    axes.plot(h["iteration"], h[what] - zero, color=orange, linewidth=0.8, label="iterates")
    stopped = [row["iterations"] for row in wall.returned]
    returned = [row[what] - zero for row in wall.returned]
    axes.plot(stopped, returned, "k.-", linewidth=0.8, markersize=4, label="fallback, if stopped here")
    axes.set_xscale("log")


def _label(axes: Axes, title: str, x: str) -> None:
    axes.set_yscale("log")
    axes.set_title(title, loc="left", fontsize="medium")
    axes.set_xlabel(x)
    axes.grid(True, linewidth=0.4, alpha=0.5)
    axes.legend(frameon=False, fontsize="small")


def main() -> None:
    options = with_folders(arguments(__doc__).parse_args())
    use_one_core()
    folder, names = options.data / "chrono", SCENES
    if not (folder / f"{SCENES[0]}.hdf5").exists():
        print(f"literal: no {SCENES[0]}.hdf5 in {folder}; the problems in examples/problems stand in")
        folder, names = EXAMPLES, STAND_INS
    iterations = QUICK_ITERATIONS if options.quick else ITERATIONS
    problems = {name: read(folder / f"{name}.hdf5") for name in names}
    traces = [trace(name, problem, iterations) for name, problem in problems.items()]
    walls = traces[:2]
    network = names[-1]
    rows, histories = bilateral(problems[network], network)
    summaries = [summary(found) for found in traces]
    columns = ("iteration", "products", "objective", "residual", "best_residual", "step", "backtracks")
    curves = [
        {"problem": t.name} | {c: r[c].item() for c in columns}
        for t in walls
        for r in thinned(t.history, CURVE_ROWS)
    ]
    write_csv(options.out / "literal_curves.csv", curves)
    write_csv(options.out / "literal_fallback.csv", [row for t in traces for row in t.returned])
    write_csv(options.out / "literal_summary.csv", summaries)
    write_csv(options.out / "literal_bilateral.csv", rows)
    draw(options.figures / "paper.png", walls, network, histories)
    for row in summaries:
        print(
            f"literal: {row['problem']}: the objective rises in {row['rises']} of {row['iterations']} "
            f"iterations, by up to {100 * row['largest_rise']:.2g} % of its range; the residual "
            f"of the fallback is {'monotone' if row['fallback_monotone'] else 'NOT monotone'}"
        )
    counts = ", ".join(f"{row['method']} {row['products_1e-03']}" for row in rows)
    print(f"literal: {network}, products to 1e-3: {counts}")


if __name__ == "__main__":
    main()
