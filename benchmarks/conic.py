"""The associated problem as a convex program for Clarabel, in two equivalent formulations.

Impulses: min 1/2 x'A x + b'x with x in K. Velocities: with A = D M^-1 D' and b = w + D M^-1 f, the dual
program min 1/2 v'M v - f'v with D v + w in K*, whose multipliers are the impulses. Clarabel takes min 1/2
z'P z + q'z with G z + s = h, s in a product of cones; its second-order cone { s_0 >= |s_1..| } is the
friction cone after scaling the normal row by mu, or the dual of one after scaling the tangential rows by
mu.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import amontons
import clarabel
import numpy as np
import scipy.sparse as sp
from amontons.checks import Array


@dataclass(frozen=True)
class Program:
    """One formulation, ready to be handed to Clarabel."""

    formulation: str
    P: sp.csc_matrix  # upper triangle
    q: Array
    G: sp.csc_matrix
    h: Array
    cones: list[clarabel.SupportedConeT]
    impulses: Callable[[clarabel.DefaultSolution], Array]


@dataclass(frozen=True)
class Outcome:
    x: Array
    time: float
    """s, by Clarabel's own clock: setup (scaling, ordering, symbolic factorisation) and iterations"""
    wall: float
    """s, from handing over the SciPy matrices to the solution"""
    iterations: int
    status: str


def programs(problem: amontons.vi.Problem) -> list[Program]:
    """The formulations that exist for a problem with friction cones and free rows."""
    found = [impulse_program(problem)]
    if isinstance(problem.A, amontons.vi.Factored) and not problem.A.compliance.any():
        found.append(velocity_program(problem))
    return found


def impulse_program(problem: amontons.vi.Problem) -> Program:
    """min 1/2 x'A x + b'x, (mu x_n, x_t) in the second-order cone; no constraint on free rows."""
    A = problem.A.to_sparse() if isinstance(problem.A, amontons.vi.Factored) else sp.csr_array(problem.A)
    mu, m = problem.mu, problem.rows
    scale = np.ones((len(mu), 3))
    scale[:, 0] = mu
    rows, cones = _cone_rows(scale, mu, dual=False)
    G = -sp.csc_matrix(sp.hstack([rows, sp.csr_matrix((rows.shape[0], m - 3 * len(mu)))]))
    h = np.zeros(G.shape[0])
    return Program("impulses", _upper(A), problem.b, G, h, cones, lambda s: np.array(s.x))


def velocity_program(problem: amontons.vi.Problem) -> Program:
    """min 1/2 v'M v - f'v, (u_n, mu u_t) in the second-order cone, u = 0 on free rows, u = D v + w."""
    operator = problem.A
    assert isinstance(operator, amontons.vi.Factored)
    D = operator.jacobian()
    inverse_mass = operator.inverse_mass_matrix()
    M = sp.csr_array(sp.linalg.inv(sp.csc_matrix(inverse_mass)))
    f = np.zeros(D.shape[1]) if problem.f is None else problem.f
    w = problem.b - D @ (inverse_mass @ f)
    mu = problem.mu
    contact_rows = 3 * len(mu)
    scale = np.repeat(mu[:, None], 3, axis=1)
    scale[:, 0] = 1
    rows, cones = _cone_rows(scale, mu, dual=True)
    free = problem.rows - contact_rows
    selection = sp.csr_matrix(sp.block_diag([rows, sp.eye(free)]) if free else rows)
    if free:
        cones = [*cones, clarabel.ZeroConeT(free)]
    G, h = -sp.csc_matrix(selection @ D), selection @ w
    return Program("velocities", _upper(M), -f, G, h, cones, lambda s: selection.T @ np.array(s.z))


def _cone_rows(scale: Array, mu: Array, *, dual: bool) -> tuple[sp.csr_matrix, list[clarabel.SupportedConeT]]:
    """The matrix that takes contact rows to cone rows, and the cones.

    Without friction the cone is a half line in the normal direction: x_t = 0, and u_t is not constrained.
    """
    entries, cones = [], []
    for c, coefficient in enumerate(mu):
        if coefficient > 0:
            entries += [(3 * c + k, scale[c, k]) for k in range(3)]
            cones.append(clarabel.SecondOrderConeT(3))
        else:
            entries.append((3 * c, 1.0))
            cones.append(clarabel.NonnegativeConeT(1))
            if not dual:
                entries += [(3 * c + 1, 1.0), (3 * c + 2, 1.0)]
                cones.append(clarabel.ZeroConeT(2))
    columns = [column for column, _ in entries]
    values = [value for _, value in entries]
    shape = (len(entries), 3 * len(mu))
    return sp.csr_matrix((values, (np.arange(len(entries)), columns)), shape=shape), cones


def _upper(matrix: sp.sparray) -> sp.csc_matrix:
    return sp.csc_matrix(sp.triu(matrix, format="csc"))


def settings(tolerance: float) -> clarabel.DefaultSettings:
    """Clarabel's defaults on one thread, with all of its tolerances at the given value.

    QDLDL is the faster of its two linear solvers on one thread for these problems, by 5 to 15 %.
    """
    chosen = clarabel.DefaultSettings()
    chosen.verbose = False
    chosen.max_threads = 1
    chosen.direct_solve_method = "qdldl"
    chosen.tol_gap_abs = chosen.tol_gap_rel = chosen.tol_feas = tolerance
    return chosen


def run(program: Program, chosen: clarabel.DefaultSettings) -> Outcome:
    """Solve once; setup is part of the time, the building of the matrices in Python is not."""
    start = perf_counter()
    solver = clarabel.DefaultSolver(program.P, program.q, program.G, program.h, program.cones, chosen)
    solution = solver.solve()
    wall = perf_counter() - start
    x = program.impulses(solution)
    return Outcome(x, solution.solve_time, wall, solution.iterations, str(solution.status))
