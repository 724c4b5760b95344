"""The shapes of collision geometry, each in its own frame with its centre at the origin; lengths in m."""

from __future__ import annotations

from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, Numbers, Vector3, entries, finite, frozen, number, positive, reals, vector3
from ..checks import array as as_array
from ..errors import InputError
from ..guidance import guided
from .hulls import Triangles, convex_triangles
from .mass import MassProperties
from .mesh_files import read_triangles

__all__ = [
    "Box",
    "Capsule",
    "Cylinder",
    "Ellipsoid",
    "HeightField",
    "Hull",
    "Mesh",
    "Plane",
    "Shape",
    "Sphere",
    "read_mesh",
]


class Shape:
    """Base of all shapes: checked on creation, immutable, equal if of the same kind and size.

    volume(): m^3. mass_properties(density): mass (kg), centre (m) and inertia (kg m^2) of the solid.
    """

    static_only: ClassVar[bool] = False
    """Whether bodies that move by forces may not carry it: planes, meshes and height fields."""
    core: _core.Shape

    def mass_properties(self, density: float = 1.0) -> MassProperties:
        """Mass, centre and inertia of the solid of `density` (kg/m^3).

        Raises InputError for planes, height fields, and meshes that are not closed or face inwards.
        """
        return MassProperties.of(self.core.mass_properties(positive("density", density)))

    def volume(self) -> float:
        """m^3"""
        return self.mass_properties().mass

    def _make(self, **values: Any) -> None:
        """A shape of a few lengths, which the compiled module knows by the name of the class."""
        self._set(**values)
        self._set(core=_core.Shape.of(type(self).__name__, values))

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and all(
            np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self)
        )

    def __hash__(self) -> int:
        parts = (getattr(self, f.name) for f in fields(self))
        return hash((type(self), *(x.tobytes() if isinstance(x, np.ndarray) else x for x in parts)))

    def __reduce__(self) -> tuple[Any, ...]:  # the compiled shape is made again
        return type(self), tuple(getattr(self, f.name) for f in fields(self))


@guided
@dataclass(frozen=True, eq=False)
class Sphere(Shape):
    """A ball of `radius`.

    >>> shapes.Sphere(0.1).radius
    0.1
    """

    radius: float

    def __post_init__(self) -> None:
        self._make(radius=number("Sphere: radius", self.radius))


@guided
@dataclass(frozen=True, eq=False)
class Box(Shape):
    """half: half edge lengths along x, y and z.

    >>> shapes.Box((0.3, 0.2, 0.1))  # 0.6 x 0.4 x 0.2 m
    Box(half=(0.3, 0.2, 0.1))
    """

    half: Vector3

    if TYPE_CHECKING:  # a list or an array will do

        def __init__(self, half: Numbers) -> None: ...

    def __post_init__(self) -> None:
        self._make(half=entries("Box: half", self.half, 3, remedy=": half edge lengths along x, y and z"))


@dataclass(frozen=True, eq=False)
class _Tube(Shape):
    """Base of capsule and cylinder: a radius (m) about |z| <= `half_length` (m)."""

    radius: float
    half_length: float

    def __post_init__(self) -> None:
        kind = type(self).__name__
        self._make(
            radius=number(f"{kind}: radius", self.radius),
            half_length=number(f"{kind}: half_length", self.half_length),
        )


@guided
@dataclass(frozen=True, eq=False)
class Capsule(_Tube):
    """The points within `radius` of the segment |z| <= `half_length`.

    >>> shapes.Capsule(0.05, 0.2)  # 0.5 m long in all
    Capsule(radius=0.05, half_length=0.2)
    """


@guided
@dataclass(frozen=True, eq=False)
class Cylinder(_Tube):
    """About the z axis, |z| <= `half_length`.

    >>> shapes.Cylinder(0.1, 0.02)  # a disc of 4 cm
    Cylinder(radius=0.1, half_length=0.02)
    """


@guided
@dataclass(frozen=True, eq=False)
class Ellipsoid(Shape):
    """radii: semi-axes along x, y and z.

    >>> shapes.Ellipsoid((0.3, 0.2, 0.1))
    Ellipsoid(radii=(0.3, 0.2, 0.1))
    """

    radii: Vector3

    if TYPE_CHECKING:  # a list or an array will do

        def __init__(self, radii: Numbers) -> None: ...

    def __post_init__(self) -> None:
        self._make(radii=vector3("Ellipsoid: radii", self.radii))


@guided
@dataclass(frozen=True, eq=False)
class Plane(Shape):
    """The half space z <= 0, whose normal is +z. Static.

    >>> builder = ModelBuilder()
    >>> ground = builder.add_geom(None, shapes.Plane())
    """

    static_only: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self._make()


@guided
@dataclass(frozen=True, eq=False)
class Hull(Shape):
    """The convex hull of points.

    vertices: (n, 3); points that are no corners are dropped. triangles: (t, 3) indices of a closed convex
    surface, counter-clockwise seen from outside, if known; else they are found (SciPy's Qhull).
    Raises InputError for fewer than four points, points in a plane, NaN, triangles that are no convex body.

    >>> wedge = shapes.Hull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    >>> len(wedge.vertices)
    4
    """

    vertices: Array
    triangles: Triangles | None = None

    def __post_init__(self) -> None:
        vertices = _points("Hull: vertices", self.vertices)
        if self.triangles is None:
            vertices, triangles = convex_triangles(vertices)
        else:
            triangles = _triangles("Hull: triangles", self.triangles)
        self._set(vertices=frozen(vertices), triangles=frozen(triangles))
        self._set(core=_core.Shape.hull(self.vertices, triangles))

    @classmethod
    def read(cls, path: str | PathLike[str], *, scale: float = 1.0) -> Hull:
        """The convex hull of a mesh file, see `read_mesh`; `volume()` of both tells what it adds."""
        return cls(read_mesh(path, scale=scale).vertices)

    def __repr__(self) -> str:
        return f"Hull({len(self.vertices)} vertices)"


@guided
@dataclass(frozen=True, eq=False)
class Mesh(Shape):
    """Static triangles with contact from outside only; bodies that move need `Hull`s instead.

    vertices: (n, 3). triangles: (t, 3) indices, counter-clockwise seen from outside.
    The volume and mass properties are those of a closed mesh.

    >>> floor = shapes.Mesh([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], [(0, 1, 2)])
    >>> len(floor.triangles)
    1
    """

    vertices: Array
    triangles: Triangles
    static_only: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self._set(
            vertices=frozen(_points("Mesh: vertices", self.vertices)),
            triangles=frozen(_triangles("Mesh: triangles", self.triangles)),
        )
        core = _core.Shape.mesh(self.vertices, self.triangles)
        # Triangles then name the first of equal vertices, as a mesh from a file does.
        self._set(core=core, triangles=frozen(core.values["triangles"]))

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices)} vertices, {len(self.triangles)} triangles)"


@guided
@dataclass(frozen=True, eq=False)
class HeightField(Shape):
    """A static grid of heights over the rectangle size_x by size_y centred at the origin.

    heights: (rows, columns); row r, column c lies at x = (c / (columns - 1) - 1/2) size_x and
    y = (r / (rows - 1) - 1/2) size_y. Two triangles a cell, contact from above.

    >>> shapes.HeightField(np.zeros((3, 3)), size_x=2, size_y=2).heights.shape
    (3, 3)
    """

    heights: Array
    size_x: float
    size_y: float
    static_only: ClassVar[bool] = True

    def __post_init__(self) -> None:
        heights = _numbers("HeightField: heights", self.heights)
        if heights.ndim != 2 or min(heights.shape) < 2:
            raise InputError(
                f"HeightField: heights has shape {heights.shape}; it must be (rows, columns), at least (2, 2)"
            )
        self._set(
            heights=frozen(heights),
            size_x=number("HeightField: size_x", self.size_x),
            size_y=number("HeightField: size_y", self.size_y),
        )
        self._set(core=_core.Shape.height_field(self.heights, self.size_x, self.size_y))

    def __repr__(self) -> str:
        rows, columns = self.heights.shape
        return f"HeightField({rows} x {columns}, size {self.size_x:g} x {self.size_y:g})"


def read_mesh(path: str | PathLike[str], *, scale: float = 1.0) -> Mesh:
    """The triangles of a file: .stl, .obj, .ply (by trimesh, which the viewer brings) or .dae.

    scale: m per unit of the file, 0.001 for millimetres; a .dae says its unit itself.
    Raises FileNotFoundError, FileError for a file that holds no triangles, InputError.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    points, triangles = read_triangles(path)
    return Mesh(positive("read_mesh: scale", scale) * points, triangles)


KINDS: dict[str, type[Shape]] = {
    kind.__name__: kind
    for kind in (Sphere, Box, Capsule, Cylinder, Ellipsoid, Plane, Hull, Mesh, HeightField)
}


def _numbers(what: str, values: ArrayLike) -> Array:
    """A finite copy, which nobody else can change."""
    return finite(what, reals(what, values)).copy()


def _points(what: str, values: ArrayLike) -> Array:
    array = _numbers(what, values)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{what} has shape {array.shape}; it must be (n, 3)")
    return array


def _triangles(what: str, values: ArrayLike) -> Triangles:
    array = as_array(what, values)
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in "iu":
        raise InputError(f"{what} must be (t, 3) integers, the corners of each triangle")
    if array.size and (array.min() < 0 or array.max() > np.iinfo(np.int32).max):
        raise InputError(f"{what} has the index {array.min() if array.min() < 0 else array.max()}")
    return np.array(array, dtype=np.int32, order="C")
