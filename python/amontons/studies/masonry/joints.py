"""Joints: the plane polygons over which the faces of two blocks touch."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree  # type: ignore[import-untyped]

from ...checks import Array, listed
from ...errors import InputError
from ...model.assembly import Assembly, Block
from ...model.groups import connected
from ...model.parts import WORLD
from .polygons import area, common, hull

GAP = 2e-3
"""Default of the largest distance of two faces that touch, over the median size of the blocks"""
PARALLEL = np.cos(np.radians(3.0))
"""Faces that touch are opposed within 3 degrees"""
LEAST = 1e-6
"""Area of a joint, over the squared size of the smaller block, below which it is none"""
ALIKE = 0.45
"""Distance of unit normals that may be of one face: 26 degrees"""
WHOLE = 1e-6
"""Area that the hull of a face may have beyond that of its triangles for the face to be convex"""
FLAT = 1e-4
"""Distance from a plane, over the size of the block, within which triangles are of one face"""


@dataclass(frozen=True)
class Face:
    """The part of a block's surface in one plane."""

    normal: Array
    """(3,) outwards"""
    parts: tuple[Array, ...]
    """(k, 3) convex polygons that make it (m), counter-clockwise about the normal: one, or its triangles"""
    low: Array
    high: Array
    """(3,) bounds (m)"""


@dataclass(frozen=True)
class Joint:
    """The contact of two blocks over one plane polygon.

    Forces over any part of a face have the same sums as forces at the corners of the convex hull of that
    part. So the corners of the hull stand for the whole face, whatever its shape.
    """

    a: int
    b: int
    """indices of the blocks"""
    polygon: Array
    """(k, 3) corners, counter-clockwise about the normal (m); a point or two where curved shapes touch"""
    normal: Array
    """(3,) from block b to block a"""
    area: float
    """of the touching faces (m^2), without what only their hull covers"""
    friction: float
    """Coulomb's coefficient"""
    gap: float
    """largest distance of the two faces (m); negative where they overlap"""

    @property
    def axes(self) -> Array:
        """(2, 3) unit vectors in its plane, right-handed with the normal."""
        return plane_axes(self.normal)

    @property
    def flat(self) -> Array:
        """(k, 2) corners along the axes."""
        return self.polygon @ self.axes.T


def plane_axes(normal: Array) -> Array:
    """(2, 3) two unit vectors that complete a unit normal to a right-handed frame."""
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(normal, first)])


def faces_of(block: Block) -> list[Face]:
    """Triangles by planes: the largest one that is left names a plane, and takes those that lie in it."""
    corners = block.vertices[block.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(across, axis=1)
    size = block.size
    order = [t for t in np.argsort(-areas, kind="stable").tolist() if areas[t] > 1e-12 * size**2]
    left = np.zeros(len(corners), dtype=bool)
    left[order] = True
    normals = across / np.maximum(areas, 1e-300)[:, None]
    alike = cKDTree(normals)
    faces = []
    for t in order:
        if not left[t]:
            continue
        normal = normals[t]
        close = np.array(alike.query_ball_point(normal, ALIKE, return_sorted=True))
        close = close[left[close]]
        near = np.abs((corners[close] - corners[t, 0]) @ normal).max(axis=1) <= FLAT * size
        within = close[near]
        left[within] = False
        made = corners[within]
        parts = _convex_parts(made, normal, float(areas[within].sum()) / 2)
        faces.append(Face(normal, parts, made.min(axis=(0, 1)), made.max(axis=(0, 1))))
    return faces


def _convex_parts(triangles: Array, normal: Array, size: float) -> tuple[Array, ...]:
    """The hull of triangles (t, 3, 3) in a plane if it has their area, else the triangles."""
    if len(triangles) > 1:
        axes = plane_axes(normal)
        flat = (triangles.reshape(-1, 3) - triangles[0, 0]) @ axes.T
        around = hull(flat)
        if len(around) > 2 and area(around) <= (1 + WHOLE) * size:
            return (triangles[0, 0] + around @ axes,)
    return tuple(triangles)


def default_gap(assembly: Assembly) -> float:
    """The largest distance of faces that touch (m), from the sizes of the blocks."""
    sizes = [block.size for block in assembly.blocks if not block.fixed]
    return GAP * float(np.median(sizes or [block.size for block in assembly.blocks]))


def near_pairs(low: Array, high: Array, margin: float) -> Iterator[tuple[int, int]]:
    """Pairs i < j of boxes that are at most `margin` apart, by a sweep along x."""
    order = np.argsort(low[:, 0], kind="stable")
    starts = low[order, 0]
    for place, i in enumerate(order.tolist()):
        last = int(np.searchsorted(starts, high[i, 0] + margin, side="right"))
        rest = order[place + 1 : last]
        meet = np.all((low[rest] <= high[i] + margin) & (high[rest] >= low[i] - margin), axis=1)
        yield from ((min(i, j), max(i, j)) for j in rest[meet].tolist())


def find_joints(assembly: Assembly, gap: float | None = None) -> list[Joint]:
    """All joints, by pairs of blocks in their order.

    gap: largest distance, or depth of overlap, of two faces that touch (m); None for a five-hundredth of the
    median size of the blocks.
    """
    gap = default_gap(assembly) if gap is None else gap
    blocks = assembly.blocks
    low = np.array([block.vertices.min(axis=0) for block in blocks])
    high = np.array([block.vertices.max(axis=0) for block in blocks])
    faces: dict[int, list[Face]] = {}
    joints: list[Joint] = []
    for i, j in sorted(near_pairs(low, high, gap)):
        if blocks[i].fixed and blocks[j].fixed:
            continue
        for k in (i, j):
            if k not in faces:
                faces[k] = faces_of(blocks[k])
        joints += _between(blocks, i, j, faces, gap)
    return joints


def _between(
    blocks: Sequence[Block], i: int, j: int, faces: dict[int, list[Face]], gap: float
) -> list[Joint]:
    """Joints of blocks i and j; the lower or fixed block is b, so that normals point up or off supports."""
    a, b = (i, j) if blocks[j].fixed or not blocks[i].fixed else (j, i)
    least = LEAST * min(blocks[i].size, blocks[j].size) ** 2
    mu = float(np.sqrt(blocks[i].friction * blocks[j].friction))
    found = []
    others = faces[b]
    normals = np.array([face.normal for face in others])
    lows = np.array([face.low for face in others])
    highs = np.array([face.high for face in others])
    for face in faces[a]:
        opposed = normals @ face.normal < -PARALLEL
        meet = np.all((lows <= face.high + gap) & (highs >= face.low - gap), axis=1)
        for k in np.flatnonzero(opposed & meet).tolist():
            joint = _joint(a, b, face, others[k], gap, mu, least)
            if joint is not None:
                found.append(joint)
    return found


def _joint(a: int, b: int, face: Face, other: Face, gap: float, mu: float, least: float) -> Joint | None:
    normal = other.normal - face.normal
    normal = normal / np.linalg.norm(normal)
    axes = plane_axes(normal)
    origin = face.parts[0][0]
    # Both sides in the plane, counter-clockwise about the normal of the joint.
    upper = [((part - origin) @ axes.T)[::-1] for part in face.parts]
    lower = [(part - origin) @ axes.T for part in other.parts]
    pieces = []
    total = 0.0
    lows, highs = (np.array([edge(part, axis=0) for part in lower]) for edge in (np.min, np.max))
    for first in upper:
        meet = np.all((first.min(axis=0) <= highs) & (lows <= first.max(axis=0)), axis=1)
        for k in np.flatnonzero(meet).tolist():
            piece = common(first, lower[k])
            if len(piece) and (size := area(piece)) > 0:
                pieces.append(piece)
                total += size
    if total <= least:
        return None
    corners = hull(np.concatenate(pieces))
    if len(corners) < 3:
        return None
    above = _heights(corners, face, origin, axes, normal)
    below = _heights(corners, other, origin, axes, normal)
    apart = above - below
    if np.abs(apart).max() > gap:
        return None
    points = origin + corners @ axes + np.outer((above + below) / 2, normal)
    return Joint(a, b, points, normal, total, mu, float(apart[np.argmax(np.abs(apart))]))


def _heights(points: Array, face: Face, origin: Array, axes: Array, normal: Array) -> Array:
    """Heights of the plane of a face along the normal of the joint, above plane points (k, 2)."""
    base = (face.parts[0][0] - origin) @ face.normal
    return (base - (points @ axes) @ face.normal) / (normal @ face.normal)


def require_joined(
    assembly: Assembly, joints: Sequence[Joint], gap: float, ties: Iterable[tuple[int, int]] = ()
) -> None:
    """InputError that names the blocks that no chain of joints connects with a support.

    ties: pairs of blocks that joints of a model connect; -1 is the world.
    """
    blocks = assembly.blocks
    ties = list(ties)
    supports = [i for i, block in enumerate(blocks) if block.fixed]
    supports += [WORLD] * any(WORLD in pair for pair in ties)
    if not supports:
        low = min(blocks, key=lambda block: float(block.vertices[:, 2].min()))
        raise InputError(
            f"no block is a support; name some, as supports={[low.name]!r} (the lowest block), "
            'or give supports="lowest" or supports="ground"'
        )
    group = connected(len(blocks) + 1, (*((joint.a, joint.b) for joint in joints), *ties))
    held = {group[i] for i in supports}
    loose = [block.name for i, block in enumerate(blocks) if group[i] not in held]
    if loose:
        names = listed([*map(repr, loose)], 5)
        raise InputError(
            f"block {names}: no chain of joints leads to a support, with faces at most {gap:.3g} m apart; "
            "give a larger gap=, check the unit of the file, or make it a support"
        )
