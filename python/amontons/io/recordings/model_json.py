"""Models as JSON text, which the compiled module writes and reads; classes of Python check their parts."""

from __future__ import annotations

import json
from typing import Any

from ... import _core
from ...errors import InputError
from ...model.compiled import Looks, Parts, to_core
from ...model.model import PYTHON_PARTS, Model
from ...model.parts import Body, Fluid, Geom, Joint
from ...model.shapes import Shape


def model_to_json(model: Model) -> str:
    """Every number comes back exactly. Infinity is a string: JSON has no such number."""
    description, looks = model.core.description, Looks()
    for name in PYTHON_PARTS:
        parts = getattr(model, name)
        look = name in ("sites", "sensors", "visuals")
        setattr(description, name, [looks.to_core(part) if look else to_core(part) for part in parts])
    return _core.write_model(description)


def model_from_json(text: str, who: str = "model") -> Model:
    """Raises InputError that begins with `who` and names the place, or the part that cannot be."""
    description = _core.read_model(text, who)
    try:
        return _model_of(description)
    except InputError:
        _core.Model(description)  # whose messages name the part
        raise


def _model_of(description: _core.ModelDescription) -> Model:
    parts = Parts()
    given: dict[str, Any] = {
        name: parts.all(getattr(description, name))
        for name in (
            "bodies", "geoms", "joints", "tendons", "couplings", "actuators", "pair_materials", "fluid_boxes",
            "bonds", *PYTHON_PARTS,
        )
    }  # fmt: skip
    fluid: Fluid = parts.of(description.fluid)
    return Model(
        gravity=tuple(description.gravity),
        excluded_bodies=tuple(description.excluded_bodies),
        excluded_geoms=tuple(description.excluded_geoms),
        fluid=fluid,
        friction_rule=description.friction_rule.name,
        trees=description.trees.name,
        **given,
    )


def model_parts(model: Model) -> dict[str, Any]:
    """A model as lists and dictionaries; a shape is its index in the list "shapes"."""
    parts: dict[str, Any] = json.loads(model_to_json(model))
    return parts


def model_of_parts(parts: dict[str, Any]) -> Model:
    """The model of `model_parts`."""
    return model_from_json(json.dumps(parts, default=lambda array: array.tolist()))


def plain_part(part: Body | Geom | Joint) -> dict[str, Any]:
    """A part of a model as JSON has it; a shape is 0."""
    lists = {Body: "bodies", Geom: "geoms", Joint: "joints"}
    description = _core.ModelDescription()
    setattr(description, lists[type(part)], [to_core(part)])
    plain: dict[str, Any] = json.loads(_core.write_model(description))[lists[type(part)]][0]
    return plain


def plain_shape(shape: Shape) -> dict[str, Any]:
    """A shape as JSON has it."""
    description = _core.ModelDescription()
    description.geoms = [to_core(Geom(shape=shape))]
    plain: dict[str, Any] = json.loads(_core.write_model(description))["shapes"][0]
    return plain
