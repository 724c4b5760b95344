"""More than UsdPhysics can hold: each part of a model as an attribute of its prim, with every digit.

The schema has single precision and degrees, and knows no tendons, springs with a rest, sensors or keyframes.
So the writer leaves the part as JSON on its prim, with a digest of what the prim says to other programs. A
part counts as long as the digest fits. If somebody has edited the prim, the schema counts.
"""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....model.model import Model
from ....model.parts import WORLD
from ....model.transforms import Transform
from ...recordings.model_json import model_of_parts, plain_part, plain_shape
from .building import Building
from .stage import Scene, applied

PART, DIGEST = "amontons:part", "amontons:digest"
LISTS = ("bodies", "geoms", "joints")
"""Lists whose parts have prims of their own; all else is on the root."""
SAME = 1e-9
"""m, or of a quaternion: how far a matrix of the file may turn a pose by rounding"""


def stamp(prim: Any, root: Any, part: dict[str, Any]) -> None:
    """Leave a part on the prim that was written for it. Nothing of the prim may change after that."""
    from pxr import Sdf

    for name, text in ((PART, json.dumps(part, allow_nan=False)), (DIGEST, digest(prim, root))):
        prim.CreateAttribute(name, Sdf.ValueTypeNames.String, True).Set(text)


def digest(prim: Any, root: Any) -> str:
    """A hash of all that a prim says but our attributes, and of the units of the stage."""
    from pxr import Sdf, UsdGeom, UsdPhysics

    stage = prim.GetStage()
    said = hashlib.sha256()
    units = UsdGeom.GetStageMetersPerUnit(stage), UsdPhysics.GetStageKilogramsPerUnit(stage)
    head = (*units, UsdGeom.GetStageUpAxis(stage), prim.GetTypeName(), *applied(prim), prim.IsActive())
    said.update(repr([str(x) for x in head]).encode())
    for thing in sorted(prim.GetAuthoredProperties(), key=lambda found: str(found.GetName())):
        if thing.GetName().startswith("amontons:"):
            continue
        said.update(str(thing.GetName()).encode())
        if hasattr(thing, "Get"):
            said.update(_bytes(thing.Get()))
        else:  # the file may be a part of another one, where all paths are longer
            paths = [p.ReplacePrefix(root.GetPath(), Sdf.Path("/")) for p in thing.GetForwardedTargets()]
            said.update(repr([str(p) for p in paths]).encode())
    return said.hexdigest()


def _bytes(value: Any) -> bytes:
    """A value to hash, the same whether a zero in it has a sign: files of the kind .usdc lose it."""
    if type(value).__name__.endswith("Array"):
        array = np.array(value)
        return (array + 0).tobytes() if array.dtype.kind in "fiu" else repr([str(x) for x in value]).encode()
    return re.sub(r"-0\.0(?=[,)]|$)", "0.0", repr(value)).encode()


@dataclass
class _Entry:
    prim: Any
    part: dict[str, Any]
    fits: bool


@dataclass
class _Written:
    """The parts that a writer left in a scene."""

    scene: Scene
    root: Any
    rest: dict[str, Any]
    lists: dict[str, dict[int, _Entry]] = field(default_factory=lambda: {name: {} for name in LISTS})
    edited: list[Any] = field(default_factory=list)
    materials: set[str] = field(default_factory=set)
    """paths of those that are as they were"""

    def complete(self, building: Building) -> bool:
        """Whether all parts are there, and nothing beside them."""
        for name, read in zip(LISTS, _read(building), strict=True):
            entries = self.lists[name]
            paths = {str(e.prim.GetPath()) for e in entries.values()}
            lost = any(not e.fits and str(e.prim.GetPath()) not in read for e in entries.values())
            if lost or set(read) - paths or set(entries) != set(range(self.rest["counts"][name])):
                return False
        return True


def _read(building: Building) -> tuple[dict[str, int], ...]:
    """By list: what the schema gave, an index of the builder by the path of the prim."""
    geoms = {path: geom for path, (geom, _) in building.geoms.items()}
    joints = {path: joint for path, (joint, _) in building.made.items()}
    return building.index, geoms, joints


def restored(building: Building) -> Model | None:
    """The model as it was written; None for a scene of others, or one that has lost parts since."""
    written = _collect(building)
    if written is None:
        return None
    scene = building.scene
    if not written.complete(building):
        scene.refuse(
            written.root,
            "prims came, went or changed since amontons wrote the file: tendons, actuators, sensors and "
            "keyframes are left out",
            "large",
        )
        return None
    untouched = {
        scene.at(entry.prim).place for name in LISTS for entry in written.lists[name].values() if entry.fits
    }
    scene.issues.found = [found for found in scene.issues.found if found.place not in untouched]
    if not written.edited:
        scene.issues.notes.clear()
    return _joined(building, written)


def _collect(building: Building) -> _Written | None:
    scene = building.scene
    marked = [p for p in building.prims if p.HasAttribute(PART)]
    root = next((p for p in marked if "rest" in _part(scene, p)), None)
    if root is None:
        return None
    written = _Written(scene, root, _part(scene, root)["rest"])
    for prim in marked:
        part = _part(scene, prim)
        fits = scene.get(prim, DIGEST, "") == digest(prim, root)
        if not fits:
            written.edited.append(prim)
        if part.get("list") in LISTS:
            written.lists[part["list"]][int(part["index"])] = _Entry(prim, part["fields"], fits)
        elif "material" in part and fits:
            written.materials.add(str(prim.GetPath()))
    return written if root not in written.edited else None


def _part(scene: Scene, prim: Any) -> dict[str, Any]:
    try:
        found = json.loads(scene.get(prim, PART))
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise scene.error(prim, f"{PART} is damaged; remove the attribute")
    return found


def _joined(building: Building, written: _Written) -> Model:
    """All parts in the order in which they were; an edited one is that of the schema."""
    document = {key: value for key, value in written.rest.items() if key != "counts"}
    bodies, geoms, _ = _read(building)
    place = {bodies[str(e.prim.GetPath())]: k for k, e in written.lists["bodies"].items()} | {WORLD: WORLD}
    if any("gravity" in _part(written.scene, prim) for prim in written.edited):
        document["gravity"] = building.gravity
    made: dict[str, Any] = {"bodies": _body, "joints": _joint}
    for name, read in made.items():
        document[name] = [read(building, entry, place) for _, entry in sorted(written.lists[name].items())]
    document["geoms"] = [
        _geom(building, entry, place, document["shapes"], written.materials)
        for _, entry in sorted(written.lists["geoms"].items())
    ]
    if written.edited:  # a filter may be new
        pairs = {tuple(pair) for pair in document["excluded_geoms"]}
        index = {geoms[str(e.prim.GetPath())]: k for k, e in written.lists["geoms"].items()}
        more = {tuple(sorted((index[a], index[b]))) for a, b in building.apart}
        document["excluded_geoms"] += [list(pair) for pair in sorted(more - pairs)]
    return model_of_parts(document)


def _body(building: Building, entry: _Entry, place: dict[int, int]) -> dict[str, Any]:
    body = building.builder.part("body", building.index[str(entry.prim.GetPath())])
    fields = entry.part if entry.fits else {**plain_part(body), "name": entry.part["name"]}
    return {**fields, "pose": _nearer(entry.part["pose"], body.pose)}


def _joint(building: Building, entry: _Entry, place: dict[int, int]) -> dict[str, Any]:
    if entry.fits:
        return entry.part
    joint: Any = building.builder.part("joint", building.made[str(entry.prim.GetPath())][0])
    ends = {"body_a": place[joint.body_a], "body_b": place[joint.body_b]}
    return {**plain_part(joint), **ends, "name": entry.part["name"]}


def _geom(
    building: Building, entry: _Entry, place: dict[int, int], shapes: list[Any], materials: set[str]
) -> dict[str, Any]:
    """The fields of a geom; its shape goes into the list, where the part does not name one of it."""
    geom = building.builder.part("geom", building.geoms[str(entry.prim.GetPath())][0])
    fields = dict(entry.part)
    if entry.fits:
        if not isinstance(fields["shape"], int):  # the first geom of this shape
            shape = fields["shape"]
            shapes[shape["index"]] = _whole(entry.prim, shape)
            fields["shape"] = shape["index"]
        local = building.builder.pose(geom.body).inverse() @ building.scene.frame(entry.prim)[0]
        fields["frame"] = _nearer(fields["frame"], local)
    else:
        shapes.append(plain_shape(geom.shape))
        kept = {key: fields[key] for key in ("name", "link", "category", "mask")}
        moved = {"body": place[geom.body], "shape": len(shapes) - 1}
        fields = {**plain_part(geom), **kept, **moved}
    if not _bound(entry.prim) <= materials:
        fields["material"] = plain_part(geom)["material"]
    return fields


def _nearer(exact: dict[str, Any], read: Transform) -> dict[str, Any]:
    """The pose that was written, unless the prim or one above it has moved."""
    there = np.array([*exact["position"], *exact["rotation"]])
    here = np.array([*read.position, *read.rotation])
    scale = max(1.0, float(np.abs(there[:3]).max()))
    apart = np.abs(there[:3] - here[:3]).max() / scale
    turned = min(np.abs(there[3:] - here[3:]).max(), np.abs(there[3:] + here[3:]).max())
    if max(apart, turned) < SAME:
        return exact
    return {"position": read.position, "rotation": read.rotation}


def _bound(prim: Any) -> set[str]:
    return {str(path) for path in prim.GetRelationship("material:binding:physics").GetForwardedTargets()}


def keep_arrays(prim: Any, shape: dict[str, Any]) -> dict[str, Any]:
    """The fields of a shape for `stamp`, without the corners of a mesh, which become an array of doubles."""
    from pxr import Sdf, Vt

    if "vertices" not in shape:
        return shape
    points = Vt.Vec3dArray.FromNumpy(np.array(shape["vertices"], dtype=np.float64).reshape(-1, 3))
    prim.CreateAttribute("amontons:vertices", Sdf.ValueTypeNames.Double3Array, True).Set(points)
    return {key: value for key, value in shape.items() if key not in ("vertices", "triangles")}


def _whole(prim: Any, shape: dict[str, Any]) -> dict[str, Any]:
    made = {key: value for key, value in shape.items() if key != "index"}
    if (points := prim.GetAttribute("amontons:vertices").Get()) is None:
        return made
    corners = np.array(prim.GetAttribute("faceVertexIndices").Get(), dtype=np.int32).reshape(-1, 3)
    return {**made, "vertices": np.array(points), "triangles": corners}
