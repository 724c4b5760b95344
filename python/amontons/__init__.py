"""Frictional contact and joint problems of rigid bodies, solved by P-SPG-FB and its companions.

import amontons
problem = amontons.read_problem("wall.hdf5")
solution = problem.solve(tolerance=1e-8)
"""

from importlib.metadata import PackageNotFoundError, version

from ._core import IterationRecord
from .cones import Free, Friction, Interval, NonNegative
from .errors import FileError, InputError, SymmetrisedWarning
from .io import read_problem
from .operators import Contacts, Factored
from .options import methods
from .problem import Problem, Violations, residual, solve, violations
from .solution import Solution

try:
    __version__ = version("amontons")
except PackageNotFoundError:  # a build folder on the path, not installed
    __version__ = "unknown"

__all__ = [
    "Contacts",
    "Factored",
    "FileError",
    "Free",
    "Friction",
    "InputError",
    "Interval",
    "IterationRecord",
    "NonNegative",
    "Problem",
    "Solution",
    "SymmetrisedWarning",
    "Violations",
    "__version__",
    "methods",
    "read_problem",
    "residual",
    "solve",
    "violations",
]
