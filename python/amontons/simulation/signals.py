"""Measured numbers with names, such as `screw.motor` and `foot.fx`: the columns of recordings, tables and
reports."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ..checks import Array
from ..model.coordinates import degrees, joint_labels
from ..model.model import Model
from .simulation import Simulation
from .tables import WRENCH, WRENCH_UNITS, effort_table, reaction_table

AXES = {3: ("x", "y", "z"), 4: ("qw", "qx", "qy", "qz")}
"""Names of the values of a sensor that has several."""
SENSOR_UNITS = {
    "accelerometer": "m/s^2", "framelinacc": "m/s^2", "frameangacc": "rad/s^2",
    "velocimeter": "m/s", "framelinvel": "m/s", "subtreelinvel": "m/s",
    "gyro": "rad/s", "frameangvel": "rad/s", "ballangvel": "rad/s",
    "force": "N", "touch": "N", "torque": "N m", "subtreeangmom": "N m s",
    "rangefinder": "m", "framepos": "m", "subtreecom": "m", "clock": "s",
}  # fmt: skip
"""Units of sensors whose unit does not depend on what they are on."""
MOTOR_UNITS = {"effort": ("N", "N m"), "position": ("m", "rad")}
"""Units of controls of motors by kind, on a slide and on a hinge; of all others that of a velocity."""
STATE = {
    "positions": (("x", "y", "z"), "m"),
    "orientations": (("qw", "qx", "qy", "qz"), ""),
    "linear_velocities": (("vx", "vy", "vz"), "m/s"),
    "angular_velocities": (("wx", "wy", "wz"), "rad/s"),
}
"""The arrays of the state with a row for each body: what their columns are called, and their unit."""


class Names:
    """Names of columns, each of them once, with their units."""

    def __init__(self) -> None:
        self.units: dict[str, str] = {}

    def add(self, owner: str, parts: Sequence[str], units: Sequence[str], kind: str) -> None:
        """OWNER.PART for each part, or OWNER alone for a part without a name.

        Where something else has one of these names, OWNER.KIND stands for OWNER.
        """
        base = owner
        while any(joined(base, part) in self.units for part in parts):
            base = f"{owner}.{kind}" if base == owner else base + "_"
        self.units.update({joined(base, part): unit for part, unit in zip(parts, units, strict=True)})


def joined(owner: str, part: str) -> str:
    return f"{owner}.{part}" if part else owner


def state_units(model: Model) -> dict[str, str]:
    """Unit by name: NAME.x, ..., .qw, ..., .vx, ..., .wx, ... of bodies, NAME of degrees of freedom."""
    return _state_names(model).units


def _state_names(model: Model) -> Names:
    names = Names()
    parts = [part for parts, _ in STATE.values() for part in parts]
    units = [unit for parts, unit in STATE.values() for _ in parts]
    for k, body in enumerate(model.bodies):
        names.add(body.name or f"body {k}", parts, units, "body")
    for name, dof in degrees(model.joints):
        names.add(name, ("",), ("rad" if dof.kind == "hinge" else "m",), "joint")
    return names


class Signals:
    """The signals of a model.

    - NAME.motor of each degree of freedom with a motor or an actuator: the effort (N, N m).
    - NAME.control of each actuator and motor, named as in `Model.control_names`.
    - NAME.effort of each actuator.
    - NAME.fx, .fy, .fz (N), .tx, .ty, .tz (N m) of each joint and link: its reaction in world axes, as in
      `Simulation.forces.joint_reactions` and `link_reactions`.
    - NAME, or NAME.x, .y, .z of each sensor.

    Efforts and reactions are means over the last step.
    """

    units: dict[str, str]
    """by name, in the order of the values"""
    reactions: slice
    """of the values: those of joints"""

    def __init__(self, model: Model) -> None:
        self._driven = _driven(model)
        names = _state_names(model)
        known = len(names.units)
        _name_drives(names, model, self._driven)
        first = len(names.units)
        for owner in (*joint_labels(model.joints), *(link.name for link in model.links)):
            names.add(owner, WRENCH, WRENCH_UNITS, "reaction")
        self.reactions = slice(first - known, first - known + len(WRENCH) * len(model.joints))
        for sensor in model.sensors:
            parts = AXES.get(sensor.size, ("",))
            names.add(sensor.name, parts, [SENSOR_UNITS.get(sensor.kind, "")] * len(parts), "sensor")
        self.units = dict(list(names.units.items())[known:])

    def read(self, simulation: Simulation) -> Array:
        """The values at the end of the last step, (signals,)."""
        if not self.units:
            return np.zeros(0)
        core, model = simulation._core, simulation.model
        step = core.impulse_step or 1.0  # no impulses before the first step
        parts = [effort_table(core)["motor"][self._driven], core.controls, core.actuator_impulses / step]
        tables = [reaction_table(core), *([simulation.forces.link_reactions] if model.links else [])]
        parts += [np.concatenate([table["force"], table["torque"]], axis=1).ravel() for table in tables]
        if model.sensors:
            parts.append(simulation.sensors.array)
        return np.concatenate(parts)


def _driven(model: Model) -> list[int]:
    """The degrees of freedom with a motor or an actuator."""
    on = {k for k, (_, dof) in enumerate(degrees(model.joints)) if dof.motor.kind != "none"}
    for drive in model.actuators:
        if (t := drive.transmission).kind == "dof":
            on.add(model.core.first_dof(t.joint) + t.dof)
    return sorted(on)


def _name_drives(names: Names, model: Model, driven: Iterable[int]) -> None:
    found = list(degrees(model.joints))
    for k in driven:
        name, dof = found[k]
        names.add(name, ("motor",), ("N m" if dof.kind == "hinge" else "N",), "joint")
    for name, (actuator, joint, d) in zip(model.control_names, model.core.controls, strict=True):
        unit = ""
        if actuator < 0:
            dof = model.joints[joint].dofs[d]
            unit = MOTOR_UNITS.get(dof.motor.kind, ("m/s", "rad/s"))[dof.kind == "hinge"]
        names.add(name, ("control",), (unit,), "control")
    for drive in model.actuators:
        unit = ""
        if (t := drive.transmission).kind == "dof":
            unit = "N m" if model.joints[t.joint].dofs[t.dof].kind == "hinge" else "N"
        names.add(drive.name, ("effort",), (unit,), "actuator")
