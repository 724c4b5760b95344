"""Moments of a run side by side in one picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..model.model import Model
from .complete_files import save_figure
from .picture import Frame, Picture, View


def snapshots_figure(
    model: Model,
    frames: Sequence[Frame],
    path: Path,
    *,
    view: View | None = None,
    columns: int = 2,
    width: int = 1300,
) -> None:
    """The frames side by side in one PNG, `width` pixels wide, all with the same scale."""
    from .plotting import plt

    columns = min(columns, len(frames))
    rows = -(-len(frames) // columns)
    scene = Picture(model, view)
    panel = width // columns
    height = int(np.clip(panel / scene.proportion(frames), 0.3 * panel, 1.5 * panel))
    framing = scene.framing(frames, panel / height)
    figure, panels = plt.subplots(
        rows,
        columns,
        figsize=(width / 100, rows * (height / 100 + 0.25)),
        squeeze=False,
        layout="constrained",
    )
    for axes in panels.flat:
        axes.set_axis_off()
    for axes, frame in zip(panels.flat, frames, strict=False):
        axes.imshow(scene.draw(frame, framing, panel, height), interpolation="none")
        axes.set_title(f"t = {frame.time:.3g} s", loc="left", fontsize="medium")
    save_figure(figure, path, 100)
