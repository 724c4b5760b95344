"""B3: a stack of plates with alternating masses."""

from __future__ import annotations

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Box, Plane
from .geometry import STEEL, require
from .registry import scene

HEAVY, LIGHT = (0.36, 0.4, 0.46, 1.0), (0.85, 0.72, 0.5, 1.0)
"""Red, green, blue and opacity of the plates in pictures."""


@scene(dt=1e-2, duration=10.0)
def plates(
    *,
    count: int = 20,
    ratio: float = 100.0,
    heavy_first: bool = False,
    mu: float = 0.3,
    width: float = 1.0,
    thickness: float = 0.1,
) -> Model:
    """B3: a vertical stack of 20 steel plates whose masses alternate 1:ratio, a heavy one on every light one.

    Plates of 1 x 1 x 0.1 m; the heavy ones are steel (780 kg), the light ones weigh `ratio` times less.
    First-order methods slow down with the ratio; the weights that the contacts must carry are known.
    `heavy_first` puts a heavy plate at the bottom.
    """
    require(count >= 1, "plates", "count must be at least 1")
    require(ratio > 0, "plates", "ratio must be positive")
    material = Material(friction=mu)
    b = ModelBuilder()
    b.add_geom(None, Plane(), material=material, name="floor")
    plate = Box((width / 2, width / 2, thickness / 2))
    for i in range(count):
        heavy = (i % 2 == 0) == heavy_first
        b.add_body(
            f"plate {i}",
            position=(0, 0, (i + 0.5) * thickness),
            shape=plate,
            density=STEEL if heavy else STEEL / ratio,
            material=material,
        )
        b.add_visual(i, plate, colour=HEAVY if heavy else LIGHT)
    return b.build()
