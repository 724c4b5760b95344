"""B2: smooth spheres in a box."""

from __future__ import annotations

import math

import numpy as np

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Box, Plane
from .geometry import require
from .registry import scene
from .sphere_lattice import Lattice, add_spheres


@scene(dt=5e-3, duration=2.0)
def spheres_in_box(
    *, count: int = 1000, radius: float = 0.1, width: float | None = None, mu: float = 0.0, seed: int = 1
) -> Model:
    """B2: 1000 equal smooth spheres fall into an open box and settle, about 3.3 frictionless contacts each.

    Spheres of `radius` m and density 1000 kg/m^3 start on a jittered lattice a little above rest; after about
    2 s they lie still, with some 3250 contacts within the default margin, 2750 of them loaded. `width` of the
    square box defaults to ten diameters and a bit, so that a thousand spheres fill a cube.
    """
    require(count >= 1, "spheres_in_box", "count must be at least 1")
    if width is None:
        width = 2.05 * radius * max(2, round(count ** (1 / 3)))
    require(width >= 2.2 * radius, "spheres_in_box", "width must be at least 2.2 radius")
    rng = np.random.default_rng(seed)
    material = Material(friction=mu)
    b = ModelBuilder(friction_rule="maximum")
    b.add_geom(None, Plane(), material=material, name="floor")
    per_row = int((width - 0.02 * radius) / (2.04 * radius))
    layers = math.ceil(count / per_row**2)
    pitch = width / per_row
    height = (layers + 2) * 2.2 * radius
    _walls(b, width, height, material)
    free = pitch / 2 - radius  # how far a sphere may be moved on its site without touching a neighbour
    lattice = Lattice(count, per_row, pitch, width, radius * 1.05, 0.9 * free)
    add_spheres(b, lattice, rng, radius, density=1000, material=material)
    return b.build()


def _walls(b: ModelBuilder, width: float, height: float, material: Material) -> None:
    """Four fixed walls whose inner faces enclose a square of the given width."""
    thickness = width / 20
    long = (width / 2 + 2 * thickness, thickness, height / 2)
    for name, (x, y), half in (
        ("wall -y", (0, -1), long),
        ("wall +y", (0, 1), long),
        ("wall -x", (-1, 0), (long[1], long[0], long[2])),
        ("wall +x", (1, 0), (long[1], long[0], long[2])),
    ):
        reach = width / 2 + thickness
        b.add_geom(None, Box(half), position=(x * reach, y * reach, height / 2), material=material, name=name)
