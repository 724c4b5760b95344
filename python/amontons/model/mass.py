"""Mass, centre and inertia of solids, how they move and add up, and their integrals over a polyhedron."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import Array, Matrix3, Vector3
from .transforms import Transform, rotation_matrix


@dataclass(frozen=True)
class MassProperties:
    """What the equations of motion need to know of a solid."""

    mass: float
    """kg"""
    centre_of_mass: Vector3
    """m"""
    inertia: Matrix3
    """about the centre of mass, in the axes in which the centre is given (kg m^2)"""

    def scaled(self, factor: float) -> MassProperties:
        """The same solid with `factor` times the density."""
        inertia = factor * np.array(self.inertia)
        return MassProperties(factor * self.mass, self.centre_of_mass, as_matrix(inertia))

    def moved(self, frame: Transform) -> MassProperties:
        """The same solid seen from the parent of `frame`, in which it was given so far."""
        R = np.array(rotation_matrix(frame.rotation))
        return MassProperties(
            self.mass, frame(self.centre_of_mass), as_matrix(R @ np.array(self.inertia) @ R.T)
        )

    def __add__(self, other: MassProperties) -> MassProperties:
        """Both solids as one, by the parallel axis theorem."""
        mass = self.mass + other.mass
        if mass == 0:
            return self
        a, b = np.array(self.centre_of_mass), np.array(other.centre_of_mass)
        centre = (self.mass * a + other.mass * b) / mass
        inertia = np.array(self.inertia) + np.array(other.inertia)
        for part, at in ((self.mass, a), (other.mass, b)):
            inertia += part * _parallel_axis(at - centre)
        return MassProperties(mass, tuple(centre.tolist()), as_matrix(inertia))


NOTHING = MassProperties(0.0, (0.0, 0.0, 0.0), ((0.0,) * 3,) * 3)


def as_matrix(values: Any) -> Matrix3:
    """A symmetric matrix as tuples, free of the asymmetry of rounding."""
    m = np.asarray(values, dtype=np.float64)
    return tuple(tuple(row) for row in ((m + m.T) / 2).tolist())  # type: ignore[return-value]


def principal(mass: float, xx: float, yy: float, zz: float) -> MassProperties:
    """A solid whose centre is the origin and whose principal axes are those of the frame."""
    return MassProperties(mass, (0.0, 0.0, 0.0), ((xx, 0.0, 0.0), (0.0, yy, 0.0), (0.0, 0.0, zz)))


def polyhedron(vertices: Array, triangles: np.ndarray) -> MassProperties:
    """The solid of unit density inside closed triangles that are counter-clockwise seen from outside.

    Sums the signed tetrahedra between the triangles and a point inside (Lien and Kajiya, "A symbolic method
    for calculating the integral properties of arbitrary nonconvex polyhedra", 1984): with corners a, b, c and
    the origin, the integral of x x' is V / 20 (aa' + bb' + cc' + ss'), s = a + b + c. A mass that is not
    positive says that the triangles are inside out or not closed.
    """
    origin = (vertices.min(axis=0) + vertices.max(axis=0)) / 2  # near the solid: no cancellation far from 0
    a, b, c = (vertices[triangles[:, k]] - origin for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    s = a + b + c
    volume = float(volumes.sum())
    if not volume > 0:
        return MassProperties(volume, (0.0, 0.0, 0.0), NOTHING.inertia)
    centre = volumes @ s / (4 * volume)
    second = sum(np.einsum("i,ij,ik->jk", volumes / 20, p, p) for p in (a, b, c, s))
    second = second - volume * np.outer(centre, centre)
    inertia = np.trace(second) * np.eye(3) - second
    return MassProperties(volume, tuple((centre + origin).tolist()), as_matrix(inertia))


def _parallel_axis(d: Array) -> Array:
    return float(d @ d) * np.eye(3) - np.outer(d, d)
