"""Closed meshes of turned and extruded parts, for the recipes beside this file."""

from collections.abc import Sequence
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


def extruded(outline: Points, thickness: float) -> shapes.Mesh:
    """A simple polygon, counter-clockwise, as a plate about z = 0."""
    count, half = len(outline), thickness / 2
    points = [(x, y, z) for z in (-half, half) for x, y in outline]
    caps = ears(np.array(outline))
    triangles = [(c, b, a) for a, b, c in caps] + [(a + count, b + count, c + count) for a, b, c in caps]
    for k in range(count):
        n = (k + 1) % count
        triangles += [(k, n, n + count), (k, n + count, k + count)]
    return shapes.Mesh(points, triangles)


def solid(points: list, triangles: list) -> tuple[np.ndarray, np.ndarray]:
    """The same without points that stand in one place, and without triangles that these leave flat."""
    unique, index = np.unique(np.round(points, 12), axis=0, return_inverse=True)
    faces = index.reshape(-1)[np.array(triangles)]
    a, b, c = faces.T
    return unique, faces[(a != b) & (b != c) & (c != a)]


def ears(points: np.ndarray) -> list[tuple[int, int, int]]:
    """Triangles of a polygon: corners whose triangle holds no other corner are cut off one by one."""
    left, found = list(range(len(points))), []
    while len(left) > 3:
        for i in range(len(left)):
            a, b, c = left[i - 1], left[i], left[(i + 1) % len(left)]
            sides = points[[b, c, a]] - points[[a, b, c]]
            others = points[[k for k in left if k not in (a, b, c)]]
            to = others[:, None] - points[[a, b, c]]
            inside = (sides[:, 0] * to[..., 1] - sides[:, 1] * to[..., 0] >= 0).all(axis=1)
            if sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0] > 0 and not inside.any():
                found.append((a, b, c))
                del left[i]
                break
        else:
            raise ValueError("the outline crosses itself, or is not counter-clockwise")
    return [*found, tuple(left)]


def mug(builder: ModelBuilder, place: tuple[float, float, float], material: Material) -> int:
    """A mug of 8 cm, upright on z = place[2], with a handle along +x; returns the index of the body."""
    wall = [(0.0, 0.0), (0.04, 0.0), (0.04, 0.09), (0.034, 0.09), (0.034, 0.006), (0.0, 0.006)]
    body = builder.add_body("mug", position=place)
    for hull in shapes.decompose(turned(wall, 12), error=0.006).hulls:
        builder.add_geom(body, hull, density=2300, material=material)
    bend = [(0.036, 0.075), (0.062, 0.07), (0.07, 0.05), (0.062, 0.025), (0.036, 0.02)]
    for (x0, z0), (x1, z1) in pairwise(bend):
        length, angle = np.hypot(x1 - x0, z1 - z0), np.arctan2(x1 - x0, z1 - z0)
        builder.add_geom(
            body, shapes.Capsule(0.005, length / 2), position=((x0 + x1) / 2, 0, (z0 + z1) / 2),
            orientation=amontons.axis_angle((0, 1, 0), angle), density=2300, material=material,
        )  # fmt: skip
    return body
