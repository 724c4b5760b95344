"""The triangles of a convex hull, oriented outwards, with true corners only."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..errors import InputError

Triangles = NDArray[np.int32]

FLAT = 1e-9
"""Thickness relative to the extent below which points lie in a plane: no solid, but a sheet with rounding."""
SAME_NORMAL = 1e-6
"""rad, below which two facets are one face: splitting it is noise of the input."""


def convex_triangles(points: Array) -> tuple[Array, Triangles]:
    """(corners, triangles) of the hull of (n, 3) points, whatever their unit of length.

    Points inside faces and edges are dropped: they would make slivers without a normal.
    """
    from scipy.spatial import ConvexHull, QhullError  # takes longer to import than all the rest

    if len(points) < 4:
        raise InputError(f"Hull: {len(points)} points span no body; give at least four")
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    extent = np.abs(points - centre).max()
    _require_solid(points - centre, extent)
    scaled = (points - centre) / extent
    corners = np.arange(len(points))
    while True:
        try:
            hull = ConvexHull(scaled[corners])
        except QhullError:
            raise InputError(
                "Hull: the points lie in a plane or on a line; give corners of a solid"
            ) from None
        kept = _corners(hull)
        if len(kept) == len(corners):
            break
        corners = corners[kept]
    triangles, normals = hull.simplices.astype(np.int32), hull.equations[:, :3]
    a, b, c = (scaled[corners][triangles[:, k]] for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), normals) < 0
    triangles[inwards] = triangles[inwards][:, [0, 2, 1]]
    return points[corners].copy(), np.ascontiguousarray(triangles)


def _require_solid(points: Array, extent: float) -> None:
    if not extent > 0:
        raise InputError("Hull: all points are the same; give corners of a solid")
    points = points - points.mean(axis=0)
    thickness = np.linalg.svd(points / extent, compute_uv=False)[-1] / np.sqrt(len(points))
    if thickness < FLAT:
        raise InputError("Hull: the points lie in a plane or on a line; give corners of a solid")


def _corners(hull: Any) -> NDArray[np.intp]:
    """The points in which three faces meet, ascending; others lie within a face or an edge.

    A face is what neighbours with one normal make up together.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    normals, count = hull.equations[:, :3], len(hull.simplices)
    facet, neighbour = np.repeat(np.arange(count), 3), hull.neighbors.ravel()
    same = np.einsum("ij,ij->i", normals[facet], normals[neighbour]) > 1 - SAME_NORMAL**2 / 2
    joined = coo_array((np.ones(same.sum()), (facet[same], neighbour[same])), shape=(count, count))
    face = connected_components(joined, directed=False)[1]
    meetings = np.unique(np.stack((hull.simplices.ravel(), face[facet]), axis=1), axis=0)
    corners, faces = np.unique(meetings[:, 0], return_counts=True)
    return corners[faces >= 3].astype(np.intp)
