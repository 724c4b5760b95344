"""Damage to arrays: other shapes, kinds and numbers. `BAD` says which no reader may let pass."""

from __future__ import annotations

import numpy as np

from .raw import Rng, pick

EXTREMES = [np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 0.0, -1.0]
WHOLE = [-1, -2, 0, 1, 2**31 - 1, -(2**31), 2**31, 2**62, -(2**62), 10**6, 10**9]


def other(rng: Rng, values: np.ndarray) -> np.ndarray:
    """The array with one thing changed: a number, the kind, the shape, the order, its size."""
    kinds = [number, number, kind, shape, size, sign, order, text, nothing, huge]
    return pick(rng, kinds)(rng, np.asarray(values))


def number(rng: Rng, values: np.ndarray) -> np.ndarray:
    changed = values.copy()
    if changed.size and changed.dtype.kind in "iuf":
        flat = changed.reshape(-1)
        extreme = pick(rng, EXTREMES if changed.dtype.kind == "f" else WHOLE)
        with np.errstate(all="ignore"):
            flat[rng.integers(flat.size)] = np.array(extreme).astype(changed.dtype)
    return changed


def kind(rng: Rng, values: np.ndarray) -> np.ndarray:
    to = str(pick(rng, ["f4", "f2", "i8", "i4", "i1", "u8", "c16", "?", "S3", "U3", "M8[s]", ">f8", ">i4"]))
    with np.errstate(all="ignore"):
        try:
            return values.astype(to)
        except (ValueError, TypeError, OverflowError):
            return np.zeros(values.shape, to)


def shape(rng: Rng, values: np.ndarray) -> np.ndarray:
    choices = [values.reshape(-1), values[..., None], values[None], values.T]
    if values.size:
        choices += [values.reshape(-1)[0], values.reshape(-1)[:1]]
    if values.size % 2 == 0:
        choices.append(values.reshape(2, -1))
    return np.array(pick(rng, choices))


def size(rng: Rng, values: np.ndarray) -> np.ndarray:
    flat = np.atleast_1d(values)
    n = int(rng.integers(0, max(1, len(flat))))
    return pick(rng, [flat[:n], flat[:-1], np.concatenate([flat, flat]), np.concatenate([flat, flat[:1]])])


def sign(rng: Rng, values: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return -values if values.dtype.kind in "if" else values


def order(rng: Rng, values: np.ndarray) -> np.ndarray:
    return rng.permutation(values) if values.ndim else values


def text(rng: Rng, values: np.ndarray) -> np.ndarray:
    return np.array(pick(rng, ["", "text", b"\xff\xfe", ["a", "b"], "%s%n%x"]))


def nothing(rng: Rng, values: np.ndarray) -> np.ndarray:
    return np.zeros(pick(rng, [(), (0,), (0, 3), (1, 1, 1), (5,)]))


def huge(rng: Rng, values: np.ndarray) -> np.ndarray:
    """Nothing but one number, which compresses to nothing."""
    return np.zeros(
        int(pick(rng, [10**5, 10**6])), dtype=values.dtype if values.dtype.kind in "iuf" else "f8"
    )
