"""What a time step returns, `Report`, and many of them as one structured array."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from .. import _core

Table = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Timings:
    """Wall clock of the phases of a step (s)."""

    collision: float
    assembly: float
    solve: float
    integration: float
    total: float


@dataclass(frozen=True)
class Report:
    """What a step did."""

    time: float
    """at the end of the step (s)"""
    advanced: bool
    """False if velocities came out not finite: the state is that before the step"""
    status: str
    """of the solve: converged | iteration_limit | deadline | stalled | interrupted | infeasible"""
    residual: float
    """natural residual of the law asked for, the worst of the substeps"""
    iterations: int
    products: int
    factorizations: int
    contacts: int
    joint_rows: int
    substeps: int
    penetration: float
    """deepest at the start of the step, >= 0 (m)"""
    joint_error: float
    """largest violation of a joint, rigid coupling or limit of a tendon at the start of the step (m)"""
    joint_angle_error: float
    """rad"""
    kinetic_energy: float
    """at the end of the step (J)"""
    potential_energy: float
    """of gravity (J)"""
    spring_energy: float
    """of joint springs (J)"""
    energy_balance: float
    """work of what can only dissipate: rigid contacts, joints, limits, dry friction (J); above zero it is
    energy from nothing"""
    balanced: bool
    """False if the step made energy from nothing, more than its tolerance explains"""
    timings: Timings
    method: str
    """of the solve"""

    @property
    def converged(self) -> bool:
        """Whether the solve reached its tolerance and the step made no energy from nothing."""
        return self.status == "converged" and self.balanced

    @property
    def energy(self) -> float:
        """Kinetic, potential and spring energy (J)."""
        return self.kinetic_energy + self.potential_energy + self.spring_energy


def from_core(core: _core.Report) -> Report:
    values = {f.name: getattr(core, f.name) for f in fields(Report)}
    values["timings"] = Timings(*(getattr(core.timings, f.name) for f in fields(Timings)))
    return Report(**values)


TIMINGS = tuple(f.name for f in fields(Timings))
REPORTS = np.dtype(
    [
        ("time", np.float64),
        ("status", "U16"),
        ("converged", np.bool_),
        ("residual", np.float64),
        ("iterations", np.int64),
        ("products", np.int64),
        ("factorizations", np.int64),
        ("contacts", np.int64),
        ("joint_rows", np.int64),
        ("substeps", np.int64),
        ("penetration", np.float64),
        ("joint_error", np.float64),
        ("joint_angle_error", np.float64),
        ("kinetic_energy", np.float64),
        ("potential_energy", np.float64),
        ("spring_energy", np.float64),
        ("energy_balance", np.float64),
        ("balanced", np.bool_),
        *((name, np.float64) for name in TIMINGS),
        ("method", "U20"),
    ]
)
"""The fields of `Report`, its timings by phase (s) among them."""


def reports_array(reports: Sequence[Report]) -> Table:
    """One row per report."""
    return np.array([_row(report) for report in reports], dtype=REPORTS)


def energy(reports: Table) -> np.ndarray[Any, Any]:
    """Kinetic, potential and spring energy (J)."""
    return reports["kinetic_energy"] + reports["potential_energy"] + reports["spring_energy"]


def _row(report: Report) -> tuple[Any, ...]:
    timings = {name: getattr(report.timings, name) for name in TIMINGS}
    return tuple(timings[name] if name in timings else getattr(report, name) for name in REPORTS.names or ())
