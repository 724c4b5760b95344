"""Pictures of models in motion, with shades and shadows, by parallel rays: lengths keep their proportions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..checks import Array
from ..model.model import Model
from ..model.parts import WORLD
from ..model.shapes import Plane
from .colours import FLOOR
from .raster import Camera, Raster, shadowed
from .solids import rotation_matrix, solids_of
from .whole import save_figure

LIGHT = (0.25, 0.7, 0.75)
"""Where it comes from: along the view to the right, towards the eye, up."""
AMBIENT = 0.42
SAMPLES = 2
"""Rays per pixel in each direction."""


@dataclass(frozen=True)
class View:
    """Where the eye is: angles (degrees) about z from the x axis, and above the horizon."""

    azimuth: float = -60.0
    elevation: float = 20.0

    def axes(self) -> tuple[Array, Array, Array]:
        """Unit vectors to the right, up, and towards the eye."""
        a, e = np.radians([self.azimuth, self.elevation])
        return _axes(np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]))


@dataclass(frozen=True)
class Frame:
    """A moment: time (s), positions (n, 3) and orientations (n, 4) of the bodies."""

    time: float
    positions: Array
    orientations: Array


def snapshots_figure(
    model: Model,
    frames: Sequence[Frame],
    path: Path,
    *,
    view: View | None = None,
    columns: int = 2,
    width: int = 1300,
) -> None:
    """The frames side by side in one PNG, `width` pixels wide, all with the same scale."""
    from .plotting import plt

    columns = min(columns, len(frames))
    rows = -(-len(frames) // columns)
    scene = Picture(model, view or View())
    left, right, bottom, top = scene.bounds(frames)
    panel = width // columns
    height = int(np.clip(panel * (top - bottom) / (right - left), 0.3 * panel, 1.5 * panel))
    figure, panels = plt.subplots(
        rows,
        columns,
        figsize=(width / 100, rows * (height / 100 + 0.25)),
        squeeze=False,
        layout="constrained",
    )
    for axes in panels.flat:
        axes.set_axis_off()
    for axes, frame in zip(panels.flat, frames, strict=False):
        image = scene.draw(frame, (left, right, bottom, top), panel, height)
        axes.imshow(image, origin="lower", interpolation="none")
        axes.set_title(f"t = {frame.time:.3g} s", loc="left", fontsize="medium")
    save_figure(figure, path, 100)


class Picture:
    """The solids of a model, made once for all frames."""

    def __init__(self, model: Model, view: View, *, collision: bool = False) -> None:
        """collision: draw what touches in place of what the model looks like."""
        self.view = view.axes()
        right = self.view[0]
        to_eye = np.cross(right, (0.0, 0.0, 1.0))
        self.light = _unit(LIGHT[0] * right + LIGHT[1] * to_eye + np.array([0.0, 0.0, LIGHT[2]]))
        self.solids = solids_of(model, collision=collision)
        self.floor: float | None = None
        for geom in model.geoms:  # of planes only floors are drawn
            flat = isinstance(geom.shape, Plane) and rotation_matrix(geom.frame.rotation)[2, 2] > 0.999
            if flat and geom.body == WORLD:
                height = geom.frame.position[2]
                self.floor = height if self.floor is None else max(height, self.floor)

    def bounds(self, frames: Sequence[Frame]) -> tuple[float, float, float, float]:
        """left, right, bottom, top of all that moves in all frames; a few that fly far away do not count."""
        axes, solids = np.array(self.view[:2]), self.solids
        counted = solids.moving if solids.moving.any() else ~solids.moving
        if not (counted.any() and frames):
            return (-1.0, 1.0, -1.0, 1.0)
        places = [solids.places(frame)[counted] @ axes.T for frame in frames]
        reach = solids.reach[counted][:, None]
        low = np.concatenate([place - reach for place in places])
        high = np.concatenate([place + reach for place in places])
        few = 0.3 if len(low) > 200 else 0.0  # per cent
        (left, bottom), (right, top) = np.percentile(low, few, axis=0), np.percentile(high, 100 - few, axis=0)
        margin = 0.04 * max(right - left, top - bottom)
        return left - margin, right + margin, bottom - margin, top + margin

    def draw(self, frame: Frame, bounds: tuple[float, float, float, float], width: int, height: int) -> Array:
        """(height, width, 3) colours from 0 to 1, the lowest row first."""
        left, right, bottom, top = bounds
        pixel = max((right - left) / width, (top - bottom) / height) / SAMPLES
        width, height = width * SAMPLES, height * SAMPLES
        left -= (width * pixel - (right - left)) / 2
        bottom -= (height * pixel - (top - bottom)) / 2
        picture = Raster(Camera(*self.view, left, bottom, pixel, width, height))
        corners, normals, items = self.solids.placed(frame, self.visible(frame))
        picture.triangles(corners, items, normals)
        if self.floor is not None:
            picture.floor(self.floor)
        shadow = self._shadow(picture, corners)
        colours = np.concatenate((self.solids.colours, [FLOOR, (1.0, 1.0, 1.0)]))  # -2 and -1 at the end
        direct = np.maximum(picture.normal @ self.light, 0) * (1 - 0.75 * shadow)
        brightness = AMBIENT + (1.06 - AMBIENT) * direct
        brightness[picture.label == -1] = 1.0
        floor = picture.label == -2  # in the light it is as bright as its colour, as the paper around it
        brightness[floor] = 1 - 0.3 * shadow[floor]
        image = colours[picture.label] * (brightness * _edges(picture))[:, :, None]
        blocks = np.clip(image, 0, 1).reshape(height // SAMPLES, SAMPLES, width // SAMPLES, SAMPLES, 3)
        return blocks.mean(axis=(1, 3))

    def visible(self, frame: Frame) -> Array:
        """(m,) what moves, and what is fixed and does not stand between the eye and what moves."""
        moving = self.solids.moving
        if not moving.any():
            return ~moving
        along = self.solids.places(frame) @ self.view[2]
        return moving | (along <= along[moving].mean())

    def _shadow(self, picture: Raster, corners: Array, texels: int = 1400) -> Array:
        """The share of light that each pixel misses, from the depths that the light sees."""
        if not len(corners):
            return np.zeros(picture.depth.shape)
        axes = _axes(self.light)
        flat = corners.reshape(-1, 3) @ np.array(axes[:2]).T
        low, high = flat.min(axis=0), flat.max(axis=0)
        texels = min(texels, max(picture.camera.width, picture.camera.height))
        pixel = float((high - low).max()) / (texels - 8)
        columns, rows = (int(n) + 8 for n in np.ceil((high - low) / pixel))
        light = Raster(Camera(*axes, low[0] - 4 * pixel, low[1] - 4 * pixel, pixel, columns, rows))
        light.triangles(corners, np.zeros(len(corners), dtype=np.int32))
        return shadowed(picture, light)


def _edges(picture: Raster) -> Array:
    """Darker where one object ends and another begins."""
    edge = np.zeros(picture.label.shape, dtype=bool)
    edge[:, 1:] |= picture.label[:, 1:] != picture.label[:, :-1]
    edge[1:, :] |= picture.label[1:, :] != picture.label[:-1, :]
    return np.where(edge, 0.72, 1.0)


def _axes(eye: Array) -> tuple[Array, Array, Array]:
    right = np.cross((0.0, 0.0, 1.0), eye)
    right = _unit(right) if np.linalg.norm(right) > 1e-9 else np.array([1.0, 0.0, 0.0])
    return right, np.cross(eye, right), eye


def _unit(v: Array) -> Array:
    return v / np.linalg.norm(v)
