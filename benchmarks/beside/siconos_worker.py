"""Siconos' solvers of one friction problem, in the interpreter that has Siconos.

    python3 -m beside.siconos_worker

Reads a JSON object per line and answers with one: `problem`, a NumPy archive, then `solver` and `tolerance`
for each solve, whose impulses go to the file `out`, or `judge`, a file of impulses. Times are seconds of this
process.
"""

from __future__ import annotations

from importlib.metadata import version
from time import process_time
from typing import Any

import numpy as np
import scipy.sparse
import siconos.numerics as numerics

from .plain import serve

ITERATIONS = {"NSGS": 100000, "ADMM": 100000, "NSN_AC": 1000}


class Problem:
    """With blocks for Gauss-Seidel, which is the fastest with them, and with a sparse matrix for others."""

    def __init__(self, path: str) -> None:
        data = np.load(path)
        self.q, self.mu, self.size = data["q"], data["mu"], len(data["q"])
        entries = (data["value"], (data["row"], data["col"]))
        self.matrix = scipy.sparse.csc_matrix(entries, shape=(self.size, self.size))
        self.blocks = numerics.SBM_from_csparse(3, self.matrix)[1]

    def form(self, solver: str) -> Any:
        matrix = self.blocks if solver == "NSGS" else self.matrix
        return numerics.FrictionContactProblem(3, matrix, self.q, self.mu)


def judge(problem: Problem, order: dict[str, Any]) -> dict[str, Any]:
    """The error of the impulses of a file, by Siconos' own measure."""
    options = numerics.SolverOptions(numerics.SICONOS_FRICTION_3D_NSGS)
    impulses, velocities = np.load(order["judge"]), np.zeros(problem.size)
    given = problem.form("NSGS"), impulses, velocities, order["tolerance"], options
    return {"error": numerics.fc3d_compute_error(*given, np.linalg.norm(problem.q))[1]}


def solve(problem: Problem, order: dict[str, Any]) -> dict[str, Any]:
    options = numerics.SolverOptions(getattr(numerics, f"SICONOS_FRICTION_3D_{order['solver']}"))
    options.dparam[numerics.SICONOS_DPARAM_TOL] = order["tolerance"]
    options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = ITERATIONS[order["solver"]]
    impulses, velocities = np.zeros(problem.size), np.zeros(problem.size)
    given = problem.form(order["solver"])
    begin = process_time()
    info = numerics.fc3d_driver(given, impulses, velocities, options)
    spent = process_time() - begin
    np.save(order["out"], impulses)
    return {"time": spent, "solved": info == 0}


def main() -> None:
    last: list[Problem] = []

    def answer(order: dict[str, Any]) -> dict[str, Any]:
        if "version" in order:
            return {"version": version("siconos")}
        if "problem" in order:
            last[:] = [Problem(order["problem"])]
            return {}
        return (judge if "judge" in order else solve)(*last, order)

    serve(answer)


if __name__ == "__main__":
    main()
