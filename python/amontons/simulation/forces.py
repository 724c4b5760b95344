"""Contacts, joint reactions and drives of a step as structured arrays."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..checks import Array
from ..model.model import Model
from ..model.parts import WORLD
from .outcome import Table

CONTACTS = np.dtype(
    [
        ("body_a", np.int32),
        ("body_b", np.int32),
        ("geom_a", np.int32),
        ("geom_b", np.int32),
        ("link_a", np.int32),
        ("link_b", np.int32),
        ("point", np.float64, 3),
        ("normal", np.float64, 3),
        ("gap", np.float64),
        ("friction", np.float64),
        ("impulse", np.float64, 3),
        ("force", np.float64, 3),
        ("torque", np.float64, 3),
        ("slip", np.float64, 3),
        ("spin", np.float64, 3),
        ("normal_velocity", np.float64),
        ("state", "U5"),
    ]
)
"""The fields of Simulation.contacts; docs/simulation.md says what they mean."""

REACTIONS = np.dtype(
    [
        ("joint", np.int32),
        ("body_a", np.int32),
        ("body_b", np.int32),
        ("point", np.float64, 3),
        ("force", np.float64, 3),
        ("torque", np.float64, 3),
    ]
)
"""The fields of Simulation.joint_reactions."""

EFFORTS = np.dtype(
    [
        ("joint", np.int32),
        ("dof", np.int32),
        ("coordinate", np.float64),
        ("control", np.float64),
        ("passive", np.float64),
        ("motor", np.float64),
        ("friction", np.float64),
        ("limit", np.float64),
    ]
)
"""The fields of Simulation.joint_efforts."""

TENDONS = np.dtype(
    [
        ("tendon", np.int32),
        ("length", np.float64),
        ("rate", np.float64),
        ("passive", np.float64),
        ("friction", np.float64),
        ("limit", np.float64),
    ]
)
"""The fields of Simulation.tendon_efforts."""

ACTUATORS = np.dtype(
    [
        ("actuator", np.int32),
        ("control", np.float64),
        ("activation", np.float64),
        ("length", np.float64),
        ("rate", np.float64),
        ("effort", np.float64),
    ]
)
"""The fields of Simulation.actuator_efforts."""

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
WRENCH_UNITS = ("N",) * 3 + ("N m",) * 3
"""Names and units of the components of a force and a torque."""

_STATES = np.array(["open", "stick", "slip"], dtype="U5")


def contact_table(core: _core.Simulation, model: Model) -> Table:
    fields = core.contacts
    table = np.zeros(len(fields["gap"]), CONTACTS)
    for name, values in fields.items():
        if name in (CONTACTS.names or ()):
            table[name] = _STATES[values] if name == "state" else values
    if len(table):
        links = np.array(model.geom_links, dtype=np.int32)
        table["link_a"], table["link_b"] = links[table["geom_a"]], links[table["geom_b"]]
        table["force"] = fields["impulse"] / core.impulse_step
        table["torque"] = fields["angular_impulse"] / core.impulse_step
    return table


def contact_sums(core: _core.Simulation, table: Table, bodies: int) -> tuple[Array, Array]:
    """(forces, torques about the centres of mass) of all contacts on each body, (n, 3) each."""
    forces, torques = np.zeros((bodies, 3)), np.zeros((bodies, 3))
    for side, sign, arm in zip(("body_a", "body_b"), (1, -1), core.contact_arms(), strict=True):
        on = table[side] != WORLD
        force = sign * table["force"][on]
        np.add.at(forces, table[side][on], force)
        np.add.at(torques, table[side][on], np.cross(arm[on], force) + sign * table["torque"][on])
    return forces, torques


def reaction_table(core: _core.Simulation, model: Model) -> Table:
    table = np.zeros(len(model.joints), REACTIONS)
    step = core.impulse_step or 1.0  # no impulses before the first step
    reactions = core.joint_reactions()
    table["joint"] = np.arange(len(model.joints))
    table["body_a"] = [joint.body_a for joint in model.joints]
    table["body_b"] = [joint.body_b for joint in model.joints]
    table["point"] = reactions[:, :3]
    table["force"], table["torque"] = reactions[:, 3:6] / step, reactions[:, 6:] / step
    return table


def effort_table(core: _core.Simulation, model: Model) -> Table:
    table = np.zeros(model.dofs, EFFORTS)
    step = core.impulse_step or 1.0
    table["joint"] = [j for j, joint in enumerate(model.joints) for _ in joint.dofs]
    table["dof"] = [k for joint in model.joints for k in range(len(joint.dofs))]
    table["coordinate"], table["control"] = core.joint_coordinates, np.nan
    for (actuator, joint, dof), control in zip(model.core.controls, core.controls, strict=True):
        if actuator < 0:
            table["control"][model.core.first_dof(joint) + dof] = control
    for name, impulses in zip(("passive", "motor", "friction", "limit"), core.dof_impulses.T, strict=True):
        table[name] = impulses / step
    table["motor"] = motor_impulses(core, model) / step
    return table


def motor_impulses(core: _core.Simulation, model: Model) -> Array:
    """Impulses of the motor of each degree of freedom and of the actuators on it, in the last step (N s, N m
    s).
    """
    impulses = core.dof_impulses[:, 1].copy()
    for actuator, impulse in zip(model.actuators, core.actuator_impulses, strict=True):
        if (t := actuator.transmission).kind == "dof":
            impulses[model.core.first_dof(t.joint) + t.dof] += t.gear * impulse
    return impulses


def tendon_table(core: _core.Simulation, model: Model) -> Table:
    table = np.zeros(len(model.tendons), TENDONS)
    step = core.impulse_step or 1.0
    table["tendon"] = np.arange(len(table))
    table["length"], table["rate"] = core.tendon_lines().T
    passive, spring, friction, limit = core.tendon_impulses.T / step
    table["passive"], table["friction"], table["limit"] = passive + spring, friction, limit
    return table


def actuator_table(core: _core.Simulation, model: Model) -> Table:
    table = np.zeros(len(model.actuators), ACTUATORS)
    table["actuator"] = np.arange(len(table))
    table["control"], table["activation"] = core.controls[: len(table)], core.activations
    table["length"], table["rate"] = core.actuator_lines().T
    table["effort"] = core.actuator_impulses / (core.impulse_step or 1.0)
    return table
