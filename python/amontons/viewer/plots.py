"""Curves of the last steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import Array
from .events import Post, on_user
from .runs import SERIES, LiveRun, ReplayRun

if TYPE_CHECKING:
    import viser

COLOURS = ("", "#c2413a", "#3a6fb0", "#3d8a4a", "#8a5fb0", "#b07a2a")
LOGARITHMIC = {"residual", "real-time factor"}
SHOWN = ("residual", "real-time factor")
"""Which are drawn from the start."""
SMALLEST = 1e-16


class Plots:
    """One plot per quantity, each with a switch; those that are off cost nothing."""

    def __init__(self, server: viser.ViserServer, run: LiveRun | ReplayRun, post: Post) -> None:
        self._run, self._gui = run, server.gui
        self._plots: dict[str, Any] = {}
        self._wanted: dict[str, bool] = {}
        empty = np.zeros((0, len(SERIES)))
        with server.gui.add_folder("Plots", expand_by_default=False):
            for name in SERIES[1:]:
                self._wanted[name] = name in SHOWN
                box = server.gui.add_checkbox(name.capitalize(), self._wanted[name])
                self._plots[name] = self._add(name, empty)
                on_user(box, lambda v, name=name: post(lambda: self._switch(name, v)))

    def show(self) -> None:
        """Curves up to now."""
        if not any(self._wanted.values()):
            return
        history = self._run.history
        for name, plot in self._plots.items():
            if self._wanted[name]:
                plot.data = columns(history, name)

    def _switch(self, name: str, wanted: bool) -> None:
        self._wanted[name] = wanted
        self._plots[name].visible = wanted

    def _add(self, name: str, history: Array) -> Any:
        return self._gui.add_uplot(
            columns(history, name),
            (
                {"label": "t"},
                {"label": name, "stroke": COLOURS[SERIES.index(name)], "width": 1.5},
            ),
            title=f"log10 {name}" if name in LOGARITHMIC else name,
            scales={"x": {"time": False}},
            height=150,
            legend={"show": False},
            visible=self._wanted[name],
        )


def columns(history: Array, name: str) -> tuple[Array, Array]:
    """Time and the quantity, of some its decimal logarithm."""
    values = history[:, SERIES.index(name)]
    if name in LOGARITHMIC:
        values = np.log10(np.maximum(values, SMALLEST))
    return np.ascontiguousarray(history[:, 0]), np.ascontiguousarray(values, dtype=np.float64)
