"""Convergence figures."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from .comparison import Run, thinned
from .complete_files import save_figure
from .complete_files import title as plain
from .plotting import Axes, plt

ROWS_PER_FIGURE = 6
AXES = {"iterations": "iterations", "products": "products with A", "time": "time (ms)"}
FIELDS = {"iterations": "iteration", "products": "products"}
FLOOR = 1e-17  # where a residual of exactly zero is drawn
# One colour per method in every figure, distinguishable for most kinds of colour vision (Okabe, Ito 2008, and
# neutral companions); first-order methods are solid, Krylov dotted, factorising methods dashed.
STYLES: dict[str, tuple[str, str]] = {
    "auto": ("#d62728", "-."),
    "p-spg-fb": ("#d55e00", "-"),
    "p-spg-fb-literal": ("#e69f00", "-"),
    "apgd": ("#0072b2", "-"),
    "gauss-seidel": ("#009e73", "-"),
    "jacobi": ("#999999", "-"),
    "cg": ("#56b4e9", ":"),
    "minres": ("#000000", ":"),
    "interior-point": ("#5b2a86", "--"),
    "newton": ("#8c6d1f", "--"),
}


def convergence_figures(
    runs: Sequence[Run],
    folder: Path,
    *,
    tolerance: float,
    law: str,
    against: Sequence[str] = ("products", "time"),
) -> list[Path]:
    """Residual against products and against time, one row per problem; returns the PNG files in `folder`.

    against: the columns, of those of AXES.

    Thick lines are the best residual so far, which is that of the vector a method returns; thin lines the
    residual of the current iterate.
    """
    grouped = [(name, list(group)) for name, group in groupby(runs, key=lambda run: run.problem)]
    paths = []
    for start in range(0, len(grouped), ROWS_PER_FIGURE):
        page = start // ROWS_PER_FIGURE
        path = folder / ("convergence.png" if page == 0 else f"convergence-{page + 1}.png")
        _figure(grouped[start : start + ROWS_PER_FIGURE], path, tolerance, law, against)
        paths.append(path)
    return paths


def _figure(
    grouped: list[tuple[str, list[Run]]], path: Path, tolerance: float, law: str, against: Sequence[str]
) -> None:
    rows = len(grouped)
    figure, axes = plt.subplots(
        rows,
        len(against),
        figsize=(5.5 * len(against), 1.2 + 2.9 * rows),
        sharey="row",
        squeeze=False,
        layout="constrained",
    )
    handles: dict[str, Any] = {}
    for (name, runs), row in zip(grouped, axes, strict=True):
        lowest = 1.0
        for run in runs:
            if run.solution is not None and run.solution.history is not None and len(run.solution.history):
                handles[run.method] = _curves(row, run, against)
                lowest = min(lowest, float(run.solution.history["best_residual"][-1]))
        row[0].set_ylim(max(lowest, FLOOR) / 5, 10)
        for column, panel in enumerate(row):
            _decorate(panel, "" if column else name, "" if column else "residual", tolerance)
    for panel, what in zip(axes[-1], against, strict=True):
        panel.set_xlabel(AXES[what])
    order = [method for method in STYLES if method in handles]
    order += [method for method in handles if method not in order]
    figure.legend(
        [handles[method] for method in order],
        order,
        loc="outside upper center",
        ncols=min(5, max(1, len(order))),
        frameon=False,
        title=f"natural residual, law {law}",
    )
    save_figure(figure, path, 140)


def _curves(row: Sequence[Axes], run: Run, against: Sequence[str]) -> Any:
    assert run.solution is not None
    assert run.solution.history is not None
    history = thinned(run.solution.history)
    colour, line = STYLES.get(run.method, ("#444444", "-."))
    best = np.maximum(history["best_residual"], FLOOR)
    current = np.maximum(history["residual"], FLOOR)
    handle = None
    for axes, what in zip(row, against, strict=True):
        # The start has no product yet: it is drawn at a half, which a logarithmic axis can show.
        x = 1e3 * history["time"] if what == "time" else np.maximum(history[FIELDS[what]], 0.5)
        axes.plot(x, current, color=colour, linestyle=line, linewidth=0.6, alpha=0.35)
        (handle,) = axes.plot(x, best, color=colour, linestyle=line, linewidth=1.6)
        axes.plot(x[-1:], best[-1:], color=colour, marker="o", markersize=3)
    return handle


def _decorate(axes: Axes, title: str, label: str, tolerance: float) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(True, which="major", linewidth=0.4, alpha=0.5)
    if tolerance > 0:
        axes.axhline(tolerance, color="black", linewidth=0.6, linestyle=(0, (1, 2)))
    if title:
        axes.set_title(plain(title), loc="left", fontsize="medium")
    if label:
        axes.set_ylabel(label)
