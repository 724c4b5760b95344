"""The figures of the reference paper."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from amontons.report.complete_files import save_figure
from amontons.report.figures import STYLES
from amontons.report.plotting import Axes, NullFormatter, plt

from .measure import LEVEL, PRODUCTS, Trace


def objective_figure(found: Trace, path: Path, title: str) -> None:
    """Objective and residual of the iterates, which rise and fall, and those of the fallback."""
    figure, panels = plt.subplots(1, 2, figsize=(12, 4.5), layout="constrained")
    history = found.history[1:]
    floor = 1e-16 * (abs(found.optimum) or 1.0)
    orange, _ = STYLES["p-spg-fb-literal"]
    iterates = (np.maximum(history["objective"] - found.optimum, floor), history["residual"])
    fallback = (np.maximum(found.objectives - found.optimum, floor), found.residuals)
    labels = ("objective above its minimum (J)", "natural residual")
    for axes, mine, kept, label in zip(panels, iterates, fallback, labels, strict=True):
        axes.plot(history["iteration"], mine, color=orange, linewidth=0.8, label="iterates")
        axes.plot(found.stops, kept, "k.-", linewidth=1, markersize=4, label="fallback, if stopped here")
        axes.set(xlabel="iteration", ylabel=label, yscale="log", xscale="log")
        axes.grid(True, linewidth=0.4, alpha=0.5)
        axes.legend(frameon=False)
    figure.suptitle(
        f"{title}: the objective rises in {found.rises} of {len(history)} iterations", x=0.01, ha="left"
    )
    save_figure(figure, path, 120)


def cost_figure(groups: dict[str, list[dict[str, Any]]], path: Path, label: str) -> None:
    """Rows of sweeps by title, against `value`: products and time to LEVEL, the residual after PRODUCTS."""
    figure, panels = plt.subplots(
        len(groups), 3, figsize=(13, 0.8 + 3 * len(groups)), squeeze=False, layout="constrained"
    )
    handles: dict[str, Any] = {}
    for (title, rows), axes in zip(groups.items(), panels, strict=True):
        for method in dict.fromkeys(row["method"] for row in rows):
            mine = [row for row in rows if row["method"] == method and row["status"] != "not applicable"]
            if mine:
                handles[method] = _curves(axes, mine, method)
        whats = (f"products to {LEVEL:g}", f"time (ms) to {LEVEL:g}", f"residual after {PRODUCTS} products")
        for each, what in zip(axes, whats, strict=True):
            each.set(xscale="log", yscale="log")
            each.set_title(f"{title}: {what}", loc="left", fontsize="medium")
            each.xaxis.set_minor_formatter(NullFormatter())
            each.grid(True, which="major", linewidth=0.4, alpha=0.5)
    for each in panels[-1]:
        each.set_xlabel(label)
    figure.legend(handles.values(), handles, loc="outside upper center", ncols=7, frameon=False)
    save_figure(figure, path, 120)


def _curves(axes: Sequence[Axes], rows: list[dict[str, Any]], method: str) -> Any:
    colour, line = STYLES.get(method, ("#444444", "-."))
    value = np.array([row["value"] for row in rows], dtype=float)
    reached = np.array([row["reached"] for row in rows])
    columns = (
        [max(row["products"], 1) for row in rows],
        [1e3 * max(row["time"], 1e-6) for row in rows],
        [max(row["residual"], 1e-17) for row in rows],
    )
    handle = None
    for k, (each, values) in enumerate(zip(axes, columns, strict=True)):
        y = np.array(values, dtype=float)
        (handle,) = each.plot(value, y, color=colour, linestyle=line, linewidth=1.3, marker="o", markersize=3)
        if k < 2:  # open: the run ended before it reached the level
            each.plot(value[~reached], y[~reached], "o", markersize=5, color=colour, markerfacecolor="white")
    return handle
