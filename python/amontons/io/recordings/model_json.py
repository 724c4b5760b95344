"""Models as JSON text, which the compiled module writes and reads; classes of Python check their parts."""

from __future__ import annotations

import json
from typing import Any

from ... import _core
from ...model.compiled import Looks, Parts
from ...model.model import PYTHON_PARTS, Model
from ...model.parts import Body, Geom, Joint
from ...model.shapes import Shape


def model_to_json(model: Model) -> str:
    """Every number comes back exactly. Infinity is a string: JSON has no such number."""
    looks, annotations = Looks(), {name: getattr(model, name) for name in PYTHON_PARTS}
    for name in ("sites", "sensors", "visuals"):
        annotations[name] = [looks.fields(part) for part in annotations[name]]
    return _core.write_model(model.stepped() | annotations)


def model_from_json(text: str, who: str = "model") -> Model:
    """Raises InputError that begins with `who` and names the place, or the part that cannot be."""
    given = _core.read_model(text, who, Parts().make)
    return Model(**(given | {"gravity": tuple(given["gravity"])}))


def model_parts(model: Model) -> dict[str, Any]:
    """A model as lists and dictionaries; a shape is its index in the list "shapes"."""
    parts: dict[str, Any] = json.loads(model_to_json(model))
    return parts


def model_of_parts(parts: dict[str, Any]) -> Model:
    """The model of `model_parts`."""
    return model_from_json(json.dumps(parts, default=lambda array: array.tolist()))


def plain_part(part: Body | Geom | Joint) -> dict[str, Any]:
    """A part of a model as JSON has it; a shape is 0."""
    name = {Body: "bodies", Geom: "geoms", Joint: "joints"}[type(part)]
    plain: dict[str, Any] = json.loads(_core.write_model({name: [part]}))[name][0]
    return plain


def plain_shape(shape: Shape) -> dict[str, Any]:
    """A shape as JSON has it."""
    plain: dict[str, Any] = json.loads(_core.write_model({"geoms": [Geom(shape=shape)]}))["shapes"][0]
    return plain
