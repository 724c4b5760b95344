"""Vectors, rotations and rigid transforms as plain tuples, checked where users hand them in.

Rotations are unit quaternions (w, x, y, z) that turn body coordinates into world coordinates.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .errors import InputError

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix3 = tuple[Vector3, Vector3, Vector3]

IDENTITY: Quaternion = (1.0, 0.0, 0.0, 0.0)
UNIT = 1e-6
"""|length - 1| up to which a quaternion counts as a unit quaternion with rounding and is normalised."""
EXACT = 1e-15
"""|length - 1| of what was normalised: it stays as it is, bit for bit, when it is read back from a file."""


def number(what: str, value: Any, *, infinite: bool = False) -> float:
    """`value` as a float, finite unless said otherwise."""
    if type(value) is not float:
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            raise InputError(f"{what} is {value!r}; it must be a number")
        value = float(value)
    if math.isnan(value) or (math.isinf(value) and not infinite):
        raise InputError(f"{what} is {value:g}; it must be {'a number' if infinite else 'finite'}")
    return value


def entries(what: str, values: Any, count: int) -> tuple[float, ...]:
    """`values` as a tuple of `count` finite floats."""
    try:
        listed = tuple(values)
    except TypeError:
        listed = ()
    if len(listed) != count or isinstance(values, str):
        raise InputError(f"{what} is {values!r}; it must have {count} numbers")
    return tuple([number(f"{what}[{i}]", x) for i, x in enumerate(listed)])


def vector3(what: str, values: Any) -> Vector3:
    return entries(what, values, 3)  # type: ignore[return-value]


def unit_vector(what: str, values: Any) -> Vector3:
    """The direction of three numbers, not all zero."""
    v = vector3(what, values)
    if abs(math.hypot(*v) - 1) < EXACT:
        return v
    scale = max(map(abs, v))
    if scale == 0:
        raise InputError(f"{what} is zero; it must be a direction")
    v = (v[0] / scale, v[1] / scale, v[2] / scale)  # no overflow or underflow in the squares
    length = math.hypot(*v)
    return (v[0] / length, v[1] / length, v[2] / length)


def quaternion(what: str, values: Any) -> Quaternion:
    """A unit quaternion; one that is so within UNIT is normalised."""
    q = entries(what, values, 4)
    length = math.hypot(*q)
    if abs(length - 1) > UNIT:
        remedy = "divide it by its length" if length > 0 else "(1, 0, 0, 0) is no rotation"
        raise InputError(f"{what} is {q}, of length {length:g}; it must be a unit quaternion: {remedy}")
    return q if abs(length - 1) < EXACT else tuple(x / length for x in q)  # type: ignore[return-value]


def add(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a: Vector3, b: Vector3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector3, b: Vector3) -> Vector3:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
        a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1],
    )


def conjugate(q: Quaternion) -> Quaternion:
    return (q[0], -q[1], -q[2], -q[3])


def rotate(q: Quaternion, v: Vector3) -> Vector3:
    u = (q[1], q[2], q[3])
    t = cross(u, v)
    t = (2 * t[0], 2 * t[1], 2 * t[2])
    s = cross(u, t)
    return (v[0] + q[0] * t[0] + s[0], v[1] + q[0] * t[1] + s[1], v[2] + q[0] * t[2] + s[2])


def rotation_matrix(q: Quaternion) -> Matrix3:
    """The matrix whose columns are the turned axes."""
    x, y, z = (rotate(q, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    return ((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]))


def axis_angle(axis: Sequence[float], angle: float) -> Quaternion:
    """The rotation by `angle` (rad) about `axis`, of any length but zero."""
    n = unit_vector("axis", axis)
    s = math.sin(angle / 2)
    return (math.cos(angle / 2), s * n[0], s * n[1], s * n[2])


def rotation_to_z(z: Vector3) -> Quaternion:
    """The shortest rotation that turns the third axis into the unit vector `z`."""
    if z[2] > -0.9999:
        half = (1 + z[2], -z[1], z[0], 0.0)
    else:  # turn by pi about x first: the half-way quaternion vanishes at -z
        half = multiply((1 - z[2], z[1], -z[0], 0.0), (0.0, 1.0, 0.0, 0.0))
    length = math.hypot(*half)
    return tuple(x / length for x in half)  # type: ignore[return-value]


@dataclass(frozen=True)
class Transform:
    """A frame in its parent: x -> rotation x + position.

    position: m. rotation: unit quaternion (w, x, y, z). `a @ b` is a after b, `a(point)` applies it,
    `a.inverse()` undoes it.
    """

    position: Vector3 = (0.0, 0.0, 0.0)
    rotation: Quaternion = IDENTITY

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", vector3("position", self.position))
        object.__setattr__(self, "rotation", quaternion("rotation", self.rotation))

    def __call__(self, point: Sequence[float]) -> Vector3:
        return add(rotate(self.rotation, vector3("point", point)), self.position)

    def __matmul__(self, other: Transform) -> Transform:
        return Transform(self(other.position), multiply(self.rotation, other.rotation))

    def inverse(self) -> Transform:
        back = conjugate(self.rotation)
        x, y, z = rotate(back, self.position)
        return Transform((-x, -y, -z), back)


ORIGIN = Transform()
