"""Cost against error, a panel per scene; and the performance profile over all scenes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from common import shrink

COLOURS = {
    "amontons": "#c1272d", "mujoco": "#0072b2", "drake": "#8c6bb1", "dart": "#e69f00", "pybullet": "#009e73",
    "rapier": "#56b4e9", "newton": "#7f7f7f", "exudyn": "#000000",
}  # fmt: skip
LEAST, MOST = 1e-6, 1e4
"""mm: what is less is drawn here, and there what is more, or was lost on the way."""
COLUMNS = 4
ERRORS = (1e-3, 1e-4)
"""m: of the performance profile."""
Row = Mapping[str, Any]


def draw(rows: Sequence[Row], folder: Path) -> None:
    if rows:
        draw_scenes(rows, folder / "beside.png")
        draw_profile(rows, folder / "beside_profile.png")


def draw_scenes(rows: Sequence[Row], path: Path) -> None:
    """Open marks are default settings, filled ones tuned; nearer to the lower left is better in both."""
    scenes = list(dict.fromkeys(row["case"] for row in rows))
    lines = math.ceil(len(scenes) / COLUMNS)
    figure, panels = plt.subplots(
        lines, COLUMNS, figsize=(3.0 * COLUMNS, 2.3 * lines), squeeze=False, layout="constrained"
    )
    for axes in panels.flat[len(scenes) :]:
        axes.axis("off")
    for axes, scene in zip(panels.flat, scenes, strict=False):
        mine = [row for row in rows if row["case"] == scene]
        for engine in dict.fromkeys(row["engine"] for row in mine):
            line(axes, [row for row in mine if row["engine"] == engine])
        costs = [math.log10(1e3 * float(row["cost"])) for row in mine]
        # Whole decades: between them the labels of a logarithmic axis overlap.
        limits = 10 ** math.floor(min(costs)), 10 ** math.ceil(max(costs) + 1e-9)
        axes.set(xscale="log", yscale="log", ylim=(0.3 * LEAST, 3 * MOST), xlim=limits)
        axes.set_title(scene, fontsize=9)
        axes.tick_params(labelsize=7)
        axes.grid(True, alpha=0.25)
    for axes in panels[-1]:
        axes.set_xlabel("ms per simulated second", fontsize=8)
    for axes in panels[:, 0]:
        axes.set_ylabel("error (mm)", fontsize=8)
    legend(figure, rows)
    figure.savefig(path, dpi=80)
    plt.close(figure)
    shrink(path)


def legend(figure: Any, rows: Sequence[Row]) -> None:
    present = dict.fromkeys(row["family"] for row in rows)
    handles = [
        plt.Line2D([], [], marker="o", linestyle="", color=COLOURS[name], label=label(name))
        for name in COLOURS
        if name in present
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), fontsize=9, frameon=False)


def label(family: str) -> str:
    names = {"mujoco": "MuJoCo", "dart": "DART", "pybullet": "PyBullet", "newton": "Newton Kamino"}
    return names.get(family, family if family == "amontons" else family.capitalize())


def line(axes: Any, rows: Sequence[Row]) -> None:
    """A setting with its steps, joined."""
    colour, tuned = COLOURS[rows[0]["family"]], str(rows[0]["tuned"]) == "True"
    rows = sorted(rows, key=lambda r: float(r["cost"]))
    points = [(1e3 * float(r["cost"]), min(max(1e3 * error(r), LEAST), MOST)) for r in rows]
    axes.plot(*zip(*points, strict=True), "-", color=colour, linewidth=0.7, alpha=0.6)
    for (x, y), r in zip(points, rows, strict=True):
        axes.plot(x, y, "o" if finished(r) else "x", color=colour, markersize=4.5, markeredgewidth=1.1,
                  markerfacecolor=colour if tuned else "none")  # fmt: skip


def finished(row: Row) -> bool:
    return str(row["complete"]) == "True" and str(row["lost"]) == "False"


def error(row: Row) -> float:
    """The length that is off (m); infinite if the run was not finished."""
    found = float(row["off"])
    return found if math.isfinite(found) and str(row["lost"]) == "False" else math.inf


def profile(rows: Sequence[Row], family: str, bound: float) -> list[float]:
    """Of each scene where any engine stays below the error: the least cost of a family that does (s per
    simulated second), infinite where none of its settings does."""
    scenes = {r["scene"] for r in rows if finished(r) and error(r) <= bound}
    found = []
    for scene in sorted(scenes):
        costs = [
            float(r["cost"])
            for r in rows
            if (r["scene"], r["family"]) == (scene, family) and finished(r) and error(r) <= bound
        ]
        found.append(min(costs, default=math.inf))
    return found


def draw_profile(rows: Sequence[Row], path: Path) -> None:
    figure, panels = plt.subplots(1, len(ERRORS), figsize=(10, 3.4), sharey=True, layout="constrained")
    for axes, bound in zip(panels, ERRORS, strict=True):
        for family in [f for f in COLOURS if any(r["family"] == f for r in rows)]:
            costs = np.sort(profile(rows, family, bound))
            share = np.arange(1, len(costs) + 1) / max(1, len(costs))
            kept = np.isfinite(costs)
            axes.step([*(1e3 * costs[kept]), 1e5], [*share[kept], share[kept][-1] if kept.any() else 0],
                      where="post", color=COLOURS[family])  # fmt: skip
        axes.set(xscale="log", xlim=(1e-1, 1e5), ylim=(0, 1.02), xlabel="ms per simulated second")
        axes.set_title(f"error below {1e3 * bound:g} mm", fontsize=9)
        axes.grid(True, alpha=0.25)
    panels[0].set_ylabel("part of the scenes")
    legend(figure, rows)
    figure.savefig(path, dpi=90)
    plt.close(figure)
    shrink(path)
