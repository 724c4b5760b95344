"""A model file as we and as MuJoCo load it; for robot/run.py and robot/forms.py."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import amontons
import mujoco


def beside(
    model: amontons.Model | None, path: Path, urdf: bool
) -> tuple[amontons.Model | None, Any, dict[str, Any]]:
    """A model, of a URDF with a floor, the same of MuJoCo, and what it says."""
    floor = None
    if model is not None and urdf:
        model, floor = with_floor(model)
    theirs, refusal = their_model(path, urdf, floor)
    return model, theirs, {"mujoco_refuses": refusal, "floor": floor}


def their_model(path: Path, urdf: bool, floor: float | None) -> tuple[Any, str]:
    """MuJoCo's model, or None with what it says; a URDF with the base, meshes and floor that ours has."""
    try:
        if urdf:
            return compiled_urdf(path, floor), ""
        return mujoco.MjModel.from_xml_path(str(path)), ""
    except (ValueError, mujoco.FatalError, amontons.InputError, OSError) as error:
        return None, " ".join(str(error).split())[:300]


def compiled_urdf(path: Path, floor: float | None) -> Any:
    """MuJoCo's own reader knows neither packages nor free bases, so the preparation is ours."""
    from amontons.io.models import compiled_model

    compiled = compiled_model(path)
    if floor is None:
        return compiled.model
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    compiled.spec.worldbody.add_geom(type=plane, size=(0, 0, 1), pos=(0, 0, floor))
    return compiled.spec.compile()


def our_model(path: Path, trees: str = "auto") -> tuple[amontons.Model | None, dict[str, Any]]:
    """The model as it loads, or None if it is refused; and what of the file was not read."""
    with warnings.catch_warnings(action="ignore"):  # the model has the list
        try:
            model = replace(amontons.load_model(path), trees=trees)
        except (amontons.InputError, OSError) as error:
            return None, {"load": "refused", "what": " ".join(str(error).split())[:1000]}
    what = [re.sub(r"^\S*/", "", str(entry)) for entry in model.unread]  # the file without its folders
    changes = sum(entry.changes_motion for entry in model.unread)
    facts = {"load": "ok", "not_read": len(what), "changes_motion": changes, "bodies": len(model.bodies)}
    return model, {**facts, "what": "; ".join(what)[:1000]}


def with_floor(model: amontons.Model) -> tuple[amontons.Model, float | None]:
    """A robot that floats, on a plane at its lowest point, and where that is: URDF has no floors."""
    if not any(c.kind == "free" for c in model.coordinates.values()):
        return model, None
    try:
        standing = amontons.on_floor(model)
    except amontons.InputError:  # nothing that could touch it
        return model, None
    height = model.bodies[0].pose.position[2] - standing.bodies[0].pose.position[2]
    builder = amontons.ModelBuilder(
        gravity=model.gravity, friction_rule=model.friction_rule, trees=model.trees
    )
    builder.add_model(model)
    builder.add_floor(height=height, material=amontons.Material(friction=1.0))  # MuJoCo's default
    return builder.build(), height
