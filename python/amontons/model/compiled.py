"""Parts of models to the compiled module, which reads them by the names of their fields, and back from it.

A new field of a part needs nothing here.
"""

from __future__ import annotations

import base64
import zlib
from dataclasses import fields
from functools import cache
from typing import Any

import numpy as np

from .. import _core
from ..limits import plausible
from .drives import Actuator, PathElement, Tendon, TendonTerm, Transmission
from .links import Link
from .parts import Body, Bond, Coupling, Dof, Fluid, FluidBox, Geom, Joint, Material, Motor, PairMaterial
from .presets import Keyframe, Unread
from .sensing import Sensor, Site
from .shapes import Shape, shape_of_core
from .transforms import Transform
from .visuals import TriangleMesh, Visual

PARTS: dict[str, Any] = {
    kind.__name__: kind
    for kind in (
        Material, Motor, Dof, Body, Geom, Joint, Coupling, PairMaterial, Fluid, FluidBox, Bond, TendonTerm,
        PathElement, Tendon, Transmission, Actuator, Link, Site, Sensor, Visual, Keyframe, Unread,
    )
}  # fmt: skip
PACKED = {"vertices": "<f4", "triangles": "<i4"}
"""The arrays of a mesh to look at, with their types in files."""


class Looks:
    """Compiled looks of shapes and of meshes for pictures; parts that share a mesh share its look."""

    def __init__(self) -> None:
        self._known: dict[int, _core.Look] = {}

    def fields(self, part: Site | Sensor | Visual) -> dict[str, Any]:
        """The fields of the part, whose shape is a look."""
        return vars(part) | {"shape": None if part.shape is None else self._look(part.shape)}

    def _look(self, shape: Shape | TriangleMesh) -> _core.Look:
        if isinstance(shape, Shape):
            return _core.Look(shape.core)
        if id(shape) not in self._known:
            self._known[id(shape)] = _core.Look(*(_packed(getattr(shape, name)) for name in PACKED))
        return self._known[id(shape)]


class Parts:
    """Parts of the package from compiled ones; those that share a hull or a mesh there share it here."""

    def __init__(self) -> None:
        self._shapes: dict[tuple[str, int], Shape | TriangleMesh] = {}

    def make(self, kind: str, given: dict[str, Any]) -> Any:
        """Raises InputError as the class of the part does."""
        cls = PARTS[kind]
        given = {name: self._value(given[name], said) for name, said in _annotated(cls)}
        if cls is Geom and not any(given["friction_direction"]):  # zero stands for none there
            given["friction_direction"] = None
        return cls(**given)

    def _value(self, value: Any, annotation: str) -> Any:
        if isinstance(value, _core.Look):
            return self._look(value)
        if isinstance(value, _core.Shape):
            return self._shape(value)
        if annotation == "Transform":
            return Transform(*map(tuple, value))
        if isinstance(value, list | tuple):
            return tuple(tuple(part) if isinstance(part, list) else part for part in value)
        if annotation == "NonNegative | None" and value < 0:  # how the compiled module marks none
            return None
        return value

    def _look(self, look: _core.Look) -> Shape | TriangleMesh | None:
        if look.shape is not None:
            return self._shape(look.shape)
        if look.mesh is None:
            return None
        key = ("", look.key)
        if key not in self._shapes:
            arrays = (_unpacked(text, kind) for text, kind in zip(look.mesh, PACKED.values(), strict=True))
            self._shapes[key] = TriangleMesh(*arrays)
        return self._shapes[key]

    def _shape(self, core: _core.Shape) -> Any:
        if core.key == 0:
            return shape_of_core(core)
        key = (core.kind, core.key)
        if key not in self._shapes:
            self._shapes[key] = shape_of_core(core)
        return self._shapes[key]


@cache
def _annotated(kind: Any) -> list[tuple[str, str]]:
    """The fields of a part with the types that its class gives them."""
    return [(f.name, str(f.type)) for f in fields(kind) if f.init]


def _packed(array: np.ndarray[Any, Any]) -> str:
    return base64.b64encode(zlib.compress(array.tobytes())).decode()


def _unpacked(text: str, kind: str) -> np.ndarray[Any, Any]:
    packed = base64.b64decode(text)
    unpacking = zlib.decompressobj()
    try:
        data = unpacking.decompress(packed, plausible(len(packed)))
    except zlib.error as error:
        raise ValueError(f"a mesh is damaged: {error}") from None
    if not unpacking.eof:
        raise ValueError("a mesh is damaged: it is cut off, or unpacks to more than its size can mean")
    return np.frombuffer(data, dtype=kind).reshape(-1, 3)
