"""The path of a track's pins around its wheels, in the plane of the track (x, z)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Circle = tuple[float, float, float]
"""x, z and radius of the path around a wheel, m."""
_SAMPLES = 3000
"""Corners per circle: the polygon deviates from the circle by half a millionth of the radius."""


def belt(circles: list[Circle]) -> NDArray[np.float64]:
    """The convex curve around the circles, counter-clockwise from the middle of its lowest side, as a
    polygon."""
    from scipy.spatial import ConvexHull  # takes longer to import than all the rest

    angles = np.arange(_SAMPLES) * (2 * np.pi / _SAMPLES)
    rim = np.column_stack([np.cos(angles), np.sin(angles)])
    points = np.vstack([(x, z) + r * rim for x, z, r in circles])
    curve = points[ConvexHull(points).vertices]
    sides = np.roll(curve, -1, axis=0) - curve
    level = np.where(
        np.abs(sides[:, 1]) < 1e-3 * np.linalg.norm(sides, axis=1), np.linalg.norm(sides, axis=1), 0
    )
    low = np.where(curve[:, 1] < curve[:, 1].mean(), level, 0)
    start = int(np.argmax(low))
    middle = (curve[start] + curve[(start + 1) % len(curve)]) / 2
    return np.vstack([middle, np.roll(curve, -start - 1, axis=0), middle])


def march(curve: NDArray[np.float64], count: int, pitch: float) -> tuple[NDArray[np.float64], float]:
    """`count` chords of length `pitch` along a curve; their `count` start points, and the length left over.

    A negative remainder says how much too long the chords are together.
    """
    lengths = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    total = lengths[-1]

    def at(s: float) -> NDArray[np.float64]:
        s = s % total
        return np.array([np.interp(s, lengths, curve[:, 0]), np.interp(s, lengths, curve[:, 1])])

    points, s = [], 0.0
    for _ in range(count):
        here = at(s)
        points.append(here)
        # The chord is shorter than the arc by a fourth-order term: a few fixed-point steps find the arc.
        step = pitch
        for _ in range(100):
            chord = float(np.linalg.norm(at(s + step) - here))
            if abs(chord - pitch) < 1e-14 * total:
                break
            step += pitch - chord
        s += step
    return np.array(points), total - s


def close(
    circles: Callable[[float], list[Circle]], count: int, pitch: float, low: float, high: float
) -> tuple[float, NDArray[np.float64]]:
    """The position of the tensioner, between `low` (slack) and `high` (tight), at which the chords close."""
    from scipy.optimize import brentq  # takes as long to import as the whole package

    def left(x: float) -> float:
        return march(belt(circles(x)), count, pitch)[1]

    if left(low) > 0 or left(high) < 0:
        raise InputError(f"a track of {count} shoes does not fit around these wheels: change their number")
    x = float(brentq(left, low, high, xtol=1e-15 * high))
    return x, march(belt(circles(x)), count, pitch)[0]
