"""Small helpers of the scenes: quaternions (w, x, y, z), rotations of points, checks of parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..model.builder import ModelBuilder
from ..model.parts import Material
from ..model.shapes import Shape
from ..model.transforms import axis_angle
from ..model.turns import rotate as rotate

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

X: Vector = (1.0, 0.0, 0.0)
Y: Vector = (0.0, 1.0, 0.0)
Z: Vector = (0.0, 0.0, 1.0)
about = axis_angle
STEEL = 7800.0
"""Density, kg/m^3."""


def from_z(direction: ArrayLike) -> Quaternion:
    """A rotation that takes the z axis to a direction: for capsules and cylinders, whose axis is z."""
    d = np.asarray(direction, dtype=float)
    d = d / np.linalg.norm(d)
    if d[2] < -1 + 1e-12:  # half a turn: the axis is free
        return (0.0, 1.0, 0.0, 0.0)
    q = np.array([1 + d[2], -d[1], d[0], 0.0])
    q /= np.linalg.norm(q)
    return (float(q[0]), float(q[1]), float(q[2]), float(q[3]))


def require(condition: bool, scene: str, message: str) -> None:
    """InputError that names the scene if a parameter is not usable."""
    if not condition:
        raise InputError(f"scene {scene!r}: {message}")


def add_part(
    b: ModelBuilder,
    name: str,
    shape: Shape,
    *,
    density: float,
    shape_orientation: Quaternion = (1.0, 0.0, 0.0, 0.0),
    material: Material | None = None,
    category: int = 1,
    mask: int = 1,
    **body: Any,
) -> int:
    """A body of one solid shape, turned in the body frame, with collision categories of its own; `body`:
    other arguments of `add_body`."""
    index = b.add_body(name, **body)
    b.add_geom(
        index,
        shape,
        orientation=shape_orientation,
        material=material,
        category=category,
        mask=mask,
        name=name,
        density=density,
    )
    return index
