"""Rotations of many at once: unit quaternions (w, x, y, z) in the last axis of arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..checks import Array

SMALL = 1e-8
"""rad: below it sin(x) / x is 1 to rounding"""


def rotate(q: ArrayLike, v: ArrayLike) -> Array:
    """Vectors turned by quaternions."""
    q, v = np.asarray(q, dtype=float), np.asarray(v, dtype=float)
    t = 2 * np.cross(q[..., 1:], v)
    return v + q[..., :1] * t + np.cross(q[..., 1:], t)


def product(a: Array, b: Array) -> Array:
    """Two turns one after the other: first b, then a."""
    a0, a1, a2, a3 = (a[..., k] for k in range(4))
    b0, b1, b2, b3 = (b[..., k] for k in range(4))
    turned = (
        a0 * b0 - (a1 * b1 + a2 * b2 + a3 * b3),
        a0 * b1 + b0 * a1 + (a2 * b3 - a3 * b2),
        a0 * b2 + b0 * a2 + (a3 * b1 - a1 * b3),
        a0 * b3 + b0 * a3 + (a1 * b2 - a2 * b1),
    )
    return np.stack(turned, axis=-1)


def conjugate(a: Array) -> Array:
    """The turns back."""
    return a * (1.0, -1.0, -1.0, -1.0)


def exponential(rotation: Array) -> Array:
    """The quaternion that turns about a vector by its length (rad)."""
    angle = np.linalg.norm(rotation, axis=-1, keepdims=True)
    some = np.maximum(angle, SMALL)
    by = np.where(angle < SMALL, 0.5, np.sin(some / 2) / some)
    return np.concatenate([np.cos(angle / 2), by * rotation], axis=-1)


def logarithm(a: Array) -> Array:
    """The shortest rotation vector (rad) of a unit quaternion."""
    a = np.where(a[..., :1] < 0, -a, a)
    half = np.linalg.norm(a[..., 1:], axis=-1, keepdims=True)
    some = np.maximum(half, SMALL)
    return a[..., 1:] * np.where(half < SMALL, 2.0, 2 * np.arctan2(some, a[..., :1]) / some)
