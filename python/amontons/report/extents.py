"""Where the things of a model are, and the window that holds them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..model.parts import WORLD
from ..model.turns import product, rotate
from .batches import Batch

FAR = 3.0
"""Parts farther from the middle half of all than this many times its spread do not count."""
FEW = 5
"""Fewer things all count."""
MARGIN = 0.08
THIN = 0.15


class Moment(Protocol):
    """Positions (n, 3) and orientations (n, 4) of the bodies."""

    @property
    def positions(self) -> Array: ...
    @property
    def orientations(self) -> Array: ...


@dataclass(frozen=True)
class Balls:
    """The balls and the boxes around the m things of a model; what does not move is in the world's frame."""

    bodies: NDArray[np.int32]
    """(m,): WORLD for what does not move"""
    centres: Array
    """(m, 3) in the frame of the body"""
    reach: Array
    """(m,) radius (m)"""
    turns: Array
    """(m, 4) from the axes of the box to the frame of the body"""
    half: Array
    """(m, 3) half the sides of the box (m)"""
    thickness: Array
    """(m,) the shortest side of the thing, or of what is thin THIN times its diameter (m)"""

    @staticmethod
    def of(batches: Sequence[Batch]) -> Balls:
        bodies, centres = [np.zeros(0, dtype=np.int32)], [np.zeros((0, 3))]
        reach, thickness = [np.zeros(0)], [np.zeros(0)]
        turns, half = [np.zeros((0, 4))], [np.zeros((0, 3))]
        for batch in batches:
            middle, radius = batch.surface.ball
            bodies.append(batch.bodies if batch.moves else np.full(len(batch.bodies), WORLD, dtype=np.int32))
            centres.append(batch.positions + rotate(batch.rotations, batch.scales * middle))
            reach.append(radius * batch.scales.max(axis=1))
            turns.append(batch.rotations)
            half.append(np.ptp(batch.surface.vertices, axis=0) / 2 * batch.scales)
            thickness.append(np.maximum(2 * half[-1].min(axis=1), 2 * THIN * reach[-1]))
        return Balls(*(np.concatenate(parts) for parts in (bodies, centres, reach, turns, half, thickness)))

    @property
    def counted(self) -> NDArray[np.bool_]:
        """(m,) what pictures must hold: what moves, or all if nothing does."""
        moving = self.bodies != WORLD
        return moving if moving.any() else ~moving

    def median(self, sizes: Array) -> float:
        """Median of `reach` or `thickness` over the counted parts (m)."""
        return float(np.median(sizes[self.counted])) if len(sizes) else 1.0

    def places(self, moment: Moment) -> Array:
        """(k, 3) the centres in the world of the things that are counted."""
        bodies, centres = self.bodies[self.counted], self.centres[self.counted]
        if not len(bodies) or bodies[0] == WORLD:
            return centres
        return moment.positions[bodies] + rotate(moment.orientations[bodies], centres)

    def reaches(self, moment: Moment, axes: Array) -> Array:
        """(k, n) how far the things that are counted reach from their centres along axes (n, 3) of the world
        (m): the smaller bound of the ball and the box."""
        bodies, turns = self.bodies[self.counted], self.turns[self.counted]
        if len(bodies) and bodies[0] != WORLD:
            turns = product(moment.orientations[bodies], turns)
        sides = [rotate(turns, np.tile(unit, (len(turns), 1))) for unit in np.eye(3)]
        boxes = sum(
            np.abs(side @ np.asarray(axes).T) * half[:, None]
            for side, half in zip(sides, self.half[self.counted].T, strict=True)
        )
        return np.minimum(boxes, self.reach[self.counted][:, None])


def window_of(
    places: Sequence[Array], reaches: Sequence[Array], diameter: float, *, centred: bool
) -> tuple[float, float, float, float]:
    """left, right, bottom, top around the places (k, 2) of all moments, with a margin.

    reaches: (k, 2) from each place along both axes (m).
    diameter: of the median thing (m).

    A place counts unless it is farther from the range of the middle half, along an axis, than FAR times the
    larger of that range and of a thing's diameter: a body that flew away does not shrink all others.

    centred: the window is as far to the left as to the right of zero, and down as up.
    """
    if not places or not len(places[0]):
        return -1.0, 1.0, -1.0, 1.0
    at, reach = np.concatenate(places), np.concatenate(reaches)
    if len(places[0]) >= FEW:
        low, high = np.percentile(at, [25, 75], axis=0)
        far = FAR * max(float((high - low).max()), diameter)
        kept = ((at >= low - far) & (at <= high + far)).all(axis=1)
        at, reach = at[kept], reach[kept]
    (left, bottom), (right, top) = (at - reach).min(axis=0), (at + reach).max(axis=0)
    if centred:
        right, top = max(-left, right), max(-bottom, top)
        left, bottom = -right, -top
    margin = MARGIN * max(right - left, top - bottom)
    return left - margin, right + margin, bottom - margin, top + margin
