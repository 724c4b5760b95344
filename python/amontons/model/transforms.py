"""Vectors, rotations and rigid transforms as plain tuples.

Rotations are unit quaternions (w, x, y, z) that turn body coordinates into world coordinates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from .. import checks
from ..checks import Matrix3, Numbers, Quaternion, Vector3, changed, number, quaternion, unit_vector

IDENTITY: Quaternion = (1.0, 0.0, 0.0, 0.0)


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


def axis_angle(axis: Numbers, angle: float) -> Quaternion:
    """The unit quaternion (w, x, y, z) of the rotation by `angle` (rad) about `axis`, of any length but zero.

    builder.add_body(..., orientation=amontons.axis_angle((0, 0, 1), math.radians(90)))

    Raises InputError naming the argument.

    >>> print(np.round(axis_angle((0, 0, 1), np.pi), 9))
    [0. 0. 0. 1.]
    """
    angle = number("angle", angle)
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

    >>> turned = Transform((1, 0, 0), axis_angle((0, 0, 1), np.pi / 2))
    >>> print(np.round(turned((1, 0, 0)), 9))
    [1. 1. 0.]
    """

    position: Vector3 = (0.0, 0.0, 0.0)
    rotation: Quaternion = IDENTITY

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", checks.point("position", self.position))
        object.__setattr__(self, "rotation", quaternion("rotation", self.rotation))

    @classmethod
    def named(cls, who: str, position: Numbers, orientation: Numbers) -> Transform:
        """The same from the arguments of a builder's function; messages begin with `who` and their names."""
        at, turned = (
            checks.point(f"{who}: position", position),
            quaternion(f"{who}: orientation", orientation),
        )
        return changed(ORIGIN, position=at, rotation=turned)

    def __call__(self, point: Numbers) -> Vector3:
        return add(rotate(self.rotation, checks.point("point", point)), self.position)

    def __matmul__(self, other: Transform) -> Transform:
        return Transform(self(other.position), multiply(self.rotation, other.rotation))

    def inverse(self) -> Transform:
        back = conjugate(self.rotation)
        x, y, z = rotate(back, self.position)
        return Transform((-x, -y, -z), back)


ORIGIN = Transform()
