"""Poses and velocities of one instant: what a step leaves is of second order, from the first step on."""

import math

import numpy as np
import pytest
from amontons import ModelBuilder, Motor, Simulation, shapes
from instants import FIRST_ORDER, MOTIONS, G, errors, pendulum, spring, swinging_arm
from measures import run

FORMS = ["none", "auto"]
UNSOLVED = [("four-bar", "auto")]


@pytest.mark.parametrize("trees", FORMS)
@pytest.mark.parametrize("h", [1e-2, 3e-3])
def test_free_fall_is_exact(trees, h):
    # Breaks when the first step takes the given velocity for one half a step before it: g h t / 2 too far.
    b = ModelBuilder(trees=trees)
    b.add_body("ball", shape=shapes.Sphere(0.1), mass=2, position=(0, 0, 50), linear_velocity=(1, 0, 3))
    sim = Simulation(b.build(), dt=h)
    for k in range(1, 101):
        sim.step()
        t = k * h
        assert sim.state.positions[0] == pytest.approx([t, 0, 50 + 3 * t - G * t * t / 2], abs=1e-12)
        assert sim.state.linear_velocities[0] == pytest.approx([1, 0, 3 - G * t], abs=1e-12)


@pytest.mark.parametrize("trees", FORMS)
def test_a_pendulum_keeps_its_time(trees):
    # Against the pendulum at a step of 0.1 ms. Of first order it is 1.7e-2 rad off.
    exact, sim = (pendulum(h, trees, angle=math.pi / 2) for h in (2e-4, 1e-2))
    run(exact, 2.0)
    run(sim, 2.0)
    assert abs(sim.q[0] - exact.q[0]) < 5e-4
    # Half a step ahead of the rates in the middle: of coordinates here, of velocities in the world there.
    assert abs(sim.qd[0] - exact.qd[0]) < (3e-3 if trees == "none" else 6e-3)


@pytest.mark.parametrize("trees", FORMS)
@pytest.mark.parametrize("name", MOTIONS)
def test_motion_is_of_second_order(name, trees):
    # Errors fall by four when the step is halved; a mean of three over four steps is far from first order.
    # Rows of joints leave errors of position below 1e-4 of the length alone, which are of no order.
    if (name, trees) in UNSOLVED:
        pytest.skip("loops of trees are not solved to the tolerance in this scene")
    if name in FIRST_ORDER:
        pytest.skip("of first order, as docs/physics.md says")
    found = errors(name, trees)
    for error in found.T:
        assert error[-1] < max(error[0] / 3 ** (len(error) - 1), 1e-5), found


@pytest.mark.parametrize("trees", FORMS)
def test_what_is_set_is_what_is_read(trees):
    sim = pendulum(1e-2, trees, links=2)
    run(sim, 0.1)
    sim.state.angular_velocities[:] = [[0, 0.5, 0], [0, -0.25, 0]]
    sim.state.linear_velocities[:] = np.arange(6).reshape(2, 3)
    kept = np.array(sim.state.linear_velocities), np.array(sim.state.angular_velocities)
    assert (sim.state.linear_velocities == kept[0]).all()
    assert (sim.state.angular_velocities == kept[1]).all()
    assert (sim.copy().state.angular_velocities == kept[1]).all()


def test_velocities_that_are_set_hold_at_once():
    # Breaks when a step goes on with the velocity in the middle of the last one.
    b = ModelBuilder()
    b.add_body(shape=shapes.Sphere(0.1), mass=1, position=(0, 0, 10))
    sim = Simulation(b.build(), dt=1e-2)
    run(sim, 0.1)
    z = sim.state.positions[0, 2]
    sim.state.linear_velocities[0] = (0, 0, 2)
    run(sim, 0.1)
    assert sim.state.positions[0, 2] - z == pytest.approx(0.2 - G * 0.01 / 2, abs=1e-12)


@pytest.mark.parametrize("trees", FORMS)
def test_a_torque_that_jumps_keeps_the_order(trees):
    # A disc on an axis, and a torque that is switched on and off between steps: exact, as it is held.
    b = ModelBuilder(gravity=(0, 0, 0), trees=trees)
    disc = b.add_body(shape=shapes.Cylinder(0.1, 0.02), mass=2)
    b.add_revolute_joint(disc, None, point=(0, 0, 0), axis=(0, 0, 1), motor=Motor("effort"))
    sim = Simulation(b.build(), dt=1e-2)
    inertia = 0.5 * 2 * 0.1**2
    angle = rate = 0.0
    for k in range(60):
        torque = [0.0, 0.3, -0.2][k // 20]
        sim.controls = [torque]
        sim.step()
        angle += sim.dt * rate + sim.dt**2 / 2 * torque / inertia
        rate += sim.dt * torque / inertia
        assert sim.q[0] == pytest.approx(angle, abs=1e-12)
        if k % 20:  # in the step of a jump the rate ends with the mean of both torques
            assert sim.qd[0] == pytest.approx(rate, abs=1e-11)


@pytest.mark.parametrize("trees", FORMS)
def test_a_resting_body_does_not_move(trees):
    b = ModelBuilder(trees=trees)
    b.add_geom(None, shapes.Plane())
    b.add_body(shape=shapes.Box((0.1, 0.1, 0.1)), mass=1, position=(0, 0, 0.1))
    sim = Simulation(b.build(), dt=1e-2)
    start = np.array(sim.state.positions)
    run(sim, 1.0)
    assert np.abs(sim.state.positions - start).max() < 1e-12
    assert np.abs(sim.state.linear_velocities).max() < 1e-12


def test_a_body_that_comes_to_rest_does_not_turn_back():
    # Breaks when the deceleration of the last step of sliding goes on for half a step beyond the stop.
    b = ModelBuilder()
    b.add_geom(None, shapes.Plane())
    b.add_body(shape=shapes.Box((0.1, 0.1, 0.1)), mass=1, position=(0, 0, 0.1), linear_velocity=(1, 0, 0))
    sim = Simulation(b.build(), dt=1e-2)
    speeds = []
    run(sim, 0.5, lambda s, r: speeds.append(s.state.linear_velocities[0, 0]))
    assert min(speeds) > -1e-6
    assert abs(speeds[-1]) < 1e-9


@pytest.mark.parametrize("h", [2e-3, 5e-3])
def test_a_bouncing_ball_leaves_with_no_more_than_it_had(h):
    b = ModelBuilder()
    b.add_geom(None, shapes.Plane())
    b.add_body(shape=shapes.Sphere(0.1), mass=1, position=(0, 0, 1.1))
    sim = Simulation(b.build(), dt=h)  # without restitution
    speeds = []
    run(sim, 1.0, lambda s, r: speeds.append(s.state.linear_velocities[0, 2]))
    assert max(speeds[5:]) < 1e-9


@pytest.mark.parametrize("trees", FORMS)
def test_an_arm_on_a_standing_base_keeps_its_energy(trees):
    # Joints of bodies in contact lost (h w)^2 / 2 of the energy per step: 22 % of m g l in four seconds.
    sim = swinging_arm(5e-3, trees)
    found = [r.energy for r in run(sim, 5.0)]
    assert max(abs(e - found[0]) for e in found) < 0.01 * G * 0.25


@pytest.mark.parametrize("trees", FORMS)
def test_springs_keep_their_amplitude(trees):
    # w = 10 rad/s, h w = 0.1: implicit Euler loses a share h w^2 t / 2 of the amplitude, 92 % in 5 s.
    sim = spring(1e-2, trees, damping=0.0)
    found = []
    run(sim, 5.0, lambda s, r: found.append(r.energy))
    assert np.ptp(found) < 0.01 * 0.5 * 100 * 0.2**2


@pytest.mark.parametrize("trees", FORMS)
@pytest.mark.parametrize("law", ["position", "velocity"])
def test_actuators_follow_their_equations(law, trees):
    # Breaks when an actuator acts by implicit Euler, as it did: x' errs by h w / 2 of its largest value then.
    # A mass of 1 kg on a servo, from rest: x = u (1 - cos w t) with w^2 = kp, x' = u (1 - exp(-kd t)). The
    # midpoint rule has the frequency w (1 - (h w)^2 / 12) and the decay kd (1 + (h kd)^2 / 12); rates of
    # instants, half a step from the middle, add (h w)^2 / 8, which all together is below (h w)^2.
    h, w, u = 1e-2, 10.0, 0.3
    b = ModelBuilder(gravity=(0, 0, 0), trees=trees)
    b.add_prismatic_joint(b.add_body(shape=shapes.Sphere(0.1), mass=1), None, axis=(1, 0, 0))
    gains = {"kp": w**2} if law == "position" else {"kd": w}
    b.add_actuator(joint=0, law=law, control=u, **gains)
    sim = Simulation(b.build(), dt=h)
    for k in range(1, 51):
        sim.step()
        t = k * h
        rate = w * u * math.sin(w * t) if law == "position" else u * (1 - math.exp(-w * t))
        largest = w * u if law == "position" else u
        assert abs(sim.qd[0] - rate) < (h * w) ** 2 * largest


@pytest.mark.parametrize("trees", FORMS)
def test_the_rule_of_springs_does_not_jump(trees):
    # Between the midpoint rule and implicit Euler there is no jump: the motion depends smoothly on the
    # stiffness. At the ends of the blend, h w = 1 and 2, stiffnesses on both sides differ by 1e-9.
    def after(stiffness: float) -> float:
        b = ModelBuilder(gravity=(0, 0, 0), trees=trees)
        mass = b.add_body(shape=shapes.Sphere(0.1), mass=1, position=(0.1, 0, 0))
        b.add_prismatic_joint(mass, None, axis=(1, 0, 0), stiffness=stiffness, rest=-0.1)
        sim = Simulation(b.build(), dt=1e-2)
        run(sim, 0.1)
        return float(sim.q[0])

    for resolved in (1.0, 2.0):
        stiffness = (resolved / 1e-2) ** 2
        assert abs(after(stiffness * (1 + 1e-9)) - after(stiffness * (1 - 1e-9))) < 1e-8


@pytest.mark.parametrize("trees", FORMS)
def test_damping_is_not_biased(trees):
    # The decay of the energy of a damped oscillator, within 0.1 %; implicit Euler adds a share h w^2 / d.
    sim = spring(5e-3, trees, damping=0.4)
    found = np.array([r.energy for r in run(sim, 10 * 2 * math.pi / 10)])
    times = sim.dt * np.arange(len(found))
    phase = 2 * math.sqrt(100 - 0.2**2) * times  # the power of the damper comes and goes
    terms = np.stack([np.ones_like(times), -times, np.cos(phase), np.sin(phase)], axis=1)
    assert np.linalg.lstsq(terms, np.log(found), rcond=None)[0][1] == pytest.approx(0.4, rel=1e-3)
