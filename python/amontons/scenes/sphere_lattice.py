"""Spheres in layers of squares, each moved a little at random, so that they fall as a heap would."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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


def sites(lattice: Lattice, rng: np.random.Generator) -> NDArray[np.float64]:
    """Positions, (count, 3), each moved at random."""
    layer, site = np.divmod(np.arange(lattice.count), lattice.per_row**2)
    j, i = np.divmod(site, lattice.per_row)
    jitter = rng.uniform(-lattice.jitter, lattice.jitter, size=(lattice.count, 3))
    return np.column_stack(
        [
            (i + 0.5) * lattice.pitch - lattice.width / 2 + jitter[:, 0],
            (j + 0.5) * lattice.pitch - lattice.width / 2 + jitter[:, 1],
            lattice.bottom + layer * lattice.pitch + jitter[:, 2],
        ]
    )


def add_spheres(
    b: ModelBuilder,
    lattice: Lattice,
    rng: np.random.Generator,
    radius: float,
    *,
    density: float,
    material: Material,
) -> None:
    """Spheres on the sites of a lattice."""
    add_spheres_at(b, sites(lattice, rng), radius, density=density, material=material)


def add_spheres_at(
    b: ModelBuilder, positions: NDArray[np.float64], radius: float, *, density: float, material: Material
) -> None:
    """Equal spheres at positions, (count, 3)."""
    shape = Sphere(radius)
    for n, position in enumerate(positions.tolist()):
        b.add_body(f"sphere {n}", position=position, shape=shape, density=density, material=material)
