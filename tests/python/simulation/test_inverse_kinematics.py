"""Inverse kinematics against closed forms, on arms, at limits and with closed loops; gravity compensation."""

import numpy as np
import pytest
from amontons import InputError, ModelBuilder, Motor, Simulation, shapes
from amontons.simulation.tangent import difference, integrate

FIRST, SECOND = 0.5, 0.3


def planar(limits=(None, None)):
    """Two links in the plane of x and z, stretched along x; hinges about y, so that angles turn x to -z."""
    builder = ModelBuilder()
    builder.add_body("upper", shape=shapes.Box((FIRST / 2, 0.02, 0.02)), mass=2, position=(FIRST / 2, 0, 0))
    place = (FIRST + SECOND / 2, 0, 0)
    builder.add_body("lower", shape=shapes.Box((SECOND / 2, 0.02, 0.02)), mass=1, position=place)
    motor = Motor("effort")
    builder.add_revolute_joint("upper", None, axis=(0, 1, 0), point=(0, 0, 0), name="a", limits=limits[0],
                               motor=motor)  # fmt: skip
    builder.add_revolute_joint("lower", "upper", axis=(0, 1, 0), point=(FIRST, 0, 0), name="b",
                               limits=limits[1], motor=motor)  # fmt: skip
    builder.add_site("lower", position=(SECOND / 2, 0, 0), name="tip")
    return builder.build()


def seven():
    """Seven hinges, about z and y in turn, with limits: the wrist of the usual arms."""
    builder, above = ModelBuilder(), None
    for k in range(7):
        builder.add_body(
            f"l{k}", shape=shapes.Capsule(0.04, 0.06), mass=2 - 0.2 * k, position=(0, 0, 0.1 + 0.2 * k)
        )
        axis = (0, 0, 1) if k % 2 == 0 else (0, 1, 0)
        builder.add_revolute_joint(f"l{k}", above, axis=axis, point=(0, 0, 0.2 * k), name=f"j{k}",
                                   limits=(-2.6, 2.6) if k % 2 == 0 else (-1.9, 1.9))  # fmt: skip
        above = f"l{k}"
    builder.add_site("l6", position=(0.02, 0, 0.1), name="tool")
    return builder.build()


# Breaks when the solution is not that of the law of cosines: cos b = (r^2 - a^2 - b^2) / (2 a b), and either
# bend of the elbow is one.
@pytest.mark.parametrize("target", [(0.4, 0.3), (-0.2, 0.5), (0.1, -0.25), (-0.5, -0.45)])
def test_planar_closed_form(target):
    sim = Simulation(planar())
    sim.set_q({"a": 0.1, "b": 0.2})
    before = sim.q
    found = sim.kinematics.solve_ik("tip", position=(target[0], 0, target[1]))
    assert found.converged
    cosine = (np.hypot(*target) ** 2 - FIRST**2 - SECOND**2) / (2 * FIRST * SECOND)
    assert np.cos(found.q[1]) == pytest.approx(cosine, abs=1e-5)
    a, b = found.q
    reached = FIRST * np.cos(a) + SECOND * np.cos(a + b), -FIRST * np.sin(a) - SECOND * np.sin(a + b)
    assert reached == pytest.approx(target, abs=sim.model.length / 1e6)
    assert found.position_error <= sim.model.length / 1e6
    np.testing.assert_array_equal(sim.q, before)  # nothing moved
    sim.kinematics.solve_ik("tip", (target[0], 0, target[1]), apply=True)
    assert sim.kinematics.site("tip")["position"] == pytest.approx((target[0], 0, target[1]), abs=1e-6)


# Breaks when a place out of reach passes for reached, or what comes nearest is not found: the arm stretched
# towards it. At the end of the reach the distance changes with the square of the angle: 1e-4 is 1e-8 m.
def test_out_of_reach():
    sim = Simulation(planar())
    sim.set_q({"a": 0.3, "b": -0.5})
    found = sim.kinematics.solve_ik("tip", (0.0, 0, 1.2), attempts=3)
    assert not found.converged
    assert found.position_error == pytest.approx(1.2 - FIRST - SECOND, abs=1e-7)
    assert found.q == pytest.approx([-np.pi / 2, 0], abs=1e-3)


# Breaks when limits are passed, or the other bend of the elbow is not found though it is allowed.
def test_limits():
    sim = Simulation(planar(limits=((-3, 3), (0.1, 3))))
    sim.set_q({"a": -1.0, "b": 0.5})
    found = sim.kinematics.solve_ik("tip", (0.4, 0, 0.3))
    assert found.converged
    assert 0.1 <= found.q[1] <= 3
    nowhere = Simulation(planar(limits=((-0.1, 0.1), (-0.1, 0.1)))).kinematics.solve_ik("tip", (0.0, 0, 0.5))
    assert not nowhere.converged
    assert np.abs(nowhere.q) == pytest.approx([0.1, 0.1], abs=1e-9)  # both as far up as they go
    assert nowhere.q[0] < 0


# Breaks when places and orientations that an arm of seven joints has are not found, from one start.
def test_seven_joints():
    sim, wanted = Simulation(seven()), np.random.default_rng(5)
    other = sim.copy()
    for _ in range(20):
        other.q = wanted.uniform(-1.5, 1.5, 7)
        site = other.kinematics.site("tool")
        found = sim.kinematics.solve_ik("tool", position=site["position"], orientation=site["orientation"])
        assert found.converged
        assert np.abs(found.q[::2]).max() <= 2.6
        assert np.abs(found.q[1::2]).max() <= 1.9
        other.q = found.q
        assert other.kinematics.site("tool")["position"] == pytest.approx(site["position"], abs=1e-6)
        turn = abs(
            other.kinematics.site("tool")["orientation"] @ site["orientation"]
        )  # cos of half the angle
        assert turn == pytest.approx(1, abs=1e-12)
    only = sim.kinematics.solve_ik("tool", orientation=(0, 1, 0, 0))
    assert only.converged
    assert only.position_error == 0


# Breaks when the same question has another answer.
def test_is_deterministic():
    answers = [
        Simulation(seven()).kinematics.solve_ik("tool", (0.3, 0.3, 0.6), (0, 1, 0, 0)).q for _ in range(2)
    ]
    np.testing.assert_array_equal(*answers)


# Breaks when loops open: the coupler of a parallelogram stays level, its middle on a circle about (0.5, 0).
def test_closed_loop():
    builder = ModelBuilder()
    for name, x in (("left", 0.0), ("right", 1.0)):
        builder.add_body(name, shape=shapes.Box((0.02, 0.02, 0.25)), mass=1, position=(x, 0, 0.25))
        builder.add_revolute_joint(name, None, axis=(0, 1, 0), point=(x, 0, 0), name=f"foot {name}")
    builder.add_body("coupler", shape=shapes.Box((0.5, 0.02, 0.02)), mass=1, position=(0.5, 0, 0.5))
    builder.add_revolute_joint("coupler", "left", axis=(0, 1, 0), point=(0, 0, 0.5), name="near")
    builder.add_revolute_joint("coupler", "right", axis=(0, 1, 0), point=(1, 0, 0.5), name="far")
    builder.add_site("coupler", name="middle")
    sim = Simulation(builder.build())
    sim.set_q({"foot left": 0.2})
    for angle in (0.9, -0.7):
        target = (0.5 + 0.5 * np.sin(angle), 0, 0.5 * np.cos(angle))
        found = sim.kinematics.solve_ik("middle", target)
        assert found.converged
        assert found.q == pytest.approx([angle, angle, -angle], abs=1e-5)
    off = sim.kinematics.solve_ik(
        "middle", (0.5, 0, 0.8), attempts=2
    )  # 0.3 above the highest point of the circle
    assert not off.converged
    assert off.position_error == pytest.approx(0.3, abs=1e-6)


# Breaks when a floating base moves without leave, or cannot with it; a link or body stands for a site.
def test_what_may_move():
    builder = ModelBuilder()
    builder.add_body("trunk", shape=shapes.Box((0.2, 0.2, 0.2)), mass=5, position=(0, 0, 1))
    builder.add_body("arm", shape=shapes.Box((0.2, 0.02, 0.02)), mass=1, position=(0.4, 0, 1))
    builder.add_revolute_joint("arm", "trunk", axis=(0, 1, 0), point=(0.2, 0, 1), name="hinge")
    sim = Simulation(builder.build())
    held = sim.kinematics.solve_ik("arm", (0.2, 0, 0.8))
    assert held.converged
    assert held.q[:7] == pytest.approx([0, 0, 1, 1, 0, 0, 0], abs=1e-12)
    assert held.q[7] == pytest.approx(np.pi / 2, abs=1e-5)
    assert not sim.kinematics.solve_ik("arm", (5, 0, 0.8), attempts=1).converged
    moved = sim.kinematics.solve_ik("arm", (5, 0, 0.8), (0, 1, 0, 0), coordinates=["trunk"])
    assert moved.converged
    assert moved.q[7] == pytest.approx(0, abs=1e-12)


# Breaks when what cannot be meant is not refused by name.
@pytest.mark.parametrize(
    ("arguments", "options", "said"),
    [
        (("tipp", (0, 0, 0)), {}, 'there is no site, link or body "tipp".*did you mean.*tip'),
        (("tip",), {}, "needs a position, an orientation or both"),
        (("tip", (0, 0)), {}, "position"),
        (("tip", None, (0, 0, 0, 0)), {}, "orientation"),
        (("tip", (0, 0, 0)), {"coordinates": ["c"]}, "coordinates: there is no 'c'; known are a, b"),
        (("tip", (0, 0, 0)), {"coordinates": []}, "nothing that solve_ik may move"),
        (("tip", (0, 0, 0)), {"tolerance": 0}, "tolerance"),
        (("tip", (0, 0, 0)), {"attempts": 0}, "attempts"),
        (("tip", (0, 0, 0)), {"apply": "yes"}, "apply"),
    ],
)
def test_refuses(arguments, options, said):
    sim = Simulation(planar())
    with pytest.raises(InputError, match=said):
        sim.kinematics.solve_ik(*arguments, **options)


# Breaks when a change along qd is not that of a short time: quaternions turned on the wrong side, say.
def test_tangent():
    builder = ModelBuilder(gravity=(0, 0, 0))
    builder.add_body("free", shape=shapes.Sphere(0.1), mass=1)
    builder.add_body("held", shape=shapes.Sphere(0.1), mass=1, position=(1, 0, 0))
    builder.add_ball_joint("held", "free", point=(1, 0, 0), name="ball")
    builder.add_body("out", shape=shapes.Sphere(0.1), mass=1, position=(2, 0, 0))
    builder.add_prismatic_joint("out", "held", axis=(1, 0, 0), name="slide")
    model = builder.build()
    rng, dt = np.random.default_rng(2), 1e-6
    sim = Simulation(model, dt=dt)
    sim.q, sim.qd = rng.normal(size=model.nq), rng.normal(size=model.nv)
    first = sim.q
    sim.step()
    assert integrate(model, first, dt * sim.qd) == pytest.approx(sim.q, abs=1e-11)
    change = rng.normal(size=model.nv)
    assert difference(model, first, integrate(model, first, change)) == pytest.approx(change, abs=1e-12)


# Breaks when the forces do not hold the pose: statics of two links, moments m g x about each hinge (a turn
# about +y lowers x), and the motors then keep the arm where it is.
def test_gravity_compensation_of_a_chain():
    sim = Simulation(planar(), dt=1e-3)
    sim.q = (0.4, -1.1)
    sim.qd = (3.0, -2.0)  # has no say
    g, (a, b) = 9.81, sim.q
    lower = SECOND / 2 * np.cos(a + b)
    about_b = -1 * g * lower
    about_a = -2 * g * FIRST / 2 * np.cos(a) - 1 * g * (FIRST * np.cos(a) + lower)
    forces = sim.forces.gravity_compensation()
    assert forces == pytest.approx([about_a, about_b], abs=1e-12)
    sim.reset(q=(0.4, -1.1))
    sim.state.joint_forces = forces
    sim.run(0.2)
    assert sim.q == pytest.approx([0.4, -1.1], abs=1e-6)


# Breaks when a floating base or a ball has other signs or axes than those of MuJoCo's qfrc_bias at rest.
def test_gravity_compensation_is_that_of_mujoco(root):
    mujoco = pytest.importorskip("mujoco")
    from amontons import load_model

    for name in ("quadruped.xml", "arm.xml", "gripper.xml"):
        path = root / "examples" / "models" / name
        theirs = mujoco.MjModel.from_xml_path(str(path))
        data, sim = mujoco.MjData(theirs), Simulation(load_model(path))
        rng = np.random.default_rng(3)
        change = rng.normal(size=sim.model.nv)
        q = np.array(data.qpos)
        mujoco.mj_integratePos(theirs, q, change, 1.0)
        assert integrate(sim.model, np.array(data.qpos), change) == pytest.approx(q, abs=1e-12)
        data.qpos[:] = q
        mujoco.mj_forward(theirs, data)
        sim.q = q
        assert sim.forces.gravity_compensation(springs=False) == pytest.approx(data.qfrc_bias, abs=1e-9)
