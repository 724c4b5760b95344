"""Small changes of generalised coordinates along generalised velocities, and back."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..checks import Array
from ..model.model import Model

SMALL = 1e-8
"""rad: below it sin(x) / x is 1 to rounding"""


def integrate(model: Model, q: Array, change: Array) -> Array:
    """q after a time 1 with constant velocities `change`, (nv,): quaternions turn about axes of theirs."""
    moved = q.copy()
    for at, rates in linear_entries(model):
        moved[at] += change[rates]
    for at, rates in rotations(model):
        moved[at] = product(q[at], exponential(change[rates]))
    return moved


def difference(model: Model, first: Array, last: Array) -> Array:
    """The change, (nv,), for which integrate(first, change) is last."""
    change = np.zeros(model.nv)
    for at, rates in linear_entries(model):
        change[rates] = last[at] - first[at]
    for at, rates in rotations(model):
        change[rates] = logarithm(product(conjugate(first[at]), last[at]))
    return change


def differences(model: Model, first: Array, last: Array) -> Array:
    """`difference` of many, (rows, nv), of (rows, nq) each."""
    change = np.zeros((len(first), model.nv))
    for at, rates in linear_entries(model):
        change[:, rates] = last[:, at] - first[:, at]
    for at, rates in rotations(model):
        for row, (a, b) in enumerate(zip(first[:, at], last[:, at], strict=True)):
            change[row, rates] = logarithm(product(conjugate(a), b))
    return change


def linear_entries(model: Model) -> Iterator[tuple[slice, slice]]:
    """Entries of q and qd that are lengths and angles."""
    for c in model.coordinates.values():
        if c.kind == "free":
            yield slice(c.q.start, c.q.start + 3), slice(c.qd.start, c.qd.start + 3)
        elif c.kind != "ball":
            yield c.q, c.qd


def rotations(model: Model) -> Iterator[tuple[slice, slice]]:
    """Entries of q that are quaternions, and those of qd that are angular velocities, in the turned axes."""
    for c in model.coordinates.values():
        if c.kind in ("free", "ball"):
            yield slice(c.q.stop - 4, c.q.stop), slice(c.qd.stop - 3, c.qd.stop)


def angles(model: Model) -> Array:
    """(nv,) of bool: which entries of qd are rad/s, the others are m/s."""
    turning = np.zeros(model.nv, dtype=bool)
    for c in model.coordinates.values():
        turning[c.qd] = c.kind == "hinge"
    for _, rates in rotations(model):
        turning[rates] = True
    return turning


def product(a: Array, b: Array) -> Array:
    """Two turns one after the other: quaternions w, x, y, z."""
    u, v = a[1:], b[1:]
    return np.array([a[0] * b[0] - u @ v, *(a[0] * v + b[0] * u + np.cross(u, v))])


def conjugate(a: Array) -> Array:
    return a * (1.0, -1.0, -1.0, -1.0)


def exponential(rotation: Array) -> Array:
    """The quaternion that turns about a vector by its length (rad)."""
    angle = float(np.linalg.norm(rotation))
    by = 0.5 if angle < SMALL else math.sin(angle / 2) / angle
    return np.array([math.cos(angle / 2), *(by * rotation)])


def logarithm(a: Array) -> Array:
    """The shortest rotation vector (rad) of a unit quaternion."""
    a = -a if a[0] < 0 else a
    half = float(np.linalg.norm(a[1:]))
    return a[1:] * (2.0 if half < SMALL else 2 * math.atan2(half, a[0]) / half)
