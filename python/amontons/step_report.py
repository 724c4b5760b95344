"""What a time step returns."""

from __future__ import annotations

from dataclasses import dataclass, fields

from . import _core


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
    """largest violation of a joint at the start of the step (m)"""
    joint_angle_error: float
    """rad"""
    kinetic_energy: float
    """at the end of the step (J)"""
    potential_energy: float
    """of gravity (J)"""
    spring_energy: float
    """of joint springs (J)"""
    timings: Timings
    method: str
    """of the solve"""

    @property
    def converged(self) -> bool:
        """Whether the solve reached its tolerance."""
        return self.status == "converged"

    @property
    def energy(self) -> float:
        """Kinetic, potential and spring energy (J)."""
        return self.kinetic_energy + self.potential_energy + self.spring_energy


def from_core(core: _core.Report) -> Report:
    values = {f.name: getattr(core, f.name) for f in fields(Report)}
    values["timings"] = Timings(*(getattr(core.timings, f.name) for f in fields(Timings)))
    return Report(**values)
