"""A robot that rests beside a ball sleeps, with the bits of a simulation in which nothing sleeps."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import amontons
import numpy as np
import pytest
from amontons import Motor
from amontons.shapes import Box, Sphere


def arm_beside_a_ball(trees: Literal["auto", "none"]) -> amontons.Model:
    """A box that holds a bar with a motor, and a ball that rolls far from it."""
    builder = amontons.ModelBuilder(trees=trees)
    builder.add_floor()
    box = builder.add_body(shape=Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.1))
    bar = builder.add_body(shape=Box((0.05, 0.02, 0.02)), mass=0.2, position=(0.2, 0, 0.1))
    hinge = builder.add_revolute_joint(bar, box, point=(0.1, 0, 0.1), axis=(0, 1, 0))
    builder.set_motor(hinge, Motor("position", kp=200.0, kd=2.0, max_effort=5.0))
    builder.add_body(shape=Sphere(0.1), mass=1.0, position=(-9, 5, 0.1), linear_velocity=(1, 0, 0))
    return builder.build()


def arrays(simulation: amontons.Simulation) -> dict[str, np.ndarray]:
    state = simulation.state
    names = ("positions", "orientations", "linear_velocities", "angular_velocities")
    return {"q": np.array(simulation.q)} | {name: np.array(getattr(state, name)) for name in names}


# Breaks when a robot that rests does not answer a control in the same step, or when a step has other bits
# than that of a simulation that begins with the same state.
@pytest.mark.parametrize("trees", ["auto", "none"])
def test_a_robot_at_rest_wakes_for_a_control(trees: Literal["auto", "none"], tmp_path: Path) -> None:
    simulation = amontons.Simulation(arm_beside_a_ball(trees), dt=5e-3)
    for _ in range(280):
        simulation.step()
    for step in range(40):
        if step == 20:
            simulation.state.controls[0] = -0.1
        simulation.save(tmp_path / "state.h5")
        other = amontons.Simulation.load(tmp_path / "state.h5")
        before = simulation.state.positions[1][2]
        simulation.step()
        other.step()
        for name, value in arrays(simulation).items():
            assert np.array_equal(value, arrays(other)[name]), (step, name)
        moved = abs(simulation.state.positions[1][2] - before)
        assert moved == 0 if step < 20 else moved > 0, step
    assert before > 0.105
