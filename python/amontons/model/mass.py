"""Mass, centre and inertia of solids, and how they move and add up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..checks import Matrix3, Vector3
from .transforms import Transform


@dataclass(frozen=True)
class MassProperties:
    """Mass properties of a solid in the equations of motion."""

    mass: float
    """kg"""
    centre_of_mass: Vector3
    """m"""
    inertia: Matrix3
    """about the centre of mass, in the axes in which the centre is given (kg m^2)"""

    @classmethod
    def of(cls, solid: tuple[float, Any, Any]) -> MassProperties:
        """From what the compiled module returns: mass, centre, inertia."""
        mass, centre, inertia = solid
        return cls(mass, tuple(centre), tuple(map(tuple, inertia)))  # type: ignore[arg-type]

    def scaled(self, factor: float) -> MassProperties:
        """The same solid with `factor` times the density."""
        inertia = factor * np.array(self.inertia)
        return MassProperties(factor * self.mass, self.centre_of_mass, as_matrix(inertia))

    def _plain(self) -> tuple[float, Vector3, Matrix3]:
        return (self.mass, self.centre_of_mass, self.inertia)

    def moved(self, frame: Transform) -> MassProperties:
        """The same solid seen from the parent of `frame`, in which it was given so far."""
        return MassProperties.of(_core.moved_solid(self._plain(), (frame.position, frame.rotation)))

    def __add__(self, other: MassProperties) -> MassProperties:
        """Both solids as one, by the parallel axis theorem."""
        return MassProperties.of(_core.sum_of_solids(self._plain(), other._plain()))


NOTHING = MassProperties(0.0, (0.0, 0.0, 0.0), ((0.0,) * 3,) * 3)


def as_matrix(values: Any) -> Matrix3:
    """A symmetric matrix as tuples, free of the asymmetry of rounding."""
    m = np.asarray(values, dtype=np.float64)
    return tuple(tuple(row) for row in ((m + m.T) / 2).tolist())  # type: ignore[return-value]


def principal(mass: float, xx: float, yy: float, zz: float) -> MassProperties:
    """A solid whose centre is the origin and whose principal axes are those of the frame."""
    return MassProperties(mass, (0.0, 0.0, 0.0), ((xx, 0.0, 0.0), (0.0, yy, 0.0), (0.0, 0.0, zz)))
