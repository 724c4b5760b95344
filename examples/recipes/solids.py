"""Closed meshes of turned parts, and a mug, for the recipes beside this file."""

from collections.abc import Sequence
from functools import cache
from itertools import pairwise

import amontons
import numpy as np
from amontons import Material, ModelBuilder, shapes

Points = Sequence[tuple[float, float]]


def turned(profile: Points, sides: int = 32) -> shapes.Mesh:
    """A closed outline (radius, height), counter-clockwise with the radius to the right, turned about z."""
    count = len(profile)
    angles = 2 * np.pi * np.arange(sides) / sides
    points = [(r * np.cos(a), r * np.sin(a), z) for a in angles for r, z in profile]
    triangles = []
    for i in range(sides):
        for k in range(count):
            a, b = i * count + k, i * count + (k + 1) % count
            c, d = ((i + 1) % sides * count + j % count for j in (k, k + 1))
            triangles += [(a, c, b), (b, c, d)]
    return shapes.Mesh(*solid(points, triangles))


def solid(points: list, triangles: list) -> tuple[np.ndarray, np.ndarray]:
    """The same without points that stand in one place, and without triangles that these leave flat."""
    unique, index = np.unique(np.round(points, 12), axis=0, return_inverse=True)
    faces = index.reshape(-1)[np.array(triangles)]
    a, b, c = faces.T
    return unique, faces[(a != b) & (b != c) & (c != a)]


@cache
def cup() -> tuple[shapes.Hull, ...]:
    """The parts of the wall and the foot of the mug: one decomposition for all mugs."""
    wall = [(0.0, 0.0), (0.04, 0.0), (0.04, 0.09), (0.034, 0.09), (0.034, 0.006), (0.0, 0.006)]
    return tuple(shapes.decompose(turned(wall, 12), error=0.006).hulls)


def mug(builder: ModelBuilder, place: tuple[float, float, float], material: Material) -> int:
    """A mug of 8 cm, upright on z = place[2], with a handle along +x; returns the index of the body."""
    body = builder.add_body("mug", position=place)
    for hull in cup():
        builder.add_geom(body, hull, density=2300, material=material)
    bend = [(0.036, 0.075), (0.062, 0.07), (0.07, 0.05), (0.062, 0.025), (0.036, 0.02)]
    for (x0, z0), (x1, z1) in pairwise(bend):
        length, angle = np.hypot(x1 - x0, z1 - z0), np.arctan2(x1 - x0, z1 - z0)
        builder.add_geom(
            body, shapes.Capsule(0.005, length / 2), position=((x0 + x1) / 2, 0, (z0 + z1) / 2),
            orientation=amontons.axis_angle((0, 1, 0), angle), density=2300, material=material,
        )  # fmt: skip
    return body
