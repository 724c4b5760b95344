"""A picture by depth buffer: convex faces and spheres seen by parallel rays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..checks import Array


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

    def face(self, corners: Array, normal: Array, label: int) -> None:
        """A convex polygon, (k, 3) counter-clockwise for the eye."""
        seen = self.camera.seen(corners)
        window = self._window(*seen[:, :2].min(axis=0), *seen[:, :2].max(axis=0))
        if window is None:
            return
        x, y, rows, columns = window
        inside = np.ones((len(y), len(x)), dtype=bool)
        for (ax, ay, _), (bx, by, _) in zip(seen, np.roll(seen, -1, axis=0), strict=True):
            inside &= (bx - ax) * (y - ay)[:, None] >= (by - ay) * (x - ax)[None, :]
        # The plane of the face: normal . (corner + step) = normal . corner.
        towards, pixel = float(normal @ self.camera.eye), self.camera.pixel
        slope_x = -float(normal @ self.camera.right) * pixel / towards
        slope_y = -float(normal @ self.camera.up) * pixel / towards
        x0, y0, z0 = seen[0]
        depth = z0 + slope_x * (x - x0)[None, :] + slope_y * (y - y0)[:, None]
        self._put(rows, columns, inside, depth, label, normal)

    def sphere(self, centre: Array, radius: float, label: int) -> None:
        (x0, y0, z0) = self.camera.seen(centre[None])[0]
        r = radius / self.camera.pixel
        window = self._window(x0 - r, y0 - r, x0 + r, y0 + r)
        if window is None:
            return
        x, y, rows, columns = window
        across, along = (x - x0)[None, :] / r, (y - y0)[:, None] / r
        squared = 1 - across**2 - along**2
        height = np.sqrt(np.maximum(squared, 0))
        c = self.camera
        normal = across[..., None] * c.right + along[..., None] * c.up + height[..., None] * c.eye
        self._put(rows, columns, squared > 0, z0 + radius * height, label, normal)

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

    def _window(self, left: float, bottom: float, right: float, top: float):  # noqa: ANN202
        """Pixel centres and slices of a rectangle of the picture, or None outside it."""
        first, last = max(0, int(left)), min(self.camera.width, int(right) + 2)
        low, high = max(0, int(bottom)), min(self.camera.height, int(top) + 2)
        if first >= last or low >= high:
            return None
        x, y = np.arange(first, last) + 0.5, np.arange(low, high) + 0.5
        return x, y, slice(low, high), slice(first, last)

    def _put(
        self, rows: slice, columns: slice, inside: Array, depth: Array, label: int, normal: Array
    ) -> None:
        nearer = inside & (depth > self.depth[rows, columns])
        self.depth[rows, columns][nearer] = depth[nearer]
        self.label[rows, columns][nearer] = label
        self.normal[rows, columns][nearer] = normal[nearer] if normal.ndim == 3 else normal


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
