"""A solver of one's own: projected Gauss-Seidel by blocks, beside the built-in methods, and inside a simulation."""

from pathlib import Path
from typing import Any

import amontons
import numpy as np
from amontons.report.comparison import compare

PROBLEMS = Path(__file__).parents[1] / "problems"


def gauss_seidel(problem: amontons.Problem, x0: Any, options: amontons.SolveOptions) -> Any:
    """Block by block, x_i := Pi_K(x_i - (A x + b + De Saxce term)_i / P_i), from the newest x."""
    A = problem.A.to_sparse().tocsr()
    step, term = 1 / problem.P, np.zeros(problem.rows)
    blocks, row = [], 0
    for cone in problem.cones:
        size = cone.rows // cone.n  # rows of each of its blocks
        for _ in range(cone.n):
            blocks.append((slice(row, row + size), cone))
            row += size
    x = x0.copy()
    for _ in range(options.max_iterations or 200):
        for rows, cone in blocks:
            u = A[rows] @ x + problem.b[rows]
            term[:] = 0
            if isinstance(cone, amontons.Friction):  # Coulomb's law
                term[rows.start] = np.hypot(u[1], u[2])
    return x
