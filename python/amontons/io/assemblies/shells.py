"""Closed shells: what the readers of drawings return, and how one mesh becomes several of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...checks import Array


@dataclass(frozen=True, eq=False)
class Shell:
    """A surface of triangles in the unit and axes of its file."""

    name: str
    vertices: Array
    """(n, 3)"""
    triangles: NDArray[np.int64]
    """(t, 3)"""
    fixed: bool = False
    """whether the file marks it as a support"""
    density: float | None = None
    """kg/m^3, where the file gives it"""
    friction: float | None = None


def split(shell: Shell) -> list[Shell]:
    """The closed surfaces of a mesh, one after the other, with the corners that each uses.

    Programs write solids one after the other. So triangles are taken in their order until each edge has been
    passed in both directions. That separates blocks that touch, with edges in the same place. If the end is
    not closed, the mesh stays whole, and its block says where it is open.
    """
    grid = 1e-7 * max(float(np.ptp(shell.vertices, axis=0).max(initial=0.0)), 1e-300)
    places = np.round((shell.vertices - shell.vertices.min(axis=0)) / grid).astype(np.int64)
    _, index = np.unique(places, axis=0, return_inverse=True)
    corners = index.reshape(-1)[shell.triangles]
    open_edges: dict[tuple[int, int], int] = {}
    parts: list[list[int]] = [[]]
    for t, (a, b, c) in enumerate(corners.tolist()):
        parts[-1].append(t)
        if a == b or b == c or c == a:
            continue
        for edge in ((a, b), (b, c), (c, a)):
            back = (edge[1], edge[0])
            if open_edges.get(back):
                open_edges[back] -= 1
                if not open_edges[back]:
                    del open_edges[back]
            else:
                open_edges[edge] = open_edges.get(edge, 0) + 1
        if not open_edges:
            parts.append([])
    parts = [part for part in parts if part]
    if open_edges:
        parts = _connected(corners)
    if len(parts) <= 1:
        return [shell]
    return [_part(shell, part) for part in parts]


def _connected(corners: NDArray[np.int64]) -> list[list[int]]:
    """Triangles that hang together by corners."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = int(corners.max()) + 1
    links = (np.ones(2 * len(corners)), (corners[:, [0, 0]].ravel(), corners[:, 1:].ravel()))
    label = connected_components(coo_array(links, shape=(count, count)), directed=False)[1][corners[:, 0]]
    return [np.flatnonzero(label == k).tolist() for k in dict.fromkeys(label.tolist())]


def _part(shell: Shell, part: Sequence[int]) -> Shell:
    used, index = np.unique(shell.triangles[list(part)], return_inverse=True)
    return replace(shell, vertices=shell.vertices[used], triangles=index.reshape(-1, 3))


def triangles_of(points: Array, face: Sequence[int]) -> list[tuple[int, int, int]]:
    """A polygon as triangles by cutting off ears (Meisters, 1975); the polygon may be concave.

    points: (n, 3) of the mesh. face: indices of corners in their order.
    """
    left = list(face)
    if len(left) == 3:
        return [(left[0], left[1], left[2])]
    loop = points[left]
    normal = np.sum(np.cross(loop, np.roll(loop, -1, axis=0)), axis=0)
    size = np.linalg.norm(normal)
    if not size > 0:
        return [(left[0], left[k], left[k + 1]) for k in range(1, len(left) - 1)]
    drop = int(np.argmax(np.abs(normal)))
    keep = [(drop + 1) % 3, (drop + 2) % 3]
    flat = points[:, keep] if normal[drop] > 0 else points[:, keep[::-1]]
    made = []
    while len(left) > 3:
        ear = _ear(flat, left)
        made.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    return [*made, (left[0], left[1], left[2])]


def _ear(flat: Array, left: Sequence[int]) -> int:
    """The place of a corner that can be cut off; the most convex one where rounding leaves none."""
    best, most = 0, -np.inf
    for k in range(len(left)):
        a, b, c = flat[left[k - 1]], flat[left[k]], flat[left[(k + 1) % len(left)]]
        turn = _turn(a, b, c)
        if turn <= 0:
            continue
        others = (flat[i] for i in left if i not in (left[k - 1], left[k], left[(k + 1) % len(left)]))
        free = not any(_turn(a, b, p) >= 0 and _turn(b, c, p) >= 0 and _turn(c, a, p) >= 0 for p in others)
        if free:
            return k
        if turn > most:
            best, most = k, turn
    return best


def _turn(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def mesh(points: Array, faces: Iterable[Sequence[int]]) -> tuple[Array, NDArray[np.int64]]:
    """(vertices, triangles) of polygons."""
    triangles = [t for face in faces if len(face) >= 3 for t in triangles_of(points, face)]
    return points, np.array(triangles, dtype=np.int64).reshape(-1, 3)
