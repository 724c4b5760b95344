"""Reports of steps as a structured array."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .step_report import Report

Table = np.ndarray[Any, Any]
TIMINGS = ("collision", "assembly", "solve", "integration", "total")
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
        *((name, np.float64) for name in TIMINGS),
        ("method", "U20"),
    ]
)
"""The fields of `Report`, its timings by phase (s) among them."""


def report_table(reports: Sequence[Report]) -> Table:
    """One row per report."""
    return np.array([_row(report) for report in reports], dtype=REPORTS)


def energy(reports: Table) -> np.ndarray[Any, Any]:
    """Kinetic, potential and spring energy (J)."""
    return reports["kinetic_energy"] + reports["potential_energy"] + reports["spring_energy"]


def _row(report: Report) -> tuple[Any, ...]:
    timings = {name: getattr(report.timings, name) for name in TIMINGS}
    return tuple(timings[name] if name in timings else getattr(report, name) for name in REPORTS.names or ())
