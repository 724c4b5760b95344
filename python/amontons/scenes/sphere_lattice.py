"""Spheres in layers of squares, each moved a little at random, so that they fall as a heap would."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..model.builder import ModelBuilder
from ..model.parts import Material
from ..model.shapes import Sphere


class Lattice(NamedTuple):
    """Sites of a lattice about the z axis, row by row, layer by layer."""

    count: int
    per_row: int
    pitch: float
    """m, between neighbours"""
    width: float
    """m, of a layer"""
    bottom: float
    """m, height of the lowest layer"""
    jitter: float
    """m, the largest displacement along each axis"""


def add_spheres(
    b: ModelBuilder,
    lattice: Lattice,
    rng: np.random.Generator,
    radius: float,
    *,
    density: float,
    material: Material,
) -> None:
    for n in range(lattice.count):
        k, site = divmod(n, lattice.per_row**2)
        j, i = divmod(site, lattice.per_row)
        jitter = rng.uniform(-lattice.jitter, lattice.jitter, size=3)
        b.add_body(
            f"sphere {n}",
            position=(
                (i + 0.5) * lattice.pitch - lattice.width / 2 + jitter[0],
                (j + 0.5) * lattice.pitch - lattice.width / 2 + jitter[1],
                lattice.bottom + k * lattice.pitch + jitter[2],
            ),
            shape=Sphere(radius),
            density=density,
            material=material,
        )
