"""Shapes as triangles, for viewers and files: alike shapes share one surface and differ in scale."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..model.hulls import convex_triangles
from ..model.shapes import Box, Capsule, Cylinder, Ellipsoid, HeightField, Hull, Mesh, Plane, Shape, Sphere
from ..model.visuals import TriangleMesh

AROUND = 32
"""Corners of a circle."""
MOST_TRIANGLES = 8_000_000
"""of all balls of a batch: what a picture of some GB of memory holds"""


@dataclass(frozen=True)
class Surface:
    """Triangles of a solid, counter-clockwise seen from outside."""

    vertices: NDArray[np.float32]
    """(n, 3)"""
    triangles: NDArray[np.uint32]
    """(m, 3)"""
    flat: bool
    """whether its faces are flat; else normals are means over the triangles that share a vertex"""
    closed: bool = True
    """whether it has an outside; what may be open is seen from both sides"""

    @property
    def ball(self) -> tuple[Array, float]:
        """The middle of its bounds (3,) and how far it reaches from there."""
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        centre = (low.astype(np.float64) + high) / 2
        return centre, float(np.linalg.norm(self.vertices - centre, axis=1).max())


@dataclass(frozen=True)
class Form:
    """A shape as a surface that others share, and its own scale."""

    key: Hashable
    """equal for shapes that share the surface"""
    scale: tuple[float, float, float]
    """along the axes of the shape"""


def form_of(shape: Shape | TriangleMesh) -> Form | None:
    """None of a plane, which has no end."""
    match shape:
        case Sphere():
            return Form("sphere", (shape.radius,) * 3)
        case Ellipsoid():
            return Form("sphere", shape.radii)
        case Box():
            return Form("box", shape.half)
        case Cylinder():
            return Form("cylinder", (shape.radius, shape.radius, shape.half_length))
        case Capsule():  # whose caps stay round: only those of one proportion are alike
            return Form(("capsule", round(shape.half_length / shape.radius, 6)), (shape.radius,) * 3)
        case Plane():
            return None
    return Form(("mesh", id(shape)), (1.0, 1.0, 1.0))


def surface_of(shape: Shape | TriangleMesh, count: int = 1) -> Surface:
    """Unit shapes that `form_of` scales: the sphere of radius one, and so on.

    count: instances in one batch. Balls have fewer corners where there are more than 7800, at least six
    around: a million of them are a few pixels each.
    """
    match shape:
        case Sphere() | Ellipsoid():
            around = min(AROUND, max(6, 2 * int(np.sqrt(MOST_TRIANGLES / count) / 2)))
            angles = np.linspace(-np.pi / 2, np.pi / 2, around // 2 + 1)
            return Surface(*_turned(np.column_stack((np.cos(angles), np.sin(angles))), around), flat=False)
        case Box():
            return Surface(*_box(), flat=True)
        case Cylinder():  # an edge is two rings: normals do not go round it
            profile = np.array([(0, -1), (1, -1), (np.nan, 0), (1, -1), (1, 1), (np.nan, 0), (1, 1), (0, 1)])
            return Surface(*_parts(profile), flat=False)
        case Capsule():
            angles = np.linspace(0, np.pi / 2, AROUND // 4 + 1)
            half = shape.half_length / shape.radius
            cap = np.column_stack((np.cos(angles), half + np.sin(angles)))
            return Surface(*_turned(np.concatenate((cap[::-1] * (1, -1), cap))), flat=False)
        case Hull():
            return _surface(*convex_triangles(shape.vertices), closed=True)
        case HeightField():
            return _surface(*height_field(shape), closed=False)
        case Mesh() | TriangleMesh():
            return _surface(shape.vertices, shape.triangles, closed=False)
    raise TypeError(f"{type(shape).__name__} has no surface")


def _surface(vertices: Array, triangles: Array, *, closed: bool) -> Surface:
    return Surface(
        np.ascontiguousarray(vertices, dtype=np.float32),
        np.ascontiguousarray(triangles, dtype=np.uint32),
        flat=True,
        closed=closed,
    )


def _box() -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float32)
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return signs, np.array(triangles, dtype=np.uint32)


def _turned(profile: Array, around: int = AROUND) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """The solid of revolution about z of a profile (distance from the axis, height) from the bottom up."""
    angles = 2 * np.pi * np.arange(around) / around
    ring = np.column_stack((np.cos(angles), np.sin(angles)))
    vertices = np.concatenate([np.column_stack((d * ring, np.full(around, z))) for d, z in profile])
    i = np.arange(around)
    j = (i + 1) % around
    triangles = []
    for k in range(len(profile) - 1):
        low, high = k * around, (k + 1) * around
        if profile[k, 0] > 1e-9:  # no area where both corners lie on the axis
            triangles.append(np.column_stack((low + i, low + j, high + j)))
        if profile[k + 1, 0] > 1e-9:
            triangles.append(np.column_stack((low + i, high + j, high + i)))
    return vertices.astype(np.float32), np.concatenate(triangles).astype(np.uint32)


def _parts(profile: Array) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """The same of several profiles with a row of nan between them."""
    cuts = np.flatnonzero(np.isnan(profile[:, 0]))
    vertices, triangles, first = [], [], 0
    for part in np.split(profile, cuts):
        points, faces = _turned(part[~np.isnan(part[:, 0])])
        vertices.append(points)
        triangles.append(faces + first)
        first += len(points)
    return np.concatenate(vertices), np.concatenate(triangles).astype(np.uint32)


def height_field(shape: HeightField) -> tuple[Array, Array]:
    rows, columns = shape.heights.shape
    x = (np.arange(columns) / (columns - 1) - 0.5) * shape.size_x
    y = (np.arange(rows) / (rows - 1) - 0.5) * shape.size_y
    grid = np.stack((*np.meshgrid(x, y), shape.heights), axis=-1).reshape(-1, 3)
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    return grid, np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
