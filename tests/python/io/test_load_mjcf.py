"""MJCF files against MuJoCo: the same bodies, joints, forces and contacts; everything else is told."""

import math
import pickle
import warnings
from dataclasses import replace

import amontons
import numpy as np
import pytest
from amontons import InputError, shapes
from amontons.io.models import load_model
from amontons.model.transforms import Transform, axis_angle, rotate, rotation_matrix, subtract
from mjcf import index, load, mujoco
from scipy.spatial import ConvexHull

# Positions come from other products of the same rotations than MuJoCo's: a few roundings apart.
ROUNDING = 1e-13


@pytest.fixture(scope="module")
def arm(root):
    return root / "tests" / "python" / "io" / "models" / "arm.xml"


def about_origin(mass, centre, inertia):
    """The inertia about the origin of the frame in which all is given: what adds up over parts."""
    c = np.asarray(centre)
    return np.asarray(inertia) + mass * (c @ c * np.eye(3) - np.outer(c, c))


def chain(joint, q):
    """The pose of frame A in frame B: a product of exponentials in the order of the dofs."""
    pose = Transform()
    for dof, x in zip(joint.dofs, q, strict=True):
        if dof.kind == "slide":
            pose = pose @ Transform(tuple(x * np.array(dof.axis)))
        else:
            turn = axis_angle(dof.axis, x)
            pose = pose @ Transform(subtract(dof.anchor, rotate(turn, dof.anchor)), turn)
    return pose


# Breaks when a mass, centre, inertia or initial pose is not that of MuJoCo's compiler, or a name is lost.
def test_bodies_are_those_of_mujoco(arm):
    model, m = load_model(arm), mujoco.MjModel.from_xml_path(str(arm))
    d = mujoco.MjData(m)
    mujoco.mj_kinematics(m, d)
    names = [m.body(i).name for i in range(1, m.nbody)]
    moves = [m.body_weldid[i] != 0 for i in range(1, m.nbody)]
    parts = [k and not m.body_jntnum[i + 1] and m.body_mocapid[i + 1] < 0 for i, k in enumerate(moves)]
    assert model.body_names == tuple(n for n, part in zip(names, parts, strict=True) if not part)
    assert tuple(link.name for link in model.links) == tuple(np.array(names)[parts])
    assert {"sensor_mount", "marker"} <= {link.name for link in model.links}
    whole = {link.body for link in model.links}
    for thing in (*model.links, *(b for k, b in enumerate(model.bodies) if k not in whole)):
        i = index(m, thing.name)
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, m.body_iquat[i])
        R = R.reshape(3, 3)
        assert thing.mass == pytest.approx(m.body_mass[i], rel=1e-14)
        np.testing.assert_allclose(thing.centre_of_mass, m.body_ipos[i], atol=ROUNDING)
        inertia = R @ np.diag(m.body_inertia[i]) @ R.T
        np.testing.assert_allclose(thing.inertia, inertia, atol=ROUNDING * max(inertia.max(), 1e-9))
    for body in model.bodies:
        i = index(m, body.name)
        np.testing.assert_allclose(body.pose.position, d.xpos[i], atol=ROUNDING)
        np.testing.assert_allclose(
            rotation_matrix(body.pose.rotation), d.xmat[i].reshape(3, 3), atol=ROUNDING
        )
    motions = dict(zip(model.body_names, (b.motion for b in model.bodies), strict=True))
    assert {n for n, k in motions.items() if k == "static"} == {"table", "base"}
    assert {n for n, k in motions.items() if k == "kinematic"} == {"target"}
    moving = [i for i in range(1, m.nbody) if m.body_weldid[i] and m.body_mocapid[i] < 0]
    assert model.total_mass == pytest.approx(m.body_mass[moving].sum(), rel=1e-13)
    assert model.gravity == (0.0, 0.0, -9.8)


# Breaks when an axis, an anchor, a reference or the order of several joints of a body is not MuJoCo's.
def test_kinematics_are_those_of_mujoco(arm):
    model, m = load_model(arm), mujoco.MjModel.from_xml_path(str(arm))
    d = mujoco.MjData(m)
    rng = np.random.default_rng(0)
    for _ in range(20):
        d.qpos[:] = m.qpos0
        scalar = [j for j in range(m.njnt) if m.jnt_type[j] >= 2]
        for j in scalar:
            d.qpos[m.jnt_qposadr[j]] = rng.uniform(-1, 1)
        wrist = m.jnt_qposadr[index(m, "wrist", "joint")]
        ball = rng.normal(size=4)
        d.qpos[wrist : wrist + 4] = ball / np.linalg.norm(ball)
        mujoco.mj_kinematics(m, d)
        world = {n: Transform(tuple(d.xpos[i]), tuple(d.xquat[i])) for i, n in enumerate(map(
            lambda i: m.body(i).name, range(m.nbody)))}  # fmt: skip
        for joint in model.joints[:-2]:  # the last two close loops
            a = world[model.body_names[joint.body_a]]
            b = world[model.body_names[joint.body_b]] if joint.body_b >= 0 else Transform()
            names = joint.name.split("+") if joint.dofs else []
            q = [d.qpos[m.jnt_qposadr[index(m, n, "joint")]] for n in names]
            expected = b @ joint.frame_b @ chain(joint, q)
            got = a @ joint.frame_a
            np.testing.assert_allclose(got.position, expected.position, atol=ROUNDING)
            if joint.spherical:
                expected = expected @ Transform((0, 0, 0), tuple(d.qpos[wrist : wrist + 4]))
            np.testing.assert_allclose(
                rotation_matrix(got.rotation), rotation_matrix(expected.rotation), atol=ROUNDING
            )


# Breaks when the engine finds other coordinates in a pose than MuJoCo's qpos, or a keyframe is not applied.
def test_coordinates_are_qpos(arm):
    model, m = load_model(arm), mujoco.MjModel.from_xml_path(str(arm))
    key = model.keyframes[model.keyframe_index("home")]
    placed = [
        replace(body, pose=Transform(p, q))
        for body, p, q in zip(model.bodies, key.positions, key.orientations, strict=True)
    ]
    coordinates = amontons.Simulation(replace(model, bodies=tuple(placed))).state.joint_coordinates
    for name in ("yaw", "shoulder", "gear_a", "gear_b", "rocker"):
        q = m.key_qpos[0][m.jnt_qposadr[index(m, name, "joint")]]
        assert coordinates[model.dof_index(name)] == pytest.approx(q, abs=1e-9)
    for k, name in enumerate(("elbow", "reach", "roll")):
        q = m.key_qpos[0][m.jnt_qposadr[index(m, name, "joint")]]
        assert coordinates[model.dof_index("elbow+reach+roll", k)] == pytest.approx(q, abs=1e-9)
    assert coordinates == pytest.approx(key.joint_coordinates, abs=1e-9)


# Breaks when velocities of a keyframe are not the rates of its poses. Central differences: error O(h^2).
def test_keyframe_velocities(arm):
    model, m = load_model(arm), mujoco.MjModel.from_xml_path(str(arm))
    h = 1e-6
    poses = []
    for sign in (-1, 1):
        d = mujoco.MjData(m)
        mujoco.mj_resetDataKeyframe(m, d, 0)
        mujoco.mj_integratePos(m, d.qpos, m.key_qvel[0], sign * h)
        mujoco.mj_kinematics(m, d)
        poses.append((d.xpos.copy(), d.xmat.reshape(-1, 3, 3).copy()))
    key = model.keyframes[model.keyframe_index("home")]
    for k, name in enumerate(model.body_names):
        i = index(m, name)
        v = (poses[1][0][i] - poses[0][0][i]) / (2 * h)
        W = (poses[1][1][i] - poses[0][1][i]) @ ((poses[0][1][i] + poses[1][1][i]) / 2).T / (2 * h)
        np.testing.assert_allclose(key.linear_velocities[k], v, atol=1e-8)
        np.testing.assert_allclose(key.angular_velocities[k], [W[2, 1], W[0, 2], W[1, 0]], atol=1e-8)
    assert model.keyframes[model.keyframe_index("key_1")].time == 1.5
    sim = amontons.Simulation(model)
    sim.apply_keyframe("home")
    np.testing.assert_array_equal(sim.state.positions, key.positions)
    np.testing.assert_array_equal(sim.state.angular_velocities, key.angular_velocities)
    np.testing.assert_array_equal(sim.state.joint_coordinates, key.joint_coordinates)
    with pytest.raises(InputError, match='no keyframe "away"; known are home, key_1'):
        sim.apply_keyframe("away")


# Breaks when a limit, spring, damper or friction of a joint is lost or in other units.
def test_joint_parameters(arm):
    model = load_model(arm)
    shoulder = model.joints[model.joint_index("shoulder")].dofs[0]
    assert shoulder.lower == pytest.approx(math.radians(-120))
    assert shoulder.upper == pytest.approx(math.radians(120))
    assert (shoulder.stiffness, shoulder.damping, shoulder.friction, shoulder.armature) == (4, 0.1, 0.3, 0.02)
    assert shoulder.rest == pytest.approx(math.radians(35))
    elbow, reach, roll = model.joints[model.joint_index("elbow+reach+roll")].dofs
    assert (reach.kind, reach.lower, reach.upper, reach.damping) == ("slide", -0.05, 0.1, 3)
    assert (elbow.kind, roll.kind, roll.upper) == ("hinge", "hinge", math.inf)
    wrist = model.joints[model.joint_index("wrist")]
    assert wrist.spherical
    assert (wrist.ball_stiffness, wrist.ball_damping) == (0.5, 0.1)
    assert wrist.ball_limit == pytest.approx(math.radians(60))
    assert all(joint.collide for joint in model.joints)
    with pytest.raises(
        InputError, match='"sensor_mount_fixed" fixes the link "sensor_mount".*link_reactions'
    ):
        model.joint_index("sensor_mount_fixed")


# Breaks when the motor of an actuator gives another effort than MuJoCo's, or limits are not kept.
def test_actuators_push_like_mujoco(arm):
    model, m = load_model(arm), mujoco.MjModel.from_xml_path(str(arm))
    d = mujoco.MjData(m)
    rng = np.random.default_rng(1)
    for _ in range(50):
        d.qpos[:], d.qvel[:] = m.key_qpos[0], rng.normal(size=m.nv)
        d.ctrl[:] = rng.normal(scale=2, size=m.nu)
        mujoco.mj_forward(m, d)
        for actuator in model.actuators:
            name, gear = actuator.name, actuator.transmission.gear
            j = index(m, name, "joint")
            state = np.array([1, gear * d.qpos[m.jnt_qposadr[j]], gear * d.qvel[m.jnt_dofadr[j]]])
            u = actuator.clipped(d.ctrl[index(m, name, "actuator")])
            effort = np.dot(actuator.gain, state) * u + np.dot(actuator.bias, state)
            effort = gear * min(max(effort, actuator.lower_force), actuator.upper_force)
            assert effort == pytest.approx(d.qfrc_actuator[m.jnt_dofadr[j]], rel=1e-12, abs=1e-12)
    shoulder = model.actuators[model.actuator_index("shoulder")]
    assert shoulder.upper_force * abs(shoulder.transmission.gear) == 40
    sim = amontons.Simulation(model)
    sim.set_control("yaw", 7.0)
    assert sim.controls[0] == 0.5  # the end of the control's range
    with pytest.raises(InputError, match='no control "tail"; known are yaw, shoulder'):
        sim.set_control("tail", 0)


# Breaks when an equality does not hold where MuJoCo's does: its residual is the same function of the pose.
def test_equalities(arm):
    model, m = load_model(arm), mujoco.MjModel.from_xml_path(str(arm))
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, 0)
    mujoco.mj_forward(m, d)
    key = model.keyframes[model.keyframe_index("home")]
    (coupling,) = model.couplings
    q = key.joint_coordinates[model.dof_index(coupling.joint_b, coupling.dof_b)]
    y = key.joint_coordinates[model.dof_index(coupling.joint_a, coupling.dof_a)]
    rows = [d.efc_pos[(d.efc_type == 0) & (d.efc_id == e)] for e in range(3)]
    assert y - sum(c * q**k for k, c in enumerate(coupling.coefficients)) == pytest.approx(rows[0][0])
    for e, name in ((1, "loop"), (2, "dock")):
        joint = model.joints[model.joint_index(name)]
        ends = []
        for body, frame in ((joint.body_a, joint.frame_a), (joint.body_b, joint.frame_b)):
            ends.append(Transform(key.positions[body], key.orientations[body]) @ frame)
        gap = np.subtract(ends[0].position, ends[1].position)
        assert np.linalg.norm(gap) == pytest.approx(np.linalg.norm(rows[e][:3]))
        relative = ends[0].inverse() @ ends[1]
        if name == "dock":  # torquescale 1: the vector part of the relative quaternion
            assert np.linalg.norm(relative.rotation[1:]) == pytest.approx(np.linalg.norm(rows[e][3:]))
    assert model.joints[model.joint_index("loop")].spherical


# Breaks when relpose or anchor of a weld are taken in the wrong body.
@pytest.mark.parametrize(
    "attributes",
    ['relpose="0.1 0.2 0.3 0.8 0 0.6 0" anchor="0.3 0.1 0"', 'anchor="0.5 0 0.2"', 'relpose="1 2 3 1 0 0 0"'],
)
def test_weld_poses(tmp_path, attributes):
    bodies = """<body name="a" pos="0 0 1" euler="10 20 30"><freejoint/><geom size="0.1"/></body>
    <body name="b" pos="1 0 1" euler="-40 0 5"><freejoint/><geom size="0.1"/></body>"""
    tail = f'<equality><weld body1="a" body2="b" {attributes}/></equality>'
    model, m = load(tmp_path, bodies, tail=tail)
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    (joint,) = model.joints
    ends = [
        model.bodies[b].pose @ f for b, f in ((joint.body_a, joint.frame_a), (joint.body_b, joint.frame_b))
    ]
    gap = np.subtract(ends[0].position, ends[1].position)
    assert np.linalg.norm(gap) == pytest.approx(np.linalg.norm(d.efc_pos[:3]), abs=1e-12)
    turn = (ends[0].inverse() @ ends[1]).rotation
    assert np.linalg.norm(turn[1:]) == pytest.approx(np.linalg.norm(d.efc_pos[3:6]), abs=1e-9)


# Breaks when a shape has another size or place than MuJoCo's geom, or the hull of a mesh keeps its dent.
def test_geoms_are_those_of_mujoco(arm):
    model, m = load_model(arm), mujoco.MjModel.from_xml_path(str(arm))
    d = mujoco.MjData(m)
    mujoco.mj_kinematics(m, d)
    kinds = {
        0: shapes.Plane, 1: shapes.HeightField, 2: shapes.Sphere, 3: shapes.Capsule, 4: shapes.Ellipsoid,
        5: shapes.Cylinder, 6: shapes.Box, 7: shapes.Hull,
    }  # fmt: skip
    assert len(model.geoms) == m.ngeom
    for g, geom in enumerate(model.geoms):
        assert isinstance(geom.shape, kinds[m.geom_type[g]])
        body = model.bodies[geom.body].pose if geom.body >= 0 else Transform()
        pose = body @ geom.frame
        np.testing.assert_allclose(pose.position, d.geom_xpos[g], atol=ROUNDING)
        np.testing.assert_allclose(
            rotation_matrix(pose.rotation), d.geom_xmat[g].reshape(3, 3), atol=ROUNDING
        )
        size = m.geom_size[g]
        match geom.shape:
            case shapes.Sphere(radius):
                assert radius == size[0]
            case shapes.Capsule(radius, half) | shapes.Cylinder(radius, half):
                assert (radius, half) == tuple(size[:2])
            case shapes.Box(sizes) | shapes.Ellipsoid(sizes):
                assert sizes == tuple(size)
    step = model.geoms[model.geom_index("step")]
    world = [step.frame(v) for v in step.shape.vertices]
    corners = 0.1 * np.array(
        [[-1, -1, -0.5], [1, -1, -0.5], [1, 1, -0.5], [-1, 1, -0.5], [-1, -1, 0.5], [-1, 1, 0.5]]
    )
    corners = corners + [-2, 0, 0.1]
    order = [sorted(map(tuple, np.round(points, 6))) for points in (world, corners)]  # meshes are float32
    np.testing.assert_allclose(*order, atol=1e-6)
    assert ConvexHull(world).volume == pytest.approx(ConvexHull(corners).volume, rel=1e-5)


# Breaks when rows or columns of a height field are swapped or turned over. MuJoCo casts a ray down each node.
def test_height_field(arm):
    model, m = load_model(arm), mujoco.MjModel.from_xml_path(str(arm))
    d = mujoco.MjData(m)
    mujoco.mj_kinematics(m, d)
    geom = model.geoms[model.geom_index("hills")]
    rows, columns = geom.shape.heights.shape
    hit = np.zeros(1, dtype=np.int32)
    for r in range(rows):
        for c in range(columns):
            x = (c / (columns - 1) - 0.5) * geom.shape.size_x
            y = (r / (rows - 1) - 0.5) * geom.shape.size_y
            inside = 1 - 1e-6
            start = np.add(geom.frame.position, (inside * x, inside * y, 5.0))
            distance = mujoco.mj_ray(m, d, start, np.array([0, 0, -1.0]), None, 1, -1, hit)
            assert hit[0] == m.geom("hills").id
            assert 5.0 - distance == pytest.approx(geom.shape.heights[r, c], abs=1e-4)


# Breaks when a switch of <flag> is not obeyed.
def test_flags(tmp_path):
    body = """<geom type="plane" size="1 1 1"/><body name="b" pos="0 0 1">
    <joint name="h" range="-10 10" stiffness="3" damping="2" frictionloss="1"/><geom size="0.1"/></body>"""
    tail = """<equality><joint joint1="h"/></equality>
    <actuator><motor name="m" joint="h" ctrlrange="-1 1"/></actuator>"""
    flags = (
        "limit",
        "spring",
        "damper",
        "frictionloss",
        "contact",
        "gravity",
        "actuation",
        "equality",
        "clampctrl",
    )

    def facts(model):
        dof = model.joints[0].dofs[0]
        upper = model.actuators[0].upper_control if model.actuators else None
        return {
            "limit": dof.upper, "spring": dof.stiffness, "damper": dof.damping, "frictionloss": dof.friction,
            "contact": model.geoms[1].mask, "gravity": model.gravity, "actuation": model.actuator_names,
            "equality": len(model.couplings), "clampctrl": upper,
        }  # fmt: skip

    on = facts(load(tmp_path, body, tail=tail)[0])
    off = {
        "limit": math.inf, "spring": 0, "damper": 0, "frictionloss": 0, "contact": 0, "gravity": (0, 0, 0),
        "actuation": (), "equality": 0, "clampctrl": math.inf,
    }  # fmt: skip
    for flag in flags:
        head = f'<option><flag {flag}="disable"/></option>'
        changed = facts(load(tmp_path, body, tail=tail, head=head)[0])
        same = {"actuation": "clampctrl"}.get(flag)  # no actuator, no limits of its control
        for other in flags:
            if other != same:
                assert changed[other] == (off if other == flag else on)[other], (flag, other)


# Breaks when mass is lost where bodies without joints cannot be bodies of their own.
def test_bodies_that_merge(tmp_path):
    body = """<body name="lever"><joint/>
      <body name="weight" pos="1 0 0" euler="0 0 30"><geom type="box" size="0.1 0.2 0.3" mass="2"/>
        <body name="point" pos="0 1 0"><inertial pos="0 0 0.5" mass="1" diaginertia="0 0 0"/></body>
        <body name="tip" pos="0 0 1"><joint axis="1 0 0"/><geom size="0.1" mass="0.5"/></body>
      </body></body>"""
    model, m = load(tmp_path, body)
    assert model.body_names == ("lever", "tip")  # a lever without mass is one with what is fixed to it
    assert model.bodies[0].mass == pytest.approx(3)
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    expected, centre = np.zeros((3, 3)), np.zeros(3)
    for i in (2, 3):
        R = d.ximat[i].reshape(3, 3)
        expected += about_origin(m.body_mass[i], d.xipos[i], R @ np.diag(m.body_inertia[i]) @ R.T)
        centre += m.body_mass[i] * d.xipos[i] / 3
    lever = model.bodies[0]
    np.testing.assert_allclose(lever.centre_of_mass, centre, atol=ROUNDING)
    np.testing.assert_allclose(about_origin(3, lever.centre_of_mass, lever.inertia), expected, atol=1e-12)
    tip = model.joints[model.joint_index("tip_joint")]
    np.testing.assert_allclose(tip.frame_b.position, d.xpos[4], atol=ROUNDING)


# Breaks when a keyframe does not put a free joint with a damper, three slides and a ball here, where MuJoCo
# puts it, or coordinates and bodies disagree there.
def test_keyframe_of_a_damped_free_joint(tmp_path):
    body = '<body name="b" pos="0 0 1"><joint type="free" damping="1"/><geom size="0.1"/></body>'
    key = '<keyframe><key name="k" qpos="1 2 3 0.6 0.8 0 0" qvel="1 2 3 0.1 0.2 0.3"/></keyframe>'
    model, m = load(tmp_path, body, tail=key)
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, 0)
    sim = amontons.Simulation(model)
    sim.apply_keyframe("k")
    np.testing.assert_allclose(sim.state.positions[0], d.qpos[:3])
    np.testing.assert_allclose(sim.q, d.qpos, atol=1e-12)
    np.testing.assert_allclose(sim.qd, d.qvel, atol=1e-12)
    np.testing.assert_allclose(sim.state.joint_coordinates, d.qpos[:3])


# Breaks when the whole fixture warns, or a model can not be pickled, saved or restored with what it carries.
def test_model_keeps_its_presets(arm):
    with warnings.catch_warnings(action="error"):
        warnings.filterwarnings("ignore", message="(?s).*its convex hull collides")
        model = load_model(arm)
    again = pickle.loads(pickle.dumps(model))
    assert again == model
    assert again.keyframes == model.keyframes
    assert again.actuators == model.actuators
