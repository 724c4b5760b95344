"""How long a step may take, whatever is in it."""

import amontons
import numpy as np
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
        assert report.products * (blocks + 16) < 1e6 + 4e4 * blocks
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
