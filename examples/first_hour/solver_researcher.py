"""A solver of one's own: projected Gauss-Seidel, beside the built-in methods, then inside a simulation."""

from pathlib import Path
from typing import Any

import amontons
import numpy as np
from amontons.report.comparison import compare


def gauss_seidel(problem: amontons.vi.Problem, x0: Any, options: amontons.vi.SolveOptions) -> Any:
    """Block by block x := Pi_K(x - g / q) from the newest u, q the largest eigenvalue of the block of A."""
    A = problem.A.to_sparse().toarray()
    blocks, row = [], 0
    for cone in problem.cones:
        size = cone.rows // cone.n if isinstance(cone, amontons.vi.Friction) else 1
        blocks += [slice(k, k + size) for k in range(row, row + cone.rows, size)]
        row += cone.rows
    q = [np.linalg.norm(A[rows, rows], 2) for rows in blocks]
    x, u = x0, A @ x0 + problem.b
    for _ in range(options.max_iterations or 3000):
        for rows, largest in zip(blocks, q, strict=True):
            trial = x.copy()
            trial[rows] -= (u + problem.de_saxce(u))[rows] / largest
            new = problem.project(trial)
            u += A[:, rows] @ (new - x)[rows]
            x = new
        if problem.residual(x) <= options.tolerance:
            break
    return x


# 1. A problem from a file, which carries its law.
path = Path(__file__).parents[1] / "problems" / "block_on_incline.hdf5"
problem = amontons.vi.read_problem(path)
print(problem, "\n  law:  ", problem.law)

# 2. My solver, judged by the residual that judges all methods.
x = gauss_seidel(problem, np.zeros(problem.rows), amontons.vi.SolveOptions(tolerance=1e-8))
print(f"mine: residual {problem.residual(x):.1e}, {amontons.vi.violations(problem, x)}")
assert problem.residual(x) <= 1e-8

# 3. The methods that are there.
for run in compare("incline", problem, amontons.vi.methods(), tolerance=1e-8, deadline=1.0):
    if run.solution is not None:
        print(f"{run.method:17} {run.solution.status:10} {run.solution.residual:.1e}")

# 4. The same function makes the steps of a simulation: a block that slides and comes to rest.
model = amontons.scenes.sliding_cube(speed=1.0, mu=0.5)
mine = amontons.Simulation(model, method=gauss_seidel)
theirs = amontons.Simulation(model)
report = mine.run(0.25)
theirs.run(0.25)
apart = np.abs(mine.state.positions - theirs.state.positions).max()
print(f"{report.method}: {report.status}, {apart:.1e} m from the built-in method")
assert apart < 1e-5
