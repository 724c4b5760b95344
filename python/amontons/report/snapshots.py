"""Pictures of models in motion, with shades and shadows, by parallel rays: lengths keep their proportions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt

from ..checks import Array
from ..model.model import Model
from ..model.parts import WORLD
from ..model.shapes import Plane
from .colours import FIXED, FLOOR, colour_of
from .raster import Camera, Raster, shadowed
from .solids import Solid, rotation_matrix, solid_of

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
    figure.savefig(path, dpi=100)
    plt.close(figure)


class Picture:
    """The solids of a model, made once for all frames."""

    def __init__(self, model: Model, view: View) -> None:
        self.view = view.axes()
        right = self.view[0]
        to_eye = np.cross(right, (0.0, 0.0, 1.0))
        self.light = _unit(LIGHT[0] * right + LIGHT[1] * to_eye + np.array([0.0, 0.0, LIGHT[2]]))
        self.floor: float | None = None
        self.moving: list[Solid] = []
        self.fixed: list[Solid] = []
        for index, geom in enumerate(model.geoms):
            if isinstance(geom.shape, Plane):  # of these only floors are drawn
                if geom.body == WORLD and rotation_matrix(geom.frame.rotation)[2, 2] > 0.999:
                    height = geom.frame.position[2]
                    self.floor = height if self.floor is None else max(height, self.floor)
                continue
            at_rest = geom.body == WORLD or model.bodies[geom.body].motion == "fixed"
            solid = solid_of(geom, FIXED if at_rest else colour_of(type(geom.shape).__name__, index))
            (self.fixed if at_rest else self.moving).append(solid)

    def bounds(self, frames: Sequence[Frame]) -> tuple[float, float, float, float]:
        """left, right, bottom, top of all that moves in all frames; a few that fly far away do not count."""
        axes = np.array(self.view[:2])
        solids = self.moving or self.fixed
        reach = np.array([solid.radius for solid in solids])[:, None]
        places = [np.array([solid.placed(f)[0] for solid in solids]) @ axes.T for f in frames if solids]
        if not places:
            return (-1.0, 1.0, -1.0, 1.0)
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
        solids = [*self._visible(frame), *self.moving]
        for label, solid in enumerate(solids):
            solid.draw(picture, frame, label)
        if self.floor is not None:
            picture.floor(self.floor)
        shadow = self._shadow(picture, solids, frame)
        colours = np.array(
            [*(solid.colour for solid in solids), FLOOR, (1.0, 1.0, 1.0)]
        )  # -2 and -1 at the end
        direct = np.maximum(picture.normal @ self.light, 0) * (1 - 0.75 * shadow)
        brightness = AMBIENT + (1.06 - AMBIENT) * direct
        brightness[picture.label == -1] = 1.0
        floor = picture.label == -2  # in the light it is as bright as its colour, as the paper around it
        brightness[floor] = 1 - 0.3 * shadow[floor]
        image = colours[picture.label] * (brightness * _edges(picture))[:, :, None]
        blocks = np.clip(image, 0, 1).reshape(height // SAMPLES, SAMPLES, width // SAMPLES, SAMPLES, 3)
        return blocks.mean(axis=(1, 3))

    def _visible(self, frame: Frame) -> list[Solid]:
        """What is fixed and does not stand between the eye and what moves."""
        if not self.moving:
            return self.fixed
        eye = self.view[2]
        middle = np.mean([eye @ solid.placed(frame)[0] for solid in self.moving])
        return [solid for solid in self.fixed if eye @ solid.placed(frame)[0] <= middle]

    def _shadow(self, picture: Raster, solids: list[Solid], frame: Frame, texels: int = 1400) -> Array:
        """The share of light that each pixel misses, from the depths that the light sees."""
        if not solids:
            return np.zeros(picture.depth.shape)
        axes = _axes(self.light)
        centres = np.array([solid.placed(frame)[0] for solid in solids])
        reach = np.array([solid.radius for solid in solids])[:, None]
        flat = centres @ np.array(axes[:2]).T
        low, high = (flat - reach).min(axis=0), (flat + reach).max(axis=0)
        pixel = float((high - low).max()) / (texels - 8)
        columns, rows = (int(n) + 8 for n in np.ceil((high - low) / pixel))
        light = Raster(Camera(*axes, low[0] - 4 * pixel, low[1] - 4 * pixel, pixel, columns, rows))
        for label, solid in enumerate(solids):
            solid.draw(light, frame, label)
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
