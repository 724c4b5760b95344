"""Small changes of generalised coordinates along generalised velocities, and back."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..checks import Array
from ..model.model import Model
from ..model.turns import conjugate, exponential, logarithm, product


def integrate(model: Model, q: Array, change: Array) -> Array:
    """q after a time 1 with constant velocities `change`, (..., nv): quaternions turn about axes of theirs.

    q: (..., nq), or one for all.
    """
    moved = np.broadcast_to(q, (*change.shape[:-1], model.nq)).copy()
    for at, rates in linear_entries(model):
        moved[..., at] += change[..., rates]
    for at, rates in rotations(model):
        moved[..., at] = product(moved[..., at], exponential(change[..., rates]))
    return moved


def difference(model: Model, first: Array, last: Array) -> Array:
    """The change, (..., nv), for which integrate(first, change) is last; first and last: (..., nq)."""
    change = np.zeros((*np.broadcast_shapes(first.shape, last.shape)[:-1], model.nv))
    for at, rates in linear_entries(model):
        change[..., rates] = last[..., at] - first[..., at]
    for at, rates in rotations(model):
        change[..., rates] = logarithm(product(conjugate(first[..., at]), last[..., at]))
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


def along_velocities(model: Model, q: Array, slope: Array) -> Array:
    """Derivatives over changes of q along qd, (nv,), from those over the entries of q, (nq,)."""
    found = np.zeros(model.nv)
    for at, rates in linear_entries(model):
        found[rates] = slope[at]
    for at, rates in rotations(model):
        # Turned by a vector r, q changes by q (0, r) / 2.
        found[rates] = 0.5 * product(conjugate(q[at]), slope[at])[1:]
    return found


def of_coordinates(model: Model, q: Array, slope: Array) -> Array:
    """The inverse: derivatives over the entries of q, (nq,), of which none is along a quaternion."""
    found = np.zeros(model.nq)
    for at, rates in linear_entries(model):
        found[at] = slope[rates]
    for at, rates in rotations(model):
        found[at] = 2 * product(q[at], np.concatenate([[0.0], slope[rates]]))
    return found
