"""A run of dominoes."""

from __future__ import annotations

import math

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Box, Plane
from .geometry import Y, about, require
from .registry import scene


@scene(dt=2e-3, duration=2.0)
def domino_run(
    *,
    count: int = 30,
    spacing: float = 0.02,
    domino: tuple[float, float, float] = (0.0075, 0.024, 0.048),
    mu: float = 0.3,
) -> Model:
    """Dominoes on a table fall one after the other; the first starts beyond its tipping point.

    `count` stones (thickness, width, height in m, 1100 kg/m^3), `spacing` m from face to face.
    """
    require(count >= 1 and spacing > 0, "domino_run", "count and spacing must be positive")
    b = ModelBuilder()
    material = Material(friction=mu)
    b.add_geom(None, Plane(), material=material, name="table")
    thickness, width, height = domino
    shape = Box((thickness / 2, width / 2, height / 2))
    # Past the diagonal the first one falls by itself: it starts turned about its lower front edge.
    lean = 1.3 * math.atan2(thickness, height)
    for i in range(count):
        x, z, turn = i * (spacing + thickness), height / 2, 0.0
        if i == 0:
            turn = lean
            x = thickness / 2 - thickness / 2 * math.cos(lean) + height / 2 * math.sin(lean)
            z = thickness / 2 * math.sin(lean) + height / 2 * math.cos(lean)
        b.add_body(
            f"domino {i}",
            position=(x, 0, z),
            orientation=about(Y, turn),
            shape=shape,
            density=1100,
            material=material,
        )
    return b.build()
