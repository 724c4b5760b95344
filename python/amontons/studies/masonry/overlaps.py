"""Blocks that pass into each other, which no verdict may hide."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...checks import Array
from ...errors import InputError
from ...model.assembly import Assembly, Block
from ...model.decomposing import winding
from .joints import faces_of, near_pairs

NAMED = 3
"""Overlaps that a message names"""


def require_apart(
    assembly: Assembly, gap: float, touches: Callable[[int, int], bool] = lambda a, b: True
) -> None:
    """InputError that names blocks which overlap by more than `gap` (m), the depth and the place.

    touches: whether a pair of blocks may touch at all.
    """
    blocks = assembly.blocks
    low = np.array([block.vertices.min(axis=0) for block in blocks])
    high = np.array([block.vertices.max(axis=0) for block in blocks])
    planes: dict[int, tuple[Array, Array] | None] = {}
    found = []
    for i, j in sorted(near_pairs(low, high, -gap)):
        if (blocks[i].fixed and blocks[j].fixed) or not touches(i, j):
            continue
        for k in (i, j):
            if k not in planes:
                planes[k] = _half_spaces(blocks[k])
        first, second = planes[i], planes[j]
        if first is not None and second is not None:
            depth, place = _of_convex(blocks[i], first, blocks[j], second, gap)
        else:
            depth, place = _of_any(blocks[i], blocks[j], gap)
        if depth > gap:
            at = ", ".join(f"{x:.4g}" for x in place)
            found.append(f"{blocks[i].name!r} and {blocks[j].name!r} by {depth:.3g} m near ({at})")
    if found:
        rest = f", and {len(found) - NAMED} pairs more" if len(found) > NAMED else ""
        raise InputError(
            f"blocks overlap: {'; '.join(found[:NAMED])}{rest}; faces may overlap by gap = {gap:.3g} m. "
            "Move the blocks apart where they were drawn, or give a larger gap="
        )


def _half_spaces(block: Block) -> tuple[Array, Array] | None:
    """Normals (f, 3) and offsets (f,) of a closed convex block; None of others."""
    if block.given_mass is not None or not _closed(block) or not block.is_convex:
        return None
    faces = faces_of(block)
    normals = np.array([face.normal for face in faces])
    return normals, np.array([float(face.normal @ face.parts[0][0]) for face in faces])


def _closed(block: Block) -> bool:
    edges = np.sort(np.concatenate([block.triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    return bool(np.all(np.unique(edges, axis=0, return_counts=True)[1] == 2))


def _of_convex(
    a: Block, planes_a: tuple[Array, Array], b: Block, planes_b: tuple[Array, Array], gap: float
) -> tuple[float, Array]:
    """Diameter (m) and centre of the largest ball in both; 0 where a face separates them."""
    for (normals, offsets), other in ((planes_a, b), (planes_b, a)):
        nearest = (other.vertices @ normals.T).min(axis=0) - offsets
        if nearest.max() > -gap:
            return 0.0, np.zeros(3)
    from scipy.optimize import linprog  # type: ignore[import-untyped]

    normals = np.concatenate((planes_a[0], planes_b[0]))
    offsets = np.concatenate((planes_a[1], planes_b[1]))
    within = np.column_stack((normals, np.ones(len(normals))))
    ball = linprog((0, 0, 0, -1), A_ub=within, b_ub=offsets, bounds=[(None, None)] * 3 + [(0, None)])
    return (2 * float(ball.x[3]), ball.x[:3]) if ball.status == 0 else (0.0, np.zeros(3))


def _of_any(a: Block, b: Block, gap: float) -> tuple[float, Array]:
    """Twice the gap and the place, if a point of one surface, moved inwards by the gap, is in the other."""
    for one, other in ((a, b), (b, a)):
        if not _closed(other):
            continue
        corners = one.vertices[one.triangles]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(across, axis=1)
        points = corners.mean(axis=1) - 1.01 * gap * across / np.maximum(size, 1e-300)[:, None]
        near = np.all((points > other.vertices.min(axis=0)) & (points < other.vertices.max(axis=0)), axis=1)
        for point in points[near & (size > 0)]:
            if _surrounds(other, point) and _inside(point, one):
                return 2 * gap, point
    return 0.0, np.zeros(3)


def _inside(point: Array, block: Block) -> bool:
    return not _closed(block) or _surrounds(block, point)


def _surrounds(block: Block, point: Array) -> bool:
    return bool(winding(*(block.vertices[block.triangles[:, k]] - point for k in range(3))) > 0.5)
