"""Strings, springs and drives on tendons against closed forms."""

import math
import os
from pathlib import Path

import amontons
import numpy as np
import pytest
from amontons import ModelBuilder, Simulation, Transform, shapes
from amontons.parts import PathElement, TendonTerm

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = Path(os.environ.get("AMONTONS_DATA", ROOT.parent / "shared" / "data")) / "robots"
G = 9.81


def weights(builder, masses, height=0.5):
    """Weights on vertical slides, side by side, 0.4 m apart."""
    for i, mass in enumerate(masses):
        at = (0.4 * i, 0, height)
        builder.add_body(f"w{i}", shape=shapes.Sphere(0.05), mass=mass, position=at)
        builder.add_prismatic_joint(f"w{i}", axis=(0, 0, 1), name=f"s{i}")


def hook(body):
    return (body, (0.0, 0.0, 0.0))


# Breaks when a string that is taut is not one, or forces along it differ at its ends: Atwood's machine, over
# a drum, with the acceleration (a - b) g / (a + b) and the tension 2 a b g / (a + b). The drum is the
# obstacle between both ends, wider than their distance so that the string hangs straight down.
def test_string_over_a_drum():
    a, b = 2.0, 1.0
    builder = ModelBuilder()
    weights(builder, (a, b))
    turned = (math.sqrt(0.5), math.sqrt(0.5), 0, 0)  # the axis of the drum is y
    drum = PathElement("cylinder", None, Transform((0.2, 0, 1.5), turned), 0.2, side=(0.2, 0, 2))
    length = 2 * 1.0 + math.pi * 0.2
    builder.add_tendon("string", path=[hook("w0"), drum, hook("w1")], limits=(None, length))
    sim = Simulation(builder.build(), dt=1e-3, tolerance=1e-9)
    (row,) = sim.forces.tendon_efforts
    assert row["length"] == pytest.approx(length, abs=1e-12)
    sim.run(0.2)
    expected = (a - b) * G / (a + b)
    # At 1 ms velocities are those of the force, positions differ from parabolas by half a step.
    assert sim.qd == pytest.approx([-expected * 0.2, expected * 0.2], rel=1e-6)
    (row,) = sim.forces.tendon_efforts
    assert row["limit"] == pytest.approx(-2 * a * b * G / (a + b), rel=1e-6)
    assert row["length"] == pytest.approx(length, abs=1e-9)


# Breaks when the divisor of a pulley counts wrongly: a weight on a loop of string holds half of it.
def test_block_and_tackle():
    builder = ModelBuilder()
    weights(builder, (2.0, 1.0))
    path = [
        (None, (0, 0, 2)), hook("w0"), PathElement("pulley", divisor=0.5), (None, (0.4, 0, 2)), hook("w1")
    ]  # fmt: skip
    # l = d0 + 2 d1 stays: while w1 goes down by x, w0 goes up by 2 x. Balanced where 2 g = 2 (1 g).
    builder.add_tendon("loop", path=path, limits=(None, 1.5 + 2 * 1.5))
    sim = Simulation(builder.build(), dt=2e-3, tolerance=1e-9)
    sim.run(0.3)
    t = -sim.forces.tendon_efforts["limit"][0]
    # w0: 2 a0 = t - 2 g, w1: a1 = 2 t - g with a0 = -2 a1: t = 10 g / 9 ... of which the rates follow.
    a1 = (2 * t - 1.0 * G) / 1.0
    assert sim.qd == pytest.approx([0.3 * (t - 2 * G) / 2, 0.3 * a1], rel=1e-5)
    assert sim.qd[0] + 2 * sim.qd[1] == pytest.approx(0, abs=1e-8)


# Breaks when dry friction of a tendon gives way below its size or holds above it: the weight slips with
# what is left.
@pytest.mark.parametrize("friction", [12.0, 6.0])
def test_friction(friction):
    builder = ModelBuilder()
    weights(builder, (1.0,))
    builder.add_tendon(path=[(None, (0, 0, 2)), hook("w0")], friction=friction)
    sim = Simulation(builder.build(), dt=2e-3, tolerance=1e-10)
    sim.run(0.2)
    assert sim.qd[0] == pytest.approx(min(0.0, (friction - G) * 0.2), abs=1e-8)
    assert sim.forces.tendon_efforts["friction"][0] == pytest.approx(-min(friction, G), rel=1e-6)


# Breaks when a spring acts between its rest lengths, or its energy is not that of its stretch.
def test_spring_with_a_slack_range():
    builder = ModelBuilder(gravity=(0, 0, 0))
    weights(builder, (1.0,))
    builder.add_tendon(path=[(None, (0, 0, 2)), hook("w0")], stiffness=50, rest=(1.0, 2.0))
    sim = Simulation(builder.build(), dt=1e-4)
    sim.qd = [-1.0]
    report = sim.run(0.4)
    assert sim.qd[0] == pytest.approx(-1.0, abs=1e-14)  # slack up to a length of 2
    assert report.spring_energy == 0
    sim.run(0.1 + 0.5 * math.pi / math.sqrt(50))  # then a quarter of an oscillation
    assert abs(sim.qd[0]) < 0.02
    # Of first order: energy is lost by about h omega pi / 4 of it.
    assert sim.step().spring_energy == pytest.approx(0.5, rel=2e-3)


# Breaks when what acts along a tendon or between bodies is no pair of opposite forces on one line: momentum
# of free bodies stays, whatever drives, springs and obstacles do, but for 1e-5 of the impulses of rows over
# many bodies.
def test_momentum():
    builder = ModelBuilder(gravity=(0, 0, 0))
    random = np.random.default_rng(2)
    for i, place in enumerate([(0, 0, 0), (0.5, 0.02, 0.1), (1, 0, 0.05), (1.4, 0.3, 0)]):
        builder.add_body(
            f"b{i}", shape=shapes.Box((0.1, 0.05, 0.08)), density=500, position=place,
            angular_velocity=random.normal(size=3), linear_velocity=0.1 * random.normal(size=3),
        )  # fmt: skip
    sphere = PathElement("sphere", "b1", Transform((0, 0.05, 0)), 0.12)
    path = [("b0", (0.05, 0, 0.02)), sphere, ("b2", (0, 0.03, 0)), ("b3", (0.02, 0.01, 0))]
    builder.add_tendon("t", path=path, stiffness=20, rest=0.8, damping=1, friction=0.2, armature=0.3)
    builder.add_actuator("pull", tendon="t", law="position", kp=10, kd=1, control=1.0)
    builder.add_actuator(
        "push",
        transmission=amontons.parts.Transmission(
            "wrench", body="b0", reference_body="b3", force=(1, 2, 0), torque=(0.1, 0, 0.2)
        ),
        control=0.5,
    )
    builder.add_actuator(
        "crank",
        transmission=amontons.parts.Transmission("slider_crank", body="b1", reference_body="b3", rod=1.2),
        control=0.3,
    )  # fmt: skip
    sim = Simulation(builder.build(), dt=2e-3, tolerance=1e-10)
    before = np.concatenate(sim.forces.momentum())
    report = sim.run(0.3)
    assert report.kinetic_energy > 0.1
    np.testing.assert_allclose(np.concatenate(sim.forces.momentum()), before, atol=5e-5)


# Breaks when an equality of tendons is not kept, or costs the freedom that it leaves: a differential, whose
# two shafts turn by the mean of the drive.
def test_differential():
    builder = ModelBuilder(gravity=(0, 0, 0))
    for i in range(3):
        builder.add_body(f"b{i}", shape=shapes.Cylinder(0.1, 0.05), density=1000, position=(0, 0, i))
        builder.add_revolute_joint(f"b{i}", point=(0, 0, i), axis=(0, 0, 1), name=f"j{i}")
    builder.add_tendon("mean", joints={"j0": 0.5, "j1": 0.5})
    builder.add_tendon("drive", joints=[TendonTerm("j2")])
    builder.add_coupling(tendon_a="mean", tendon_b="drive")
    builder.add_actuator("motor", joint="j2")
    sim = Simulation(builder.build(), dt=1e-3, tolerance=1e-10)
    sim.set_q({"j0": 0.3, "j1": -0.1})
    assert sim.q == pytest.approx([0.3, -0.1, 0.1])  # the loop closes
    sim.qd = [1.0, -1.0, 0.0]
    sim.controls = [0.01]
    sim.run(0.5)
    # Of equal inertias I: the mean m and the drive turn together, I m' 2 + I m' = 0.01.
    inertia = 0.5 * sim.model.bodies[0].mass * 0.1**2
    rate = 0.5 * 0.01 / (3 * inertia)
    assert sim.qd == pytest.approx([rate + 1, rate - 1, rate], rel=1e-4)
    assert 0.5 * (sim.q[0] + sim.q[1]) == pytest.approx(sim.q[2], abs=1e-8)


# Breaks when the activation is not that of a first-order lag or of an integral, or the effort another one.
def test_activations():
    builder = ModelBuilder(gravity=(0, 0, 0))
    weights(builder, (1.0, 1.0))
    builder.add_actuator("lag", joint="s0", dynamics="filter", time_constant=0.1, gain=(3, 0, 0))
    builder.add_actuator("sum", joint="s1", dynamics="integrator", activation_limits=(-1, 0.15))
    sim = Simulation(builder.build(), dt=1e-3)
    sim.controls = [2.0, 0.5]
    sim.run(0.2)
    lag = 2 * (1 - math.exp(-2.0))
    assert sim.state.activations == pytest.approx([lag, 0.1], rel=1e-12)
    # Efforts are those of the start of a step: the sum of a geometric series.
    assert sim.qd[0] == pytest.approx(6 * (0.2 - 0.1 * (1 - math.exp(-2.0))), rel=6e-3)
    sim.run(0.2)
    assert sim.state.activations[1] == 0.15


# Breaks when a servo is not bounded by its limits of force on either side, or pushes where it should hold.
def test_servo_at_its_limits():
    builder = ModelBuilder()
    weights(builder, (1.0,))
    builder.add_actuator("lift", joint="s0", law="position", kp=1e6, kd=1e3, force_limits=(-2.0, 15.0))
    sim = Simulation(builder.build(), dt=1e-3, tolerance=1e-10)
    sim.controls = [1.0]
    sim.run(0.1)
    assert sim.qd[0] == pytest.approx(0.1 * (15 - G), rel=1e-9)
    sim.controls = [-1.0]
    sim.step()
    assert sim.forces.actuator_efforts["effort"][0] == pytest.approx(-2)
    sim.set_q([0.0])
    sim.qd = [0.0]
    sim.controls = [0.0]
    sim.run(0.1)
    assert sim.forces.actuator_efforts["effort"][0] == pytest.approx(G, rel=1e-6)


# Breaks when a tendon's limit is as coarse as its unit: l = c q has the same limit as q at c times it,
# however small c. Its row comes in as the arm comes near and not before, and a start beyond it is taken back
# as far.
@pytest.mark.parametrize("coefficient", [1e-3, 1.0, 1e3])
def test_a_limit_in_any_unit(coefficient):
    def arm(start):
        builder = ModelBuilder()
        builder.add_body("arm", shape=shapes.Box((0.5, 0.05, 0.05)), mass=1.0, position=(0.5, 0, 0))
        builder.add_revolute_joint("arm", axis=(0, 1, 0), point=(0, 0, 0), name="hinge")
        builder.add_tendon(joints={"hinge": coefficient}, limits=(None, 0.5 * coefficient))
        sim = Simulation(builder.build())
        sim.q = [start]
        return sim, sim.step()

    assert arm(0.0)[1].joint_rows == 5
    assert arm(0.49)[1].joint_rows == 6
    sim, _ = arm(0.6)
    sim.run(0.5)
    assert -1e-6 <= sim.q[0] - 0.5 <= 1.1e-4  # errors of position: 1e-4 of the length


def robot(name):
    path = ROBOTS / name
    if not path.exists():
        pytest.skip(f"no {path}")
    pytest.importorskip("mujoco")
    return Simulation(amontons.load_model(path), dt=2e-3, on_failure="raise")


# Breaks when the string of the toy stretches: a ball that is thrown up and away stays within its length.
@pytest.mark.filterwarnings("ignore")
def test_ball_in_cup():
    sim = robot("dm_suite/ball_in_cup.xml")
    sim.set_qd({"ball_x": 2.0, "ball_z": 3.0})
    longest = []
    sim.run(1.0, after_step=lambda s, _: longest.append(s.forces.tendon_efforts["length"][0]) and None)
    assert max(longest) == pytest.approx(sim.model.tendons[0].upper, abs=1e-3)
    assert sim.forces.tendon_efforts["limit"][0] <= 0


# Breaks when a fixed tendon does not drive both wheels: the car goes straight ahead by one motor, and turns
# by the other.
@pytest.mark.filterwarnings("ignore")
def test_car():
    sim = robot("mujoco/car/car.xml")
    sim.set_control("forward", 0.5)
    sim.run(1.5)
    x, y, _ = sim.state.positions[0]
    assert math.hypot(x, y) > 0.3
    start = sim.state.orientations[0].copy()
    assert abs(start[3]) < 1e-3  # straight ahead
    sim.set_control("turn", 0.3)
    sim.run(0.5)
    assert abs(sim.state.orientations[0][3]) > 0.05
