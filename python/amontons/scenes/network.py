"""B1: a network of parts and joints, without contacts."""

from __future__ import annotations

import numpy as np

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.shapes import Sphere
from .geometry import require
from .registry import scene


@scene(dt=1e-2, duration=3.0)
def network(
    *,
    columns: int = 10,
    layers: int = 10,
    rods: int | None = None,
    pitch: float = 0.5,
    speed: float = 1.0,
    seed: int = 1,
) -> Model:
    """B1: 1000 parts in a lattice, hung from a ceiling, with 3500 scalar bilateral constraints.

    `columns` x `columns` strings of `layers` parts each hang by ball joints (3 constraints each, halfway
    between the parts); `rods` of constant length (1 constraint each) tie parts of neighbouring strings,
    chosen at random. Parts of 1 kg and 0.1 kg m^2, `pitch` m apart, random velocities of `speed` m/s.
    Nothing touches: the problem of a step is a linear system, the home ground of conjugate gradients. By
    default there are columns^2 layers / 2 rods, 3.5 constraints a part.
    """
    require(columns >= 2 and layers >= 1, "network", "columns must be at least 2, layers at least 1")
    rng = np.random.default_rng(seed)
    b = ModelBuilder()
    grid = np.empty((columns, columns, layers), dtype=int)
    for i, j, k in np.ndindex(grid.shape):
        grid[i, j, k] = b.add_body(
            f"part {i} {j} {k}",
            position=(i * pitch, j * pitch, -(k + 0.5) * pitch),
            mass=1.0,
            inertia=(0.1, 0.1, 0.1),
            linear_velocity=rng.normal(scale=speed, size=3),
        )
        b.add_geom(int(grid[i, j, k]), Sphere(pitch / 5), category=0, mask=0)
    for i, j, k in np.ndindex(grid.shape):
        above = int(grid[i, j, k - 1]) if k else None
        b.add_ball_joint(
            int(grid[i, j, k]), above, point=(i * pitch, j * pitch, -k * pitch), name=f"ball {i} {j} {k}"
        )
    pairs = [
        (site, (site[0] + di, site[1] + dj, site[2]))
        for site in np.ndindex(grid.shape)
        for di, dj in ((1, 0), (0, 1))
        if site[0] + di < columns and site[1] + dj < columns
    ]
    rods = grid.size // 2 if rods is None else rods
    require(0 <= rods <= len(pairs), "network", f"rods must be in [0, {len(pairs)}]")
    for n, choice in enumerate(sorted(rng.choice(len(pairs), size=rods, replace=False))):
        ends = [(i * pitch, j * pitch, -(k + 0.5) * pitch) for i, j, k in pairs[choice]]
        first, second = (int(grid[site]) for site in pairs[choice])
        b.add_distance_joint(first, second, point_a=ends[0], point_b=ends[1], name=f"rod {n}")
    return b.build()
