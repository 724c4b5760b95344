"""Pictures of a model in motion, with shades and shadows: who sees it, from where, and what is drawn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..checks import Array, chosen, entries, number, positive
from ..errors import InputError
from ..model.model import Model
from ..model.parts import WORLD
from ..model.shapes import Plane
from ..simulation.step_report import Table
from .batches import Batch, shapes_of, visuals_of
from .colours import FLOOR
from .extents import Balls, window_of
from .force_lines import force_lines, line_rows, width_per_newton
from .joint_lines import joint_lines

LIGHT = (0.25, 0.7, 0.75)
"""Where it comes from: along the view to the right, towards the eye, up."""
FIXED = ("glass", "show", "hide")
GLASS = 0.25
"""Opacity of what is fixed where something that moves is behind it."""
FADE = 0.6
"""Share of white in everything but the lines of forces, where they are drawn."""
TILES = 8
"""The tiles of a plane from side to side of a picture, at least."""
NO_LINES = np.zeros((0, 10))
FIELD = 40.0
"""Degrees that are seen from side to side by an eye at a distance, unless a width is given."""


@dataclass(frozen=True)
class View:
    """Where the eye is and what it sees. Raises InputError naming the field."""

    azimuth: float = -60.0
    """degrees about z from the x axis"""
    elevation: float = 20.0
    """degrees above the horizon"""
    target: str | int | Sequence[float] | None = None
    """what is in the middle: a point (m), or a body, which the eye follows; None: the middle of what moves"""
    width: float | None = None
    """what is seen at the target from side to side (m); None: all that moves, or FIELD with a distance"""
    distance: float | None = None
    """of the eye from the target (m); None: infinite, so that rays are parallel"""
    fixed: str = "glass"
    """what does not move: "glass" lets what moves behind it shine through, "show" hides it, "hide" leaves
    what is fixed out, but for planes"""
    forces: bool | float = False
    """draw the contact forces as lines between the bodies, as wide as the force is large: by so many m per N,
    or, if True, the largest half as wide as a body"""
    collision: bool = False
    """draw what touches in place of what the model looks like"""
    joints: bool = False
    """draw joints: pins of hinges, rods from the bodies, strings"""

    def __post_init__(self) -> None:
        number("azimuth", self.azimuth)
        number("elevation", self.elevation)
        for name in ("width", "distance"):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name))
        if not isinstance(self.target, str | int | None):
            entries("target", self.target, 3)
        if not isinstance(self.forces, bool):
            positive("forces", self.forces)
        chosen("fixed", self.fixed, dict.fromkeys(FIXED, True))

    def axes(self) -> tuple[Array, Array, Array]:
        """Unit vectors to the right, up, and towards the eye."""
        a, e = np.radians([self.azimuth, self.elevation])
        eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return right, np.cross(eye, right), eye


@dataclass(frozen=True)
class Frame:
    """A moment: time (s), positions (n, 3) and orientations (n, 4) of the bodies; contacts for forces."""

    time: float
    positions: Array
    orientations: Array
    contacts: Table | None = None


@dataclass(frozen=True)
class Framing:
    """Settings that all pictures of a series share."""

    target: Array | int
    """(3,) or a body"""
    width: float
    """at the target (m)"""
    per_newton: float = 0.0
    """width of the lines of forces (m/N)"""

    def target_in(self, frame: Frame) -> Array:
        """(3,) in the world."""
        return frame.positions[self.target] if isinstance(self.target, int) else self.target


class Picture:
    """A model as surfaces, made once for all its pictures."""

    def __init__(self, model: Model, view: View | None = None) -> None:
        self.model, self.view = model, view or View()
        self._origin = _origin(model, self.view.target)
        batches = (shapes_of if self.view.collision else visuals_of)(model)
        self.balls = Balls.of(batches)
        self._scene = _scene(model, batches, self.view.fixed)
        self._style = _style(self.view)

    def framing(self, frames: Sequence[Frame], aspect: float) -> Framing:
        """Window around all moving parts in all frames, except those far from all others, for pictures
        `aspect` times as wide as high.
        """
        view = self.view
        places, (left, right, bottom, top) = self._window(frames)
        width = max(right - left, aspect * (top - bottom)) if view.width is None else view.width
        if view.width is None and view.distance is not None:
            width = 2 * view.distance * math.tan(math.radians(FIELD / 2))
        target = self._origin
        if view.target is None:
            # The point on the line of sight through the middle of the window that is as deep as the middle of
            # all parts.
            depths = [np.median(place @ view.axes()[2]) for place in places if len(place)]
            depth = np.mean(depths) if depths else 0.0
            target = np.array([(left + right) / 2, (bottom + top) / 2, depth]) @ np.array(view.axes())
        per_newton = float(view.forces)
        if view.forces is True:
            tables = [frame.contacts for frame in frames if frame.contacts is not None]
            per_newton = width_per_newton(tables, self.balls.median(self.balls.thickness))
        return Framing(target, width, per_newton)

    def proportion(self, frames: Sequence[Frame]) -> float:
        """Width over height of what holds all that moves in all frames."""
        left, right, bottom, top = self._window(frames)[1]
        return (right - left) / (top - bottom)

    def _window(self, frames: Sequence[Frame]) -> tuple[list[Array], tuple[float, float, float, float]]:
        """For each frame the positions (k, 3) relative to the target; and their bounds: left, right, bottom,
        top.
        """
        axes, origin = np.array(self.view.axes()[:2]), Framing(self._origin, 1.0)
        places = [self.balls.places(frame) - origin.target_in(frame) for frame in frames]
        centred = self.view.target is not None
        reaches = [self.balls.reaches(frame, axes) for frame in frames]
        diameter = 2 * self.balls.median(self.balls.reach)
        return places, window_of([place @ axes.T for place in places], reaches, diameter, centred=centred)

    def draw(
        self, frame: Frame, framing: Framing, width: int, height: int, lines: Array = NO_LINES
    ) -> NDArray[np.uint8]:
        """(height, width, 3) red, green and blue, the highest row first.

        lines: more of them, as `line_rows` gives them.
        """
        return self._drawn(frame, framing, width, height, 2, False, lines)[0].reshape(height, width, 3)

    def probe(self, frame: Frame, framing: Framing, width: int, height: int) -> tuple[Array, Array]:
        """The first part that is visible through the middle of each pixel, the lowest row first: its number
        (as in `balls`), -1 for none, -2 - k for plane k; and its distance from the target towards the camera
        (m). Both (height, width)."""
        _, labels, depths = self._drawn(frame, framing, width, height, 1, True)
        return labels.reshape(height, width), depths.reshape(height, width)

    def _drawn(
        self,
        frame: Frame,
        framing: Framing,
        width: int,
        height: int,
        samples: int,
        probe: bool,
        lines: Array = NO_LINES,
    ) -> tuple[Array, Array, Array]:
        camera = _core.PictureCamera()
        camera.right, camera.up, camera.eye = [tuple(axis) for axis in self.view.axes()]
        camera.target = tuple(framing.target_in(frame))
        camera.distance = math.inf if self.view.distance is None else float(self.view.distance)
        camera.width, camera.height, camera.samples = width, height, samples
        camera.pixel = framing.width / width
        self._style.tile = _round_length(framing.width / TILES)
        positions = np.ascontiguousarray(frame.positions, dtype=np.float64).reshape(-1, 3)
        orientations = np.ascontiguousarray(frame.orientations, dtype=np.float64).reshape(-1, 4)
        if self.view.forces and frame.contacts is not None:
            drawn = force_lines(self.model, positions, orientations, frame.contacts, framing.per_newton)
            lines = np.concatenate((lines, line_rows(drawn)))
        if self.view.joints:
            thickness = self.balls.median(self.balls.thickness)
            lines = np.concatenate(
                (lines, line_rows(joint_lines(self.model, positions, orientations, thickness)))
            )
        return self._scene.draw(
            positions, orientations, camera=camera, style=self._style, lines=lines, probe=probe, threads=0
        )


def _origin(model: Model, target: Any) -> Array | int:
    """The point (3,) or the body that is in the middle; without any, from where places are counted."""
    if target is None:
        return np.zeros(3)
    return model.body_index(target) if isinstance(target, str | int) else np.array(target, dtype=np.float64)


def _scene(model: Model, batches: Sequence[Batch], fixed: str) -> Any:
    scene = _core.PictureScene()
    kind = _core.Appearance
    for batch in batches:
        appearance = kind.moving if batch.moves else kind.fixed
        if batch.opacity < 1:
            appearance = kind.clear
        if fixed == "hide" and not batch.moves:
            appearance = kind.hidden
        scene.add(
            np.ascontiguousarray(batch.surface.vertices, dtype=np.float64),
            np.ascontiguousarray(batch.surface.triangles, dtype=np.int32),
            flat=batch.surface.flat,
            closed=batch.surface.closed,
            bodies=batch.bodies if batch.moves else np.full(len(batch.bodies), WORLD, dtype=np.int32),
            positions=np.ascontiguousarray(batch.positions, dtype=np.float64),
            rotations=np.ascontiguousarray(batch.rotations, dtype=np.float64),
            scales=np.ascontiguousarray(batch.scales, dtype=np.float64),
            colours=batch.colours / 255.0,
            opacity=batch.opacity,
            appearance=appearance,
        )
    for geom in model.geoms:
        if isinstance(geom.shape, Plane):
            scene.add_plane(geom.body, geom.frame.position, geom.frame.rotation)
    return scene


def _style(view: View) -> Any:
    right, _, _ = view.axes()
    light = LIGHT[0] * right + LIGHT[1] * np.cross(right, (0.0, 0.0, 1.0)) + np.array([0.0, 0.0, LIGHT[2]])
    style = _core.PictureStyle()
    style.light = tuple(light / np.linalg.norm(light))
    style.glass = GLASS if view.fixed == "glass" else 1.0
    style.fade = FADE if view.forces else 0.0
    style.floor = tuple(FLOOR)
    return style


def _round_length(most: float) -> float:
    """The largest of 1, 2 or 5 times a power of ten that is at most `most`."""
    power = 10.0 ** math.floor(math.log10(most))
    return max(k for k in (power, 2 * power, 5 * power) if k <= most * (1 + 1e-9))


def frame_of(simulation: Any, *, forces: bool = False) -> Frame:
    """A copy of the present state, which the next step does not change."""
    state = simulation.state
    contacts = simulation.contacts.copy() if forces else None
    return Frame(simulation.time, state.positions.copy(), state.orientations.copy(), contacts)


def require_contacts(frames: Sequence[Frame], touching: bool, where: str) -> None:
    """InputError if `forces` is set for a recording without contacts."""
    if touching and all(frame.contacts is None or not len(frame.contacts) for frame in frames):
        raise InputError(
            f"{where}: has no contact tables, which --forces draws; record without --no-record-contacts"
        )
