"""The same in other units and after a restart; test_bits.py compares runs, threads and instruction sets."""

import amontons
import amontons.scenes
import numpy as np
import pytest
from measures import run, simulate
from units import ratio_of_motion


@pytest.mark.parametrize(("length", "mass"), [(1024, 1), (1, 1024), (1024, 1024), (1 / 1024, 1 / 64)])
def test_units_by_powers_of_two_change_no_bit(length, mass):
    # Scaling by powers of two commutes with rounding: any difference at all is a constant that carries a
    # dimension, in collision, assembly, stabilisation or a solver's default.
    assert ratio_of_motion(float(length), float(mass)) == 0


@pytest.mark.parametrize(("unit", "factor"), [("mm-g", 1e3), ("km-t", 1e-3)])
def test_units_do_not_matter(unit, factor):
    # mm-g and km-t as m-kg, to rounding: where the solver stops, tolerance 1e-12, half a second of sliding
    # and rolling accumulates 100 steps of at most 1e-12 of the velocities.
    assert ratio_of_motion(factor, factor, tolerance=1e-12) < 1e-9


SCENES = {
    "wall": {"columns": 6, "rows": 6, "speed": 4.0},
    "hopper": {"count": 60},
    "chain": {"links": 20},
    "card_house": {"levels": 2},
    "tracked_vehicle": {"slabs": 3},
}
"""Contacts, joints and both, small enough to run a few hundred steps."""


def bits(sim):
    state = sim.state
    parts = (state.positions, state.orientations, state.linear_velocities, state.angular_velocities)
    return b"".join(np.ascontiguousarray(p).tobytes() for p in parts)


@pytest.mark.parametrize("name", SCENES)
def test_restart_is_bit_identical(name, tmp_path):
    # What warm start needs is part of the state: a missing piece changes the last bits of the next step.
    sim = simulate(name, SCENES[name])
    run(sim, 20 * sim.dt)
    sim.save(tmp_path / "state.h5")
    run(sim, 20 * sim.dt)
    again = amontons.Simulation.load(tmp_path / "state.h5")
    run(again, 20 * sim.dt)
    assert again.time == sim.time
    assert bits(again) == bits(sim)
