"""A scene of USD, opened with care: its layers within a folder, its units and axes as ours."""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ....checks import Array
from ....errors import FileError, InputError
from ....limits import Limits
from ....model.orientations import quaternion_of
from ....model.transforms import IDENTITY, Quaternion, Transform, axis_angle, rotation_matrix
from ...files import told_at, write_whole
from ..issues import Issues
from ..places import inside, is_special

WITHOUT = "files of USD need usd-core: pip install 'amontons[usd]'"
Y_UP = axis_angle((1.0, 0.0, 0.0), math.pi / 2)
"""Turns a scene whose y axis points up so that z does."""


@dataclass(frozen=True)
class At:
    """Where a prim is, for the list of what was not read; in words, as the stage may be gone by then."""

    place: str
    kind: str

    def __str__(self) -> str:
        return self.kind


@dataclass
class Scene:
    """A composed stage, with what turns its numbers into SI units and z up."""

    path: Path
    stage: Any
    issues: Issues
    metre: float
    """m per unit of length"""
    kilogram: float
    """kg per unit of mass"""
    upright: Quaternion
    cache: Any
    read: set[str] = field(default_factory=set)
    """names of attributes that have been asked for"""
    idle: set[str] = field(default_factory=set)
    """paths of prims that change nothing, as joints between two fixed bodies"""

    def at(self, prim: Any) -> At:
        return At(f"{self.path}:{prim.GetPath()}", str(prim.GetTypeName() or "prim"))

    def error(self, prim: Any, what: str) -> FileError:
        return FileError(f"{self.path}:{prim.GetPath()}: {what}")

    def told(self, prim: Any) -> AbstractContextManager[None]:
        """Lets what is wrong with a prim (InputError) name file and prim."""
        return told_at(f"{self.path}:{prim.GetPath()}")

    def refuse(self, prim: Any, what: str, effect: str = "small") -> None:
        self.issues.add(self.at(prim), what, effect)

    def pass_over(self, prim: Any) -> None:
        """Notes that nothing that a prim says changes the motion."""
        self.idle.add(str(prim.GetPath()))

    def get(self, prim: Any, name: str, default: Any = None) -> Any:
        """The value of an attribute, of its schema if none is written; else the default."""
        self.read.add(name)
        attribute = prim.GetAttribute(name)
        value = attribute.Get(self.cache.GetTime()) if attribute and attribute.IsValid() else None
        return default if value is None else value

    def number(self, prim: Any, name: str, default: float = 0.0) -> float:
        value = float(self.get(prim, name, default))
        if math.isnan(value):
            raise self.error(prim, f"{name} is not a number; correct it")
        return value

    def targets(self, prim: Any, name: str) -> list[Any]:
        """The prims that a relationship names and that there are."""
        self.read.add(name)
        relation = prim.GetRelationship(name)
        if not relation:
            return []
        found = []
        for path in relation.GetForwardedTargets():
            target = self.stage.GetPrimAtPath(path)
            if target:
                found.append(target)
            else:
                self.refuse(prim, f"{name} names {path}, which is not there", "large")
        return found

    def matrix(self, prim: Any) -> tuple[Array, Array]:
        """Linear map (3, 3), scales included, and origin (3,) of a prim in the world (m)."""
        m = np.array(self.cache.GetLocalToWorldTransform(prim), dtype=np.float64)
        if not np.isfinite(m).all():
            raise self.error(prim, "its place is not finite; correct its transformations")
        turn = np.array(rotation_matrix(self.upright))
        return turn @ m[:3, :3].T, self.metre * (turn @ m[3, :3])

    def frame(self, prim: Any) -> tuple[Transform, Array]:
        """The place of a prim without its scale, and the scales (3,) along its axes."""
        linear, origin = self.matrix(prim)
        rotation, scale = unscaled(linear)
        return Transform(tuple(origin.tolist()), rotation), scale

    def prims(self) -> Iterator[Any]:
        """All prims that take part, those of instances too."""
        from pxr import Usd

        return iter(Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies()))


def unscaled(linear: Array) -> tuple[Quaternion, Array]:
    """The rotation nearest to a linear map, and the lengths of the map's columns; a mirror has a negative."""
    scale = np.linalg.norm(linear, axis=0)
    if not (scale > 0).all():
        return IDENTITY, scale
    if np.linalg.det(linear) < 0:
        scale[0] = -scale[0]
    u, _, v = np.linalg.svd(linear / scale)
    return quaternion_of(u @ v), scale


def applied(prim: Any) -> list[str]:
    """The names of all applied schemas, of those too that usd-core does not know, as PhysX's."""
    return [str(name) for name in prim.GetPrimTypeInfo().GetAppliedAPISchemas()]


def quaternion(value: Any) -> Quaternion:
    """A Gf.Quat as ours, of length one; the identity for one that is zero."""
    q = np.array([value.GetReal(), *value.GetImaginary()], dtype=np.float64)
    length = np.linalg.norm(q)
    return tuple((q / length).tolist()) if length > 0 else IDENTITY  # type: ignore[return-value]


@contextmanager
def new_stage(path: Path) -> Iterator[Any]:
    """A stage in metres, z up, to be filled; its file appears whole."""
    try:
        from pxr import Usd, UsdGeom
    except ImportError:
        raise InputError(WITHOUT) from None
    with tempfile.TemporaryDirectory() as folder:
        temporary = Path(folder) / path.name
        stage = Usd.Stage.CreateNew(str(temporary))
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        yield stage
        stage.GetRootLayer().Save()
        del stage
        write_whole({path: temporary.read_bytes()})


def open_scene(path: Path, issues: Issues, limits: Limits) -> Scene:
    """The scene of a file; FileError for what is damaged, or reaches outside of the folder."""
    try:
        from pxr import Tf, Usd, UsdGeom, UsdPhysics
    except ImportError:
        raise InputError(WITHOUT) from None
    if limits.folder is None:
        limits = Limits(**{**vars(limits), "folder": path.resolve().parent})
    try:
        _require_layers(path, limits, issues)
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise _damaged(path, error) from None
    except RuntimeError as error:
        reason = " ".join(str(error).split())[:200]
        raise FileError(f"{path}: is no scene of USD ({reason}); export it again") from None
    count = 0
    for count, _ in enumerate(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()), 1):
        if count > limits.elements:
            raise FileError(
                f"{path}: more than {limits.elements} prims; if that is meant, raise the limit: "
                "limits=amontons.Limits(elements=...)"
            )
    if not count:
        raise FileError(f"{path}: holds no prim")
    metre, kilogram = UsdGeom.GetStageMetersPerUnit(stage), UsdPhysics.GetStageKilogramsPerUnit(stage)
    if not (0 < metre < math.inf and 0 < kilogram < math.inf):
        raise FileError(
            f"{path}: metersPerUnit = {metre:g} and kilogramsPerUnit = {kilogram:g} must be > 0; correct them"
        )
    upright = Y_UP if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y else IDENTITY
    cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    return Scene(path, stage, issues, metre, kilogram, upright, cache)


def _damaged(path: Path, error: Exception) -> FileError:
    """The parser's own words, with file and line where it says them."""
    said = " ".join(str(error).split())
    found = re.search(r": '([^']*?):(\d+):\d+: (.*?)'", said) or re.search(r": '()()(.*?)'", said)
    file, line, what = found.groups() if found else ("", "", said)
    place = f"{file}:{line}" if line else f"{path}"
    what = re.sub(r"^parse error matching \S*pegtl.*", "something here has no end", what.strip())
    return FileError(f"{place}: is damaged, or no scene of USD: {what[:240]}; export it again")


def _require_layers(path: Path, limits: Limits, issues: Issues) -> None:
    """Follows the names of all layers, before any is composed."""
    from pxr import Ar, Sdf

    resolver = Ar.GetResolver()
    left, seen = [str(path)], set()
    while left:
        name = left.pop()
        if name in seen:
            continue
        seen.add(name)
        layer = Sdf.Layer.FindOrOpen(name)
        if layer is None:
            if name == str(path):
                raise FileError(f"{path}: is no scene of USD; export it again")
            continue  # the stage warns of it, and what it held is missing
        if name == str(path):
            layer.Reload()  # the file may have changed since another stage opened it
        for asset in layer.GetCompositionAssetDependencies():
            if not asset:
                continue  # within the layer
            target = resolver.CreateIdentifier(asset, layer.resolvedPath)
            if "://" in target:
                issues.add(_Layer(path, asset), "nothing is fetched; download it beside the file", "large")
                continue
            place = Path(target.partition("[")[0])
            if not inside(place, limits):
                raise FileError(
                    f"{path}: the layer @{asset}@ lies outside of {limits.folder}; allow it by "
                    "limits=amontons.Limits(folder=...), a folder that holds both"
                )
            if is_special(place):
                raise FileError(f"{path}: the layer @{asset}@ is no regular file")
            if not place.exists():
                issues.add(_Layer(path, asset), "this layer is not there", "large")
                continue
            left.append(target)


@dataclass(frozen=True)
class _Layer:
    path: Path
    asset: str

    @property
    def place(self) -> str:
        return str(self.path)

    def __str__(self) -> str:
        return f"@{self.asset}@"
