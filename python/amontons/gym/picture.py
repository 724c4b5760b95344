"""Pictures of environments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..model.model import Model
from ..report.picture import Picture, View, frame_of
from ..simulation.simulation import Simulation

ROOM = 1.5
"""Margin for motion (share of the width of the model at the start)."""


class Painter:
    """Draws a model from a fixed direction; the picture goes along with the first body."""

    width, height = 480, 360  # pixels

    def __init__(self, model: Model) -> None:
        start = Simulation(model)
        self.picture = Picture(model, View())
        framing = self.picture.framing([frame_of(start)], self.width / self.height)
        self.framing = replace(framing, width=ROOM * framing.width)
        self.offset = framing.target_in(frame_of(start)) - start.state.positions[0]

    def paint(self, simulation: Simulation) -> NDArray[np.uint8]:
        """(height, width, 3) colours of 8 bits, the highest row first."""
        along = replace(self.framing, target=simulation.state.positions[0] + self.offset)
        return self.picture.draw(frame_of(simulation), along, self.width, self.height)
