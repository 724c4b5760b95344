"""Measurements on the time steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from amontons.problem.problem import Problem
from amontons.report.comparison import Run, compare

from .cases import Case

LEVEL = 1e-4
"""Residual at which the cost of a method is read off."""
PRODUCTS = 200
"""Products after which the residual is read off."""
TOLERANCE = 1e-8
"""Where the runs end."""
STOPS = 30
SWEPT = ("p-spg-fb-literal", "p-spg-fb", "jacobi", "gauss-seidel", "apgd", "interior-point", "newton")
SWEPT_BILATERAL = ("p-spg-fb-literal", "p-spg-fb", "jacobi", "gauss-seidel", "apgd", "cg", "minres")
Before = Callable[[str], None]


@dataclass(frozen=True)
class Trace:
    """The literal variant on one problem: its iterates, and what it would return if stopped."""

    history: np.ndarray[Any, Any]
    optimum: float
    """objective of an accurate solution (J)"""
    stops: np.ndarray[Any, Any]
    objectives: np.ndarray[Any, Any]
    """of the fallback after so many iterations (J)"""
    residuals: np.ndarray[Any, Any]
    """natural, of the fallback"""

    @property
    def rises(self) -> int:
        """Iterations in which the objective rose."""
        return int((np.diff(self.history["objective"]) > 0).sum())


def trace(problem: Problem, iterations: int, deadline: float) -> Trace:
    """Solved afresh for every stop: the fallback is chosen by the method's own measure, not by ours."""
    literal: dict[str, Any] = {"law": "associated", "method": "p-spg-fb-literal", "tolerance": 0.0}
    history = problem.solve(**literal, max_iterations=iterations, history=True).history
    assert history is not None
    optimum = problem.solve(law="associated", tolerance=1e-10, deadline=deadline).objective
    stops = np.unique(np.geomspace(1, max(2, len(history) - 1), STOPS).round().astype(int))
    stopped = [problem.solve(**literal, max_iterations=int(stop)) for stop in stops]
    objectives, residuals = (
        np.array([getattr(s, name) for s in stopped]) for name in ("objective", "residual")
    )
    optimum = min(optimum, float(history["objective"].min()), float(objectives.min()))
    return Trace(history, optimum, stops, objectives, residuals)


def sweep(
    cases: Sequence[tuple[float, Callable[[], Case]]],
    methods: Sequence[str],
    *,
    law: str,
    deadline: float,
    before: Before,
) -> Iterator[dict[str, Any]]:
    """One row per case and method; cases: (what varies, how to make it)."""
    for value, make in cases:
        case = make()
        before(f"{case.name} of {case.bodies} bodies")
        for run in compare(case.name, case.problem, methods, law=law, tolerance=TOLERANCE, deadline=deadline):
            yield {
                "problem": case.name,
                "value": value,
                "bodies": case.bodies,
                "rows": case.problem.rows,
                **_cost(run),
            }


def _cost(run: Run) -> dict[str, Any]:
    """Products and time to LEVEL, or until the run ended without it; residual after PRODUCTS."""
    s = run.solution
    if s is None or s.history is None:
        return {"method": run.method, "status": "not applicable", "reached": False}
    at = first_below(run, LEVEL)
    early = s.history["products"] <= PRODUCTS
    return {
        "method": run.method,
        "status": s.status,
        "reached": at is not None,
        "products": at[0] if at else s.products,
        "time": at[1] if at else s.time,
        "residual": float(s.history["best_residual"][early][-1]),
    }


def first_below(run: Run, level: float) -> tuple[int, float] | None:
    """Products and time (s) at which the best residual first reached a level, or None."""
    history = None if run.solution is None else run.solution.history
    if history is None:
        return None
    reached = np.flatnonzero(history["best_residual"] <= level)
    return (
        (int(history["products"][reached[0]]), float(history["time"][reached[0]])) if len(reached) else None
    )
