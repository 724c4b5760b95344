"""Shapes as flat faces, for pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ..checks import Array
from ..model.hulls import convex_triangles
from ..model.parts import WORLD, Geom
from ..model.shapes import Box, Capsule, Cylinder, Ellipsoid, HeightField, Hull, Mesh, Sphere
from .raster import Raster
from .surfaces import height_field


class Moment(Protocol):
    """Positions (n, 3) and orientations (n, 4) of the bodies."""

    positions: Array
    orientations: Array


def rotation_matrix(q: Any) -> Array:
    """Of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@dataclass(frozen=True)
class Solid:
    """A geom with flat faces; without any it is a sphere."""

    body: int
    position: Array
    rotation: Array
    radius: float
    """of a ball about the centre that holds it"""
    colour: Array
    vertices: Array
    polygons: tuple[Array, ...]
    """corners of each face, counter-clockwise seen from outside"""
    normals: Array

    def placed(self, moment: Moment) -> tuple[Array, Array]:
        """Centre and rotation in the world."""
        if self.body == WORLD:
            return self.position, self.rotation
        R = rotation_matrix(moment.orientations[self.body])
        return moment.positions[self.body] + R @ self.position, R @ self.rotation

    def draw(self, raster: Raster, moment: Moment, label: int) -> None:
        centre, rotation = self.placed(moment)
        if not self.polygons:
            raster.sphere(centre, self.radius, label)
            return
        vertices, normals = centre + self.vertices @ rotation.T, self.normals @ rotation.T
        for k in np.flatnonzero(normals @ raster.camera.eye > 1e-6):
            raster.face(vertices[self.polygons[k]], normals[k], label)


def solid_of(geom: Geom, colour: Array) -> Solid:
    shape = geom.shape
    vertices, polygons = np.empty((0, 3)), ()
    match shape:
        case Box():
            vertices, polygons = _box(np.array(shape.half))
        case Capsule() | Cylinder():
            vertices, polygons = _turned(_profile(shape))
        case Ellipsoid():
            angles = np.linspace(-np.pi / 2, np.pi / 2, 11)
            vertices, polygons = _turned(np.column_stack((np.cos(angles), np.sin(angles))))
            vertices = vertices * np.array(shape.radii)
        case Hull():
            vertices, triangles = convex_triangles(shape.vertices)
            polygons = tuple(np.asarray(triangles))
        case Mesh():
            vertices, polygons = shape.vertices, tuple(np.asarray(shape.triangles))
        case HeightField():
            vertices, triangles = height_field(shape)
            polygons = tuple(triangles)
    reach = float(np.linalg.norm(vertices, axis=1).max(initial=0))
    return Solid(
        body=geom.body,
        position=np.array(geom.frame.position),
        rotation=rotation_matrix(geom.frame.rotation),
        radius=shape.radius if isinstance(shape, Sphere) else reach,
        colour=colour,
        vertices=vertices,
        polygons=polygons,
        normals=_normals(vertices, polygons),
    )


def _normals(vertices: Array, polygons: tuple[Array, ...]) -> Array:
    """Unit normals by the vector area of each face; zero for one without area, which no eye sees."""
    normals = np.zeros((len(polygons), 3))
    for k, face in enumerate(polygons):
        corners = vertices[face] - vertices[face[0]]
        area = np.cross(corners[1:-1], corners[2:]).sum(axis=0)
        length = float(np.linalg.norm(area))
        normals[k] = area / length if length > 0 else 0.0
    return normals


def _box(half: Array) -> tuple[Array, tuple[Array, ...]]:
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return signs * half, tuple(np.array(face) for face in faces)


def _profile(shape: Capsule | Cylinder) -> Array:
    """(distance from the axis, height) from the bottom to the top."""
    r, h = shape.radius, shape.half_length
    if isinstance(shape, Cylinder):
        return np.array([(0, -h), (r, -h), (r, h), (0, h)])
    angles = np.linspace(0, np.pi / 2, 5)
    cap = np.column_stack((r * np.cos(angles), h + r * np.sin(angles)))
    return np.concatenate((cap[::-1] * (1, -1), cap))


def _turned(profile: Array, around: int = 20) -> tuple[Array, tuple[Array, ...]]:
    """The solid of revolution of a profile about z."""
    angles = 2 * np.pi * np.arange(around) / around
    ring = np.column_stack((np.cos(angles), np.sin(angles)))
    vertices = np.concatenate([np.column_stack((d * ring, np.full(around, z))) for d, z in profile])
    faces = []
    for j in range(len(profile) - 1):
        for i in range(around):
            a, b = j * around + i, j * around + (i + 1) % around
            faces.append(np.array([a, b, b + around, a + around]))
    return vertices, tuple(faces)
