"""Visuals of a model that differ from its collision geometry; they do not affect the simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import entries, frozen, indices, named, reals, shown
from ..errors import InputError
from .parts import OWN, WORLD
from .shapes import Shape
from .transforms import ORIGIN, Transform


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A visual triangle mesh; it need not be closed.

    vertices: (n, 3) (m), kept in single precision. triangles: (m, 3) indices, counter-clockwise from outside.

    >>> parts.TriangleMesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]).triangles.shape
    (1, 3)
    """

    vertices: NDArray[np.float32]
    triangles: NDArray[np.int32]

    def __post_init__(self) -> None:
        with np.errstate(over="ignore"):
            vertices = reals("TriangleMesh: vertices", self.vertices).astype(np.float32)
        triangles = indices("TriangleMesh: triangles", self.triangles)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise InputError("TriangleMesh: vertices must be finite numbers of shape (n, 3)")
        if triangles.ndim != 2 or triangles.shape[1] != 3:
            raise InputError("TriangleMesh: triangles must have the shape (m, 3)")
        if len(triangles) and not (triangles.min() >= 0 and triangles.max() < len(vertices)):
            raise InputError(
                f"TriangleMesh: a triangle names vertex {triangles.max()}; there are {len(vertices)}"
            )
        object.__setattr__(self, "vertices", frozen(vertices))
        object.__setattr__(self, "triangles", frozen(triangles))

    def __repr__(self) -> str:
        return f"TriangleMesh({len(self.vertices)} vertices, {len(self.triangles)} triangles)"


@dataclass(frozen=True)
class Visual:
    """A visual shape on a body or on the world; it has no contacts.

    >>> cap = parts.Visual("cap", body=0, shape=shapes.Sphere(0.1), colour=(1, 0, 0, 1))
    """

    name: str = ""
    body: int = WORLD
    frame: Transform = ORIGIN
    """of the shape in the body frame"""
    shape: Shape | TriangleMesh = field(kw_only=True)
    colour: Sequence[float] | None = None
    """red, green, blue and opacity, from 0 to 1; None is that of the kind of shape"""
    link: int = OWN
    """the link of the body that looks like this, an index of `Model.links`; OWN: none"""

    def __post_init__(self) -> None:
        who = named("visual", self.name)
        shape: Any = self.shape
        if not isinstance(shape, Shape | TriangleMesh):
            raise InputError(f"{who}shape is {shown(shape)}; give one of amontons.shapes or a TriangleMesh")
        if self.colour is not None:
            colour = entries(f"{who}colour", self.colour, 4)
            if not all(0 <= part <= 1 for part in colour):
                raise InputError(f"{who}colour is {colour}; its four parts must lie in [0, 1]")
            object.__setattr__(self, "colour", colour)
