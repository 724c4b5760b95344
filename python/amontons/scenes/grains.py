"""Grains in motion: an avalanche, a heap, a rotating drum. With `hopper`, the scenes of many spheres."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Box, Plane, Sphere
from .geometry import Y, about, from_z, require
from .registry import scene
from .sphere_lattice import Lattice, add_spheres_at, sites

_DENSITY = 1500.0
"""kg/m^3, of sand in bulk"""
_STAVES = 36
"""plates of a drum: an inner wall that is round to 0.4 % of its radius"""
_PITCH = 2.1
"""radii between neighbours of a lattice, less a jitter that keeps them apart"""
_JITTER = 0.02
"""radii"""


def _add_rough(
    b: ModelBuilder,
    radius: float,
    x: tuple[float, float],
    y: tuple[float, float],
    slope: float,
    material: Material,
) -> None:
    """Fixed spheres side by side, half sunk in a plane through the y axis that falls by `slope` (rad) along
    x, from x[0] to x[1] along the plane. Grains rest between them and do not roll away."""
    places = [np.arange(low + radius, high, 2 * radius).tolist() for low, high in (x, y)]
    c, s = math.cos(slope), math.sin(slope)
    shape = Sphere(radius)
    for along in places[0]:
        for across in places[1]:
            b.add_geom(None, shape, position=(c * along, across, -s * along), material=material)


def _lattice(count: int, per_row: int, radius: float, bottom: float) -> Lattice:
    pitch = _PITCH * radius
    return Lattice(count, per_row, pitch, per_row * pitch, bottom, _JITTER * radius)


@scene(dt=5e-3, duration=3.0)
def avalanche(
    *, count: int = 400, radius: float = 0.05, slope: float = 35.0, mu: float = 0.3, seed: int = 1
) -> Model:
    """A block of grains is let go on a slope, runs down and comes to rest on level ground.

    `count` spheres of `radius` m stand in a loose block, twice as wide and long as it is high, on a plane
    that falls by `slope` degrees. The slope meets the ground half a length below the block. Slope and ground
    are rough: fixed spheres of the same radius lie side by side.
    """
    require(count >= 1, "avalanche", "count must be at least 1")
    require(0 < slope < 80, "avalanche", "slope (degrees) must be in (0, 80)")
    b = ModelBuilder()
    material = Material(friction=mu)
    down = math.radians(slope)
    b.add_geom(None, Plane(), material=material, name="ground")
    b.add_geom(None, Plane(), orientation=about(Y, down), material=material, name="slope")
    lattice = _lattice(count, max(2, math.ceil((2 * count) ** (1 / 3))), radius, 2.1 * radius)
    width = lattice.width
    _add_rough(b, radius, (-1.5 * width - 2 * radius, -radius), (-width, width), down, material)
    _add_rough(b, radius, (0.0, 2 * width), (-width, width), 0.0, material)
    block = sites(lattice, np.random.default_rng(seed))
    block[:, 0] -= width  # along the slope; the foot of the slope is the y axis
    c, s = math.cos(down), math.sin(down)
    along, above = block[:, 0].copy(), block[:, 2].copy()
    block[:, 0] = c * along + s * above
    block[:, 2] = c * above - s * along
    add_spheres_at(b, block, radius, density=_DENSITY, material=material)
    return b.build()


@scene(dt=5e-3, duration=2.0)
def pile(*, count: int = 400, radius: float = 0.05, mu: float = 0.5, seed: int = 1) -> Model:
    """A column of grains collapses on rough ground into a heap.

    `count` spheres of `radius` m stand in a loose column, twice as high as it is wide. The ground is rough:
    fixed spheres of the same radius lie side by side, over four widths of the column.
    """
    require(count >= 1, "pile", "count must be at least 1")
    b = ModelBuilder()
    material = Material(friction=mu)
    b.add_geom(None, Plane(), material=material, name="ground")
    lattice = _lattice(count, max(1, math.ceil((count / 2) ** (1 / 3))), radius, 2.1 * radius)
    half = 2 * lattice.width
    _add_rough(b, radius, (-half, half), (-half, half), 0.0, material)
    column = sites(lattice, np.random.default_rng(seed))
    add_spheres_at(b, column, radius, density=_DENSITY, material=material)
    return b.build()


@scene(dt=5e-3, duration=3.0)
def drum(
    *,
    count: int = 400,
    radius: float = 0.05,
    speed: float = 1.5,
    fill: float = 0.35,
    mu: float = 0.5,
    seed: int = 1,
) -> Model:
    """A drum turns about its horizontal axis; the grains in it climb and roll down their slope.

    The wall of the drum is 36 plates of one kinematic body, which turns with `speed` rad/s. The drum is as
    long as its radius and has fixed ends. `count` spheres of `radius` m fill the part `fill` of it.
    """
    require(count >= 1, "drum", "count must be at least 1")
    require(0 < fill <= 0.5, "drum", "fill must be in (0, 0.5]")
    b = ModelBuilder()
    material = Material(friction=mu)
    pitch = _PITCH * radius
    inner = max(6 * radius, pitch * (count / (fill * math.pi)) ** (1 / 3))
    while len(grains := _in_drum(count, inner, pitch, radius)) < count:
        inner *= 1.05
    _wall(b, inner, speed, 2 * radius, material)
    grains += np.random.default_rng(seed).uniform(-_JITTER * radius, _JITTER * radius, size=grains.shape)
    add_spheres_at(b, grains, radius, density=_DENSITY, material=material)
    return b.build()


def _in_drum(count: int, inner: float, pitch: float, radius: float) -> NDArray[np.float64]:
    """The lowest sites of a lattice in a drum along y, (n, 3), n <= count."""
    slices = max(1, int((inner - 0.2 * radius) / pitch))
    across = int(2 * inner / pitch)
    steps = (np.arange(across) - (across - 1) / 2) * pitch
    z, x = np.meshgrid(steps, steps, indexing="ij")  # the lowest first
    inside = np.hypot(x, z) < inner - 1.1 * radius
    x, z = x[inside], z[inside]
    y = (np.arange(slices) - (slices - 1) / 2) * pitch
    wanted = min(count, slices * len(x))
    row, place = np.divmod(np.arange(wanted), slices)
    return np.column_stack([x[row], y[place], z[row]])


def _wall(b: ModelBuilder, inner: float, speed: float, thickness: float, material: Material) -> None:
    """Plates whose inner faces touch a circle about y, on one turning body, and two fixed ends."""
    body = b.add_body("drum", motion="kinematic", angular_velocity=(0.0, speed, 0.0))
    half = (thickness / 2, inner / 2, (inner + thickness) * math.tan(math.pi / _STAVES))
    reach = inner + thickness / 2
    for k in range(_STAVES):
        angle = 2 * math.pi * k / _STAVES
        b.add_geom(
            body,
            Box(half),
            position=(reach * math.cos(angle), 0.0, -reach * math.sin(angle)),
            orientation=about(Y, angle),
            material=material,
            name=f"stave {k}",
        )
    for side in (-1.0, 1.0):
        b.add_geom(
            None,
            Plane(),
            position=(0.0, side * inner / 2, 0.0),
            orientation=from_z((0.0, -side, 0.0)),
            material=material,
            name="front" if side < 0 else "back",
        )
