"""The figures of the documents, views of the tables of a folder of results.

    python benchmarks/figures.py [FOLDER] [--figures FOLDER] [--only NAME ...]

growth, profile and beside_profile read a CSV file. convergence (`amontons compare`) and arch (an example) run
the programs that their pages name. Methods and engines have one colour each in all of them.
"""

from __future__ import annotations

import argparse
import math
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from amontons.report.figures import STYLES
from common import EXAMPLES, FIGURES, ROOT, TABLES, shrink
from matplotlib.ticker import LogLocator, NullFormatter
from views import Results, by_task, over_best

Row = Mapping[str, Any]
COLOURS = {
    "amontons": "#c1272d", "mujoco": "#0072b2", "drake": "#8c6bb1", "dart": "#e69f00", "pybullet": "#009e73",
    "rapier": "#56b4e9", "newton": "#7f7f7f", "exudyn": "#000000",
}  # fmt: skip
LINES = {"amontons, 1e-6": (COLOURS["amontons"], "o", "-"), "amontons, 1e-3": ("#e58a8d", "v", "-"),
         "MuJoCo": (COLOURS["mujoco"], "s", "-")}  # fmt: skip
"""Colour, marker and line of the engines whose growth is drawn."""
SIZES = {"wall, rows": "rows of 10 bricks", "plates 1:100": "plates",
         "20 plates, mass ratio": "mass ratio", "chain, links": "links",
         "chain of 40, mass ratio": "mass ratio", "spheres in a box": "spheres"}  # fmt: skip
COMPARED = ("lattice", "plates", "wall_impact")
"""Problems of examples/problems that convergence.png shows."""
LARGEST = 30
"""times the time of the fastest: where the profile ends"""
ERRORS = (1e-3, 1e-4)
"""m: of the performance profile of engines."""


def save(path: Path, dpi: int = 100) -> None:
    plt.savefig(path, dpi=dpi, facecolor="white")
    plt.close()
    shrink(path)


def growth(rows: Sequence[Row], path: Path) -> None:
    """The time of a step over the size: a panel per family, at least a decade high, with one legend."""
    figure, panels = plt.subplots(2, 3, figsize=(10, 6), layout="constrained")
    for axes, (family, size) in zip(panels.flat, SIZES.items(), strict=True):
        times = []
        for engine, (colour, marker, line) in LINES.items():
            mine = [r for r in rows if (r["task"], r["method"]) == (family, engine) and r["time"]]
            found = [1e3 * float(r["time"]) for r in mine]
            axes.plot([float(r["size"]) for r in mine], found, color=colour, marker=marker, linestyle=line,
                      markersize=4, linewidth=1.4, label=engine)  # fmt: skip
            times += found
        axes.set(xscale="log", yscale="log", xlabel=size)
        if times:
            low, high = np.log10(0.8 * min(times)), np.log10(1.25 * max(times))
            axes.set_ylim(10 ** np.floor(low), 10 ** np.ceil(high))
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(numticks=9))
            axis.set_minor_formatter(NullFormatter())
        axes.set_title(family.split(",")[0], fontsize=10)
        axes.grid(True, alpha=0.25)
    for axes in panels[:, 0]:
        axes.set_ylabel("time of a step (ms)")
    figure.legend(
        *panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False
    )
    save(path)


def profile(rows: Sequence[Row], path: Path) -> None:
    """For each method the share of all solves that anyone does within a multiple of the fastest time."""
    plt.figure(figsize=(6.5, 4), layout="constrained")
    for method, ratios in over_best(rows).items():
        colour, line = STYLES[method]
        steps(ratios, plt, [1], 1e3, label=method, color=colour,
              linestyle="-" if method == "auto" else line,
              linewidth=2.4 if method == "auto" else 1.3)  # fmt: skip
    plt.xscale("log")
    plt.xlim(1, LARGEST)
    plt.ylim(0, 1.01)
    plt.xticks([1, 2, 5, 10, 20], ["1", "2", "5", "10", "20"])
    plt.xlabel("time / fastest")
    plt.ylabel("share of solves")
    plt.grid(True, alpha=0.25)
    plt.legend(loc="center left", bbox_to_anchor=(1, 0.5), frameon=False)
    save(path)


def steps(costs: Sequence[float], axes: Any, first: list[float], last: float, **style: Any) -> None:
    """The share of the costs that are at most so large, from those on that no cost is below."""
    kept = np.sort([cost for cost in costs if math.isfinite(cost)])
    share = [0] * len(first) + [*(np.arange(1, len(kept) + 1) / max(1, len(costs)))]
    axes.step([*first, *kept, last], [*share, share[-1] if share else 0], where="post", **style)


def beside(rows: Sequence[Row], path: Path) -> None:
    """For each engine the share of the scenes in which it stays below an error within a cost (ms per
    simulated second): of those in which any engine does."""
    rows = [row for row in rows if str(row["error"]) != ""]
    if not rows:
        return
    figure, panels = plt.subplots(1, len(ERRORS), figsize=(10, 3.8), sharey=True, layout="constrained")
    ran = {name: {r["task"] for r in rows if r["family"] == name} for name in COLOURS}
    for axes, bound in zip(panels, ERRORS, strict=True):
        done = [r for r in rows if finished(r) and error(r) <= bound]
        costs = by_task(done, method="family", time="cost").values()
        for family in filter(ran.get, COLOURS):
            found = [1e3 * cost.get(family, math.inf) for cost in costs]
            steps(found, axes, [], 1e5, color=COLOURS[family])
        axes.set(xscale="log", xlim=(1e-1, 1e5), ylim=(0, 1.02), xlabel="ms per simulated second")
        axes.set_title(f"error below {1e3 * bound:g} mm", fontsize=9)
        axes.grid(True, alpha=0.25)
    panels[0].set_ylabel("share of the scenes")
    # An engine lacks the joints or shapes of some scenes.
    count = len(set().union(*ran.values()))
    handles = [
        plt.Line2D([], [], color=COLOURS[name], label=f"{label(name)}: ran {len(scenes)} of {count}")
        for name, scenes in ran.items()
        if scenes
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, fontsize=9, frameon=False)
    save(path, dpi=90)


def label(family: str) -> str:
    names = {"mujoco": "MuJoCo", "dart": "DART", "pybullet": "PyBullet", "newton": "Newton Kamino"}
    return names.get(family, family if family == "amontons" else family.capitalize())


def finished(row: Row) -> bool:
    return str(row["complete"]) == "True" and str(row["lost"]) == "False"


def error(row: Row) -> float:
    """The length that is off (m); infinite if the run was not finished, 0 where the scene has no answer."""
    found = float(row["error"] or 0)
    return found if math.isfinite(found) and str(row["lost"]) == "False" else math.inf


def convergence(path: Path) -> None:
    """All methods on three problems of the examples, under the default law."""
    files = [EXAMPLES / f"{name}.hdf5" for name in COMPARED]
    made_by(["-m", "amontons", "compare", *files, "--law", "coulomb", "--out", "."], "convergence.png", path)


def arch(path: Path) -> None:
    made_by([ROOT / "examples" / "arch_friction.py"], "arch.png", path)


def made_by(words: Sequence[str | Path], name: str, path: Path) -> None:
    """What a Python program leaves under a name in its folder."""
    with TemporaryDirectory() as folder:
        subprocess.run([sys.executable, *words], cwd=folder)
        shutil.copy(Path(folder) / name, path)
    shrink(path)


VIEWS: dict[str, tuple[str, Callable[[Sequence[Row], Path], None]]] = {
    "growth": ("growth", growth), "profile": ("profile", profile), "beside_profile": ("beside", beside),
}  # fmt: skip
"""By name: the table, and what draws it."""
RUNS: dict[str, Callable[[Path], None]] = {"convergence": convergence, "arch": arch}


def draw(folder: Path, figures: Path, only: Sequence[str] = tuple(VIEWS)) -> None:
    """What the tables of the folder show, and what is asked for by name."""
    results = Results(folder)
    for name in only:
        if name in RUNS:
            RUNS[name](figures / f"{name}.png")
        elif rows := results[VIEWS[name][0]]:
            VIEWS[name][1](rows, figures / f"{name}.png")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", default=TABLES)
    parser.add_argument("--figures", type=Path, default=FIGURES)
    names = [*VIEWS, *RUNS]
    parser.add_argument(
        "--only", nargs="+", choices=names, default=names, metavar="NAME", help=" ".join(names)
    )
    options = parser.parse_args()
    draw(options.folder, options.figures, options.only)


if __name__ == "__main__":
    main()
