"""Feet with restitution on damped motors: a bounce that motors press back in the step is no energy."""

import amontons
import pytest
from amontons import Material, ModelBuilder, Motor, shapes

GRIP = Material(friction=1.0)
BOUNCY = Material(friction=1.0, restitution=0.5)


def add_leg(b, base, x, y, hip, foot=BOUNCY):
    """Two capsules of 155 mm below a hip, on damped position motors."""
    upper = b.add_body(position=(x, y, hip - 0.0775), shape=shapes.Capsule(0.01, 0.06), mass=0.15)
    lower = b.add_body(
        position=(x, y, hip - 0.2325), shape=shapes.Capsule(0.01, 0.06), mass=0.05, material=foot
    )
    for body, parent, z, target in ((upper, base, hip, 0.3), (lower, upper, hip - 0.155, -0.6)):
        motor = Motor("position", target, kp=20.0, kd=0.5)
        b.add_revolute_joint(body, parent, point=(x, y, z), axis=(0, 1, 0), motor=motor)


def robot(legs, height, foot=BOUNCY):
    """A base of 1.5 kg with its centre at `height`: on one leg and a vertical rail, or free on four legs."""
    b = ModelBuilder()
    b.add_floor(material=GRIP)
    base = b.add_body(position=(0, 0, height), shape=shapes.Box((0.2, 0.1, 0.03)), mass=1.5)
    if legs == 1:
        b.add_prismatic_joint(base, None, point=(0, 0, height), axis=(0, 0, 1))
        add_leg(b, base, 0, 0, height, foot)
        return b.build()
    for x in (-0.15, 0.15):
        for y in (-0.12, 0.12):
            add_leg(b, base, x, y, height, foot)
    return b.build()


def drop(model, dt, duration=1.0):
    """The reports of a drop, and how far the base rose above its start (m)."""
    sim = amontons.Simulation(model, dt=dt)
    start, rise, reports = sim.state.positions[0, 2], 0.0, []
    for _ in range(round(duration / dt)):
        reports.append(sim.step())
        rise = max(rise, sim.state.positions[0, 2] - start)
    return reports, rise


def test_a_leg_that_bounces_misses_no_step():
    # The work of a contact along the mean of the velocities before and after is x u- / 2 > 0 where u- points
    # upwards after a bounce and the motors press the foot back (u+ = 0). A balance of that work alone raises
    # an alarm in 21 of these 500 steps, with every method. A base that rises above its start has gained
    # energy: the motors start within 6 mJ of their targets' pose, m g z = 15 J per metre.
    reports, rise = drop(robot(1, 0.4), 2e-3)
    assert all(r.converged and r.balanced for r in reports)
    assert rise < 1e-3


@pytest.mark.parametrize("dt", [1e-3, 2e-3, 5e-3])
@pytest.mark.parametrize("height", [0.36, 0.4, 0.45, 0.5, 0.6, 0.7])
def test_four_legs_that_bounce_miss_no_step(dt, height):
    # Of these 18 drops 15 had missed steps for the same reason.
    reports, rise = drop(robot(4, height), dt)
    assert all(r.converged and r.balanced for r in reports)
    assert rise < 1e-3
