"""Contacts, reactions and drives of a step as structured arrays; bindings/tables.cpp writes their rows."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..checks import Array, shown
from ..errors import InputError
from ..model.drives import Tendon
from ..model.model import Model
from ..model.parts import WORLD
from .step_report import Table

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
"""The fields of Simulation.contacts; docs/contacts.md says what they mean."""

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
"""The fields of Simulation.forces.joint_reactions."""

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
"""The fields of Simulation.forces.joint_efforts."""

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
"""The fields of Simulation.forces.tendon_efforts."""

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
"""The fields of Simulation.forces.actuator_efforts."""

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
WRENCH_UNITS = ("N",) * 3 + ("N m",) * 3
"""Names and units of the components of a force and a torque."""


def contact_table(core: _core.Simulation, model: Model) -> Table:
    return _core.contact_rows(core, model._geom_link_array).view(CONTACTS)


def contact_sums(core: _core.Simulation, table: Table, bodies: int) -> tuple[Array, Array]:
    """(forces, torques about the centres of mass) of all contacts on each body, (n, 3) each."""
    forces, torques = np.zeros((bodies, 3)), np.zeros((bodies, 3))
    for side, sign, arm in zip(("body_a", "body_b"), (1, -1), core.contact_arms(), strict=True):
        on = table[side] != WORLD
        force = sign * table["force"][on]
        np.add.at(forces, table[side][on], force)
        np.add.at(torques, table[side][on], np.cross(arm[on], force) + sign * table["torque"][on])
    return forces, torques


def reaction_table(core: _core.Simulation) -> Table:
    return _core.reaction_rows(core).view(REACTIONS)


def effort_table(core: _core.Simulation) -> Table:
    return _core.effort_rows(core).view(EFFORTS)


def tendon_table(core: _core.Simulation) -> Table:
    return _core.tendon_rows(core).view(TENDONS)


def actuator_table(core: _core.Simulation) -> Table:
    return _core.actuator_rows(core).view(ACTUATORS)


def tensions_of(model: Model, core: _core.Simulation, tendon: int | str) -> Array:
    """See `Simulation.forces.tensions`."""
    index = model.tendon_index(tendon)
    places = [_places(each) for each in model.tendons]
    count = places[index]
    if count == 0:
        raise InputError(
            f"tendon {shown(tendon)} has no friction on its path, so that it has one tension: read "
            "tendon_efforts"
        )
    first = sum(places[:index])
    half = core.rub_impulses.reshape(-1, 2)[first : first + count] / (core.impulse_step or 1.0)
    # Both neighbours of a part see its tension; the earlier one is read.
    return np.array([half[0, 0] + half[0, 1], *(half[:, 0] - half[:, 1])])


def _places(tendon: Tendon) -> int:
    return 1 if tendon.closed else sum(stop.friction > 0 for stop in tendon.path)
