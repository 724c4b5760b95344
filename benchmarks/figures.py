"""The figures of the documents, views of the tables of a folder of results.

    python benchmarks/figures.py [FOLDER] [--figures FOLDER] [--only NAME ...]

growth, profile and beside_profile read a CSV file. convergence (`amontons compare`) and arch (an example) run
the programs that their pages name. Methods and engines have one colour each in all of them.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
from amontons.report.figures import STYLES
from beside import figure as engines
from common import EXAMPLES, FIGURES, ROOT, TABLES, shrink
from matplotlib.ticker import LogLocator, NullFormatter
from targets import PROFILE_KEYS, ratio
from views import Results

Row = dict[str, str]
LINES = {"amontons, 1e-6": ("#c1272d", "o", "-"), "amontons, 1e-3": ("#e58a8d", "v", "-"),
         "MuJoCo": (engines.COLOURS["mujoco"], "s", "-")}  # fmt: skip
"""Colour, marker and line of the engines whose growth is drawn."""
SIZES = {"wall, rows": "rows of 10 bricks", "plates 1:100": "plates",
         "20 plates, mass ratio": "mass ratio", "chain, links": "links",
         "chain of 40, mass ratio": "mass ratio", "spheres in a box": "spheres"}  # fmt: skip
COMPARED = ("lattice", "plates", "wall_impact")
"""Problems of examples/problems that convergence.png shows."""
LARGEST = 30
"""times the time of the fastest: where the profile ends"""


def save(path: Path) -> None:
    plt.savefig(path, dpi=100, facecolor="white")
    plt.close()
    shrink(path)


def growth(rows: Sequence[Row], path: Path) -> None:
    """The time of a step over the size: a panel per family, at least a decade high, with one legend."""
    figure, panels = plt.subplots(2, 3, figsize=(10, 6), layout="constrained")
    for axes, (family, size) in zip(panels.flat, SIZES.items(), strict=True):
        times = []
        for engine, (colour, marker, line) in LINES.items():
            mine = [r for r in rows if (r["family"], r["engine"]) == (family, engine) and r["step"]]
            found = [1e3 * float(r["step"]) for r in mine]
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
    methods = [key for key in rows[0] if key not in PROFILE_KEYS] + ["auto"]
    solved = [row for row in rows if any(row[method] for method in methods)]
    plt.figure(figsize=(6.5, 4), layout="constrained")
    for method in methods:
        ratios = np.sort([ratio(row, method, methods) for row in solved])
        ratios = ratios[np.isfinite(ratios)]
        share = np.arange(1, len(ratios) + 1) / max(1, len(solved))
        colour, line = STYLES[method]
        plt.step([1, *ratios, 1e3], [0, *share, share[-1] if len(share) else 0], where="post", label=method,
                 color=colour, linestyle="-" if method == "auto" else line,
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


def convergence(path: Path) -> None:
    """All methods on three problems of the examples, under the default law."""
    files = [EXAMPLES / f"{name}.hdf5" for name in COMPARED]
    with TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, "-m", "amontons", "compare", *files, "--law", "coulomb", "--out", folder]
        )
        shutil.copy(Path(folder) / "convergence.png", path)
    shrink(path)


def arch(path: Path) -> None:
    """The picture of examples/arch_friction.py."""
    with TemporaryDirectory() as folder:
        subprocess.run([sys.executable, ROOT / "examples" / "arch_friction.py"], cwd=folder, check=True)
        shutil.copy(Path(folder) / "arch.png", path)
    shrink(path)


VIEWS: dict[str, Callable[[Sequence[Row], Path], None]] = {"growth": growth, "profile": profile}
RUNS: dict[str, Callable[[Path], None]] = {"convergence": convergence, "arch": arch}


def draw(folder: Path, figures: Path, only: Sequence[str] = ()) -> None:
    """What the tables of the folder show, and what is asked for by name."""
    results = Results(folder)
    for name, view in VIEWS.items():
        if name in (only or VIEWS) and results[name]:
            view(results[name], figures / f"{name}.png")
    if not only or "beside_profile" in only:
        engines.draw(results["beside"], figures)
    for name, make in RUNS.items():
        if name in only:
            make(figures / f"{name}.png")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", default=TABLES)
    parser.add_argument("--figures", type=Path, default=FIGURES)
    names = [*VIEWS, "beside_profile", *RUNS]
    parser.add_argument(
        "--only", nargs="+", choices=names, default=names, metavar="NAME", help=" ".join(names)
    )
    options = parser.parse_args()
    draw(options.folder, options.figures, options.only)


if __name__ == "__main__":
    main()
