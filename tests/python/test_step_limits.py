"""How long a step may take, whatever is in it."""

from itertools import pairwise

import amontons
import numpy as np
import pytest
from amontons import scenes, shapes


# Breaks when a step that cannot be solved, here as nothing meets a tolerance of zero, works on without bound,
# leaves its state, or ends otherwise the next time: its limit counts work, by the formula of `most_work` in
# solve_step.hpp, and no time. Half of it is for one solve; an iteration of the last may be long.
def test_step_that_cannot_be_solved_ends():
    def made():
        sim = amontons.Simulation(scenes.make("stack", boxes=4), dt=5e-3, tolerance=0, on_failure="ignore")
        return sim, [sim.step() for _ in range(3)]

    (first, reports), (second, _) = made(), made()
    for report in reports:
        blocks = report.contacts + report.joint_rows
        assert report.products * (blocks + 16) < 1.5e6 + 100 * blocks**2
        assert report.advanced
        assert report.residual < 1e-6
    np.testing.assert_array_equal(first.state.positions, second.state.positions)


# Breaks when a body that spins some million times in a step takes seconds for it, or energy from nothing.
def test_spin_that_no_step_follows():
    builder = amontons.ModelBuilder(gravity=(0, 0, 0))
    builder.add_body(shape=shapes.Box((1e-3, 2e-3, 3e-3)), density=1, angular_velocity=(3e8, 2e8, 1e8))
    sim = amontons.Simulation(builder.build(), dt=5e-3)
    report = sim.step()
    assert report.advanced
    before = report.kinetic_energy
    assert sim.step().kinetic_energy <= 3 * before  # of three inertias, which such a step confuses


# Breaks when impulses that there was no time to find make energy: with a budget that is spent before the
# first solve, every step of bodies that start inside each other, with joints between them, is such a
# step. What is not allowed is taken back, whatever else they lack then.
def test_steps_without_time_make_no_energy():
    rng = np.random.default_rng(3)
    builder = amontons.ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    bodies = [
        builder.add_body(
            shape=shapes.Box((0.1, 0.05, 0.02)),
            density=10.0 ** rng.uniform(1, 5),
            position=0.15 * rng.random(3),
        )
        for _ in range(10)
    ]
    for a, b in pairwise(bodies):
        builder.add_revolute_joint(a, b, point=0.15 * rng.random(3), axis=(0, 1, 0), stiffness=1e3, damping=1)
    for recovery in ("projection", "velocity"):
        sim = amontons.Simulation(
            builder.build(), dt=5e-3, budget=1e-9, recovery=recovery, on_failure="ignore"
        )
        for _ in range(50):
            report = sim.step()
            assert report.balanced
            assert np.isfinite(sim.state.positions).all()
        # Falling for a quarter of a second gives 2.5 m/s.
        assert np.abs(sim.state.linear_velocities).max() < 100


# Breaks when surfaces that interlock let bodies through: from some mu on the cone is a half space to
# rounding.
@pytest.mark.parametrize("mu", [1e3, 1e8, 1e30])
def test_friction_without_bound(mu):
    builder = amontons.ModelBuilder()
    rough = amontons.Material(friction=mu)
    builder.add_geom(None, shapes.Plane(), material=rough)
    for i in range(3):
        box = dict(shape=shapes.Box((0.1, 0.1, 0.1)), density=1000, material=rough)
        builder.add_body(**box, position=(0.03 * i, 0, 0.11 + 0.21 * i))
    sim = amontons.Simulation(builder.build(), dt=5e-3, on_failure="ignore")
    sim.run(0.5)
    np.testing.assert_allclose(sim.state.positions[:, 2], [0.1, 0.3, 0.5], atol=2e-3)
    with pytest.raises(amontons.InputError, match="friction is inf; it must be finite"):
        amontons.Material(friction=float("inf"))
