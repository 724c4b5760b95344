"""Joints: linkages against their kinematics, the long chain, the cradle."""

import math
from itertools import pairwise

import amontons
import numpy as np
import pytest
from amontons import shapes
from amontons.scenes.linkages import four_bar_pose
from measures import run, simulate

BARS = {"ground": 0.9, "crank": 0.3, "coupler": 1.0, "rocker": 0.8}


def angle_of(sim, body):
    """Of a bar's long axis in the x-z plane, rad."""
    w, _, y, _ = sim.state.orientations[sim.model.body_index(body)]
    return -2 * math.atan2(y, w)


def wrapped(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


def test_slider_crank():
    # x = r cos a + sqrt(l^2 - r^2 sin^2 a) with a = w t, which the motor keeps exactly. Joints are closed
    # on the level of velocities, to the second order in h: of h^2 a / 2 = 8e-5 m of the pin's centripetal
    # acceleration w^2 r no more than twice remains, nor of what the correction of positions allows.
    w, r, l, h = 2 * math.pi, 0.2, 0.6, 2e-3
    sim = simulate("slider_crank", {"speed": w}, dt=h)
    slider = sim.model.body_index("slider")
    worst = 0.0

    def check(s, _):
        nonlocal worst
        a = w * s.time
        x = r * math.cos(a) + math.sqrt(l**2 - (r * math.sin(a)) ** 2)
        worst = max(worst, abs(s.state.positions[slider, 0] - x))

    run(sim, 2.0, check)
    assert worst < 2 * h**2 * w**2 * r
    assert abs(wrapped(angle_of(sim, "crank") - w * 2.0)) < 1e-6


def test_four_bar_follows_the_loop_equation():
    # Coupler and rocker angles follow from the crank's by the cosine rule; tolerance as for the slider-crank,
    # turned into angles by the shortest bar.
    w, h = 2 * math.pi, 2e-3
    sim = simulate("four_bar", {"speed": w, "driven": True}, dt=h)
    worst = 0.0

    def check(s, _):
        nonlocal worst
        c, r = four_bar_pose(angle_of(s, "crank"), **BARS)
        worst = max(worst, abs(wrapped(angle_of(s, "coupler") - c)), abs(wrapped(angle_of(s, "rocker") - r)))

    run(sim, 3.0, check)
    assert worst < 2 * h**2 * w**2 * 0.3 / 0.3
    assert angle_of(sim, "crank") % (2 * math.pi) == pytest.approx(math.radians(60), abs=1e-6)


def test_four_bar_does_not_drift():
    # Conservative case: joint errors must not grow from the first 5 s to the last 5 s of 20 s, out-of-plane
    # motion stays zero although three constraints are redundant, and the energy stays within 1 %. (100 s:
    # benchmarks.)
    sim = simulate("four_bar", {"driven": False, "gravity": 0.0})
    energies = []
    reports = run(sim, 20.0, lambda s, r: energies.append(r.energy))
    errors = np.array([r.joint_error for r in reports])
    n = len(errors) // 4
    assert errors[-n:].max() < 1.5 * errors[:n].max() + 1e-9
    assert np.abs(sim.state.positions[:, 1]).max() < 1e-9
    assert np.abs(np.array(energies) / energies[0] - 1).max() < 0.01


def test_door_with_two_hinges():
    # Two hinges on one axis give five constraints twice: the second five are redundant. The door swings like
    # one on a single hinge, neither drifts off its axis nor tilts, and both hinges together carry its weight.
    b = amontons.ModelBuilder()
    door = b.add_body(
        "door",
        position=(0.45, 0, 1.0),
        shape=shapes.Box((0.45, 0.02, 1.0)),
        density=600,
        angular_velocity=(0, 0, 2.0),
        linear_velocity=(0, 0.9, 0),
    )
    for name, z in (("lower", 0.2), ("upper", 1.8)):
        b.add_revolute_joint(door, None, point=(0, 0, z), axis=(0, 0, 1), name=name)
    sim = amontons.Simulation(b.build(), dt=5e-3)
    reports = run(sim, 10.0)
    # A step leaves an error of third order, and errors below 1e-4 lengths stay.
    assert max(r.joint_error for r in reports) < 1e-4
    assert abs(sim.state.positions[0, 2] - 1.0) < 1e-6
    assert abs(np.hypot(*sim.state.positions[0, :2]) - 0.45) < 1e-4
    # Joints do no work, so the door keeps its speed: a projection of velocities loses a share of it in every
    # step, 20 % of it here. The first step knows of no chord and may be off by (h w)^2. Single steps
    # alternate.
    before = sim.state.angular_velocities[0, 2]
    sim.step()
    mean = (before + sim.state.angular_velocities[0, 2]) / 2
    assert mean == pytest.approx(2.0, rel=2 * (sim.dt * 2.0) ** 2)
    carried = sim.forces.joint_reactions["force"].sum(axis=0)[2]
    assert carried == pytest.approx(sim.model.total_mass * 9.81, rel=1e-4)


def test_network_holds_together():
    # B1, a smaller one: through a second of wild motion the joints stay closed, and the energy does not grow,
    # for constraint impulses do no work but for the first-order loss.
    sim = simulate("network", {"columns": 5, "layers": 6}, tolerance=1e-8)
    reports = run(sim, 1.0)
    assert max(r.joint_error for r in reports) < 2e-3
    energies = np.array([r.energy for r in reports])
    assert energies.max() - energies[0] < 1e-6 * reports[0].kinetic_energy


def test_redundant_loops_pass_their_change_point():
    # Three legs of 1 kg and 1 m swing a beam through the pose in which all lie in one line. Joints of
    # the tree are exact, so the closing joints alone carry the errors, which that pose magnifies. If
    # these grow from step to step the frame jams: it loses its energy.
    builder = amontons.ModelBuilder(trees="auto")
    lean = math.radians(30)
    top = np.array([math.sin(lean), 0.0, math.cos(lean)])

    def bar(start, end):
        along = end - start
        turn = -math.atan2(along[2], along[0])
        half = np.linalg.norm(along) / 2
        return builder.add_body(
            position=(start + end) / 2,
            mass=1.0,
            inertia=(1e-3, half**2 / 3, half**2 / 3),
            orientation=(math.cos(turn / 2), 0, math.sin(turn / 2), 0),
        )

    feet = [np.array([x, 0.0, 0.0]) for x in (0.0, 1.0, 2.0)]
    legs = [bar(foot, foot + top) for foot in feet]
    beam = bar(top, feet[2] + top)
    for leg, foot in zip(legs, feet, strict=True):
        builder.add_revolute_joint(leg, None, point=foot, axis=(0, 1, 0))
    builder.add_revolute_joint(beam, legs[0], point=top, axis=(0, 1, 0))
    for leg, foot in zip(legs[1:], feet[1:], strict=True):
        builder.add_revolute_joint(leg, beam, point=foot + top, axis=(0, 1, 0))
    sim = amontons.Simulation(builder.build(), dt=2e-3)
    heights = []
    reports = run(sim, 1.0, lambda s, _: heights.append(s.state.positions[beam, 2]))
    assert min(heights) < -0.99  # beyond it, which is at z = 0
    # Of second order: 6 rad/s and 2 ms give (w h)^2 = 1.5e-4 of the energy of motion.
    moving = max(r.kinetic_energy for r in reports)
    assert max(abs(r.energy - reports[0].energy) for r in reports) < 1.5e-4 * moving


def test_chain_of_a_tree_that_becomes_taut():
    # A bridge of light planks catches a ball of 1000 times their mass. As the planks come into one line only
    # the joint at its end can be apart. It closes, and the ball is held.
    builder = amontons.ModelBuilder(trees="auto")
    pins = np.linspace((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), 11)
    pins[:, 2] = -0.3 * (1 - pins[:, 0] ** 2)
    below = None
    for start, end in pairwise(pins):
        along = end - start
        turn = -math.atan2(along[2], along[0])
        plank = builder.add_body(
            position=(start + end) / 2,
            shape=shapes.Box((0.45 * np.linalg.norm(along), 0.2, 0.02)),
            mass=1.0,
            orientation=(math.cos(turn / 2), 0, math.sin(turn / 2), 0),
        )
        builder.add_revolute_joint(plank, below, point=start, axis=(0, 1, 0))
        below = plank
    builder.add_revolute_joint(below, None, point=pins[-1], axis=(0, 1, 0))
    ball = builder.add_body(shape=shapes.Sphere(0.2), mass=1000.0, position=(0, 0, pins[5, 2] + 0.23))
    sim = amontons.Simulation(builder.build(), dt=2e-3)
    reports = run(sim, 1.0)
    assert max(r.joint_error for r in reports[-100:]) < 1e-3
    assert sim.state.positions[ball, 2] > -0.5  # in free fall it would be at -5


def test_chain_with_a_heavy_end():
    # 100 links and a ball of 1000 links' mass at h = 5 ms. The largest joint error stays below 0.1 mm over
    # the whole swing; a solver that stops early opens the joints next to the ball by centimetres. (5 s:
    # benchmarks.)
    sim = simulate("chain", dt=5e-3)
    reports = run(sim, 2.0)
    assert max(r.joint_error for r in reports) < 1e-4
    # It falls like a pendulum: v^2 = 2 g (drop of the ball), but for what the O(h) step and the links lose.
    ball = sim.model.body_index("ball")
    assert np.linalg.norm(sim.state.linear_velocities[ball]) > 1.0


@pytest.mark.parametrize("raised", [1, 2])
def test_cradle(raised):
    # With e = 1 as many balls leave as came, with their speed, the others stay: momentum and energy allow
    # nothing else for a single ball, and sequential reflections choose it for two. The energy never grows.
    sim = simulate("newtons_cradle", {"raised": raised, "angle": 30.0})
    energies, speeds = [], []

    def check(s, r):
        energies.append(r.energy)
        speeds.append(np.array(s.state.linear_velocities[:, 0]))

    # A quarter of a period and a little more: the blow has just passed.
    quarter = math.pi / 2 * math.sqrt(0.5 / 9.81) * 1.0175  # 1 + sin^2(15 deg) / 4, the first term of K
    run(sim, quarter + 0.05, check)
    speeds = np.array(speeds)
    top = np.abs(speeds).max()
    last = speeds[-1]
    assert last[-raised:].min() > 0.95 * top
    assert np.abs(last[:-raised]).max() < 0.05 * top
    # Of the energy of the blow, a share of (w h)^2 = 2e-5 comes and goes within a swing.
    blow = 0.5 * sim.model.bodies[0].mass * top**2
    assert max(energies) - energies[0] < 9.81 / 0.5 * sim.dt**2 * blow


def crank_torque(a, w, r=0.2, l=0.6, gravity=9.81):
    """Of the motor that keeps a crank at w rad/s, by the work of all links: w^2 I'(a) / 2 + V'(a), with the
    inertia I about the crank and the potential V of gravity, N m. Bars are as the scene makes them."""
    model = amontons.scenes.slider_crank()
    masses = [body.mass for body in model.bodies]
    spins = [body.inertia[1][1] for body in model.bodies]

    def centres(a):
        pin, reach = (
            np.array([r * np.cos(a), r * np.sin(a)]),
            r * np.cos(a) + np.sqrt(l**2 - (r * np.sin(a)) ** 2),
        )
        end = np.array([reach, 0 * a])
        return [pin / 2, (pin + end) / 2, end], [a, -np.arcsin(r / l * np.sin(a)), 0 * a]

    def inertia(a, step=1e-20):
        places, angles = centres(a + 1j * step)  # exact derivatives, of analytic functions
        moving = sum(m * (p.imag / step) @ (p.imag / step) for m, p in zip(masses, places, strict=True))
        return moving + sum(i * (t.imag / step) ** 2 for i, t in zip(spins, angles, strict=True))

    def potential(a):
        return sum(m * gravity * p[1] for m, p in zip(masses, centres(a)[0], strict=True))

    h = 1e-5
    return (0.5 * w**2 * (inertia(a + h) - inertia(a - h)) + potential(a + h) - potential(a - h)) / (2 * h)


def test_efforts_belong_to_the_start_of_the_step():
    # The torque of a step is that of the pose at its start: the mean of two steps to 1e-4 of the largest at
    # 1 ms, which is of second order. Single steps alternate about it (joints are a midpoint rule). With the
    # coordinate of now the torque is off by w h times its slope, 1.1 %. Breaks when an effort, the coordinate
    # that comes with it or Simulation.forces.instant are those of another instant.
    w, h = 2 * math.pi, 1e-3
    sim = simulate("slider_crank", {"speed": w}, dt=h)
    run(sim, 0.1)  # past the start, whose velocities are those of no step
    rows = []

    def check(s, report):
        effort = s.forces.effort("crank pivot")
        assert effort.time == s.forces.instant.time == pytest.approx(report.time - h, abs=1e-12)
        assert effort.coordinate == pytest.approx(s.forces.instant.q[0], abs=1e-12)
        rows.append(
            (
                effort.motor,
                crank_torque(effort.coordinate, w),
                crank_torque(s.kinematics.coordinate("crank pivot"), w),
            )
        )

    run(sim, 1.0, check)
    torque, there, now = np.array(rows).T / abs(np.array(rows)).max()
    assert abs(torque - there).max() < 5e-3
    torque, there, now = ((x[1:] + x[:-1]) / 2 for x in (torque, there, now))
    assert abs(torque - there).max() < 2e-4
    assert 5e-3 < abs(torque - now).max() < 2e-2


def test_reactions_belong_to_the_start_of_the_step():
    # The guide of the slider takes what its mass and weight leave: force along x is that of the rod. Breaks
    # when a reaction by name is another joint's, or its point is that of another instant.
    w, h = 2 * math.pi, 1e-3
    sim = simulate("slider_crank", {"speed": w}, dt=h)
    run(sim, 0.3)
    place = sim.state.positions[sim.model.body_index("slider"), 0]
    sim.step()
    reaction = sim.forces.reaction("slide")
    assert reaction.point[0] == pytest.approx(place, abs=1e-9)
    assert reaction.time == pytest.approx(sim.time - h, abs=1e-12)
    rows = sim.forces.joint_reactions
    assert reaction.force == tuple(rows["force"][sim.model.joint_index("slide")])
    with pytest.raises(amontons.InputError, match="there was no step yet"):
        amontons.Simulation(sim.model).forces.reaction("slide")


def test_rows_beside_a_tree_keep_their_motion():
    # A gate on three hinges has more joints that close loops than a tree could hold: all are rows, also
    # beside a tree. Errors of rows must not return as those of closing joints do, which would make the
    # motion of first order.
    moved = []
    for trees in ("none", "auto"):
        builder = amontons.ModelBuilder(trees=trees)
        arm = builder.add_body(shape=shapes.Capsule(0.1, 1.0), mass=1.0, position=(3, 0, 0))
        builder.add_revolute_joint(arm, None, point=(3, 0, 1), axis=(0, 1, 0))
        gate = builder.add_body(shape=shapes.Box((0.5, 0.5, 0.05)), mass=1.0, position=(0.5, 0, 0))
        for y in (-0.4, 0, 0.4):
            builder.add_revolute_joint(gate, None, point=(0, y, 0), axis=(0, 1, 0))
        sim = amontons.Simulation(builder.build(), dt=5e-3)
        run(sim, 1.0)
        moved.append(sim.state.positions[gate])
    # Both are the same rows, so that only rounding differs.
    assert np.abs(moved[1] - moved[0]).max() < 1e-9
