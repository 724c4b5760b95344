"""`Report`, the result of a time step, and many of them as one structured array."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from types import SimpleNamespace
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


class Report:
    """The result of a step.

    It views what the compiled step returned: a field costs something only when it is read.

    >>> report = Simulation(scenes.make("stack")).step()
    >>> report.status, report.residual <= 1e-6, report.penetration < 1e-6
    ('converged', True, True)
    """

    __slots__ = ("_core",)

    def __init__(self, core: _core.Report) -> None:
        self._core = core

    @property
    def time(self) -> float:
        """At the end of the step (s)."""
        return self._core.time

    @property
    def advanced(self) -> bool:
        """False if velocities came out not finite: the state is that before the step."""
        return self._core.advanced

    @property
    def status(self) -> str:
        """How the solves of the step ended: converged | iteration_limit | deadline | stalled | interrupted |
        infeasible; that of the first solve that missed its tolerance. made_safe: the solve converged, and the
        safe step changed its impulses (`path`)."""
        return self._core.status

    @property
    def path(self) -> str:
        """Path of the step: the last stage that changed its impulses or velocities.

        - accurate: the impulses are those that the solve found.
        - joints_restored: the solve missed its tolerance; the joints were solved exactly for the contact
          impulses that it left.
        - budget_spent: the same, as the budget of the step ended the solve.
        - impulses_scaled: the step would have made energy from nothing; its contact impulses were scaled down
          until it does not.
        - bodies_stopped: bodies that would have passed fixed geometry were stopped there.
        """
        return self._core.path

    @property
    def solves(self) -> int:
        """Calls of a solver: for positions, impacts and the step itself; 0 where the start was accepted."""
        return self._core.solves

    @property
    def residual(self) -> float:
        """Natural residual of `Simulation.problem()` at `Simulation.forces.impulses`, under their law."""
        return self._core.residual

    @property
    def iterations(self) -> int:
        """Iterations of all solves of the step."""
        return self._core.iterations

    @property
    def products(self) -> int:
        """Products with the operator A in all solves of the step."""
        return self._core.products

    @property
    def factorizations(self) -> int:
        """Factorisations of all solves of the step."""
        return self._core.factorizations

    @property
    def contacts(self) -> int:
        """Contact points with rows."""
        return self._core.contacts

    @property
    def joint_rows(self) -> int:
        """Rows of joints, drives, limits, tendons and couplings."""
        return self._core.joint_rows

    @property
    def substeps(self) -> int:
        """Number of parts (substeps) of the step."""
        return self._core.substeps

    @property
    def penetration(self) -> float:
        """Deepest at the start of the step, >= 0 (m)."""
        return self._core.penetration

    @property
    def joint_error(self) -> float:
        """Largest violation of a joint, rigid coupling or limit of a tendon at the start of the step (m)."""
        return self._core.joint_error

    @property
    def joint_angle_error(self) -> float:
        """The same of angles (rad)."""
        return self._core.joint_angle_error

    @property
    def kinetic_energy(self) -> float:
        """At the end of the step (J)."""
        return self._core.kinetic_energy

    @property
    def potential_energy(self) -> float:
        """Energy of gravity (J)."""
        return self._core.potential_energy

    @property
    def spring_energy(self) -> float:
        """Energy of joint springs (J)."""
        return self._core.spring_energy

    @property
    def energy_balance(self) -> float:
        """Work of what can only dissipate: rigid contacts, joints, limits, dry friction (J).

        Above zero it is energy from nothing.
        """
        return self._core.energy_balance

    @property
    def balanced(self) -> bool:
        """False if the step made energy from nothing, more than its tolerance explains."""
        return self._core.balanced

    @property
    def method(self) -> str:
        """Name of the method that solved the step."""
        return self._core.method

    @property
    def timings(self) -> Timings:
        """Wall-clock time of each phase (s)."""
        core = self._core.timings
        return Timings(*(getattr(core, name) for name in TIMINGS))

    @property
    def converged(self) -> bool:
        """Whether the solve reached its tolerance and the step made no energy from nothing."""
        return self.status == "converged" and self.balanced

    @property
    def energy(self) -> float:
        """Kinetic, potential and spring energy (J)."""
        return self.kinetic_energy + self.potential_energy + self.spring_energy

    def _values(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in FIELDS}

    def __repr__(self) -> str:
        return f"Report({', '.join(f'{name}={value!r}' for name, value in self._values().items())})"

    def __eq__(self, other: object) -> bool:
        return self._values() == other._values() if isinstance(other, Report) else NotImplemented

    def __hash__(self) -> int:
        return hash(tuple(self._values().values()))

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self._values(),)


def _restored(values: dict[str, Any]) -> Report:
    """A report that was pickled, of plain numbers."""
    return Report(SimpleNamespace(**values))  # type: ignore[arg-type]


TIMINGS = tuple(f.name for f in fields(Timings))
FIELDS = tuple(name for name, value in vars(Report).items() if isinstance(value, property))[:-2]
"""Fields of a report, without those that follow from others."""
REPORTS = np.dtype(
    [
        ("time", np.float64),
        ("status", "U16"),
        ("converged", np.bool_),
        ("residual", np.float64),
        ("path", "U16"),
        ("solves", np.int64),
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
