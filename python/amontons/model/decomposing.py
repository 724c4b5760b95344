"""Convex parts of a mesh, by CoACD, and how far they reach outside of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..checks import Array, number, shown
from ..errors import InputError
from .hulls import convex_triangles
from .mesh_files import is_closed
from .shapes import Hull, Mesh

KEPT = 64
"""Meshes whose parts are remembered; a decomposition takes seconds"""
AT_ONCE = 1 << 20
"""Pairs of a point and a triangle in one pass: about 100 MB"""


@dataclass(frozen=True)
class Decomposition:
    """Hulls that together stand for a mesh."""

    hulls: tuple[Hull, ...]
    deviation: float
    """m, the largest distance from the mesh of a point of a hull that is outside of the mesh; points are
    corners, middles of edges and centres of triangles"""


def decompose(mesh: Mesh, *, error: float) -> Decomposition:
    """Hulls in place of a closed mesh that is not convex, for bodies that move.

    error: the depth (m) of dents that may be filled, CoACD's concavity. `Decomposition.deviation` is
    measured; where it is larger, give a smaller error. The same mesh and error give the same hulls, computed
    once. Needs coacd: pip install amontons[decompose] (Wei et al., ACM Trans. Graph. 41, 2022).
    Raises InputError, also for a mesh that is not closed.
    """
    if not isinstance(mesh, Mesh):
        raise InputError(f"decompose: mesh is {shown(mesh)}; give a shapes.Mesh, as shapes.read_mesh(path)")
    error = number("decompose: error", error)
    if not error > 0:
        raise InputError(f"decompose: error is {error:g}; give a length in m, > 0")
    if not is_closed(mesh.vertices, mesh.triangles) or mesh.volume() <= 0:
        raise InputError("decompose: the mesh is not closed, or faces inwards; repair it where it was made")
    return _decomposed(mesh, error)


@lru_cache(maxsize=KEPT)
def _decomposed(mesh: Mesh, error: float) -> Decomposition:
    try:
        import coacd
    except ImportError:
        raise InputError("decompose needs CoACD: pip install amontons[decompose]") from None
    coacd.set_log_level("error")
    parts: list[Any] = coacd.run_coacd(
        coacd.Mesh(mesh.vertices, mesh.triangles), threshold=error, real_metric=True, seed=0
    )
    hulls = tuple(Hull(np.asarray(points, dtype=np.float64)) for points, _ in parts)
    return Decomposition(hulls, max(_deviation(mesh, hull) for hull in hulls))


def _deviation(mesh: Mesh, hull: Hull) -> float:
    triangles = convex_triangles(hull.vertices)[1]
    a, b, c = (hull.vertices[triangles[:, k]] for k in range(3))
    points = np.concatenate((hull.vertices, (a + b) / 2, (b + c) / 2, (c + a) / 2, (a + b + c) / 3))
    corners = mesh.vertices[mesh.triangles]
    step = max(1, AT_ONCE // len(corners))
    passes = (points[k : k + step] for k in range(0, len(points), step))
    return max(float(_outside(part, corners).max()) for part in passes)


def _outside(points: Array, corners: Array) -> Array:
    """The distance (n,) of points outside of a closed surface (t, 3, 3) from it; 0 within."""
    a, b, c = (corners[None, :, k] - points[:, None] for k in range(3))
    return np.where(winding(a, b, c) > 0.5, 0.0, _distance(a, b, c).min(axis=1))


def winding(a: Array, b: Array, c: Array) -> Array:
    """How often triangles (..., t, 3) surround the origin, 1 inside and 0 outside: the sum of their solid
    angles (Van Oosterom and Strackee, 1983) over 4 pi."""
    la, lb, lc = (np.linalg.norm(x, axis=-1) for x in (a, b, c))
    ab, bc, ca = (np.einsum("...k,...k", x, y) for x, y in ((a, b), (b, c), (c, a)))
    below = la * lb * lc + ab * lc + bc * la + ca * lb
    return np.arctan2(np.einsum("...k,...k", a, np.cross(b, c)), below).sum(axis=-1) / (2 * np.pi)


def _distance(a: Array, b: Array, c: Array) -> Array:
    """From the origin to triangles (..., 3): to the plane within the triangle, else to an edge."""
    edges = np.minimum(np.minimum(_to_edge(a, b), _to_edge(b, c)), _to_edge(c, a))
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=-1)
    inner = np.ones(size.shape, dtype=bool)
    for x, y in ((a, b), (b, c), (c, a)):
        inner &= np.einsum("...k,...k", np.cross(y - x, -x), normal) >= 0
    with np.errstate(invalid="ignore", divide="ignore"):
        plane = np.abs(np.einsum("...k,...k", a, normal)) / size
    return np.where(inner & (size > 0), plane, edges)


def _to_edge(a: Array, b: Array) -> Array:
    along = b - a
    squared = np.maximum(np.einsum("...k,...k", along, along), 1e-300)
    share = np.clip(-np.einsum("...k,...k", a, along) / squared, 0.0, 1.0)
    return np.linalg.norm(a + share[..., None] * along, axis=-1)
