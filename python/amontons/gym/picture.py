"""Pictures of environments."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..checks import Array
from ..model.model import Model
from ..simulation.simulation import Simulation


class Painter:
    """Draws a model from a fixed direction; the picture goes along with the first body."""

    width, height = 480, 360  # pixels

    def __init__(self, model: Model) -> None:
        from ..report.snapshots import Picture, View

        self.picture = Picture(model, View())
        start = Simulation(model)
        left, right, bottom, top = self.picture.bounds([self.frame(start)])
        # Room for moving about: half as much again as the model takes at the start.
        reach = 0.75 * max(top - bottom, (right - left) * self.height / self.width)
        self.half = np.array([reach * self.width / self.height, reach])
        self.offset = np.array([left + right, bottom + top]) / 2 - self.first(start)

    def frame(self, simulation: Simulation) -> Any:
        from ..report.snapshots import Frame

        state = simulation.state
        return Frame(simulation.time, state.positions.copy(), state.orientations.copy())

    def first(self, simulation: Simulation) -> Array:
        """Where the first body is in the picture (m)."""
        return np.array(self.picture.view[:2]) @ simulation.state.positions[0]

    def paint(self, simulation: Simulation) -> Array:
        """(height, width, 3) colours of 8 bits, the highest row first."""
        middle = self.first(simulation) + self.offset
        (left, bottom), (right, top) = middle - self.half, middle + self.half
        image = self.picture.draw(self.frame(simulation), (left, right, bottom, top), self.width, self.height)
        return np.ascontiguousarray((255 * image[::-1]).astype(np.uint8))
