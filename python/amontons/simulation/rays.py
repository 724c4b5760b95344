"""Rays cast into the bodies of a simulation."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..checks import Array
from ..model.model import Model
from ..model.parts import WORLD


def cast_rays(
    core: _core.Simulation, origins: Array, directions: Array, hidden: Array
) -> tuple[Array, Array, Array]:
    """Distances (n,), geoms (n,) and normals (n, 3) of what rays meet first.

    origins and directions: (n, 3), directions of length 1. hidden: (geoms,), true for those that rays pass
    through. A ray that meets nothing has an infinite distance and the geom -1.
    """
    excluded = hidden.astype(np.uint8)
    return _core.cast_rays(core, np.ascontiguousarray(origins), np.ascontiguousarray(directions), excluded)


def geoms_of(model: Model, places: set[int]) -> Array:
    """(geoms,): true for those of bodies, with their links, and of links.

    places: indices of `Model.link_names`; -1 is the world.
    """
    whole = places & {WORLD, *range(len(model.bodies))}
    on = zip(model.geoms, model.geom_links, strict=True)
    return np.array([place in places or geom.body in whole for geom, place in on], dtype=bool)
