"""A semicircular masonry arch."""

from __future__ import annotations

import math

import numpy as np

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Hull, Plane
from .geometry import require
from .registry import scene


@scene(dt=5e-3, duration=5.0)
def arch(
    *, stones: int = 15, radius: float = 2.0, thickness: float = 0.4, depth: float = 0.5, mu: float = 0.6
) -> Model:
    """A semicircular arch of dry voussoirs on the ground: it stands if it is thick enough.

    `stones` hulls (2400 kg/m^3) of `thickness` m on a mean radius of `radius` m, springing from a plane. By
    Milankovitch's theory (continuous arch, no sliding) the thinnest that stands is 0.1074 radii.
    """
    require(stones >= 2, "arch", "stones must be at least 2")
    require(0 < thickness < 2 * radius, "arch", "thickness must be in (0, 2 radius)")
    b = ModelBuilder()
    material = Material(friction=mu)
    b.add_geom(None, Plane(), material=material, name="ground")
    step = math.pi / stones
    inner, outer = radius - thickness / 2, radius + thickness / 2
    # The stone across the crown; the others are the same, turned about y.
    corners = np.array(
        [
            (r * math.sin(a), y, r * math.cos(a) - radius)
            for r in (inner, outer)
            for a in (-step / 2, step / 2)
            for y in (-depth / 2, depth / 2)
        ]
    )
    stone = Hull(corners)
    for i in range(stones):
        a = (i + 0.5) * step - math.pi / 2  # from the plumb line, to +x
        b.add_body(
            f"stone {i}",
            position=(radius * math.sin(a), 0, radius * math.cos(a)),
            orientation=(math.cos(a / 2), 0, math.sin(a / 2), 0),
            shape=stone,
            density=2400,
            material=material,
        )
    return b.build()
