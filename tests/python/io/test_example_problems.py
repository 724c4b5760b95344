"""The problems that ship with the repository, and their generator."""

import amontons
import make_example_problems as generator
import numpy as np
import pytest
from problems import EXAMPLES

WEIGHT = 9.81 * generator.STEP  # impulse of the weight of 1 kg in one step (N s)


def read(name):
    return amontons.vi.read_problem(EXAMPLES / f"{name}.hdf5")


# Breaks when the generator changes and the files do not (run tools/make_example_problems.py).
@pytest.mark.parametrize("scene", generator.SCENES, ids=lambda scene: scene.__name__)
def test_files_are_those_of_the_generator(scene):
    made, shipped = scene().problem(), read(scene.__name__)
    x = np.random.default_rng(0).normal(size=made.rows)
    assert np.allclose(shipped.A @ x, made.A @ x, rtol=0, atol=1e-12 * np.abs(made.A @ x).max())
    assert np.allclose(shipped.b, made.b, rtol=0, atol=1e-12)
    assert shipped.name == made.name


# Breaks when the folder grows beyond what a repository should carry, or holds a file nobody makes.
def test_folder_is_small_and_complete():
    files = sorted(EXAMPLES.iterdir())
    assert [f.stem for f in files] == sorted(scene.__name__ for scene in generator.SCENES)
    assert sum(f.stat().st_size for f in files) < 3e6


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
    assert problem.b[normal] == pytest.approx(-5.0 + 0.002 / generator.STEP)


# Breaks when the bilateral scene is no linear system: CG must agree with a direct solution in velocities.
def test_lattice_is_a_linear_system():
    problem = read("lattice")
    solution = problem.solve(method="cg", tolerance=1e-10)
    assert solution.converged
    velocities = problem.A.to_sparse() @ solution.x + problem.b
    assert np.abs(velocities).max() < 1e-7
