"""Clearance in joints and between gears beside closed forms."""

import math
import os
from pathlib import Path

import numpy as np
import pytest
from amontons import InputError, ModelBuilder, Motor, Simulation

ROOT = Path(__file__).resolve().parents[2]
MEASURED = Path(os.environ.get("AMONTONS_DATA", ROOT.parent / "shared" / "data")) / "measured"
G = 10.0
Z = (0, 0, 1)


def journal(mass=2.0, clearance=0.05, radius=0.1, friction=1.0, dt=1e-4, **options):
    builder = ModelBuilder(gravity=(0, -G, 0))
    inertia = 0.5 * mass * radius**2
    body = builder.add_body("shaft", mass=mass, inertia=(inertia,) * 3)
    builder.add_revolute_joint(
        body,
        point=(0, 0, 0),
        axis=Z,
        clearance=clearance,
        journal_radius=radius,
        clearance_friction=friction,
        **options,
    )
    return Simulation(builder.build(), dt=dt, tolerance=1e-12)


# A journal that rolls in its bearing is a pendulum of the length clearance (1 + I / (m R^2)). Breaks if the
# lever of the friction, the normal or the sign of the turn is wrong: a sliding journal has the length
# `clearance`.
def test_a_journal_rolls_in_its_bearing():
    sim = journal()
    start = 0.05
    sim.q = [0.05 * math.sin(start), -0.05 * math.cos(start), 0]
    length = 0.05 * 1.5
    quarter = 0.5 * math.pi * math.sqrt(length / G) * (1 + start**2 / 16)
    while sim.q[0] > 0:
        sim.step()
    assert sim.time == pytest.approx(quarter, rel=3e-3)
    # It rolls: clearance times the angle of its centre is -R times its turn.
    assert -0.1 * sim.q[2] == pytest.approx(-0.05 * start, rel=1e-2)
    assert math.hypot(sim.q[0], sim.q[1]) == pytest.approx(0.05, rel=1e-4)


# The friction circle: a shaft that turns under a load W climbs until the reaction is at the angle of
# friction, with the torque W R mu / sqrt(1 + mu^2).
def test_friction_circle_of_a_turning_journal():
    mu = 0.3
    sim = journal(friction=mu, dt=1e-3, clearance=1e-3, motor=Motor("velocity", control=5.0))
    share = mu / math.hypot(1, mu)
    # Nothing damps its swing about that place. So it starts there, and would leave another one.
    sim.q = [-1e-3 * share, -1e-3 * math.sqrt(1 - share**2), 0]
    sim.qd = [0, 0, 5]
    sim.run(0.5)
    assert sim.forces.joint_efforts["motor"][2] == pytest.approx(2.0 * G * 0.1 * share, rel=1e-6)
    x, y, _ = sim.q
    assert math.hypot(x, y) == pytest.approx(1e-3, rel=1e-3)
    assert abs(x) / math.hypot(x, y) == pytest.approx(share, rel=1e-3)


# Breaks if clearance without contact puts a force on the shaft.
def test_a_journal_falls_freely_through_its_clearance():
    sim = journal(dt=1e-3)
    sim.run(0.05)
    assert sim.state.linear_velocities[0] == pytest.approx([0, -G * 0.05, 0], rel=1e-9)


# A slider falls through its clearance. Friction in the guide takes mu g t from its speed, impacts included.
def test_a_slider_in_its_guide():
    builder = ModelBuilder(gravity=(0, -G, 0))
    body = builder.add_body("slider", mass=1, inertia=(1e-3,) * 3)
    builder.add_prismatic_joint(
        body, axis=(1, 0, 0), clearance=1e-3, guide_length=0.1, guide_normal=Z, clearance_friction=0.2
    )
    sim = Simulation(builder.build(), dt=1e-3, tolerance=1e-12)
    sim.qd = [1.0, 0, 0]
    sim.run(0.2)
    assert sim.qd[0] == pytest.approx(1 - 0.2 * G * 0.2, rel=1e-6)
    assert sim.q[1] == pytest.approx(-1e-3, rel=1e-6)


def wheels(backlash, ratio=1.0):
    builder = ModelBuilder(gravity=(0, 0, 0))
    for k, inertia in enumerate((0.3, 0.1)):
        builder.add_body(f"w{k}", mass=1, inertia=(inertia,) * 3, position=(k, 0, 0))
        builder.add_revolute_joint(f"w{k}", point=(k, 0, 0), axis=Z, name=f"j{k}")
    builder.add_coupling("j0", "j1", coefficients=(0, ratio), backlash=backlash)
    return Simulation(builder.build(), dt=1e-3, tolerance=1e-13)


# Gear rattle keeps momentum: shafts of one sense exchange it through their flanks and through nothing else.
# Breaks if a flank pulls, or if the free travel is not the backlash.
def test_gear_rattle_keeps_momentum():
    sim = wheels(0.02)
    sim.qd = [1.0, 0.0]
    widest = 0.0
    for _ in range(100):
        sim.step()
        widest = max(widest, abs(sim.q[0] - sim.q[1]))
        if sim.time < 0.0095:
            assert sim.qd == pytest.approx([1, 0], abs=1e-13)
    assert widest == pytest.approx(0.01, rel=1e-9)
    assert sim.qd == pytest.approx([0.75, 0.75], rel=1e-9)
    sim.qd = [0.75, 1.0]  # the other flank
    sim.run(0.2)
    assert sim.q[0] - sim.q[1] == pytest.approx(-0.01, rel=1e-6)
    assert 0.3 * sim.qd[0] + 0.1 * sim.qd[1] == pytest.approx(0.3 * 0.75 + 0.1, rel=1e-9)


def damper(friction, backlash, dt):
    """A rod that a motor moves, and a band with dry friction that it takes along with clearance."""
    builder = ModelBuilder(gravity=(0, 0, 0))
    for name in ("rod", "band"):
        builder.add_body(name, mass=1, inertia=(1, 1, 1))
    builder.add_prismatic_joint("rod", axis=(1, 0, 0), name="rod", motor=Motor("position"))
    builder.add_prismatic_joint("band", axis=(1, 0, 0), name="band", friction=friction)
    builder.add_coupling("rod", "band", backlash=backlash)
    return Simulation(builder.build(), dt=dt, tolerance=1e-10)


# The loop of a friction damper with backlash b, driven with the amplitude X, encloses 2 F (2 X - b).
def test_hysteresis_of_a_friction_damper():
    friction, backlash, amplitude, dt = 500.0, 4e-3, 0.01, 1e-3
    sim = damper(friction, backlash, dt)
    work = 0.0
    for k in range(2000):
        before = sim.q[0]
        sim.set_control("rod", amplitude * math.sin(2 * math.pi * (k + 1) * dt))
        sim.step()
        if k >= 1000:
            work += sim.forces.effort("rod").motor * (sim.q[0] - before)
    assert work == pytest.approx(2 * friction * (2 * amplitude - backlash), rel=1e-2)


# The measured damper: backlash brings the loop of dry friction nearer to the measured one.
def test_hysteresis_of_the_measured_damper():
    folder = MEASURED / "friction_damper"
    files = sorted(folder.glob("*.json"))
    if not files:
        pytest.skip(f"no measurements in {folder}")
    import json

    rows = np.array(json.loads(files[0].read_text())["data"])
    time, place, force = rows[:, 0], 0.0254 * rows[:, 1], 4448.2216 * rows[:, 2]
    speed = np.abs(np.gradient(place, time))
    friction = float(np.median(np.abs(force[speed > 0.8 * np.percentile(speed, 99)])))
    count = min(len(time), 2500)

    def error(backlash):
        sim = damper(friction, backlash, float(time[1] - time[0]))
        found = []
        for target in place[1:count] - place[0]:
            sim.set_control("rod", float(target))
            sim.step()
            found.append(sim.forces.effort("rod").motor)
        return np.sqrt(np.mean((np.array(found) - force[1:count]) ** 2))

    assert min(error(b) for b in (4e-3, 8e-3, 12e-3)) < 0.9 * error(1e-9)


def made(builder, make):
    make(builder)
    return builder.build().core


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda b: b.add_prismatic_joint("a", axis=(1, 0, 0), clearance=1e-3),
            "clearance needs guide_length > 0 and guide_normal",
        ),
        (
            lambda b: b.add_prismatic_joint(
                "a", axis=(1, 0, 0), clearance=1e-3, guide_length=1, guide_normal=(1, 0, 0)
            ),
            "guide_normal is not normal to the axis",
        ),
        (
            lambda b: b.add_revolute_joint("a", point=(0, 0, 0), axis=Z, clearance=-1),
            "clearance must be finite and not negative",
        ),
    ],
)  # fmt: skip
def test_wrong_clearance(make, message):
    builder = ModelBuilder()
    builder.add_body("a", mass=1, inertia=(1, 1, 1))
    with pytest.raises(InputError, match=message):
        made(builder, make)
