"""Sensors of a unit: what the library has to know of them (fmu/sensors.cpp)."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ...model.builder import ModelBuilder
from ...model.links import place_index
from ...model.model import Model
from ...model.parts import WORLD
from ...model.sensing import Sensor
from ...model.shapes import Shape
from ...model.transforms import Transform
from ..recordings.model_json import model_to_json


@dataclass
class Sensors:
    """The sensors that variables of a unit show."""

    listed: list[dict[str, Any]] = field(default_factory=list)
    volumes: ModelBuilder = field(default_factory=ModelBuilder)
    """their shapes, as geoms of the world"""

    def add(self, model: Model, sensor: Sensor) -> int:
        """The index of the sensor in the unit."""
        given: dict[str, Any] = {
            "kind": sensor.kind,
            "body": sensor.body,
            "frame": _plain(sensor.frame),
            "reference": WORLD if sensor.reference is None else sensor.reference,
            "reference_frame": _plain(sensor.reference_frame),
            "bodies": sensor.bodies,
            "field": sensor.field,
            "cutoff": sensor.cutoff,
        }
        if sensor.shape is not None:
            given["volume"] = self._volume(sensor.shape)
        if sensor.kind in ("touch", "rangefinder"):
            own = place_index(len(model.bodies), sensor.body, sensor.link)
            given["own"] = [int(place == own) for place in model.geom_links]
        given |= _source(model, sensor)
        self.listed.append(given)
        return len(self.listed) - 1

    def _volume(self, shape: Shape) -> int:
        return self.volumes.add_geom(None, shape)

    def plain(self) -> dict[str, Any]:
        """Entries of fmu.json."""
        shapes = json.loads(model_to_json(self.volumes.build()))
        return {"sensors": self.listed, "volumes": shapes} if self.listed else {}


def _plain(frame: Transform) -> tuple[Sequence[float], Sequence[float]]:
    return (frame.position, frame.rotation)


def _source(model: Model, sensor: Sensor) -> dict[str, Any]:
    """Where its coordinate, tendon or actuator is, with the limits of these."""
    name = sensor.source
    if sensor.kind.startswith("actuator"):
        return {"index": model.actuator_index(name)}
    if sensor.kind.startswith("tendon"):
        index = model.tendon_index(name)
        return {"index": index, **_limits(model.tendons[index])}
    if not sensor.kind.startswith(("joint", "ball")):
        return {}
    c = model.coordinates[name]
    if sensor.kind in ("jointactuatorfrc", "jointlimitfrc"):
        return {"index": model.dof_index(c.joint, c.dof)}
    found = {"index": c.q.start, "rate": c.qd.start}
    return found | _limits(model.joints[c.joint].dofs[c.dof]) if c.dof >= 0 else found


def _limits(limited: Any) -> dict[str, float]:
    pairs = (("lower", limited.lower), ("upper", limited.upper))
    return {name: value for name, value in pairs if math.isfinite(value)}


def left_out(sensor: Sensor) -> bool:
    """Whether a unit cannot read it: it would need masses of links that are parts of bodies."""
    return bool(sensor.links)
