"""Joints under load: reactions, limits, springs, motors, friction and compliance against closed forms."""

import math

import amontons
import numpy as np
import pytest
from amontons import Motor, shapes
from middle import kick, middle

G = 9.81
BALL = shapes.Sphere(0.1)


def slide(**options):
    """A sphere of 2 kg on a slide along x, without gravity."""
    b = amontons.ModelBuilder(gravity=(0, 0, 0))
    ball = b.add_body(shape=BALL, mass=2.0)
    b.add_prismatic_joint(ball, None, axis=(1, 0, 0), name="slide", **options)
    return amontons.Simulation(b.build())


def position(sim):
    return sim.state.positions[0, 0]


def speed(sim):
    return sim.state.linear_velocities[0, 0]


LOADED = {
    "ball": lambda b, a: b.add_ball_joint(a, None, point=(0, 0, 1), stiffness=200.0, damping=20.0),
    "revolute": lambda b, a: b.add_revolute_joint(
        a, None, point=(0, 0, 1), axis=(0, 1, 0), limits=(-0.5, 0.5)
    ),
    "prismatic": lambda b, a: b.add_prismatic_joint(a, None, axis=(0, 0, 1), limits=(-0.2, 0.2)),
    "cylindrical": lambda b, a: b.add_cylindrical_joint(
        a, None, point=(0, 0, 1), axis=(0, 1, 1), limits=[(-0.2, 0.2), (-0.5, 0.5)]
    ),
    "universal": lambda b, a: b.add_universal_joint(
        a, None, point=(0, 0, 1), axis_1=(0, 1, 0), axis_2=(1, 0, 0), limits=[(-0.5, 0.5), (-0.3, 0.3)]
    ),
    "planar": lambda b, a: b.add_planar_joint(
        a, None, normal=(1, 0, 0), limits=[(-0.2, 0.2), (-0.2, 0.2), (-0.4, 0.4)]
    ),
    "fixed": lambda b, a: b.add_fixed_joint(a, None),
    "point on line": lambda b, a: b.add_point_on_line_joint(
        a, None, point=(0.3, 0.1, 1.1), axis=(0, 1, 1), limits=(-0.2, 0.2)
    ),
}


@pytest.mark.parametrize("kind", LOADED)
def test_every_joint_carries_a_load_at_its_limits(kind):
    # Reaction, limit efforts along slides, weight, drag and external force add up to m a in every kick, to
    # rounding, as they are parts of one velocity update. A load acts in halves of two kicks. A row with a
    # wrong sign, lever or scale, or an impulse that is lost on its way to the tables, does not balance.
    # Errors of position: h^2 w^2 r / 2.
    b = amontons.ModelBuilder()
    a = b.add_body(position=(0.3, 0.1, 1), shape=shapes.Box((0.2, 0.1, 0.1)), mass=2.0)
    LOADED[kind](b, a)
    sim = amontons.Simulation(b.build())
    force = np.zeros(3)

    def load(s):
        force[:] = -8 * s.state.linear_velocities[0] + np.array([1.0, 0.5, -3.0])
        s.state.forces[0] = force
        s.state.torques[0] = -0.5 * s.state.angular_velocities[0] + np.array([0.3, 0.2, 0.1])

    sim.before_step.append(load)
    directions = {"prismatic": [(0, 0, 1)], "cylindrical": [(0, 0.5**0.5, 0.5**0.5)]}
    directions["point on line"] = directions["cylindrical"]
    for _ in range(900):
        before = np.array(middle(sim).state.linear_velocities[0])
        last = force.copy() if sim.steps else None
        report = sim.step()
        assert report.converged
        assert report.joint_error < 1e-3
        along = np.zeros(3)
        efforts = sim.forces.joint_efforts
        if kind == "planar":  # the slides complete the normal to a right-handed frame: which way is free
            continue
        for k, direction in enumerate(directions.get(kind, [])):
            along += efforts["limit"][k] * np.array(direction)
        acceleration = (middle(sim).state.linear_velocities[0] - before) / kick(sim)
        held = force if last is None else (force + last) / 2
        weight = np.array([0, 0, -2 * G])
        reaction = sim.forces.joint_reactions["force"][0]
        np.testing.assert_allclose(
            reaction + along + held + weight, 2 * acceleration, atol=1e-9 * 2 * G / sim.dt
        )
    for dof, effort in zip(sim.model.joints[0].dofs, sim.forces.joint_efforts, strict=True):
        # Errors below 1e-4 lengths, or rad, are left as they are.
        assert dof.lower - 1e-4 < effort["coordinate"] < dof.upper + 1e-4
    if kind == "planar":  # both slides rest at limits that carry the load
        np.testing.assert_allclose(
            sorted(abs(sim.forces.joint_efforts["limit"][:2])), sorted([0.5, 2 * G + 3]), rtol=1e-4
        )


def test_reactions_balance_in_motion():
    # A double pendulum hit by a ball that bounces: m (v+ - v-) / k = m g + reactions + contacts for each body
    # in every step, to rounding. Reactions given in the axes of the end of the step are wrong by h omega = 5
    # %, and those without the impulses of the impact by all of it.
    b = amontons.ModelBuilder()
    e = amontons.Material(restitution=0.5)
    rod = shapes.Box((0.3, 0.05, 0.05))
    first = b.add_body(position=(0.3, 0, 0), shape=rod, mass=1.0, angular_velocity=(0, 8, 0), material=e)
    second = b.add_body(position=(0.9, 0, 0), shape=rod, mass=2.0, angular_velocity=(0, -4, 2), material=e)
    ball = b.add_body(position=(0.6, 0, 0.6), shape=BALL, mass=1.0, linear_velocity=(0, 0, -3), material=e)
    b.add_ball_joint(first, None, point=(0, 0, 0))
    b.add_revolute_joint(second, first, point=(0.6, 0, 0), axis=(0, 1, 0))
    sim = amontons.Simulation(b.build())
    mass = np.array([body.mass for body in sim.model.bodies])[:, None]
    hits = 0
    for _ in range(200):
        before = np.array(middle(sim).state.linear_velocities)
        sim.step()
        total = np.array(sim.forces.contact_forces()[0])
        hits += np.abs(total[ball]).max() > 0
        for r in sim.forces.joint_reactions:
            total[r["body_a"]] += r["force"]
            if r["body_b"] >= 0:
                total[r["body_b"]] -= r["force"]
        rate = (middle(sim).state.linear_velocities - before) / kick(sim) - np.array([0, 0, -G])
        np.testing.assert_allclose(total, mass * rate, atol=1e-10 * np.abs(mass * rate).max())
    assert hits > 0


@pytest.mark.parametrize("h", [1e-2, 1e-3])
def test_spring_oscillates(h):
    # The implicit midpoint rule, q+ - 2 q + q- = -(h w / 2)^2 (q+ + 2 q + q-): amplitudes stay, and the
    # tangent of half the angle of a step is h w / 2.
    k, m = 50.0, 2.0
    sim = slide(stiffness=k, rest=0.1)
    sim = amontons.Simulation(sim.model, dt=h, tolerance=1e-10)
    angle = 2 * math.atan(h * math.sqrt(k / m) / 2)
    worst = 0.0
    for n in range(1, 1 + round(5 / h)):
        sim.step()
        exact = 0.1 - 0.1 * math.cos(n * angle)
        worst = max(worst, abs(position(sim) - exact))
    assert worst < 1e-6
    assert angle / h == pytest.approx(math.sqrt(k / m), rel=h * h * k / m / 12)


# Breaks when springs tell their energy in the pose at the start of a step: the sum with that of the motion
# then swings by h w = 5 %. Velocities that are half a step ahead of the middle are off by 3 (h w)^2 / 8.
def test_energy_of_a_spring_is_that_of_its_motion():
    sim = slide(stiffness=50.0, rest=0.1)
    sim = amontons.Simulation(sim.model, dt=1e-2, tolerance=1e-10)
    energies = np.array([sim.step().energy for _ in range(200)])
    assert np.ptp(energies) < 3 * (1e-2 * 5) ** 2 * energies[0]


def test_damper_and_stiff_spring():
    # v exp(-d t / m) up to (h d / m)^2; and a spring of w h = 600 settles instead of blowing up.
    sim = slide(damping=4.0)
    sim.state.linear_velocities[0] = (1, 0, 0)
    sim.run(1.0)
    assert speed(sim) == pytest.approx(math.exp(-4 / 2), rel=(sim.dt * 4 / 2) ** 2)
    stiff = slide(stiffness=3e10, damping=1e5)
    stiff.state.linear_velocities[0] = (1, 0, 0)
    stiff.run(0.5)
    assert abs(speed(stiff)) < 1e-6


@pytest.mark.parametrize("force", [9.9, 10.1, 20.0])
def test_joint_friction_holds_up_to_its_limit(force):
    # m = 2: at rest below the limit of 10 N, (F - 10) / m beyond. A factor h or m too much moves the limit.
    sim = slide(friction=10.0)
    sim.state.forces[0] = (force, 0, 0)
    sim.run(1.0)
    assert speed(sim) == pytest.approx(max(0.0, force - 10) / 2, abs=1e-5)


def test_speed_motor_holds_and_slips():
    # It accelerates with max_effort / m, holds the speed against less, and loses (7 - 6) / m beyond.
    sim = slide(motor=Motor("velocity", control=1.5, max_effort=6.0))
    sim.run(0.25)
    assert speed(sim) == pytest.approx(6 / 2 * 0.25, rel=1e-5)
    sim.run(1.0)
    assert speed(sim) == pytest.approx(1.5, rel=1e-6)
    sim.state.forces[0] = (-5.9, 0, 0)
    sim.run(1.0)
    assert speed(sim) == pytest.approx(1.5, rel=1e-6)
    assert sim.forces.joint_efforts["motor"][0] == pytest.approx(5.9, rel=1e-5)
    sim.state.forces[0] = (-7, 0, 0)
    sim.run(1.0)
    # Of the step in which the load jumps, half a kick has the old one: the motor slips at the mean of both.
    slipped = sim.dt * (6.45 - 6) / 2 + (1 - sim.dt) / 2 + sim.dt / 4
    assert speed(sim) == pytest.approx(1.5 - slipped, abs=0.06 * sim.dt)


def test_position_motor_arrives_without_swinging():
    # With max_effort F it brakes with F / 2 at most: v^2 = (F / m) way. One that asked for way / h until it
    # is there would swing about the target for ever, with the amplitude it came from.
    sim = slide(motor=Motor("position", control=0.5, max_effort=20.0))
    ways = []
    sim.run(2.0, after_step=lambda s, _: ways.append(position(s)))
    assert max(ways) < 0.5 + 1e-6
    assert position(sim) == pytest.approx(0.5, abs=1e-6)
    # Accelerating at F / m and braking at half of that, as fast as can be: (3 way m / F)^(1/2) = 0.39 s.
    arrived = next(i for i, x in enumerate(ways) if x > 0.499) * sim.dt
    assert arrived < 1.5 * math.sqrt(3 * 0.5 * 2 / 20)
    sim.state.forces[0] = (-19.0, 0, 0)
    sim.run(1.0)
    assert position(sim) == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("kind", ["velocity", "position"])
def test_rigid_motor_stops_at_the_limit(kind):
    # Motor and limit are both rigid and contradict each other; without a rule between them there is no
    # solution, and the motor drags the joint past its limit.
    sim = slide(motor=Motor(kind, control=1.0), limits=(-0.2, 0.3))
    report = sim.run(1.0, after_step=lambda _, r: not r.converged)
    assert report.converged
    assert position(sim) == pytest.approx(0.3, abs=1e-6)
    sim.set_control("slide", -1.0)
    report = sim.run(1.0, after_step=lambda _, r: not r.converged)
    assert report.converged
    assert position(sim) == pytest.approx(-0.2, abs=1e-6)


def test_compliance_is_deflection_over_force():
    # At rest: compliance x weight, of locked directions and of a rod; damping of implicit Euler ends the
    # oscillation, w = 1 / sqrt(m c) = 71 / s decays by h w^2 / 2 = 12.5 / s.
    b = amontons.ModelBuilder()
    welded = b.add_body(position=(0, 0, 1), shape=BALL, mass=2.0)
    b.add_fixed_joint(welded, None, compliance=1e-4)
    hung = b.add_body(position=(1, 0, 1), shape=BALL, mass=2.0)
    b.add_distance_joint(hung, None, point_a=(1, 0, 1), point_b=(1, 0, 2), compliance=1e-4)
    sim = amontons.Simulation(b.build())
    sim.run(3.0)
    np.testing.assert_allclose(1 - sim.state.positions[:, 2], 2 * G * 1e-4, rtol=1e-5)


def test_gear_winch_and_carrier():
    # A gear of ratio -2: torque / (I_b + 4 I_a). A winch: g m / (m + I / r^2). Two gears on a free carrier: a
    # coupling of three bodies, whose angular momentum stays.
    b = amontons.ModelBuilder(gravity=(0, 0, 0))
    for i, inertia in enumerate((0.1, 0.3)):
        b.add_body(position=(i, 0, 0), mass=1, inertia=(inertia,) * 3)
        b.add_revolute_joint(i, None, point=(i, 0, 0), axis=(0, 0, 1))
    b.add_coupling(0, 1, coefficients=(0, -2))
    sim = amontons.Simulation(b.build())
    sim.state.torques[1] = (0, 0, 1)
    sim.run(1.0)
    assert sim.state.angular_velocities[1, 2] == pytest.approx(1 / (0.3 + 4 * 0.1), rel=1e-5)
    sim.state.torques[1] = 0
    sim.run(5.0)
    assert sim.kinematics.coordinate(0) == pytest.approx(-2 * sim.kinematics.coordinate(1), rel=1e-6)

    b = amontons.ModelBuilder()
    weight = b.add_body(mass=2, inertia=(0.1,) * 3)
    drum = b.add_body(position=(1, 0, 0), mass=1, inertia=(0.04,) * 3)
    b.add_prismatic_joint(weight, None, axis=(0, 0, 1))
    b.add_revolute_joint(drum, None, point=(1, 0, 0), axis=(0, 1, 0))
    b.add_coupling(0, 1, coefficients=(0, 0.2))
    sim = amontons.Simulation(b.build())
    sim.run(1.0)
    assert sim.state.linear_velocities[0, 2] == pytest.approx(-G * 2 / (2 + 0.04 / 0.2**2), rel=1e-5)

    b = amontons.ModelBuilder(gravity=(0, 0, 0))
    carrier = b.add_body(mass=5, inertia=(2,) * 3)
    for k, x in enumerate((-0.5, 0.5)):
        b.add_body(position=(x, 0, 0), mass=1, inertia=(0.1 + 0.2 * k,) * 3)
        b.add_revolute_joint(1 + k, carrier, point=(x, 0, 0), axis=(0, 0, 1))
    b.add_coupling(0, 1, coefficients=(0, -1))
    sim = amontons.Simulation(b.build())
    sim.state.angular_velocities[1] = (0, 0, 5)
    before = np.array(sim.forces.momentum()[1])
    sim.run(3.0)
    # The helper that carries the third body has 1e-4 of the lightest part's inertia.
    np.testing.assert_allclose(sim.forces.momentum()[1], before, atol=1e-3 * before[2])
    assert sim.kinematics.coordinate(0) == pytest.approx(-sim.kinematics.coordinate(1), abs=1e-3)


@pytest.mark.parametrize("recovery", ["projection", "velocity"])
def test_errors_of_position_are_taken_back_at_the_bounded_speed(recovery):
    # A ball joint torn apart by 1 m closes at recovery_speed, no faster, and stays closed. By projection the
    # body never has a velocity: what is given one keeps it, or stops with a jerk that joints must bear.
    b = amontons.ModelBuilder(gravity=(0, 0, 0))
    b.add_body(shape=BALL, mass=1.0)
    b.add_ball_joint(0, None, point=(0, 0, 0))
    sim = amontons.Simulation(b.build(), recovery=recovery, recovery_speed=0.5)
    sim.state.positions[0] = (1, 0, 0)
    speeds, places = [], [1.0]

    def look(s, _):
        speeds.append(abs(speed(s)))
        places.append(position(s))

    sim.run(3.0, after_step=look)
    assert max(-np.diff(places)) / sim.dt == pytest.approx(0.5, rel=1e-5)
    assert max(speeds) == pytest.approx(0.5 if recovery == "velocity" else 0, abs=5e-6)
    # Errors below 1e-4 lengths stay.
    assert abs(position(sim)) < (1e-6 if recovery == "velocity" else 1e-4 * sim.model.length)


CHAIN = """<mujoco><option timestep="0.0005" integrator="RK4"/><worldbody>
<body name="a" pos="0 0 2"><joint type="hinge" axis="0 1 0" damping=".02" stiffness="2"/>
<geom type="capsule" fromto="0 0 0 .5 0 0" size=".03" mass="1" contype="0" conaffinity="0"/>
<body name="b" pos=".5 0 0"><joint type="hinge" axis="0 0 1" armature=".01"/>
<joint type="hinge" axis="0 1 0" damping=".01"/>
<geom type="box" pos=".2 0 0" size=".2 .05 .03" mass=".7" contype="0" conaffinity="0"/>
<body name="c" pos=".4 0 0"><joint type="ball" stiffness=".5" damping=".02"/>
<geom type="ellipsoid" pos=".1 0 0" size=".1 .05 .03" mass=".3" contype="0" conaffinity="0"/>
</body></body></body></worldbody></mujoco>"""


def test_spatial_chain_converges_to_mujoco(tmp_path):
    # Hinges, two of them in one joint with the inertia of a drive, springs and a ball, in generalised
    # coordinates with RK4 (error far below 1e-6 m here) and as our constraints: the difference is of second
    # order in h, down to the errors of position that stay. The inertia of a drive that takes its last rate
    # from the present Jacobian stays wrong by 3 mm at any h.
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "chain.xml"
    path.write_text(CHAIN)
    model = amontons.load_model(path)
    reference = mujoco.MjModel.from_xml_string(CHAIN)
    worst = {}
    for h in (1e-3, 2.5e-4):
        data = mujoco.MjData(reference)
        data.qvel[:2] = 1, 2
        mujoco.mj_forward(reference, data)
        ids = [reference.body(name).id for name in model.body_names]
        sim = amontons.Simulation(model, dt=h, tolerance=1e-9)
        for k, i in enumerate(ids):
            twist = np.zeros(6)
            mujoco.mj_objectVelocity(reference, data, mujoco.mjtObj.mjOBJ_XBODY, i, twist, 0)
            sim.state.angular_velocities[k], sim.state.linear_velocities[k] = twist[:3], twist[3:]
        mujoco.mj_step(reference, data, 2000)
        sim.run(1.0)
        worst[h] = np.abs(sim.state.positions - data.xpos[ids]).max()
    assert worst[1e-3] < 2e-5
    assert worst[2.5e-4] < 1e-5
