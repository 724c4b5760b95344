"""Plane polygons: the part that two triangles share, the hull of points, areas shared out over corners."""

from __future__ import annotations

import numpy as np

from ...checks import Array

SAME = 1e-9
"""Distance, over the size of a polygon, below which corners are one and bends are straight"""


def common(polygon: Array, other: Array) -> Array:
    """The part (k, 2) that two convex polygons share, both counter-clockwise; k is 0 if there is none.

    Clipping at each edge of the other (Sutherland and Hodgman, 1974).
    """
    kept = polygon
    for k in range(len(other)):
        if len(kept) < 3:
            return np.zeros((0, 2))
        a = other[k]
        along = other[(k + 1) % len(other)] - a
        left = along[0] * (kept[:, 1] - a[1]) - along[1] * (kept[:, 0] - a[0])
        if left.min() >= 0:
            continue
        points = []
        for i in range(len(kept)):
            j = (i + 1) % len(kept)
            if left[i] >= 0:
                points.append(kept[i])
            if (left[i] > 0 > left[j]) or (left[i] < 0 < left[j]):
                share = left[i] / (left[i] - left[j])
                points.append(kept[i] + share * (kept[j] - kept[i]))
        kept = np.array(points).reshape(-1, 2)
    return kept if len(kept) >= 3 else np.zeros((0, 2))


def area(polygon: Array) -> float:
    """Area, positive if counter-clockwise (m^2)."""
    x, y = (polygon - polygon[:1]).T if len(polygon) else np.zeros((2, 0))
    return float(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def hull(points: Array) -> Array:
    """The corners (k, 2) of the convex hull, counter-clockwise (Andrew's monotone chain, 1979).

    Points are first put on a grid of SAME times their extent, so that rounding makes neither corners nor
    gaps.
    """
    low, size = points.min(axis=0), float(np.ptp(points, axis=0).max())
    if not size > 0:
        return points[:1]
    order = np.unique(np.round((points - low) / (SAME * size)), axis=0)

    def chain(row: Array) -> list[Array]:
        made: list[Array] = []
        for p in row:
            while len(made) >= 2:
                a, b = made[-2], made[-1]
                bend = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
                if bend > 4 / SAME:
                    break
                made.pop()
            made.append(p)
        return made

    lower, upper = chain(order), chain(order[::-1])
    return low + SAME * size * np.array(lower[:-1] + upper[:-1]).reshape(-1, 2)


def shares(polygon: Array) -> Array:
    """The area of a convex polygon, shared out over its corners (k,) (m^2).

    Each triangle gives a third to each of its corners, averaged over the fans from all corners. So linear
    functions have the sum over the corners as their integral over the polygon.
    """
    k = len(polygon)
    sums = np.zeros(k)
    for start in range(k):
        turn = np.roll(np.arange(k), -start)
        for i in range(1, k - 1):
            corners = turn[[0, i, i + 1]]
            sums[corners] += area(polygon[corners]) / 3
    return sums / k


def inset(polygon: Array, depths: Array) -> Array:
    """The convex polygon with each edge k moved inwards by depths[k] (m); no corners if nothing remains."""
    lowest, highest = polygon.min(axis=0) - 1.0, polygon.max(axis=0) + 1.0
    kept = np.array([lowest, (highest[0], lowest[1]), highest, (lowest[0], highest[1])])
    span = float(np.abs(highest - lowest).max())
    for k in range(len(polygon)):
        along = polygon[(k + 1) % len(polygon)] - polygon[k]
        along = along / np.linalg.norm(along)
        inwards = np.array([-along[1], along[0]])
        a = polygon[k] + depths[k] * inwards
        box = np.array([a - span * along, a + span * along])
        half = np.concatenate((box, box[::-1] + span * inwards))
        kept = common(kept, half)
        if len(kept) < 3:
            return np.zeros((0, 2))
    return kept


def widths(polygon: Array) -> Array:
    """For each edge the mean width of a convex polygon along it: its area over its depth across (k,) (m)."""
    total = area(polygon)
    made = []
    for k in range(len(polygon)):
        along = polygon[(k + 1) % len(polygon)] - polygon[k]
        along = along / np.linalg.norm(along)
        depth = float(np.ptp(polygon @ np.array([-along[1], along[0]])))
        made.append(total / depth)
    return np.array(made)


def outwards(polygon: Array, point: Array) -> float:
    """Where a point lies: 0 at the centroid, 1 on the boundary, more outside (gauge about the centroid)."""
    weights = shares(polygon)
    centre = weights @ polygon / weights.sum()
    worst = 0.0
    for k in range(len(polygon)):
        along = polygon[(k + 1) % len(polygon)] - polygon[k]
        out = np.array([along[1], -along[0]])
        worst = max(worst, float(out @ (point - centre)) / float(out @ (polygon[k] - centre)))
    return worst
