"""Rays cast into the bodies of a simulation."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from .. import _core
from ..checks import Array
from ..model.model import Model


def cast_rays(
    core: _core.Simulation, model: Model, origins: Array, directions: Array, hidden: Collection[int]
) -> tuple[Array, Array, Array]:
    """Distances (n,), geoms (n,) and normals (n, 3) of what rays meet first.

    origins and directions: (n, 3), directions of length 1. hidden: bodies that rays pass through, -1 is the
    world. A ray that meets nothing has an infinite distance and the geom -1.
    """
    excluded = np.array([geom.body in hidden for geom in model.geoms], dtype=np.uint8)
    return _core.cast_rays(core, np.ascontiguousarray(origins), np.ascontiguousarray(directions), excluded)
