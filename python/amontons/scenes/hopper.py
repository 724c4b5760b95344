"""A hopper of spheres."""

from __future__ import annotations

import math

import numpy as np

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Box, Plane
from .geometry import X, Y, about, require
from .registry import scene
from .sphere_lattice import Lattice, add_spheres


@scene(dt=5e-3, duration=4.0)
def hopper(
    *,
    count: int = 400,
    radius: float = 0.05,
    outlet: float = 0.4,
    slope: float = 50.0,
    mu: float = 0.3,
    seed: int = 1,
) -> Model:
    """Spheres flow through a funnel of four inclined walls onto the ground.

    `count` spheres of `radius` m and 1500 kg/m^3 start in a loose lattice above a square funnel whose walls
    rise at `slope` degrees from an opening of `outlet` m; five diameters and more let them flow freely.
    """
    require(count >= 1, "hopper", "count must be at least 1")
    require(outlet > 0, "hopper", "outlet must be positive")
    require(0 < slope < 90, "hopper", "slope (degrees) must be in (0, 90)")
    rng = np.random.default_rng(seed)
    b = ModelBuilder()
    material = Material(friction=mu)
    b.add_geom(None, Plane(), material=material, name="ground")
    per_row = max(2, math.ceil((count / 2) ** (1 / 3)))
    pitch = 2.1 * radius
    width = per_row * pitch
    a = math.radians(slope)
    # The lattice stands where the funnel is wide enough for it.
    run = max(width / 2 - outlet / 2, 0) + 2 * radius
    bottom = 8 * radius
    _funnel(b, bottom, outlet, run / math.cos(a), a, radius, material)
    start = bottom + run * math.tan(a) + radius
    lattice = Lattice(count, per_row, pitch, width, start, 0.02 * radius)
    add_spheres(b, lattice, rng, radius, density=1500, material=material)
    return b.build()


def _funnel(
    b: ModelBuilder,
    bottom: float,
    outlet: float,
    length: float,
    slope: float,
    radius: float,
    material: Material,
) -> None:
    """Four plates whose upper faces rise from the edges of a square opening, and a rim above them."""
    thickness = 0.5 * radius
    width = outlet / 2 + length * math.cos(slope)
    rise = length * math.sin(slope)
    rim = 20 * radius
    for name, axis, (x, y) in (("-x", Y, (-1, 0)), ("+x", Y, (1, 0)), ("-y", X, (0, -1)), ("+y", X, (0, 1))):
        side = x + y
        # Turned about y, +x must rise to +x: the angle is negative there; about x it is the other way round.
        turn = (-slope if axis == Y else slope) * side
        middle = outlet / 2 + length / 2 * math.cos(slope) + thickness * math.sin(slope)
        half = (length / 2, width, thickness) if axis == Y else (width, length / 2, thickness)
        z = bottom + rise / 2 - thickness * math.cos(slope)
        b.add_geom(
            None,
            Box(half),
            position=(x * middle, y * middle, z),
            orientation=about(axis, turn),
            material=material,
            name=f"funnel {name}",
        )
        half = (thickness, width, rim / 2) if axis == Y else (width, thickness, rim / 2)
        reach = width + thickness
        b.add_geom(
            None,
            Box(half),
            position=(x * reach, y * reach, bottom + rise + rim / 2),
            material=material,
            name=f"rim {name}",
        )
