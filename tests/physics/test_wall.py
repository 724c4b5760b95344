"""B4: the wall at rest, and hit by the ball."""

import numpy as np
import pytest
from measures import impact, run, simulate, weights


def test_small_wall_at_rest():
    # No brick moves by more than 0.1 mm in 5 s, and the ground carries all of the weight.
    sim = simulate("wall_at_rest", {"columns": 8, "rows": 8})
    start = np.array(sim.state.positions)
    run(sim, 5.0)
    assert np.abs(sim.state.positions - start).max() < 1e-4
    ground = sim.contacts["force"][sim.contacts["body_b"] == -1].sum(axis=0)
    np.testing.assert_allclose(ground, [0, 0, weights(sim).sum()], atol=1e-5 * weights(sim).sum())


def test_full_wall_at_rest():
    # 750 bricks, 8684 contacts: stands still. (5 s: benchmarks.)
    sim = simulate("wall_at_rest")
    start = np.array(sim.state.positions)
    reports = run(sim, 0.1)
    assert np.abs(sim.state.positions - start).max() < 1e-4
    assert max(r.residual for r in reports) < 1e-2


# Steps whose solve stalls above the tolerance warn; their residuals are what is tested.
@pytest.mark.filterwarnings("ignore::amontons.StepWarning")
def test_small_wall_under_impact():
    # Momentum of all that moves changes by gravity, the ground and the chain's anchor only, to the solver's
    # tolerance; energy never grows; nothing sinks in by more than 1 mm at h = 5 ms; every residual below
    # 1e-2. Found by any impulse applied to one side only, or by a stabilisation that pumps energy. (Full
    # size: benchmarks.)
    result = impact(simulate("wall", {"columns": 8, "rows": 8, "speed": 4.0}), 0.8)
    assert result.bricks_moved > 5
    assert result.momentum_error < 1e-9
    assert result.energy_growth < 1e-6
    assert result.penetration < 1e-3
    assert result.worst_residual < 1e-2
    assert result.joint_error < 1e-3


@pytest.mark.filterwarnings("ignore::amontons.StepWarning")
def test_full_wall_is_hit():
    # The ball strikes the 750 bricks within 0.6 s and breaks through.
    sim = simulate("wall")
    ball = sim.model.body_index("ball")
    wall = np.array([i != ball and n.startswith("brick") for i, n in enumerate(sim.model.body_names)])
    hit = None
    while sim.time < 0.6 and hit is None:
        sim.step()
        between = sim.contacts[np.isin(sim.contacts["body_a"], ball) | np.isin(sim.contacts["body_b"], ball)]
        if (between["state"] != "open").any():
            hit = sim.time
    assert hit is not None
    report = sim.step()
    assert report.residual < 1e-2
    assert np.abs(sim.state.linear_velocities[wall]).max() > 0.5
