"""The variables of a functional mock-up unit: what of a simulation has which name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

from ...checks import suggestion
from ...errors import InputError
from ...model.model import Model
from ...model.sensing import Sensor
from ...model.transforms import ORIGIN, Transform
from ...simulation.simulation import Simulation

POSE = ("x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz")
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
SENSED = {"framepos": (0, 3), "framequat": (3, 4), "framelinvel": (7, 3)}
"""Kinds of sensors of a frame in the world: their first part of POSE, and how many."""
INTEGERS = {
    "contacts": ("contacts", "contacts of the last step"),
    "contacts.began": ("began", "pairs of shapes that began to touch since the start"),
    "contacts.ended": ("ended", "pairs of shapes that ceased to touch since the start"),
    "steps.missed": ("missed", "steps since the start that missed their tolerance"),
}


@dataclass(frozen=True)
class Variable:
    """One scalar; kind, index and part say to the unit what it is (fmu/instance.hpp)."""

    name: str
    kind: str
    index: int
    part: int
    causality: str
    """independent | input | output"""
    description: str
    start: float = 0.0
    """of inputs"""

    @property
    def integer(self) -> bool:
        return self.name in INTEGERS


@dataclass
class Frames:
    """Frames fixed in bodies, each once."""

    found: list[tuple[int, Transform]] = field(default_factory=list)

    def index(self, body: int, frame: Transform) -> int:
        if (body, frame) not in self.found:
            self.found.append((body, frame))
        return self.found.index((body, frame))

    def plain(self) -> list[dict[str, Any]]:
        return [{"body": b, "position": f.position, "rotation": f.rotation} for b, f in self.found]


def input_variables(simulation: Simulation) -> Iterator[Variable]:
    """All that can be set."""
    model, state = simulation.model, simulation.state
    for k, name in enumerate(model.control_names):
        start = float(state.controls[k])
        yield Variable(f"control.{name}", "control", k, 0, "input", "control of an actuator or motor", start)
    for c in model.coordinates.values():
        for k, name in enumerate(c.qd_names):
            index = c.qd.start + k
            start, told = float(state.joint_forces[index]), "force along a coordinate, N or N m"
            yield Variable(f"joint_force.{name}", "joint_force", index, 0, "input", told, start)
    for b, name in enumerate(model.body_names):
        loads = (*state.forces[b].tolist(), *state.torques[b].tolist())
        for k, part in enumerate(WRENCH):
            told = f"{'force, N' if k < 3 else 'torque, N m'}, at the centre of mass, world axes"
            yield Variable(f"load.{name}.{part}", "body_load", b, k, "input", told, loads[k])


def output_variables(model: Model, frames: Frames) -> Iterator[Variable]:
    """All that can be asked for."""
    for c in model.coordinates.values():
        for kind, names, first, unit in (
            ("q", c.q_names, c.q.start, "coordinate, m or rad or a part of a quaternion"),
            ("qd", c.qd_names, c.qd.start, "velocity of a coordinate, m/s or rad/s"),
        ):
            for k, name in enumerate(names):
                yield _output(f"{kind}.{name}", kind, first + k, 0, unit)
    for kind, listed in (
        ("body", [(name, b, ORIGIN) for b, name in enumerate(model.body_names)]),
        ("site", [(site.name, site.body, site.frame) for site in model.sites]),
    ):
        for name, body, frame in listed:
            index = frames.index(body, frame)
            for k, part in enumerate(POSE):
                told = "position, m", "orientation", "velocity, m/s", "angular velocity, rad/s"
                what = told[0 if k < 3 else 1 if k < 7 else 2 if k < 10 else 3]
                yield _output(f"{kind}.{name}.{part}", "frame", index, k, f"{what}, world axes")
    for sensor in model.sensors:
        yield from _of_sensor(model, sensor, frames)
    for j, name in enumerate(model.joint_names):
        for k, part in enumerate(WRENCH):
            told = f"{'force, N' if k < 3 else 'torque, N m'}, of the joint on body A, world axes"
            yield _output(f"reaction.{name}.{part}", "reaction", j, k, f"{told}, mean of the last step")
    for b, name in enumerate(model.body_names):
        for k, part in enumerate(WRENCH[:3]):
            told = "contact force on the body, N, world axes, mean of the last step"
            yield _output(f"contact_force.{name}.{part}", "contact_force", b, k, told)
    for name, (kind, told) in INTEGERS.items():
        yield _output(name, kind, 0, 0, told)


def _output(name: str, kind: str, index: int, part: int, told: str) -> Variable:
    return Variable(name, kind, index, part, "output", told)


def _of_sensor(model: Model, sensor: Sensor, frames: Frames) -> Iterator[Variable]:
    """Sensors that are a coordinate or the frame of a body in the world; none of the others."""
    told = f"sensor of kind {sensor.kind}"
    if sensor.cutoff > 0:
        return
    if sensor.kind in ("jointpos", "jointvel") and sensor.source in model.coordinates:
        c = model.coordinates[sensor.source]
        kind, index = ("q", c.q.start) if sensor.kind == "jointpos" else ("qd", c.qd.start)
        yield _output(f"sensor.{sensor.name}", kind, index, 0, told)
    elif sensor.kind in SENSED and sensor.reference is None:
        first, count = SENSED[sensor.kind]
        index = frames.index(sensor.body, sensor.frame)
        for k in range(first, first + count):
            yield _output(f"sensor.{sensor.name}.{POSE[k]}", "frame", index, k, told)


def sensors_left_out(model: Model) -> list[str]:
    """Names of the sensors that a unit cannot read: it would need the parts of them that Python computes."""
    frames = Frames()
    return [sensor.name for sensor in model.sensors if not any(_of_sensor(model, sensor, frames))]


def chosen_variables(
    known: Sequence[Variable], patterns: Iterable[str] | None, default: tuple[str, ...], what: str
) -> list[Variable]:
    """Those that one of the patterns names, in the order of `known`; InputError for one that names none."""
    wanted = default if patterns is None else tuple(patterns)
    names = [variable.name for variable in known]
    found: set[str] = set()
    for pattern in wanted:
        hits = {n for n in names if fnmatchcase(n, pattern) or n.startswith(f"{pattern}.")}
        if not hits and patterns is not None:
            kinds = sorted({name.split(".")[0] for name in names})
            raise InputError(
                f"{what}: the unit has no {pattern!r}{suggestion(pattern, names)}; names begin with "
                f"{', '.join(kinds)}, and * stands for any letters"
            )
        found |= hits
    return [variable for variable in known if variable.name in found]
