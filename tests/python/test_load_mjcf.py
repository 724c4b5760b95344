"""MJCF files against MuJoCo: the same bodies, joints, forces and contacts; everything else is told."""

import math
import pickle
import warnings
from dataclasses import replace
from itertools import combinations, product

import amontons
import numpy as np
import pytest
from amontons import InputError, shapes
from amontons.io.models import load_model
from amontons.model.transforms import Transform, axis_angle, rotate, rotation_matrix, subtract
from scipy.integrate import quad
from scipy.spatial import ConvexHull

mujoco = pytest.importorskip("mujoco")

# Positions come from other products of the same rotations than MuJoCo's: a few roundings apart.
ROUNDING = 1e-13


@pytest.fixture(scope="module")
def arm(root):
    return root / "tests" / "python" / "models" / "arm.xml"


def load(tmp_path, body, *, head="", tail="", **options):
    path = tmp_path / "model.xml"
    path.write_text(f"<mujoco>\n{head}\n<worldbody>\n{body}\n</worldbody>\n{tail}\n</mujoco>\n")
    return load_model(path, **options), mujoco.MjModel.from_xml_path(str(path))


def index(model, name, kind="body"):
    return mujoco.mj_name2id(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name)


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
    massless = "marker"  # part of sensor_mount
    names = [m.body(i).name for i in range(1, m.nbody)]
    assert model.body_names == tuple(n for n in names if n != massless)
    for body in model.bodies:
        i = index(m, body.name)
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, m.body_iquat[i])
        R = R.reshape(3, 3)
        assert body.mass == pytest.approx(m.body_mass[i], rel=1e-14)
        np.testing.assert_allclose(body.centre_of_mass, m.body_ipos[i], atol=ROUNDING)
        inertia = R @ np.diag(m.body_inertia[i]) @ R.T
        np.testing.assert_allclose(body.inertia, inertia, atol=ROUNDING * max(inertia.max(), 1e-9))
        np.testing.assert_allclose(body.pose.position, d.xpos[i], atol=ROUNDING)
        np.testing.assert_allclose(
            rotation_matrix(body.pose.rotation), d.xmat[i].reshape(3, 3), atol=ROUNDING
        )
    motions = dict(zip(model.body_names, (b.motion for b in model.bodies), strict=True))
    assert {n for n, k in motions.items() if k == "fixed"} == {"table", "base"}
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
    key = model.keyframes["home"]
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
    key = model.keyframes["home"]
    for k, name in enumerate(model.body_names):
        i = index(m, name)
        v = (poses[1][0][i] - poses[0][0][i]) / (2 * h)
        W = (poses[1][1][i] - poses[0][1][i]) @ ((poses[0][1][i] + poses[1][1][i]) / 2).T / (2 * h)
        np.testing.assert_allclose(key.linear_velocities[k], v, atol=1e-8)
        np.testing.assert_allclose(key.angular_velocities[k], [W[2, 1], W[0, 2], W[1, 0]], atol=1e-8)
    assert model.keyframes["key_1"].time == 1.5
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
    assert model.joints[model.joint_index("sensor_mount_fixed")].dofs == ()


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
    with pytest.raises(InputError, match='no actuator "tail"; known are yaw, shoulder'):
        sim.set_control("tail", 0)


# Breaks when an equality does not hold where MuJoCo's does: its residual is the same function of the pose.
def test_equalities(arm):
    model, m = load_model(arm), mujoco.MjModel.from_xml_path(str(arm))
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, 0)
    mujoco.mj_forward(m, d)
    key = model.keyframes["home"]
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


TOUCHING = """
<geom name="w0" size="1"/>
<body name="s"><geom name="s0" size="1"/><body name="t"><geom name="t0" size="1"/></body>
  <body name="arm"><joint/><geom name="arm0" size="1"/>
    <geom name="arm1" size="1" contype="2" conaffinity="4"/>
    <body name="tool"><geom name="tool0" size="1" contype="4" conaffinity="0"/>
      <body name="finger"><joint axis="1 0 0"/><geom name="finger0" size="1"/>
        <body name="nail"><joint axis="0 1 0"/>
          <geom name="nail0" size="1" contype="0" conaffinity="3"/></body>
      </body>
    </body>
  </body>
</body>
<body name="free"><freejoint/><geom name="free0" size="1" contype="5" conaffinity="2"/></body>
<body name="mocap" mocap="true"><geom name="mocap0" size="1"/>
  <body name="hung"><joint/><geom name="hung0" size="1"/></body></body>
<body name="hermit"><freejoint/><geom name="hermit0" size="1" contype="0" conaffinity="0"/></body>
"""
FILTERS = """<contact><exclude body1="free" body2="arm"/><exclude body1="world" body2="nail"/>
<pair geom1="hermit0" geom2="w0"/><pair geom1="hermit0" geom2="mocap0"/></contact>"""


def touching(model):
    """Names and materials of the pairs of geoms that may touch."""
    for a, b in combinations(range(len(model.geoms)), 2):
        if model.core.may_touch(a, b):
            yield tuple(sorted((model.geom_names[a], model.geom_names[b]))), model.core.material(a, b)


# Breaks when a filter lets other pairs touch than MuJoCo's: all geoms overlap, so every allowed pair has
# contacts there. The base, which is fixed, does not touch the link that a joint joins to
# it; there MuJoCo has contacts.
@pytest.mark.parametrize("flag", ["", '<option><flag filterparent="disable"/></option>'])
def test_contact_filters_are_those_of_mujoco(tmp_path, flag):
    model, m = load(tmp_path, TOUCHING, head=flag, tail=FILTERS, self_overlaps=True)
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    expected = {tuple(sorted(m.geom(g).name for g in pair)) for pair in d.contact.geom}
    if not flag:
        expected -= set(product(("arm0", "arm1"), ("s0", "t0")))
    found = {names for names, _ in touching(model)}
    assert found == expected
    assert ("hermit0", "w0") in found


# Breaks when the friction of a pair is not the one MuJoCo combines from priority, condim and <pair>.
def test_friction_is_that_of_mujoco(tmp_path):
    kinds = [(0.3, 3, 0), (0.8, 3, 0), (0.5, 1, 0), (0.9, 1, 0), (0.2, 3, 1), (0.7, 1, 1), (0.6, 3, 2)]
    bodies = "".join(
        f'<body><freejoint/><geom name="g{i}" size="1" friction="{mu}" condim="{dim}" priority="{p}"/></body>'
        for i, (mu, dim, p) in enumerate(kinds)
    )
    tail = '<contact><pair geom1="g0" geom2="g1" friction="0.05"/>'
    tail += '<pair geom1="g1" geom2="g4" condim="1"/></contact>'
    model, m = load(tmp_path, bodies, tail=tail)
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    expected = {}
    for contact in d.contact:
        key = tuple(sorted(m.geom(g).name for g in contact.geom))
        expected[key] = 0.0 if contact.dim == 1 else contact.friction[0]
    found = {names: material.friction for names, material in touching(model)}
    assert found == pytest.approx(expected)
    assert len(found) == 21


# Breaks when a crowd of frictionless geoms gets a material per pair, of which there are thousands, or another
# friction among each other or with the floor.
def test_a_crowd_without_friction_has_no_pairs(tmp_path):
    balls = "".join(
        f'<body pos="{i} 0 1"><freejoint/><geom size="0.1" condim="1"/></body>' for i in range(60)
    )
    model, _ = load(tmp_path, '<geom type="plane" size="1 1 1"/>' + balls)
    assert model.pair_materials == ()
    assert coefficients(model, 1, 2)[0] == 0.0
    assert coefficients(model, 0, 1)[0] == 1.0


def coefficients(model, a, b):
    """Sliding, torsional and rolling friction of two geoms: those of the pair, or the larger ones."""
    for pair in model.pair_materials:
        if {pair.geom_a, pair.geom_b} == {a, b}:
            m = pair.material
            return m.friction, m.torsional_friction, m.rolling_friction
    both = [model.geoms[g].material for g in (a, b)]
    return tuple(max(getattr(m, f"{name}friction") for m in both) for name in ("", "torsional_", "rolling_"))


# Breaks when torsional or rolling friction of a pair is not the one that MuJoCo combines. MuJoCo names the
# contact of each pair when the two are put over each other; condim says which of the numbers count.
def test_moments_are_those_of_mujoco(root):
    path = root / "tests" / "python" / "models" / "condim.xml"
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # condim 4 and 6 are supported
        model = load_model(path)
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    d.qpos[1::7] = 0  # all balls at one place
    mujoco.mj_forward(m, d)
    seen = set()
    for contact in d.contact:
        a, b = sorted(model.geom_index(m.geom(g).name) for g in contact.geom)
        slide, _, torsion, roll, _ = contact.friction
        expected = [0.0 if contact.dim < needed else x for x, needed in ((slide, 3), (torsion, 4), (roll, 6))]
        assert coefficients(model, a, b) == pytest.approx(expected), (a, b)
        seen.add((a, b))
    assert len(seen) == 7 + 21
    assert [g.material.rolling_friction for g in model.geoms] == [0, 0, 0, 0, 0.002, 0, 0, 0.002]


# Breaks when a moment has another unit, arm or direction than in MuJoCo, whose contacts are soft and whose
# friction creeps by some per cent. A rolling ball loses 5/7 g mu_r / R (the floor's mu_r = 0.003 counts), in
# the elliptic cone less by the force that it takes beside the moment: relative changes of the order of
# (mu_r / mu R)^2 = 3e-3. One that spins loses mu_t m g / I.
def test_ball_rolls_to_rest_as_in_mujoco(root):
    path = root / "tests" / "python" / "models" / "condim.xml"
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    first = m.jnt_dofadr[m.body("rolls").jntadr[0]]
    spinning = m.jnt_dofadr[m.body("spins").jntadr[0]]
    sim = amontons.Simulation(load_model(path), dt=5e-3)
    roll, spin = (sim.model.body_index(name) for name in ("rolls", "spins"))
    d.qvel[first], d.qvel[first + 4], d.qvel[spinning + 5] = 1.0, 10.0, 20.0
    sim.state.linear_velocities[roll] = (1, 0, 0)
    sim.state.angular_velocities[roll], sim.state.angular_velocities[spin] = (0, 10, 0), (0, 0, 20)
    while d.time < 1.0:
        mujoco.mj_step(m, d)
    sim.run(1.0)
    ours = 1.0 - sim.state.linear_velocities[roll, 0], 20.0 - sim.state.angular_velocities[spin, 2]
    assert ours == pytest.approx((5 / 7 * 9.81 * 0.003 / 0.1, 0.004 * 9.81 / (0.4 * 0.01)), rel=3e-3)
    assert ours == pytest.approx((1.0 - d.qvel[first], 20.0 - d.qvel[spinning + 5]), rel=0.05)


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


PENDULUM = """<option timestep="1e-4" integrator="RK4"/><compiler angle="radian"/>"""


# Breaks when a pendulum from a file has another period. T = 4 sqrt(I / (m g l)) K(sin(q0 / 2)), the integral
# done numerically; a first-order step of h misses the time of a turn by O(h), here below 2 h.
def test_pendulum_period(tmp_path):
    body = """<body pos="0 0 2"><joint name="q" axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 -0.2 0 0 -1" size="0.05"/></body>"""
    model, m = load(tmp_path, body, head=PENDULUM, tail='<keyframe><key name="k" qpos="1.2"/></keyframe>')
    length = -m.body_ipos[1, 2]
    moment = m.body_inertia[1, 1] + m.body_mass[1] * length**2
    k2 = math.sin(0.6) ** 2
    integral = quad(lambda x: 1 / math.sqrt(1 - k2 * math.sin(x) ** 2), 0, math.pi / 2)[0]
    period = 4 * integral * math.sqrt(moment / (m.body_mass[1] * 9.81 * length))
    h = 1e-3
    sim = amontons.Simulation(model, dt=h, tolerance=1e-10)
    sim.apply_keyframe("k")
    turns, before = [], sim.coordinate("q")
    while len(turns) < 2:
        sim.step()
        now = sim.coordinate("q")
        if before > 0 >= now:
            turns.append(sim.time - h * now / (now - before))
        before = now
    assert turns[1] - turns[0] == pytest.approx(period, abs=2 * h)


TWO_LINKS = """<body name="upper" pos="0 0 2" euler="0 0 0.3"><joint name="a" axis="0 1 0" {a}/>
<geom type="capsule" fromto="0 0 0 0.1 0 -0.6" size="0.04"/>
<body name="lower" pos="0.1 0 -0.6"><joint name="b" axis="0.3 1 0" {b}/>
<geom type="box" size="0.05 0.04 0.25" pos="0 0 -0.25"/></body></body>"""


# Breaks when two links swing otherwise than in MuJoCo with a tiny step: joints, inertias, springs, dampers,
# armature, or the servo differ. The error of our step is first order: halving h halves it.
@pytest.mark.parametrize(
    ("a", "b", "tail"),
    [
        ("", "", ""),
        ('damping="0.4" armature="0.02"', 'damping="0.2" stiffness="3" springref="0.4" ref="0.2"', ""),
        ('damping="0.1"', 'damping="0.1"', '<actuator><position joint="b" kp="20" kv="1" gear="2"/>'
         '<motor joint="a" gear="3"/></actuator>'),
    ],
    ids=["free", "springs", "driven"],
)  # fmt: skip
def test_two_links_move_like_mujoco(tmp_path, a, b, tail):
    controls = 'ctrl="0.8 0.5"' if tail else ""
    key = f'<keyframe><key name="k" qpos="1.0 0.6" {controls}/></keyframe>'
    model, m = load(tmp_path, TWO_LINKS.format(a=a, b=b), head=PENDULUM, tail=tail + key)
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, 0)
    while d.time < 0.5 - 1e-9:
        mujoco.mj_step(m, d)
    errors = []
    for h in (2e-3, 1e-3):
        sim = amontons.Simulation(model, dt=h, tolerance=1e-10)
        sim.apply_keyframe("k")
        sim.run(0.5)
        errors.append(np.abs(sim.state.joint_coordinates - d.qpos).max())
    assert errors[1] < 0.01
    assert errors[1] < 0.6 * errors[0]


# Breaks when a mocap body stops where it should move, or what is welded to it stays behind.
def test_mocap_pulls(tmp_path):
    body = """<body name="hand" mocap="true" pos="0 0 1"><geom size="0.1"/></body>
    <body name="box" pos="0 0 0.5"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>"""
    model, _ = load(tmp_path, body, tail='<equality><weld body1="hand" body2="box"/></equality>')
    sim = amontons.Simulation(model)
    sim.state.linear_velocities[model.body_index("hand")] = (0.5, 0, 0)
    sim.run(1.0)
    np.testing.assert_allclose(sim.state.positions[:, 0], 0.5, atol=1e-6)


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
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = load_model(arm)
    again = pickle.loads(pickle.dumps(model))
    assert again == model
    assert again.keyframes == model.keyframes
    assert again.actuators == model.actuators
