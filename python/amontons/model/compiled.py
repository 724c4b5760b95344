"""Parts of models as those of the compiled module, and back: by the names of their fields, which both share.

A new field of a part needs nothing here. The compiled module lists the values of its enumerations.
"""

from __future__ import annotations

import base64
import zlib
from dataclasses import fields
from enum import Enum
from functools import cache
from typing import Any

import numpy as np

from .. import _core
from ..checks import shown
from ..errors import InputError
from ..limits import plausible
from .drives import Actuator, PathElement, Tendon, TendonTerm, Transmission
from .links import Link
from .parts import Body, Bond, Coupling, Dof, Fluid, FluidBox, Geom, Joint, Material, Motor, PairMaterial
from .presets import Keyframe, Unread
from .sensing import Sensor, Site
from .shapes import Shape, shape_of_core
from .transforms import Transform
from .visuals import TriangleMesh, Visual

PARTS: dict[type, Any] = {
    kind: getattr(_core, kind.__name__)
    for kind in (
        Material, Motor, Dof, Body, Geom, Joint, Coupling, PairMaterial, Fluid, FluidBox, Bond, TendonTerm,
        PathElement, Tendon, Transmission, Actuator, Link, Site, Sensor, Visual, Keyframe, Unread,
    )
}  # fmt: skip
_BACK: dict[Any, type] = {core: kind for kind, core in PARTS.items()}
_ENUMS: dict[Any, dict[str, Any]] = {}
"""By compiled class: its fields that hold one of a few words, with the words."""
PACKED = {"vertices": "<f4", "triangles": "<i4"}
"""The arrays of a mesh to look at, with their types in files."""


def to_core(thing: Any, into: Any = None) -> Any:
    """The part in the compiled module, or the compiled `into` with the fields of `thing`."""
    core = PARTS[type(thing)]() if into is None else into
    words = _words(core)
    for f in fields(thing):
        if not f.init or not f.metadata.get("core", True):
            continue
        value = getattr(thing, f.name)
        if value is None:  # what the compiled module takes without it
            continue
        try:
            setattr(core, f.name, words[f.name][value] if f.name in words else _to_core_value(value))
        except TypeError:
            raise InputError(
                f"{type(thing).__name__}.{f.name} = {shown(value)} is not of the kind that the field holds"
            ) from None
    return core


def _words(core: Any) -> dict[str, Any]:
    kind = type(core)
    if kind not in _ENUMS:
        fresh = {name: getattr(core, name) for name in dir(core) if not name.startswith("_")}
        _ENUMS[kind] = {name: type(value) for name, value in fresh.items() if isinstance(value, Enum)}
    return _ENUMS[kind]


def _to_core_value(value: Any) -> Any:
    if isinstance(value, Shape):
        return value.core
    if isinstance(value, Transform):
        return (value.position, value.rotation)
    if type(value) in PARTS:
        return to_core(value)
    if isinstance(value, tuple) and value and type(value[0]) is PairMaterial:
        return _to_core_pairs(value)
    if isinstance(value, tuple) and value and type(value[0]) in PARTS:
        return [to_core(part) for part in value]
    return value


def _to_core_pairs(pairs: tuple[PairMaterial, ...]) -> list[_core.PairMaterial]:
    """There may be a million of them, which share few materials."""
    materials: dict[int, _core.Material] = {}
    for pair in pairs:
        if id(pair.material) not in materials:
            materials[id(pair.material)] = to_core(pair.material)
    return [_core.PairMaterial(p.geom_a, p.geom_b, materials[id(p.material)], p.always) for p in pairs]


class Looks:
    """Compiled looks of shapes and of meshes for pictures; parts that share a mesh share its look."""

    def __init__(self) -> None:
        self._known: dict[int, _core.Look] = {}

    def to_core(self, part: Site | Sensor | Visual) -> Any:
        """The part, whose shape is a look."""
        core = PARTS[type(part)]()
        for f in fields(part):
            value = getattr(part, f.name)
            if value is not None:
                setattr(core, f.name, self._look(value) if f.name == "shape" else _to_core_value(value))
        return core

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

    def all(self, cores: list[Any]) -> tuple[Any, ...]:
        """A part for each."""
        return tuple(map(self.of, cores))

    def of(self, core: Any) -> Any:
        """Raises InputError as the class of the part does."""
        kind = _BACK[type(core)]
        given = {name: self._value(getattr(core, name), said) for name, said in _annotated(kind)}
        if kind is Geom and not any(given["friction_direction"]):  # zero stands for none there
            given["friction_direction"] = None
        return kind(**given)

    def _value(self, value: Any, annotation: str) -> Any:
        if isinstance(value, Enum):
            return value.name
        if type(value) in _BACK:
            return self.of(value)
        if isinstance(value, _core.Look):
            return self._look(value)
        if isinstance(value, _core.Shape):
            return self._shape(value)
        if annotation == "Transform":
            return Transform(*map(tuple, value))
        if isinstance(value, list):
            return self._list(value)
        if annotation == "NonNegative | None" and value < 0:  # how the compiled module marks none
            return None
        return value

    def _list(self, values: list[Any]) -> tuple[Any, ...]:
        if values and type(values[0]) in _BACK:
            return self.all(values)
        return tuple(self._list(part) if isinstance(part, list) else part for part in values)

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
