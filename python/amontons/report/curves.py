"""Columns of a recording over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from .complete_files import save_figure
from .complete_files import title as plain
from .plotting import Axes, plt

if TYPE_CHECKING:
    from ..io.recordings.columns import Column

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Distinguishable for most kinds of colour vision (Okabe, Ito 2008)."""
NAMED = 12
"""Lines of a panel that a legend names; more are too many to tell apart."""


def curves_figure(columns: Sequence[Column], path: Path, *, title: str) -> None:
    """One panel for each unit, one line for each column (PNG, PDF, SVG by the suffix)."""
    units = list(dict.fromkeys(column.unit for column in columns))
    figure, panels = plt.subplots(
        len(units), 1, figsize=(8, 1.2 + 2.6 * len(units)), sharex=True, squeeze=False, layout="constrained"
    )
    figure.suptitle(plain(title), x=0.01, ha="left", fontsize="medium")
    for axes, unit in zip(panels[:, 0], units, strict=True):
        _panel(axes, [column for column in columns if column.unit == unit], unit)
    panels[-1, 0].set_xlabel("simulated time (s)")
    save_figure(figure, path, 110, own=False)


def _panel(axes: Axes, columns: Sequence[Column], unit: str) -> None:
    for k, column in enumerate(columns):
        style = dict(color=COLOURS[k % len(COLOURS)], linewidth=1.2, label=plain(column.name))
        axes.plot(column.times, column.values, **style)
    axes.set_ylabel(unit)
    axes.grid(True, linewidth=0.4, alpha=0.5)
    if len(columns) == 1:
        axes.set_title(plain(columns[0].name), loc="left", fontsize="medium")
    elif len(columns) <= NAMED:
        axes.legend(frameon=False, fontsize="small")
    else:
        axes.set_title(f"{len(columns)} columns", loc="left", fontsize="medium")
