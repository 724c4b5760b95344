"""Columns of a recording by name: numbers over time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ...checks import Array, shown, suggestion
from ...errors import InputError
from ...model.coordinates import known
from ...model.model import Model
from ...simulation.signals import STATE, state_units
from ...simulation.step_report import TIMINGS, Table, energy

REPORT_UNITS = {
    "residual": "", "solves": "", "iterations": "", "products": "", "factorizations": "",
    "contacts": "", "joint_rows": "", "substeps": "", "penetration": "m", "joint_error": "m",
    "joint_angle_error": "rad", "kinetic_energy": "J", "potential_energy": "J", "spring_energy": "J",
    "energy_balance": "J", **dict.fromkeys(TIMINGS, "s"),
}  # fmt: skip
"""Units of the numbers of a report; `energy` is the sum of three of them."""


@dataclass(frozen=True)
class Column:
    """A number over time."""

    name: str
    unit: str
    """"" where it has none"""
    times: Array
    """(n,) (s)"""
    values: Array
    """(n,)"""


class Recorded(Protocol):
    """The parts of a recording that columns come from."""

    times: Any
    positions: Any
    joint_coordinates: Any
    qd: Any
    signals: Any
    has_coordinates: bool

    @property
    def model(self) -> Model: ...
    @property
    def reports(self) -> Table: ...
    @property
    def signal_units(self) -> dict[str, str]: ...
    @property
    def columns(self) -> dict[str, str]: ...


def units_of(recorded: Recorded) -> dict[str, str]:
    """Unit by name of all columns: signals, joints, bodies, rates, reports."""
    state = list(state_units(recorded.model).items())
    bodies = len(state) - recorded.joint_coordinates.shape[1]
    units = recorded.signal_units | dict(state[bodies:] + state[:bodies])
    units |= {name: unit for name, (unit, _) in rates_of(recorded, units).items()}
    return units | {
        _report_name(name, units): unit for name, unit in ({"energy": "J"} | REPORT_UNITS).items()
    }


def rates_of(recorded: Recorded, taken: Iterable[str]) -> dict[str, tuple[str, int]]:
    """Unit and place in qd of NAME.rate, of hinges and slides; a name that something else has is left out."""
    if not recorded.has_coordinates:
        return {}
    found = {}
    for name, coordinate in recorded.model.coordinates.items():
        if coordinate.dof >= 0 and f"{name}.rate" not in taken:
            unit = "rad/s" if coordinate.kind == "hinge" else "m/s"
            found[f"{name}.rate"] = unit, coordinate.qd.start
    return found


def _report_name(name: str, taken: dict[str, str]) -> str:
    return f"report.{name}" if name in taken else name


def column_of(recorded: Recorded, name: str) -> Column:
    """See `Recording.column`."""
    units = recorded.columns
    if not isinstance(name, str) or name not in units:
        what = f'"{name}"' if isinstance(name, str) and len(name) <= 80 else shown(name)
        near = suggestion(name, units)
        raise InputError(f"there is no column {what}{near}; known are {known(tuple(units))}")
    for find in (_of_signals, _of_state, _of_rates):
        if (values := find(recorded, name)) is not None:
            return Column(name, units[name], recorded.times, np.asarray(values, dtype=np.float64))
    reports, field = recorded.reports, name.removeprefix("report.")
    values = energy(reports) if field == "energy" else reports[field].astype(np.float64)
    return Column(name, units[name], reports["time"], values)


def _of_signals(recorded: Recorded, name: str) -> Any:
    names = list(recorded.signal_units)
    return recorded.signals[:, names.index(name)] if name in recorded.signal_units else None


def _of_rates(recorded: Recorded, name: str) -> Any:
    place = rates_of(recorded, ()).get(name)
    return None if place is None else recorded.qd[:, place[1]]


def _of_state(recorded: Recorded, name: str) -> Any:
    names = list(state_units(recorded.model))
    if name not in names:
        return None
    k, parts = names.index(name), [(array, i) for array, (axes, _) in STATE.items() for i in range(len(axes))]
    body, part = divmod(k, len(parts))
    if body >= recorded.positions.shape[1]:
        return recorded.joint_coordinates[:, k - len(parts) * recorded.positions.shape[1]]
    array, i = parts[part]
    return getattr(recorded, array)[:, body, i]
