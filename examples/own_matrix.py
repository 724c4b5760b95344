"""A problem of one's own: a unilateral row, a motor of limited effort and a frictional contact."""

import amontons
import numpy as np
import scipy.sparse as sp

J = np.random.default_rng(1).normal(size=(5, 8))  # rows: constraints, columns: velocities
A = sp.csr_array(J @ J.T)  # unit masses
b = np.array([-1.0, 0.5, -1.0, 0.3, 0.2])  # velocities of the rows without impulses (m/s)
cones = [amontons.vi.NonNegative(1), amontons.vi.Interval(-0.2, 0.2), amontons.vi.Friction(0.4)]

solution = amontons.vi.solve(A, b, cones, tolerance=1e-10, history=True)
print(solution)
print("impulses  ", np.round(solution.x, 4))
print("velocities", np.round(solution.u, 4))
assert solution.history is not None  # as asked for
print("residuals ", solution.history["residual"][:5])
