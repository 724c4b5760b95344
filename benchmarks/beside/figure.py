"""The performance profile over all scenes."""

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
ERRORS = (1e-3, 1e-4)
"""m: of the performance profile."""
Row = Mapping[str, Any]


def legend(figure: Any, rows: Sequence[Row]) -> None:
    """A colour per engine, and how many of the scenes it ran: it lacks the joints or shapes of the others."""
    scenes = {family: {r["scene"] for r in rows if r["family"] == family} for family in COLOURS}
    count = len(set().union(*scenes.values()))
    handles = [
        plt.Line2D([], [], color=COLOURS[name], label=f"{label(name)}: ran {len(ran)} of {count}")
        for name, ran in scenes.items()
        if ran
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, fontsize=9, frameon=False)


def label(family: str) -> str:
    names = {"mujoco": "MuJoCo", "dart": "DART", "pybullet": "PyBullet", "newton": "Newton Kamino"}
    return names.get(family, family if family == "amontons" else family.capitalize())


def finished(row: Row) -> bool:
    return str(row["complete"]) == "True" and str(row["lost"]) == "False"


def judged(rows: Sequence[Row]) -> list[Row]:
    """The rows of scenes that have an error."""
    return [row for row in rows if str(row["off"]) != ""]


def error(row: Row) -> float:
    """The length that is off (m); infinite if the run was not finished, 0 where the scene has no answer."""
    found = float(row["off"] or 0)
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


def draw(rows: Sequence[Row], folder: Path) -> None:
    rows, path = judged(rows), folder / "beside_profile.png"
    if not rows:
        return
    figure, panels = plt.subplots(1, len(ERRORS), figsize=(10, 3.8), sharey=True, layout="constrained")
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
    panels[0].set_ylabel("share of the scenes")
    legend(figure, rows)
    figure.savefig(path, dpi=90)
    plt.close(figure)
    shrink(path)
