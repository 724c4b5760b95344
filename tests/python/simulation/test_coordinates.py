"""Generalised coordinates against MuJoCo, against closed forms of loops, and against differences."""

import copy
import math

import amontons
import numpy as np
import pytest
from amontons import InputError, ModelBuilder, Simulation
from floating_robot import ROBOT, box, robot
from problems import robot_file

# Products of the same rotations in another order: a few roundings apart, of numbers around one.
ROUNDING = 1e-13


@pytest.fixture(scope="module")
def mujoco():
    return pytest.importorskip("mujoco")


def random_state(mujoco, m, d, seed=0):
    rng = np.random.default_rng(seed)
    d.qpos[:] = m.qpos0
    mujoco.mj_integratePos(m, d.qpos, rng.normal(size=m.nv), 1.0)
    d.qvel[:] = rng.normal(size=m.nv)
    mujoco.mj_forward(m, d)


def four_bar(crank=1.0, coupler=2.0, rocker=2.0, ground=2.0):
    """A planar linkage in the x z plane, drawn open along x so that only the loop places the rocker."""
    builder = ModelBuilder()
    for name, x in (("crank", crank / 2), ("coupler", crank + coupler / 2)):
        box(builder, name, (x, 0, 0))
    box(builder, "rocker", (ground, 0, rocker / 2))
    axis = (0, -1, 0)  # positive angles turn x towards z
    builder.add_revolute_joint("crank", point=(0, 0, 0), axis=axis, name="A")
    builder.add_revolute_joint("coupler", "crank", point=(crank, 0, 0), axis=axis, name="B")
    builder.add_revolute_joint("rocker", point=(ground, 0, 0), axis=axis, name="D")
    builder.add_joint(
        amontons.Joint(
            name="C",
            body_a="coupler",
            body_b="rocker",
            frame_a=amontons.Transform((coupler / 2, 0, 0), axis_to_y()),
            frame_b=amontons.Transform((0, 0, rocker / 2), axis_to_y()),
            dofs=(amontons.Dof(),),
        )
    )
    return builder.build()


def axis_to_y():
    return (0.5**0.5, 0.5**0.5, 0, 0)  # z to -y


def rocker_tip(model, sim):
    i = model.body_index("rocker")
    return sim.state.positions[i] + (sim.state.positions[i] - np.array((2.0, 0, 0)))


# Breaks when names or order are not those of MuJoCo's qpos and qvel.
def test_names(mujoco, tmp_path):
    model, m, _ = robot(mujoco, tmp_path)
    assert (model.nq, model.nv) == (m.nq, m.nv)
    assert tuple(model.coordinates) == ("torso", "hip", "thigh", "ankle_x", "ankle_x+ankle.ball", "swing")
    kinds = [c.kind for c in model.coordinates.values()]
    assert kinds == ["free", "hinge", "slide", "hinge", "ball", "hinge"]
    for c, j in zip(model.coordinates.values(), range(m.njnt), strict=True):
        assert (c.q.start, c.qd.start) == (m.jnt_qposadr[j], m.jnt_dofadr[j])
    assert model.q_names[:8] == (*(f"torso.{x}" for x in ("x", "y", "z", "qw", "qx", "qy", "qz")), "hip")
    assert len(model.q_names) == m.nq
    assert len(model.qd_names) == m.nv
    with pytest.raises(InputError, match='no coordinate "knee"; known are torso, hip'):
        Simulation(model).set_q({"knee": 1.0})


# Breaks when a free joint with damping, which is a joint here, is asked for otherwise than one without.
def test_damped_floating_base(mujoco, tmp_path):
    text = ROBOT.replace('<freejoint name="root"/>', '<joint name="root" type="free" damping="0.1"/>')
    path = tmp_path / "damped.xml"
    path.write_text(text)
    damped, (plain, *_) = amontons.load_model(path), robot(mujoco, tmp_path)
    assert len(damped.joints) == len(plain.joints) + 1
    assert damped.q_names == plain.q_names
    assert damped.qd_names == plain.qd_names
    sim = Simulation(damped)
    sim.set_q({"torso": (1, 2, 3, 0.6, 0, 0.8, 0)})
    sim.set_qd({"torso": (1, 2, 3, 4, 5, 6)})
    np.testing.assert_allclose(sim.state.positions[0], (1, 2, 3), atol=1e-15)
    np.testing.assert_allclose(sim.qd[:6], (1, 2, 3, 4, 5, 6), atol=1e-13)
    assert sim.kinematics.rate("root", 1) == pytest.approx(2)


# Breaks when degrees of freedom of a model that is part of another one keep their names, which are taken.
def test_names_of_a_model_put_into_another(mujoco, tmp_path):
    model, m, _ = robot(mujoco, tmp_path)
    builder = ModelBuilder()
    for prefix in ("a/", "b/"):
        builder.add_model(model, prefix=prefix)
    both = builder.build()
    assert tuple(both.coordinates) == tuple(p + name for p in ("a/", "b/") for name in model.coordinates)
    assert both.nq == 2 * m.nq


# Breaks when forward kinematics, velocities of bodies or reading them back are not MuJoCo's.
def test_bodies_follow_q_and_qd_as_in_mujoco(mujoco, tmp_path):
    model, m, d = robot(mujoco, tmp_path)
    sim = Simulation(model)
    for seed in range(5):
        random_state(mujoco, m, d, seed)
        sim.q, sim.qd = d.qpos, d.qvel
        velocity = np.zeros(6)
        for i, name in enumerate(model.body_names):
            b = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, name)
            mujoco.mj_objectVelocity(m, d, mujoco.mjtObj.mjOBJ_XBODY, b, velocity, 0)
            np.testing.assert_allclose(sim.state.positions[i], d.xpos[b], atol=ROUNDING)
            assert abs(sim.state.orientations[i] @ d.xquat[b]) == pytest.approx(1, abs=ROUNDING)
            np.testing.assert_allclose(sim.state.angular_velocities[i], velocity[:3], atol=ROUNDING)
            np.testing.assert_allclose(sim.state.linear_velocities[i], velocity[3:], atol=10 * ROUNDING)
        ball = model.coordinates["ankle_x+ankle.ball"].q
        d.qpos[ball] *= math.copysign(1, d.qpos[ball.start])
        np.testing.assert_allclose(sim.q, d.qpos, atol=ROUNDING)
        np.testing.assert_allclose(sim.qd, d.qvel, atol=10 * ROUNDING)


# Breaks when a term of the equations of motion, an armature or a column of a Jacobian is wrong.
def test_equations_of_motion_are_those_of_mujoco(mujoco, tmp_path):
    model, m, d = robot(mujoco, tmp_path)
    sim = Simulation(model)
    rng = np.random.default_rng(9)
    for seed in range(5):
        random_state(mujoco, m, d, seed)
        sim.q, sim.qd = d.qpos, d.qvel
        M = np.zeros((m.nv, m.nv))
        mujoco.mj_fullM(m, d, M)
        np.testing.assert_allclose(sim.forces.mass_matrix(), M, atol=1e-11)
        np.testing.assert_allclose(sim.forces.bias_forces(), d.qfrc_bias, atol=1e-10)
        qdd = rng.normal(size=m.nv)
        np.testing.assert_allclose(sim.forces.inverse_dynamics(qdd), M @ qdd + d.qfrc_bias, atol=1e-10)
        b = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, "foot")
        point = rng.normal(size=3)
        Jp, Jr = np.zeros((3, m.nv)), np.zeros((3, m.nv))
        mujoco.mj_jac(m, d, Jp, Jr, d.xpos[b] + d.xmat[b].reshape(3, 3) @ point, b)
        np.testing.assert_allclose(sim.kinematics.jacobian("foot", point), np.vstack([Jp, Jr]), atol=1e-12)
        forces, torques = rng.normal(size=(2, len(model.bodies), 3))
        tau = np.zeros(m.nv)
        for body, f, t in zip(model.bodies, forces, torques, strict=True):
            i = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, body.name)
            centre = d.xpos[i] + d.xmat[i].reshape(3, 3) @ body.centre_of_mass  # of the body with its links
            mujoco.mj_applyFT(m, d, f.copy(), t.copy(), centre, i, tau)
        np.testing.assert_allclose(sim.forces.generalised_forces(forces, torques), tau, atol=1e-11)


# Breaks when the joint of a body that is B of it is walked the wrong way, or a base is not the first body.
def test_joints_are_walked_both_ways():
    builder = ModelBuilder(gravity=(0, 0, 0))
    box(builder, "hand", (2, 0, 0))
    box(builder, "arm", (1, 0, 0))
    box(builder, "far", (3, 0.2, 0))
    builder.add_revolute_joint("arm", "hand", point=(1.5, 0, 0.1), axis=(0, 1, 0), name="elbow")
    builder.add_joint(amontons.Joint(
        name="wrist", body_a="hand", body_b="far", spherical=True,
        frame_a=amontons.Transform((0.5, 0, 0)), frame_b=amontons.Transform((-0.5, -0.2, 0)),
        dofs=(amontons.Dof(kind="slide", axis=(0, 0, 1)),),
    ))  # fmt: skip
    model = builder.build()
    assert [c.kind for c in model.coordinates.values()] == ["free", "hinge", "slide", "ball"]
    assert next(iter(model.coordinates)) == "hand"
    sim = Simulation(model)
    rng = np.random.default_rng(1)
    sim.q = [1, 2, 3, *rng.normal(size=4), 0.5, 0.2, *rng.normal(size=4)]
    q, qd = sim.q, rng.normal(size=model.nv)
    sim.qd = qd
    np.testing.assert_allclose(sim.qd, qd, atol=1e-13)
    assert 0.5 * qd @ sim.forces.mass_matrix() @ qd == pytest.approx(kinetic_energy(sim), rel=1e-12)
    for i in range(3):
        v = sim.kinematics.jacobian(i) @ qd
        np.testing.assert_allclose(v[:3], sim.state.linear_velocities[i], atol=1e-12)
        np.testing.assert_allclose(v[3:], sim.state.angular_velocities[i], atol=1e-12)
    # The elbow turns the arm by 0.5 rad about y from the hand.
    rotation = [np.array(amontons.model.transforms.rotation_matrix(tuple(r))) for r in sim.state.orientations]
    relative = rotation[0].T @ rotation[1]
    assert math.atan2(relative[0, 2], relative[0, 0]) == pytest.approx(0.5, abs=1e-12)
    sim.q = q
    np.testing.assert_allclose(sim.q, q, atol=1e-14)
    np.testing.assert_allclose(sim.qd, qd, atol=1e-12)


def kinetic_energy(sim):
    """The sum over bodies; the frames of these boxes are at their centres of mass."""
    total = 0.0
    for body, v, w, q in zip(
        sim.model.bodies,
        sim.state.linear_velocities,
        sim.state.angular_velocities,
        sim.state.orientations,
        strict=True,
    ):
        R = np.array(amontons.model.transforms.rotation_matrix(tuple(q)))
        local = R.T @ w
        total += 0.5 * (body.mass * v @ v + local @ np.array(body.inertia) @ local)
    return total


# Breaks when loops stay open, the named coordinate moves, or velocities do not fit the loop.
@pytest.mark.parametrize("angle", [0.3, 1.2, 2.5])
def test_loops_are_closed(angle):
    model = four_bar()
    assert [model.joints[j].name for j in model.tree.loops] == ["C"]
    sim = Simulation(model)
    sim.set_q({"B": 0.5})
    for a in np.linspace(0.1, angle, 8):  # a path, so that the branch is the same
        sim.set_q({"A": a})
    assert sim.kinematics.coordinate("A") == pytest.approx(angle, abs=1e-15)
    # Freudenstein: the distance of the ends of coupler and rocker's pivots, with the tip on both circles.
    pin = np.array((math.cos(angle), 0, math.sin(angle)))
    i = model.body_index("coupler")
    tip = 2 * sim.state.positions[i] - pin
    assert np.linalg.norm(tip - pin) == pytest.approx(2, abs=1e-10)
    assert np.linalg.norm(tip - (2, 0, 0)) == pytest.approx(2, abs=1e-10)
    np.testing.assert_allclose(rocker_tip(model, sim), tip, atol=1e-10)
    sim.set_qd({"A": 1.0})
    k = model.coordinates
    assert sim.qd[k["A"].qd] == pytest.approx(1.0, abs=1e-12)
    e = 1e-6
    q = sim.q
    sim.set_q({"A": angle + e})
    np.testing.assert_allclose((sim.q - q) / e, sim.qd, atol=1e-4)
    with pytest.raises(InputError, match='joint "C" closes a loop'):
        sim.kinematics.rate("C")
    report = sim.step()
    assert report.joint_error < 1e-9
    assert sim.kinematics.coordinate("C") == pytest.approx(
        sim.state.joint_coordinates[model.dof_index("C")], abs=0.1
    )


# Breaks when a loop that cannot be closed passes, or leaves something behind.
def test_loops_that_cannot_be_closed():
    model = four_bar(crank=1, coupler=0.4, rocker=0.5, ground=2)
    sim = Simulation(model)
    before = copy.deepcopy(sim)
    with pytest.raises(InputError, match=r'q does not close joint "C": a gap of .* m is left'):
        sim.set_q({"A": math.pi})
    np.testing.assert_array_equal(sim.state.positions, before.state.positions)
    np.testing.assert_array_equal(sim.q, before.q)


# Breaks when coupled coordinates do not follow.
def test_couplings_follow():
    builder = ModelBuilder()
    for i in range(2):
        box(builder, f"gear{i}", (i, 0, 0))
        builder.add_revolute_joint(f"gear{i}", point=(i, 0, 0), axis=(0, 1, 0), name=f"g{i}")
    builder.add_coupling("g0", "g1", coefficients=(0.1, -2.0), name="mesh")
    sim = Simulation(builder.build())
    sim.set_q({"g1": 1.0})
    assert sim.q == pytest.approx([-1.9, 1.0], abs=1e-12)
    sim.set_qd({"g0": 1.0})
    assert sim.qd == pytest.approx([1.0, -0.5], abs=1e-12)
    with pytest.raises(InputError, match=r'coupling "mesh": .*; give values that fit together, or fewer'):
        sim.set_q({"g0": 0.0, "g1": 1.0})


# Breaks when bad values pass, or turns of hinges are lost.
def test_bad_coordinates(mujoco, tmp_path):
    model, m, _ = robot(mujoco, tmp_path)
    sim = Simulation(model)
    before = sim.q
    for values, message in [
        (np.zeros(3), r"q has the shape \(3,\); the model asks for \(15,\)"),
        (np.zeros(m.nq), r'q of body "torso" has a quaternion of length 0'),
        (np.full(m.nq, math.nan), r"q\[0\] is not finite"),
        ({"hip": "x"}, 'q of "hip" is'),
        ({"torso": (1, 2)}, r'q of "torso" has the shape \(2,\)'),
    ]:
        with pytest.raises(InputError, match=message):
            sim.q = values
        np.testing.assert_array_equal(sim.q, before)
    with pytest.raises(InputError, match="set simulation.q"):
        sim.state.joint_coordinates = 1.0
    for array in (sim.q, sim.qd, sim.qdd, sim.controls, sim.state.joint_coordinates):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    sim.set_q({"swing": 20.0})  # three turns and more
    assert sim.kinematics.coordinate("swing") == 20.0
    sim.step()
    assert sim.kinematics.coordinate("swing") == pytest.approx(20.0, abs=0.1)
    assert sim.kinematics.coordinate("hip") == sim.q[model.coordinates["hip"].q][0]
    assert sim.kinematics.rate("swing") == sim.qd[-1]
    assert sim.kinematics.acceleration("swing") == sim.qdd[-1]
    assert sim.kinematics.acceleration("swing") != 0


# Breaks when accelerations are not those of the equations of motion, to the order of the step.
def test_accelerations(mujoco, tmp_path):
    model, m, d = robot(mujoco, tmp_path)
    random_state(mujoco, m, d, 2)
    errors = []
    for dt in (1e-4, 5e-5):
        sim = Simulation(model, dt=dt)
        sim.q, sim.qd = d.qpos, d.qvel
        assert not sim.qdd.any()
        for _ in range(10):  # velocities settle to how the step looks at joints
            sim.step()
        expected = np.linalg.solve(sim.forces.mass_matrix(), -sim.forces.bias_forces())
        sim.step()
        errors.append(np.abs(expected - sim.qdd)[:-1].max())  # but for the servo of the pole
    assert errors[0] < 0.05
    assert errors[1] < 0.6 * errors[0]


TENDONS = """
<mujoco>
  <worldbody>
    <site name="high" pos="0.5 0.2 0.3"/>
    <body name="a" pos="0 0 0">
      <joint name="a" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.05"/>
      <site name="low" pos="0.05 0 -0.4"/>
      <body name="b" pos="0 0 -0.5"><joint name="b" axis="1 1 0"/><geom size="0.1" pos="0 0 -0.2"/>
        <site name="end" pos="0.1 0 -0.3"/></body>
    </body>
  </worldbody>
  <tendon>
    <fixed name="both" armature="0.3"><joint joint="a" coef="2"/><joint joint="b" coef="-1"/></fixed>
    <spatial name="rope" armature="0.7"><site site="high"/><site site="low"/><site site="end"/></spatial>
  </tendon>
</mujoco>
"""


# Breaks when the line of a tendon over qd is not MuJoCo's, or its armature is left out of M or of c.
def test_tendons_in_the_equations_of_motion(mujoco, tmp_path):
    path = tmp_path / "tendons.xml"
    path.write_text(TENDONS)
    model, m = amontons.load_model(path), mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    sim = Simulation(model)
    for seed in range(3):
        random_state(mujoco, m, d, seed)
        sim.q, sim.qd = d.qpos, d.qvel
        M = np.zeros((m.nv, m.nv))
        mujoco.mj_fullM(m, d, M)
        for t in range(m.ntendon):
            rate = d.ten_velocity[t]
            assert sim.kinematics.tendon_jacobian(t) @ sim.qd == pytest.approx(rate, abs=1e-12)
        np.testing.assert_allclose(sim.forces.mass_matrix(), M, atol=1e-12)
        np.testing.assert_allclose(sim.forces.bias_forces(), d.qfrc_bias, atol=1e-9)


ROBOTS = [
    "gymnasium/ant", "gymnasium/humanoid", "gymnasium/walker2d_v5", "dm_suite/quadruped", "dm_suite/fish",
    "dm_suite/manipulator", "dm_walkers/humanoid_CMU_V2020", "car/car", "shadow_hand/scene_right",
    "ufactory_xarm7/scene", "unitree_go1/scene",
]  # fmt: skip


# Breaks when coordinates or equations of motion of models that others made are not MuJoCo's.
@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_robots_in_coordinates(mujoco, name):
    path = robot_file(name)
    model, m = amontons.load_model(path), mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    random_state(mujoco, m, d, 4)
    sim = Simulation(model)
    sim.q, sim.qd = d.qpos, d.qvel
    d.qpos[:], d.qvel[:] = sim.q, sim.qd  # with what is coupled closed
    mujoco.mj_forward(m, d)
    M, scale = np.zeros((m.nv, m.nv)), np.abs(d.qfrc_bias).max()
    mujoco.mj_fullM(m, d, M)
    np.testing.assert_allclose(sim.forces.mass_matrix(), M, atol=1e-10 * np.abs(M).max())
    np.testing.assert_allclose(sim.forces.bias_forces(), d.qfrc_bias, atol=1e-10 * max(scale, 1.0))
    for i, body in enumerate(model.body_names):
        b = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, body)
        if b < 0 or model.bodies[i].motion != "dynamic":
            continue
        np.testing.assert_allclose(sim.state.positions[i], d.xpos[b], atol=1e-12)
        Jp, Jr = np.zeros((3, m.nv)), np.zeros((3, m.nv))
        mujoco.mj_jacBody(m, d, Jp, Jr, b)
        np.testing.assert_allclose(sim.kinematics.jacobian(i), np.vstack([Jp, Jr]), atol=1e-11)
