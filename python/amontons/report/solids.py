"""A model as triangles in one array each, for pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..model.model import Model
from ..model.parts import WORLD
from .batches import Batch, shapes_of, turned, visuals_of

SEEN = 0.5
"""What is more transparent than this is not drawn."""


class Moment(Protocol):
    """Positions (n, 3) and orientations (n, 4) of the bodies."""

    positions: Array
    orientations: Array


def rotation_matrix(q: Any) -> Array:
    """Of unit quaternions (..., 4), w first; (..., 3, 3)."""
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


@dataclass(frozen=True)
class Solids:
    """m things with t triangles in all; what does not move is in the world's frame."""

    corners: Array
    """(t, 3, 3): of each triangle three points in the frame of its body"""
    normals: Array
    """(t, 3, 3): unit vectors there, outwards"""
    items: NDArray[np.int64]
    """(t,): which thing a triangle belongs to"""
    bodies: NDArray[np.int64]
    """(m,): WORLD for what does not move"""
    centres: Array
    """(m, 3) in the frame of the body"""
    reach: Array
    """(m,) from there to the farthest corner (m)"""
    colours: Array
    """(m, 3) from 0 to 1"""

    @property
    def moving(self) -> NDArray[np.bool_]:
        """(m,)"""
        return self.bodies != WORLD

    def places(self, moment: Moment) -> Array:
        """(m, 3) the centres in the world."""
        R, x = _frames(moment)
        return np.einsum("nij,nj->ni", R[self.bodies], self.centres) + x[self.bodies]

    def placed(self, moment: Moment, shown: NDArray[np.bool_]) -> tuple[Array, Array, NDArray[np.int64]]:
        """Corners and normals (k, 3, 3) in the world, and the things (k,), of those that are `shown` (m,)."""
        R, x = _frames(moment)
        drawn = shown[self.items]
        items = self.items[drawn]
        turn, at = R[self.bodies[items]], x[self.bodies[items]]
        corners = np.matmul(self.corners[drawn], turn.transpose(0, 2, 1)) + at[:, None]
        return corners, np.matmul(self.normals[drawn], turn.transpose(0, 2, 1)), items


def solids_of(model: Model, *, collision: bool = False) -> Solids:
    """What the model looks like, or what of it touches; planes are left out."""
    batches = [b for b in (shapes_of if collision else visuals_of)(model) if b.opacity >= SEEN]
    parts = [_instances(batch) for batch in batches]
    counts = [len(batch.bodies) for batch in batches]
    first = np.concatenate(([0], np.cumsum(counts)))[:-1].astype(np.int64)
    items = [
        np.repeat(f + np.arange(n), len(b.surface.triangles))
        for f, n, b in zip(first, counts, batches, strict=True)
    ]
    bodies = [b.bodies if b.moves else np.full(len(b.bodies), WORLD) for b in batches]
    corners = _joined([part[0] for part in parts], (0, 3, 3))
    owner = _joined(items, (0,)).astype(np.int64)
    centres, reach = _balls(corners, owner, int(sum(counts)))
    return Solids(
        corners=corners,
        normals=_joined([part[1] for part in parts], (0, 3, 3)),
        items=owner,
        bodies=_joined(bodies, (0,)).astype(np.int64),
        centres=centres,
        reach=reach,
        colours=_joined([batch.colours / 255 for batch in batches], (0, 3)),
    )


def _instances(batch: Batch) -> tuple[Array, Array]:
    """Corners and normals (n t, 3, 3) of n instances of t triangles."""
    surface = batch.surface
    scaled = surface.vertices.astype(np.float64) * batch.scales[:, None, :]
    triangles = surface.triangles.astype(np.int64)
    count = len(surface.vertices)
    q = np.repeat(batch.rotations, count, axis=0)
    points = turned(q, scaled.reshape(-1, 3)).reshape(scaled.shape) + batch.positions[:, None, :]
    corners = points[:, triangles]
    area = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    if surface.flat:
        normals = np.broadcast_to(area[:, :, None], corners.shape)
    else:  # of each vertex the mean over its triangles, by their areas
        sums = np.zeros_like(points)
        for k in range(3):
            np.add.at(sums, (slice(None), triangles[:, k]), area)
        normals = sums[:, triangles]
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = normals / np.where(lengths > 0, lengths, 1.0)
    return corners.reshape(-1, 3, 3), normals.reshape(-1, 3, 3)


def _balls(corners: Array, items: NDArray[np.int64], count: int) -> tuple[Array, Array]:
    """Of each thing the middle of its bounds, and how far it reaches from there."""
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    for k in range(3):
        np.minimum.at(low, items, corners[:, k])
        np.maximum.at(high, items, corners[:, k])
    centres = (low + high) / 2
    reach = np.zeros(count)
    for k in range(3):
        np.maximum.at(reach, items, np.linalg.norm(corners[:, k] - centres[items], axis=1))
    return centres, reach


def _frames(moment: Moment) -> tuple[Array, Array]:
    """Rotations and origins of the bodies, and at the end, index -1, of the world."""
    R = np.concatenate((rotation_matrix(moment.orientations).reshape(-1, 3, 3), np.eye(3)[None]))
    return R, np.concatenate((np.asarray(moment.positions).reshape(-1, 3), np.zeros((1, 3))))


def _joined(parts: Sequence[Array], empty: tuple[int, ...]) -> Array:
    return np.concatenate(parts) if parts else np.zeros(empty)
