"""A method of the user's own inside a simulation: a Python function that solves the problems of its steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, shown, vector
from ..errors import InputError
from ..problem.problem import Problem


@dataclass(frozen=True)
class SolveOptions:
    """Options of a solve of a simulation: the last argument of a user's own method.

    >>> def method(problem, x0, options):
    ...     return problem.solve(x0=x0, tolerance=options.tolerance).x
    >>> Simulation(scenes.make("stack"), method=method).step().converged
    True
    """

    law: str = "coulomb"
    """coulomb | associated, the law of the problem"""
    tolerance: float = 1e-6
    """natural residual to reach, `problem.residual(x)`"""
    max_iterations: int | None = None
    """None: as the method likes"""
    deadline: float | None = None
    """wall clock (s) that is left of the budget of the step, None without a budget"""
    threads: int | None = None
    """None: as the method likes"""


OwnMethod = Callable[[Problem, Array, SolveOptions], ArrayLike]
"""function(problem, x0, options) -> x"""


def name_of(method: object) -> str:
    """Name of a method in reports: its name, or that of its function."""
    return method if isinstance(method, str) else getattr(method, "__name__", type(method).__name__)


def wrapped(method: OwnMethod) -> Callable[[_core.Problem, Array | None, _core.Options], Array]:
    """The function as the compiled module calls it, in the units of the core."""

    def call(core: _core.Problem, x0: Array | None, given: _core.Options) -> Array:
        problem = Problem._from_core(core, name="step", description="", source="amontons.Simulation")
        start = problem.project(np.zeros(problem.rows)) if x0 is None else problem._from_units(x0)
        options = SolveOptions(
            law=problem.law,
            tolerance=given.tolerance,
            max_iterations=given.max_iterations or None,
            deadline=given.deadline if np.isfinite(given.deadline) else None,
            threads=given.threads or None,
        )
        try:
            x = method(problem, np.array(start), options)
        except Exception as error:
            error.add_note(f"raised by method {name_of(method)} in a step, which was undone")
            raise
        return np.ascontiguousarray(problem._to_core("x", _impulses(x, method, problem.rows)))

    return call


def _impulses(x: object, method: OwnMethod, rows: int) -> Array:
    """The x of a method, (rows,); its entries may be anything, as the residual judges them."""
    what = f"method {name_of(method)}"
    if x is None:
        raise InputError(f"{what} returned None; it must return the impulses x, ({rows},)")
    if np.ndim(x) == 0:  # type: ignore[arg-type]
        raise InputError(f"{what} returned {shown(x)}; it must return the impulses x, ({rows},)")
    values = vector(f"x of {what}", x)  # type: ignore[arg-type]
    if len(values) != rows:
        raise InputError(f"{what} returned {len(values)} impulses; the problem has {rows} rows")
    return values
