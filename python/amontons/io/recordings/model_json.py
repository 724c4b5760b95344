"""Models as JSON text: the fields of their dataclasses by name, shapes once however many geoms share them."""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from ...limits import plausible
from ...model.drives import Actuator, PathElement, Tendon, TendonTerm, Transmission
from ...model.links import Link
from ...model.model import Model
from ...model.parts import Body, Coupling, Dof, Fluid, FluidBox, Geom, Joint, Material, Motor, PairMaterial
from ...model.presets import Keyframe, Unread
from ...model.sensing import Sensor, Site
from ...model.shapes import KINDS, Shape
from ...model.transforms import Transform
from ...model.visuals import TriangleMesh, Visual

_INFINITIES = {math.inf: "Infinity", -math.inf: "-Infinity"}
_NUMBERS = {text: number for number, text in _INFINITIES.items()}
VERSION = 1
"""The version of files that are written; those without one are of the first."""
PACKED = {"vertices": "<f4", "triangles": "<i4"}
"""The arrays of a mesh to look at, with their types in the file."""


def model_to_json(model: Model) -> str:
    """Every number comes back exactly. Infinity is a string: JSON has no such number."""
    return json.dumps(model_parts(model), allow_nan=False)


def model_parts(model: Model) -> dict[str, Any]:
    """The same as lists and dictionaries; a shape is its index in the list "shapes"."""
    shapes: dict[int, int] = {}
    listed: list[Shape | TriangleMesh] = []
    for thing in (*model.geoms, *model.sites, *model.sensors, *model.visuals):
        if thing.shape is not None and id(thing.shape) not in shapes:
            shapes[id(thing.shape)] = len(listed)
            listed.append(thing.shape)
    listing = [plain_shape(shape) for shape in listed]
    return {"version": VERSION, "shapes": listing, **plain_part(model, shapes)}


def plain_part(value: Any, shapes: Mapping[int, int]) -> Any:
    """A part of a model as JSON has it. shapes: the index of a shape by its id()."""
    if isinstance(value, Shape | TriangleMesh):
        return shapes[id(value)]
    if isinstance(value, tuple):
        return [plain_part(part, shapes) for part in value]
    if isinstance(value, Mapping):
        return {name: plain_part(part, shapes) for name, part in value.items()}
    if hasattr(value, "__dataclass_fields__"):
        return {f.name: plain_part(getattr(value, f.name), shapes) for f in fields(value) if f.init}
    return _INFINITIES.get(value, value) if isinstance(value, float) else value


def model_from_json(text: str) -> Model:
    """Raises ValueError, TypeError or KeyError for text that model_to_json did not write."""
    return model_of_parts(json.loads(text, object_hook=with_infinities))


def model_of_parts(d: dict[str, Any]) -> Model:
    """The model of `model_parts`, once infinities are numbers."""
    if (version := d.pop("version", VERSION)) > VERSION:
        raise ValueError(
            f"version: it is {version}; this version of amontons reads {VERSION}: take a newer one"
        )
    shapes: list[Any] = [_shape(parts) for parts in d.pop("shapes")]
    d["bodies"] = tuple(Body(**{**body, "pose": Transform(**body["pose"])}) for body in d["bodies"])
    d["geoms"] = tuple(
        Geom(
            **{
                **geom,
                "shape": shapes[geom["shape"]],
                "frame": Transform(**geom["frame"]),
                "material": Material(**geom["material"]),
            }
        )
        for geom in d["geoms"]
    )
    d["joints"] = tuple(_joint(joint) for joint in d["joints"])
    d["couplings"] = tuple(
        Coupling(**{**coupling, "coefficients": tuple(coupling["coefficients"])})
        for coupling in d["couplings"]
    )
    d["pair_materials"] = tuple(
        PairMaterial(**{**pair, "material": Material(**pair["material"])}) for pair in d["pair_materials"]
    )
    d["keyframes"] = tuple(map(_keyframe, d.get("keyframes", ())))
    d["tendons"] = tuple(_tendon(tendon) for tendon in d.get("tendons", ()))
    # Before actuators were parts of a model, these were names of its motors, which it has still.
    actuators = d["actuators"] if isinstance(d["actuators"], list) else ()
    d["actuators"] = tuple(_actuator(actuator) for actuator in actuators)
    for name, kind in (("sites", Site), ("sensors", Sensor), ("visuals", Visual)):
        d[name] = tuple(_looking(kind, parts, shapes) for parts in d.get(name, ()))
    d["links"] = tuple(Link(**{**link, "frame": Transform(**link["frame"])}) for link in d.get("links", ()))
    if "fluid" in d:
        d["fluid"] = Fluid(**d["fluid"])
        d["fluid_boxes"] = tuple(
            FluidBox(**{**box, "frame": Transform(**box["frame"])}) for box in d["fluid_boxes"]
        )
    d["unread"] = tuple(Unread(**entry) for entry in d.get("unread", ()))
    for name in ("excluded_bodies", "excluded_geoms"):
        d[name] = tuple((a, b) for a, b in d.get(name, ()))
    return Model(**d)


def with_infinities(parts: dict[str, Any]) -> dict[str, Any]:
    """An object with numbers in place of the two strings, but for a name that is one of them."""
    return {
        key: _NUMBERS.get(value, value) if isinstance(value, str) and key != "name" else value
        for key, value in parts.items()
    }


def plain_shape(shape: Shape | TriangleMesh) -> dict[str, Any]:
    if isinstance(shape, TriangleMesh):  # many numbers, of which pictures need no more than they are
        packed = {name: _packed(getattr(shape, name)) for name in PACKED}
        return {"kind": "TriangleMesh", **packed}
    values = {f.name: getattr(shape, f.name) for f in fields(shape)}  # type: ignore[arg-type]
    plain = {name: v.tolist() if isinstance(v, np.ndarray) else v for name, v in values.items()}
    return {"kind": type(shape).__name__, **plain}


def _shape(parts: dict[str, Any]) -> Shape | TriangleMesh:
    values = {name: value for name, value in parts.items() if name != "kind"}
    if parts["kind"] == "TriangleMesh":
        return TriangleMesh(*(_unpacked(values[name], kind) for name, kind in PACKED.items()))
    if "triangles" in values:
        values["triangles"] = np.array(values["triangles"], dtype=np.int32).reshape(-1, 3)
    return KINDS[parts["kind"]](**values)


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


def _tuples(value: Any) -> Any:
    return tuple(_tuples(part) for part in value) if isinstance(value, list) else value


def _keyframe(parts: dict[str, Any]) -> Keyframe:
    return Keyframe(**{key: _tuples(value) for key, value in parts.items()})


def _looking(kind: type[Any], parts: dict[str, Any], shapes: list[Any]) -> Any:
    """A site, a sensor or a visual."""
    frames = {name: Transform(**parts[name]) for name in ("frame", "reference_frame") if name in parts}
    shape = None if parts["shape"] is None else shapes[parts["shape"]]
    return kind(**{**parts, **frames, "shape": shape})


def _joint(parts: dict[str, Any]) -> Joint:
    dofs = tuple(Dof(**{**dof, "motor": Motor(**dof["motor"])}) for dof in parts["dofs"])
    frames = {name: Transform(**parts[name]) for name in ("frame_a", "frame_b")}
    return Joint(**{**parts, "dofs": dofs, **frames})


def _tendon(parts: dict[str, Any]) -> Tendon:
    terms = tuple(TendonTerm(**term) for term in parts["terms"])
    path = tuple(PathElement(**{**stop, "frame": Transform(**stop["frame"])}) for stop in parts["path"])
    return Tendon(**{**parts, "terms": terms, "path": path})


def _actuator(parts: dict[str, Any]) -> Actuator:
    given = parts["transmission"]
    frames = {name: Transform(**given[name]) for name in ("frame", "reference")}
    return Actuator(**{**parts, "transmission": Transmission(**{**given, **frames})})
