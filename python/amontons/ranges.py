"""The range of every number that users hand in, in one place; docs/python.md has the table.

The ranges are far beyond the values of any mechanism in any units, and far from the overflow of squares and
products. A value outside is a slip, a wrong unit, or a number that was never set.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from . import _core

LARGEST = 1e30
"""|value| of a number of a model in its units: masses, sizes, stiffnesses, forces, ..."""
FARTHEST: float = _core.FARTHEST
"""|coordinate| of a position (m), and speed (m/s, rad/s)"""
MOST_COUNT = 2**31 - 1


class Range(NamedTuple):
    """least <= value <= most; `whole`: an integer."""

    least: float
    most: float
    unit: str = ""
    whole: bool = False

    def __contains__(self, value: object) -> bool:
        return isinstance(value, int | float) and self.least <= value <= self.most

    def __str__(self) -> str:
        bounds = (
            f"from {self.least:g} to {self.most:g}" if self.most < math.inf else f"at least {self.least:g}"
        )
        return f"{bounds} {self.unit}".rstrip()


OPTIONS = {
    "dt": Range(1e-12, 1e9, "s"),
    "duration": Range(1e-12, 1e15, "s"),
    "tolerance": Range(0, 1e30),
    "budget": Range(1e-9, math.inf, "s"),
    "deadline": Range(1e-9, math.inf, "s"),
    "margin": Range(0, FARTHEST, "m"),
    "recovery_speed": Range(0, math.inf, "m/s"),
    "restitution_speed": Range(0, math.inf, "m/s"),
    "threads": Range(1, 1024, whole=True),
    "max_iterations": Range(1, MOST_COUNT, whole=True),
    "max_substeps": Range(1, 1024, whole=True),
    "memory": Range(0, 1_000_000, whole=True),
    "steps": Range(1, MOST_COUNT, whole=True),
    "repeat": Range(1, MOST_COUNT, whole=True),
    "every": Range(1, MOST_COUNT, whole=True),
}
"""Ranges of the options by name."""
