"""Orientations from what users have: matrices, Euler angles, a direction to look along."""

from __future__ import annotations

import numpy as np

from ..checks import Array, Matrix3, Numbers, Quaternion, finite, reals, unit_vector, vector3
from ..errors import InputError
from .transforms import axis_angle, multiply, subtract

RIGHT = 1e-6
"""How far the product of a matrix and its transpose may be from the identity"""
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def from_matrix(matrix: Numbers | Matrix3) -> Quaternion:
    """The unit quaternion (w, x, y, z) of a rotation matrix (3, 3), whose columns are the turned axes.

    Raises InputError for a matrix that is no rotation.

    >>> from_matrix(np.eye(3))
    (1.0, 0.0, 0.0, 0.0)
    """
    m = finite("matrix", reals("matrix", matrix))
    if m.shape != (3, 3):
        raise InputError(f"matrix has shape {m.shape}; it must be (3, 3)")
    if np.abs(m @ m.T - np.eye(3)).max() > RIGHT or np.linalg.det(m) < 0:
        raise InputError("matrix is no rotation: its columns must be three right-handed unit vectors")
    return quaternion_of(m)


def quaternion_of(m: Array) -> Quaternion:
    """The quaternion of a rotation matrix, by the largest of its four parts (Shepperd, 1978)."""
    trace = np.trace(m)
    products = np.empty((4, 4))
    products[0, 0], products[1:, 1:] = 1 + trace, m + m.T + np.diag(np.full(3, 1 - trace))
    products[0, 1:] = products[1:, 0] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    row = products[int(np.diag(products).argmax())]
    return tuple((row / np.linalg.norm(row)).tolist())  # type: ignore[return-value]


def from_euler(axes: str, angles: Numbers) -> Quaternion:
    """The unit quaternion (w, x, y, z) of turns about axes one after the other (rad).

    axes: "xyz" about axes that stay fixed (roll, pitch, yaw of ROS), "XYZ" about axes that turn along, as in
    SciPy; any letters x, y, z, one per angle. Raises InputError.

    >>> print(np.round(from_euler("z", [np.pi]), 9))
    [0. 0. 0. 1.]
    """
    small = isinstance(axes, str) and axes.islower()
    if not isinstance(axes, str) or not axes or not set(axes) <= set("xyz" if small else "XYZ"):
        raise InputError(f'axes is {axes!r:.100}; give letters such as "xyz" (fixed axes) or "XYZ" (turning)')
    given = np.atleast_1d(finite("angles", reals("angles", angles)))
    if given.shape != (len(axes),):
        raise InputError(f"angles has shape {given.shape}; axes = {axes!r} needs {len(axes)} angles")
    turn: Quaternion = (1.0, 0.0, 0.0, 0.0)
    for axis, angle in zip(axes.lower(), given.tolist(), strict=True):
        one = axis_angle(AXES[axis], angle)
        turn = multiply(one, turn) if small else multiply(turn, one)
    return turn


def look_at(eye: Numbers, target: Numbers, *, up: Numbers = (0.0, 0.0, 1.0)) -> Quaternion:
    """The unit quaternion (w, x, y, z) that turns x from `eye` to `target` (m), and z towards `up`.

    Raises InputError if both points are one, or `up` lies along the line.

    >>> look_at((0, 0, 0), (1, 0, 0))
    (1.0, 0.0, 0.0, 0.0)
    """
    x = np.array(
        unit_vector("look_at: target - eye", subtract(vector3("target", target), vector3("eye", eye)))
    )
    y = np.cross(unit_vector("up", up), x)
    if np.linalg.norm(y) < RIGHT:
        raise InputError("look_at: up lies along the line from eye to target; give another direction")
    y /= np.linalg.norm(y)
    return quaternion_of(np.column_stack((x, y, np.cross(x, y))))
