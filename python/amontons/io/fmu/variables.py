"""The variables of a functional mock-up unit: what of a simulation has which name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

from ...checks import suggestion
from ...errors import InputError
from ...model.model import Model
from ...model.transforms import ORIGIN, Transform
from ...simulation.simulation import Simulation
from .sensors import left_out

POSE = ("x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz")
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
PARTS = {1: ("",), 3: (".x", ".y", ".z"), 4: (".qw", ".qx", ".qy", ".qz")}
"""Ends of the names of the values of a sensor, by their number"""
EFFORTS = ("motor", "passive", "friction", "limit")
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
    yield from _measured(model)
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


def _measured(model: Model) -> Iterator[Variable]:
    """Sensors and efforts."""
    for i, sensor in enumerate(model.sensors):
        for k, part in enumerate(() if left_out(sensor) else PARTS[sensor.size]):
            yield _output(f"sensor.{sensor.name}{part}", "sensor", i, k, f"sensor of kind {sensor.kind}")
    for name, c in model.coordinates.items():
        if c.dof >= 0:
            index = model.dof_index(c.joint, c.dof)
            for k, part in enumerate(EFFORTS):
                told = "effort along a degree of freedom, N or N m, mean of the last step"
                yield _output(f"effort.{name}.{part}", "effort", index, k, told)
    for a, name in enumerate(model.actuator_names):
        told = "effort of an actuator along its length, mean of the last step"
        yield _output(f"actuator.{name}", "actuator", a, 0, told)


def _output(name: str, kind: str, index: int, part: int, told: str) -> Variable:
    return Variable(name, kind, index, part, "output", told)


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
