"""Solve a problem file with both laws of friction and look at what the residual means."""

from pathlib import Path

import amontons

problem = amontons.vi.read_problem(Path(__file__).parent / "problems" / "wall_impact.hdf5")
print(problem)

for law in ("associated", "coulomb"):
    solution = problem.solve(law=law, tolerance=1e-6, deadline=5)
    print(f"\nlaw {law}\n{solution}")
    print(amontons.vi.violations(problem, solution.x, law=law))
