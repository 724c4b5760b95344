"""A picture by depth buffer: triangles seen by parallel rays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..checks import Array

AT_ONCE = 1_000_000
"""Pixels looked at side by side."""


@dataclass(frozen=True)
class Camera:
    """Parallel rays: unit vectors to the right, up and towards the eye; the window they fill."""

    right: Array
    up: Array
    eye: Array
    left: float
    bottom: float
    pixel: float
    """size of a pixel (m)"""
    width: int
    height: int

    def seen(self, points: Array) -> Array:
        """(n, 3) world to column, row (pixels from the lower left corner) and depth (m, towards the eye)."""
        x, y = (points @ self.right - self.left) / self.pixel, (points @ self.up - self.bottom) / self.pixel
        return np.column_stack((x, y, points @ self.eye))

    def points(self, depth: Array) -> Array:
        """(h, w, 3) the points of the world that lie at a depth under each pixel."""
        x = self.left + (np.arange(self.width) + 0.5) * self.pixel
        y = self.bottom + (np.arange(self.height) + 0.5) * self.pixel
        plane = x[None, :, None] * self.right + y[:, None, None] * self.up
        return plane + depth[:, :, None] * self.eye


class Raster:
    """What each pixel shows: depth (m), the number of the object (-1 for none) and the normal."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera
        shape = (camera.height, camera.width)
        self.depth = np.full(shape, -np.inf)
        self.label = np.full(shape, -1, dtype=np.int32)
        self.normal = np.zeros((*shape, 3))

    def triangles(self, corners: Array, labels: Array, normals: Array | None = None) -> None:
        """Triangles (n, 3, 3), counter-clockwise for the eye, of the objects `labels` (n,).

        normals: (n, 3, 3) at the corners, between which they are interpolated; None leaves them zero.
        """
        seen = self.camera.seen(corners.reshape(-1, 3)).reshape(-1, 3, 3)
        x, y = seen[..., 0], seen[..., 1]
        area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
        # The pixels whose centres may lie inside.
        low = [np.maximum(np.ceil(v.min(axis=1) - 0.5), 0).astype(int) for v in (x, y)]
        ends = (self.camera.width, self.camera.height)
        high = [
            np.minimum(np.floor(v.max(axis=1) - 0.5), end - 1).astype(int)
            for v, end in zip((x, y), ends, strict=True)
        ]
        size = np.where(area > 1e-12, np.maximum(high[0] - low[0], high[1] - low[1]) + 1, 0)
        size[(high[0] < low[0]) | (high[1] < low[1])] = 0
        side = 1
        while side < 2 * max(ends):  # those of about one size at once, each in a square of pixels
            group = np.flatnonzero((size > side // 2) & (size <= side))
            for part in np.array_split(group, 1 + len(group) * side * side // AT_ONCE):
                if len(part):
                    window = (low[0][part], low[1][part], high[0][part], high[1][part])
                    self._fill(
                        side,
                        window,
                        seen[part],
                        area[part],
                        labels[part],
                        None if normals is None else normals[part],
                    )
            side *= 2

    def _fill(
        self,
        side: int,
        window: tuple[Array, ...],
        seen: Array,
        area: Array,
        labels: Array,
        normals: Array | None,
    ) -> None:
        """Triangles (k, 3, 3) seen within squares of pixels; barycentric weights say what lies inside."""
        step = np.arange(side)
        columns = window[0][:, None, None] + step[None, None, :]
        rows = window[1][:, None, None] + step[None, :, None]
        dx = [seen[:, k, 0, None, None] - (columns + 0.5) for k in range(3)]
        dy = [seen[:, k, 1, None, None] - (rows + 0.5) for k in range(3)]
        size = area[:, None, None]
        weights = [
            (dx[(k + 1) % 3] * dy[(k + 2) % 3] - dx[(k + 2) % 3] * dy[(k + 1) % 3]) / size for k in range(3)
        ]
        inside = (np.minimum(np.minimum(weights[0], weights[1]), weights[2]) >= 0) & (
            (columns <= window[2][:, None, None]) & (rows <= window[3][:, None, None])
        )
        owner = np.nonzero(inside)[0]
        share = np.stack([w[inside] for w in weights])
        pixels = (rows * self.camera.width + columns)[inside]
        depth = (share * seen[owner, :, 2].T).sum(axis=0)
        flat = self.depth.reshape(-1)
        np.maximum.at(flat, pixels, depth)
        nearest = flat[pixels] == depth
        pixels, owner = pixels[nearest], owner[nearest]
        self.label.reshape(-1)[pixels] = labels[owner]
        if normals is not None:
            mixed = np.einsum("kp,pki->pi", share[:, nearest], normals[owner])
            mixed /= np.maximum(np.linalg.norm(mixed, axis=1, keepdims=True), 1e-12)
            self.normal.reshape(-1, 3)[pixels] = mixed

    def floor(self, level: float) -> None:
        """The plane z = level behind everything, where the eye is above it; label -2."""
        c = self.camera
        y = c.bottom + (np.arange(c.height) + 0.5) * c.pixel
        if c.eye[2] < 1e-3:
            return
        depth = np.broadcast_to(((level - y * c.up[2]) / c.eye[2])[:, None], self.depth.shape)
        seen = np.isneginf(self.depth) | (self.depth < depth)
        self.depth[seen], self.label[seen] = depth[seen], -2
        self.normal[seen] = (0.0, 0.0, 1.0)


def shadowed(picture: Raster, light: Raster) -> Array:
    """(h, w) the share of light that each pixel of the picture misses, softened over 3 x 3 texels."""
    points = picture.camera.points(np.where(np.isfinite(picture.depth), picture.depth, 0.0))
    # A texel of the light is as deep as the surface within it is steep: that much is no shadow.
    steep = np.clip(picture.normal @ light.camera.eye, 0.15, 1)
    seen = light.camera.seen((points + picture.normal * (2 * light.camera.pixel)).reshape(-1, 3))
    columns = np.clip(seen[:, 0].astype(int), 1, light.camera.width - 2).reshape(picture.depth.shape)
    rows = np.clip(seen[:, 1].astype(int), 1, light.camera.height - 2).reshape(picture.depth.shape)
    depth = seen[:, 2].reshape(picture.depth.shape) + 2 * light.camera.pixel / steep
    missing = sum(
        (light.depth[rows + i, columns + j] > depth).astype(float) for i in (-1, 0, 1) for j in (-1, 0, 1)
    )
    return np.where(np.isfinite(picture.depth), missing / 9, 0.0)
