"""Cost of a step against what is off, a panel per scene."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from common import shrink

COLOURS = {"amontons": "#c1272d", "MuJoCo": "#0072b2", "PyBullet": "#009e73", "Drake": "#8c6bb1"}
LEAST, MOST = 1e-6, 1e4
"""mm: what is less is drawn here, and there what is more, or was lost on the way."""
COLUMNS = 4


def draw(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Open marks are default settings, filled ones tuned; nearer to the lower left is better in both."""
    cases = list(dict.fromkeys(row["case"] for row in rows))
    lines = math.ceil(len(cases) / COLUMNS)
    figure, panels = plt.subplots(
        lines, COLUMNS, figsize=(3.0 * COLUMNS, 2.4 * lines), squeeze=False, layout="constrained"
    )
    for axes in panels.flat[len(cases) :]:
        axes.axis("off")
    for axes, case in zip(panels.flat, cases, strict=False):
        for row in rows:
            if row["case"] == case:
                mark(axes, row)
        costs = [math.log10(1e6 * float(row["step"])) for row in rows if row["case"] == case]
        # Whole decades: between them the labels of a logarithmic axis overlap.
        limits = 10 ** math.floor(min(costs)), 10 ** math.ceil(max(costs) + 1e-9)
        axes.set(xscale="log", yscale="log", ylim=(0.3 * LEAST, 3 * MOST), xlim=limits)
        axes.set_title(case, fontsize=9)
        axes.tick_params(labelsize=7)
        axes.grid(True, alpha=0.25)
    for axes in panels[-1]:
        axes.set_xlabel("us a step", fontsize=8)
    for axes in panels[:, 0]:
        axes.set_ylabel("off (mm)", fontsize=8)
    present = {name.split(",")[0] for name in (row["engine"] for row in rows)}
    handles = [
        plt.Line2D([], [], marker="o", linestyle="", color=colour, label=name)
        for name, colour in COLOURS.items()
        if name in present
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, fontsize=9, frameon=False)
    figure.savefig(path, dpi=90)
    plt.close(figure)
    shrink(path)


def mark(axes: Any, row: Mapping[str, Any]) -> None:
    colour = COLOURS[row["engine"].split(",")[0]]
    tuned, lost = str(row["tuned"]) == "True", str(row["lost"]) == "True"
    off = MOST if lost else min(max(1e3 * float(row["off"]), LEAST), MOST)
    axes.plot(
        1e6 * float(row["step"]), off, "x" if lost else "o", color=colour, markersize=7,
        markerfacecolor=colour if tuned else "none", markeredgewidth=1.5,
    )  # fmt: skip
