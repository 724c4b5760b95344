"""Mass of the bodies of USD: what MassAPI says, else the shapes with their densities (UsdPhysics, Mass)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....model.mass import NOTHING, MassProperties
from ....model.shapes import Shape
from ....model.transforms import IDENTITY, Transform
from .stage import Scene, quaternion

DENSITY = 1000.0
"""kg/m^3, the default of UsdPhysics"""


@dataclass(frozen=True)
class Part:
    """A collider of a body."""

    prim: Any
    shape: Shape
    frame: Transform
    density: float
    """of its material (kg/m^3), 0 without one"""


def body_mass(scene: Scene, prim: Any, scale: Any, parts: list[Part]) -> tuple[MassProperties, bool]:
    """In the frame of the body, and whether the moments of inertia had to be made up."""
    own_density = _density(scene, prim)
    total = NOTHING
    for part in parts:
        if not (part.shape.static_only and part.shape.core is None):
            total = total + _of_part(scene, part, own_density)
    mass = _mass(scene, prim)
    if mass <= 0 and not total.mass:
        mass = scene.kilogram
    if mass > 0:
        total = total.scaled(mass / total.mass) if total.mass else MassProperties(mass, *_none())
    centre = _centre(scene, prim, scale)
    if centre is not None:
        total = MassProperties(total.mass, centre, total.inertia)
    moments = _moments(scene, prim)
    if moments is not None:
        made = MassProperties(total.mass, (0.0, 0.0, 0.0), moments[0])
        turned = made.moved(Transform(rotation=moments[1]))
        total = MassProperties(total.mass, total.centre_of_mass, turned.inertia)
    if any(total.inertia[k][k] > 0 for k in range(3)):
        return total, False
    radius = (total.mass / (4 / 3 * math.pi * DENSITY)) ** (1 / 3)
    ball = 0.4 * total.mass * radius**2
    return MassProperties(total.mass, total.centre_of_mass, _diagonal((ball, ball, ball))), True


def _none() -> tuple[Any, Any]:
    return NOTHING.centre_of_mass, NOTHING.inertia


def _density(scene: Scene, prim: Any) -> float:
    return _not_negative(scene, prim, "physics:density") * scene.kilogram / scene.metre**3


def _mass(scene: Scene, prim: Any) -> float:
    return _not_negative(scene, prim, "physics:mass") * scene.kilogram


def _not_negative(scene: Scene, prim: Any, name: str) -> float:
    value = scene.number(prim, name)
    if value < 0 or math.isinf(value):
        raise scene.error(prim, f"{name} = {value:g}; it must be positive, or 0 where it follows from shapes")
    return value


def _of_part(scene: Scene, part: Part, own_density: float) -> MassProperties:
    density = _density(scene, part.prim) or own_density or part.density or DENSITY
    solid = part.shape.mass_properties(density)
    given = _mass(scene, part.prim)
    if given > 0 and solid.mass:
        solid = solid.scaled(given / solid.mass)
    return solid.moved(part.frame)


def _centre(scene: Scene, prim: Any, scale: Any) -> tuple[float, float, float] | None:
    """m; minus infinity in the file says that it follows from the shapes."""
    value = scene.get(prim, "physics:centerOfMass")
    if value is None or not np.isfinite(np.array(value)).all():
        return None
    return tuple((scene.metre * np.array(value, dtype=np.float64) * scale).tolist())


def _moments(scene: Scene, prim: Any) -> tuple[Any, Any] | None:
    """Principal moments as a tensor (kg m^2), and their axes; None where they follow from the shapes."""
    value = scene.get(prim, "physics:diagonalInertia")
    if value is None or not any(value):
        return None
    moments = scene.kilogram * scene.metre**2 * np.array(value, dtype=np.float64)
    axes = scene.get(prim, "physics:principalAxes")
    return _diagonal(moments.tolist()), IDENTITY if axes is None else quaternion(axes)


def _diagonal(values: Any) -> Any:
    return tuple(tuple(row) for row in np.diag(values).tolist())
