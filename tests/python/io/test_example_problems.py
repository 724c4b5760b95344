"""The problems that ship with the repository: a time step of 10 ms each of six small scenes.

u = D v + c with c = gap / h in the normal rows of contacts and c = error / h in rows of joints.
"""

import amontons
import numpy as np
import pytest
from problems import EXAMPLES

STEP = 0.01  # s
WEIGHT = 9.81 * STEP  # impulse of the weight of 1 kg in one step (N s)


def read(name):
    return amontons.vi.read_problem(EXAMPLES / f"{name}.hdf5")


# Breaks when the folder grows beyond what a repository should carry.
def test_folder_is_small():
    assert sum(file.stat().st_size for file in EXAMPLES.iterdir()) < 5e5


# A body at rest gets from below the impulse of its weight: sum of x_n = h g m in all. Breaks when gravity,
# gap or normal have the wrong sign, size or row.
@pytest.mark.parametrize("name", ["wall_at_rest", "plates"])
def test_ground_carries_the_weight(name):
    problem = read(name)
    solution = problem.solve(tolerance=1e-9, deadline=20)
    assert solution.residual < 1e-6
    ground = (problem.A.body_b < 0) & (np.arange(problem.rows) % 3 == 0)
    weight = WEIGHT * (1 / problem.A.inverse_mass).sum()
    assert solution.x[ground].sum() == pytest.approx(weight, rel=1e-5)
    # At rest before, at rest after. u is relative to the velocity without contact.
    assert np.abs(solution.u).max() < 1e-5 * np.abs(problem.b).max()


# tan(20 deg) = .364 < mu = .5: the block sticks, its normal impulses sum to h g m cos(20 deg).
@pytest.mark.parametrize("law", ["associated", "coulomb"])
def test_block_sticks_on_the_incline(law):
    problem = read("block_on_incline")
    solution = problem.solve(law=law, tolerance=1e-10)
    assert solution.converged
    assert np.abs(solution.u).max() < 1e-8
    assert solution.x[::3].sum() == pytest.approx(8 * WEIGHT * np.cos(np.radians(20)), rel=1e-8)


# Breaks when the ball does not reach the wall within the step (gap over step against speed).
def test_ball_hits_the_wall():
    problem = read("wall_impact")
    ball = problem.A.bodies - 1
    rows = np.flatnonzero(((problem.A.body_a == ball) | (problem.A.body_b == ball)) & (problem.A.body_a >= 0))
    normal = rows[0]
    assert problem.b[normal] == pytest.approx(-5.0 + 0.002 / STEP)


# Breaks when the bilateral scene is no linear system: CG must agree with a direct solution in velocities.
def test_lattice_is_a_linear_system():
    problem = read("lattice")
    solution = problem.solve(method="cg", tolerance=1e-10)
    assert solution.converged
    velocities = problem.A.to_sparse() @ solution.x + problem.b
    assert np.abs(velocities).max() < 1e-7


# Breaks when a sphere is missing, or touches others than its neighbours in a square pyramid of six layers.
def test_spheres_are_a_pyramid():
    problem = read("spheres")
    beside, below = 2 * sum(k * (k - 1) for k in range(1, 7)), 4 * sum(k * k for k in range(1, 6))
    assert (problem.A.bodies, problem.contacts) == (91, 36 + beside + below)
    ground = (problem.A.body_b < 0) & (np.arange(problem.rows) % 3 == 0)
    assert problem.b == pytest.approx(np.where(ground, -9.81 * STEP, 0), abs=1e-12)
