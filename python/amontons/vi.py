"""Variational inequalities of time steps: problems, sets, operators, methods, residuals.

from amontons import vi
problem = vi.read_problem("wall.hdf5")
solution = problem.solve(tolerance=1e-8)
"""

from typing import TYPE_CHECKING as _TYPE_CHECKING

from ._core import IterationRecord as IterationRecord
from .errors import SymmetrisedWarning as SymmetrisedWarning
from .lazy import later as _later
from .problem.cones import Bilateral as Bilateral
from .problem.cones import EllipticFriction as EllipticFriction
from .problem.cones import Friction as Friction
from .problem.cones import Interval as Interval
from .problem.cones import NonNegative as NonNegative
from .problem.cones import PlanarFriction as PlanarFriction
from .problem.cones import RollingFriction as RollingFriction
from .problem.iterate import Iterate as Iterate
from .problem.operators import Contacts as Contacts
from .problem.operators import Factored as Factored
from .problem.options import methods as methods
from .problem.problem import Problem as Problem
from .problem.problem import Violations as Violations
from .problem.problem import residual as residual
from .problem.problem import solve as solve
from .problem.problem import violations as violations
from .problem.solution import Solution as Solution
from .simulation.own_method import SolveOptions as SolveOptions

if _TYPE_CHECKING:
    from .io import read_problem as read_problem
else:
    __getattr__ = _later(__name__, {"read_problem": "io"})

__all__ = [
    "Bilateral",
    "Contacts",
    "EllipticFriction",
    "Factored",
    "Friction",
    "Interval",
    "Iterate",
    "IterationRecord",
    "NonNegative",
    "PlanarFriction",
    "Problem",
    "RollingFriction",
    "Solution",
    "SolveOptions",
    "SymmetrisedWarning",
    "Violations",
    "methods",
    "read_problem",
    "residual",
    "solve",
    "violations",
]
