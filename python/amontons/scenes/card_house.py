"""A house of cards."""

from __future__ import annotations

import math

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Box, Plane
from .geometry import Y, about, require
from .registry import scene


@scene(dt=5e-3, duration=5.0)
def card_house(
    *,
    levels: int = 3,
    mu: float = 0.7,
    lean: float = 20.0,
    card: tuple[float, float, float] = (0.09, 0.06, 0.002),
) -> Model:
    """A house of cards: pairs of cards lean on each other, `levels` storeys with floors between them.

    Cards (height, width, thickness in m) of 800 kg/m^3, `lean` degrees from the plumb line. A pair without
    load pushes its feet apart with tan(lean) / 2 of its weight, a loaded one with up to tan(lean): the
    house stands while friction is greater, and creeps at no rate.
    """
    require(levels >= 1, "card_house", "levels must be at least 1")
    require(0 < lean < 45, "card_house", "lean (degrees) must be in (0, 45)")
    b = ModelBuilder()
    material = Material(friction=mu)
    b.add_geom(None, Plane(), material=material, name="table")
    height, width, thickness = card
    a = math.radians(lean)
    upright = Box((thickness / 2, width / 2, height / 2))
    # A card leaning to +x touches its partner with the upper inner corner and the floor with the lower
    # inner one.
    reach = height / 2 * math.sin(a) + thickness / 2 * math.cos(a)
    rise = height / 2 * math.cos(a) + thickness / 2 * math.sin(a)
    span = 2 * (height * math.sin(a) + thickness * math.cos(a)) + thickness
    z = 0.0
    for level in range(levels):
        pairs = levels - level
        for i in range(pairs):
            apex = (i - (pairs - 1) / 2) * span
            for side in (-1, 1):
                b.add_body(
                    f"card {level} {i} {'-+'[side > 0]}",
                    position=(apex + side * reach, 0, z + rise),
                    orientation=about(Y, -side * a),
                    shape=upright,
                    density=800,
                    material=material,
                )
        z += 2 * rise
        # One floor card rests on each two neighbouring apexes.
        for i in range(pairs - 1):
            x = (i - (pairs - 2) / 2) * span
            b.add_body(
                f"floor {level} {i}",
                position=(x, 0, z + thickness / 2),
                shape=Box((0.495 * span, width / 2, thickness / 2)),
                density=800,
                material=material,
            )
        z += thickness
    return b.build()
