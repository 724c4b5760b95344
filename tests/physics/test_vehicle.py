"""The tracked vehicle."""

import numpy as np
from measures import drive, simulate


def test_vehicle_drives_over_slabs():
    # At 2.5 m/s for 3 s: it must get over the first slabs, keep all shoes, and keep its pins closed to a
    # fraction of the shoe. (20 m and the real-time factor: benchmarks.)
    sim = simulate("tracked_vehicle")
    result = drive(sim, 3.0)
    assert result.distance > 4.0
    assert result.lost_shoes == 0
    assert result.joint_error < 2e-3
    assert result.worst_residual < 1e-2
    hull = sim.model.body_index("hull")
    assert abs(sim.state.positions[hull, 1]) < 0.5
    assert sim.state.orientations[hull][0] > np.cos(0.15)


def test_vehicle_turns_towards_the_slow_track():
    # turn > 0: the left track is slower, the vehicle turns left, about +z.
    sim = simulate("tracked_vehicle", {"turn": 0.9, "mu": 0.4, "slabs": 0})
    drive(sim, 2.0)
    w, _, _, z = sim.state.orientations[sim.model.body_index("hull")]
    assert 2 * np.arctan2(z, w) > 0.2
