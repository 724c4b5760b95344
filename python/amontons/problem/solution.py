"""The result of a solve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..checks import Array

HISTORY = np.dtype(
    [
        ("iteration", np.uint64),
        ("products", np.uint64),
        ("time", np.float64),
        ("residual", np.float64),
        ("best_residual", np.float64),
        ("objective", np.float64),
        ("step", np.float64),
        ("backtracks", np.uint64),
    ]
)
"""The fields of Solution.history, those of IterationRecord (amontons/solvers/driver/solution.hpp)."""


class Phase(NamedTuple):
    """One method of a solve that took several."""

    method: str
    """the method, and what it was run on where that is not the problem itself"""
    why: str
    """why it was run"""
    iterations: int
    residual: float
    """natural residual that it ended with, under the law asked for"""


@dataclass(frozen=True, eq=False, repr=False)
class Solution:
    """The outcome of a solve; also when it did not converge, x is the best iterate seen.

    >>> solution = vi.solve(np.eye(3), [-1, -2, 0], "friction", mu=0.5)
    >>> solution.status, solution.residual <= 1e-6
    ('converged', True)
    """

    x: Array
    """(m,) impulses (N s; moments N m s), in the order and frame of the rows of A"""
    u: Array
    """(m,) constraint velocities A x + b (m/s; spins rad/s), without the De Saxce term; u_n > 0 separates"""
    status: str
    """converged | iteration_limit | deadline | stalled | interrupted | infeasible"""
    residual: float
    """natural residual of x under the law asked for, relative to that of x = 0"""
    objective: float
    """1/2 x'A x + b'x (J)"""
    iterations: int
    products: int
    """products with A, the measure of work that all methods share"""
    factorizations: int
    work: float
    """nominal work, counted and not timed: its unit is one block of a product with A, some 20 ns"""
    time: float
    """wall clock (s)"""
    method: str
    """the method that produced x"""
    device: str
    """where its vectors were: "cpu", the name of a device, or the class of an `amontons.vi.Iterate`"""
    reason: str
    """what was chosen and why, and every phase that ran; empty for a method that is none of several phases"""
    phases: list[Phase]
    """the phases of auto or interior-point that ran, in order; with several islands, those of the hardest"""
    history: np.ndarray[Any, Any] | None
    """one record per iteration (fields of HISTORY), or None unless history=True"""

    @property
    def converged(self) -> bool:
        """True if the residual is at or below the tolerance."""
        return self.status == "converged"

    def __repr__(self) -> str:
        lines = [
            f"status:     {self.status}" + (f" ({self.reason})" if self.reason else ""),
            f"method:     {self.method}" + (f" on {self.device}" if self.device != "cpu" else ""),
            f"residual:   {self.residual:.3e}",
            f"objective:  {self.objective:.9g}",
            f"iterations: {self.iterations}, products: {self.products}, "
            f"factorizations: {self.factorizations}",
            f"time:       {1e3 * self.time:.3g} ms",
            f"x:          {len(self.x)} impulses, u: {len(self.u)} velocities",
        ]
        if self.history is not None:
            lines.append(f"history:    {len(self.history)} records")
        return "amontons.vi.Solution\n  " + "\n  ".join(lines)


def from_core(result: _core.Result, history: bool, scale: Array | None, asked_for: str = "cpu") -> Solution:
    """scale: by what moments of x are multiplied and spins of u divided; None where there are none.

    asked_for: the device; the reason says where another one served.
    """
    reason = result.reason
    if asked_for != "cpu" and result.device == "cpu":
        stays = f"{result.method} runs on the CPU, a device has the passes of p-spg-fb and apgd"
        reason = f"{reason}; {stays}" if reason else stays
    return Solution(
        x=result.x if scale is None else result.x * scale,
        u=result.u if scale is None else result.u / scale,
        status=result.status,
        residual=result.residual,
        objective=result.objective,
        iterations=result.iterations,
        products=result.products,
        factorizations=result.factorizations,
        work=result.work,
        time=result.time,
        method=result.method,
        device=result.device,
        reason=reason,
        phases=[Phase(*phase) for phase in result.phases],
        history=result.history.view(HISTORY) if history else None,
    )
