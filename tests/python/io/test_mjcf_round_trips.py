"""Models written as MJCF: read back they are the same, and MuJoCo finds the same in both files."""

import dataclasses
import math

import amontons
import numpy as np
import pytest
from amontons.model.coordinates import coordinate_name
from problems import DATA, quiet

mujoco = pytest.importorskip("mujoco")

ROBOTS = DATA / "robots"
LOOSE = ("collide", "link_a", "link_b", "anchor")
"""Fields of joints that pairs of bodies, or the file, say otherwise; the anchor of a slide has no meaning."""

SCENE = """
<mujoco>
  <option gravity="0.5 0.3 -9.81" magnetic="0.1 -0.4 0.2"/>
  <compiler autolimits="true"/>
  <worldbody>
    <site name="origin" pos="0.3 0.2 0.1" euler="20 30 40"/>
    <body name="post" pos="0 3 0"><geom size="0.1"/><site name="on_post" pos="0.1 0.2 0.3"/>
      <body name="vane" pos="0 0 0.4">
        <joint name="vane" axis="0 0 1" range="-20 90" ref="10" stiffness="2" springref="3" damping="0.1"/>
        <geom type="capsule" size="0.02 0.3" euler="0 90 0"/><site name="tip" pos="0.3 0 0"/></body></body>
    <body name="hand" mocap="true" pos="2 0 0" euler="0 0 30"><geom size="0.05"/></body>
    <body name="base" pos="0 0 2" euler="0 0 20">
      <freejoint name="root"/>
      <geom type="box" size="0.3 0.2 0.1"/>
      <site name="imu" pos="0.1 0 0.05" euler="10 0 70"/>
      <site name="big" pos="0.3 0 -0.2" type="cylinder" size="0.3 0.35" euler="10 0 70"/>
      <body name="upper" pos="0.3 0 0">
        <joint name="hip" axis="0 1 0.2" range="-20 20"/>
        <joint name="twist" axis="0 0 1" frictionloss="0.1" armature="0.02"/>
        <geom name="thigh" type="capsule" fromto="0 0 0 0 0 -0.4" size="0.05"/>
        <geom name="knob" type="cylinder" size="0.06 0.02" pos="0 0 -0.2" euler="90 0 0"/>
        <site name="knee_site" pos="0 0 -0.4" euler="0 0 30"/><site name="beside" pos="0.2 0 -0.2"/>
        <body name="lower" pos="0 0 -0.4" gravcomp="0.4">
          <joint name="knee" axis="0 1 0"/>
          <geom type="capsule" fromto="0 0 0 0.1 0 -0.4" size="0.04"/>
          <site name="foot" pos="0.1 0 -0.4" size="0.06" euler="0 180 0"/>
          <body name="tag" pos="0.02 0.1 -0.1" euler="10 20 30" gravcomp="0.4">
            <geom size="0.03" mass="0.2"/><site name="tag" pos="0.1 0 0"/>
            <body name="flag" pos="0.1 0 0"><joint name="flag" axis="1 0 0"/><geom size="0.02"/></body></body>
        </body>
      </body>
      <body name="ball" pos="-0.3 0 0" euler="40 0 0"><joint name="socket" type="ball" damping="0.1"/>
        <geom type="box" size="0.05 0.1 0.2" pos="0 0 -0.2"/><site name="rod" pos="0 0 -0.3"/></body>
    </body>
    <body name="buoy" pos="0 -3 1"><joint type="free" name="afloat" damping="0.3" armature="0.1"/>
      <geom size="0.2"/></body>
    <body name="crank" pos="4 0 0"><joint name="crank" axis="0 1 0"/><geom size="0.1" pos="0.2 0 0"/>
      <site name="pin" pos="0.2 0 0"/></body>
    <site name="guide" pos="4 0 0" euler="0 90 0"/>
  </worldbody>
  <contact><exclude body1="post" body2="base"/>
    <pair geom1="thigh" geom2="knob" friction="0.3 0.3 0.01 0.002 0.002"/></contact>
  <tendon>
    <spatial name="cable" range="0.1 3" stiffness="5" springlength="0.2 0.5">
      <site site="imu"/><geom geom="knob" sidesite="beside"/><site site="foot"/>
      <pulley divisor="2"/><site site="origin"/><site site="tip"/></spatial>
    <fixed name="sum" damping="0.2"><joint joint="knee" coef="0.5"/><joint joint="twist" coef="-1"/></fixed>
    <fixed name="other" frictionloss="0.2"><joint joint="vane" coef="2"/></fixed>
  </tendon>
  <equality>
    <joint name="gear" joint1="vane" joint2="crank" polycoef="0.1 2 0.3 0 0"/>
    <tendon name="same" tendon1="sum" tendon2="other" polycoef="0 0.5 0 0 0"/>
    <connect name="tie" body1="ball" body2="buoy" anchor="0 0 -0.4"/>
    <weld name="grip" body1="crank" body2="hand"/>
  </equality>
  <actuator>
    <motor name="hip" joint="hip" gear="30" ctrlrange="-1 1"/>
    <position name="knee" joint="knee" kp="20" kv="1" forcerange="-5 5"/>
    <general name="slow" joint="vane" dyntype="filterexact" dynprm="0.2" gainprm="3" actearly="true"/>
    <general name="pull" tendon="cable" gainprm="2" biastype="affine" biasprm="0 -3 -1"/>
    <motor name="thrust" site="imu" gear="0 0 1 0.1 0 0"/>
    <position name="reach" site="foot" refsite="imu" gear="1 0 0 0 0 0" kp="3"/>
    <motor name="turn" joint="socket" gear="0.1 0.2 0.3"/>
    <motor name="push" joint="afloat" gear="1 0 0 0 0 0"/>
    <general name="piston" cranksite="pin" slidersite="guide" cranklength="0.5" gainprm="4"/>
  </actuator>
  <sensor>
    <accelerometer name="acc" site="imu"/><accelerometer name="acc_foot" site="foot" cutoff="30"/>
    <velocimeter name="vel" site="imu"/><gyro name="gyro" site="imu"/><magnetometer name="mag" site="foot"/>
    <force name="f_knee" site="foot"/><torque name="t_hip" site="knee_site"/><force name="f_tag" site="tag"/>
    <force name="f_post" site="on_post"/><rangefinder name="range" site="foot"/>
    <touch name="touch" site="foot"/>
    <jointpos name="p" joint="knee"/><jointvel name="v" joint="knee"/><jointactuatorfrc name="e" joint="hip"/>
    <jointlimitpos name="l" joint="hip"/><tendonpos name="len" tendon="cable"/>
    <tendonvel name="len_rate" tendon="sum"/><actuatorpos name="ap" actuator="reach"/>
    <actuatorfrc name="af" actuator="pull"/>
    <ballquat name="bq" joint="socket"/><ballangvel name="bw" joint="socket"/>
    <framepos name="fp_r" objtype="geom" objname="thigh" reftype="site" refname="imu"/>
    <framequat name="fq_r" objtype="site" objname="foot" reftype="body" refname="base"/>
    <framexaxis name="fx" objtype="xbody" objname="lower"/>
    <framepos name="of_tag" objtype="xbody" objname="tag"/>
    <framelinvel name="fv" objtype="site" objname="foot" reftype="xbody" refname="base"/>
    <frameangvel name="fw" objtype="site" objname="tag"/>
    <subtreecom name="sc" body="base"/><subtreelinvel name="sv" body="upper"/><clock name="t"/>
    <insidesite name="in" site="big" objtype="xbody" objname="lower"/>
  </sensor>
  <keyframe>
    <key name="home"/>
    <key name="away" time="2" qpos="0.3  1 2 3 0.5 0.5 0.5 0.5  0.1 0.2 0.3 0.4  0.8 0.6 0 0
      0 -3 1 1 0 0 0  0.5" qvel="1  1 2 3 4 5 6  7 8 9 10  11 12 13  1 2 3 4 5 6  7"
      ctrl="0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9" act="0.25" mpos="1 2 3" mquat="0 1 0 0"/>
  </keyframe>
</mujoco>
"""


def written(model, folder):
    """The model that is read of the file, the path, and what is lost."""
    path = folder / "written.xml"
    lost = quiet(amontons.write_model, model, path)
    return quiet(amontons.load_model, path), path, lost


def differences(one, other, where=""):
    """Where two parts of models differ by more than rounding."""
    if dataclasses.is_dataclass(one) and type(one) is type(other):
        for f in dataclasses.fields(one):
            if f.name not in LOOSE:
                yield from differences(getattr(one, f.name), getattr(other, f.name), f"{where}.{f.name}")
    elif isinstance(one, tuple) and isinstance(other, tuple) and len(one) == len(other):
        # A rotation is the same with the other sign.
        mirrored = where.endswith("rotation") and np.dot(one, other) < 0
        for k, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from differences(a, -b if mirrored else b, f"{where}[{k}]")
    elif isinstance(one, float) and isinstance(other, float):
        if not (one == other or math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-9)):
            yield where, one, other
    elif one != other and not hasattr(one, "vertices"):  # hulls have their own order of corners
        yield where, one, other


def plain(joint):
    """A joint whose degrees of freedom have the names of their coordinates."""
    dofs = tuple(dataclasses.replace(dof, name=coordinate_name(joint, k)) for k, dof in enumerate(joint.dofs))
    return dataclasses.replace(joint, dofs=dofs)


def same(model, again):
    """All parts but hulls, of which MuJoCo has its own points, and materials, whose losses are listed."""
    by_name = {site.name: site for site in again.sites}
    assert [s.name for s in model.sites if s.name not in by_name] == []
    sums = [s.name for s in model.sensors if s.kind.startswith("subtree")]  # whose frames have no meaning
    pairs = [
        (model.bodies, again.bodies),
        (tuple(map(plain, model.joints)), tuple(map(plain, again.joints))),
        (model.sites, tuple(by_name[s.name] for s in model.sites)),
        (
            tuple(s for s in model.sensors if s.name not in sums),
            tuple(s for s in again.sensors if s.name not in sums),
        ),
        (model.keyframes, again.keyframes),
        (model.tendons, again.tendons),
        (model.actuators, again.actuators),
        (model.couplings, again.couplings),
        (tuple(k.name for k in model.links), tuple(k.name for k in again.links)),
        (tuple(g.name for g in model.geoms), tuple(g.name for g in again.geoms)),
        (tuple(model.coordinates), tuple(again.coordinates)),
        (model.control_names, again.control_names),
    ]
    for one, other in pairs:
        assert list(differences(one, other)) == []


def alike(first, second):
    """MuJoCo's masses, forces, lengths, keyframes and sensors of two files are the same off the start."""
    models = [quiet(mujoco.MjModel.from_xml_path, str(path)) for path in (first, second)]
    one = models[0]
    rate = 0.3 * np.random.default_rng(1).normal(size=one.nv)
    place = one.qpos0.copy()
    mujoco.mj_integratePos(one, place, rate, 1.0)
    found = []
    for m in models:
        m.opt.timestep = 0.002
        m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        data = mujoco.MjData(m)
        data.qpos[:], data.qvel[:], data.ctrl[:] = place, rate, 0.1
        mujoco.mj_forward(m, data)
        mass = np.zeros((m.nv, m.nv))
        mujoco.mj_fullM(m, data, mass)
        found.append(
            {
                "mass": mass, "bias": data.qfrc_bias, "passive": data.qfrc_passive,
                "drives": data.qfrc_actuator, "tendons": data.ten_length, "lengths": data.actuator_length,
                "qpos": m.key_qpos, "qvel": m.key_qvel, "ctrl": m.key_ctrl, "act": m.key_act,
                "mocap": m.key_mpos, "turned": m.key_mquat,
                **{name: data.sensor(name).data for name in names_of(m) if not of_forces(m, name)},
            }
        )  # fmt: skip
    assert found[1].keys() <= found[0].keys()
    for name, value in found[1].items():
        np.testing.assert_allclose(value, found[0][name], rtol=1e-6, atol=1e-6, err_msg=name)


def names_of(m):
    return [m.sensor(k).name for k in range(m.nsensor)]


def of_forces(m, name):
    """Whether a sensor depends on how soft limits and loops are, which the files say otherwise."""
    return mujoco.mjtStage(m.sensor_needstage[m.sensor(name).id]) == mujoco.mjtStage.mjSTAGE_ACC


# Breaks when any part of MJCF that is read here is written otherwise, or its loss is not said.
def test_scene(tmp_path):
    first = tmp_path / "scene.xml"
    first.write_text(SCENE)
    model = quiet(amontons.load_model, first)
    assert model.unread == ()
    again, path, lost = written(model, tmp_path)
    assert lost == ()
    same(model, again)
    alike(first, path)


# The same of robots of others: their links, their order, their keyframes.
@pytest.mark.parametrize(
    "name",
    [
        "dm_suite/ball_in_cup.xml", "dm_suite/finger.xml", "dm_suite/fish.xml", "dm_suite/humanoid.xml",
        "dm_suite/manipulator.xml", "dm_suite/quadruped.xml", "dm_walkers/humanoid_CMU_V2020.xml",
        "gymnasium/humanoid.xml", "mujoco/humanoid/humanoid.xml", "mujoco/slider_crank/slider_crank.xml",
        "shadow_hand/right_hand.xml", "ufactory_xarm7/scene.xml", "unitree_go1/scene.xml",
    ],
)  # fmt: skip
def test_shared_robots(tmp_path, name):
    if not (ROBOTS / name).is_file():
        pytest.skip("no shared robots")
    model = quiet(amontons.load_model, ROBOTS / name)
    again, path, _ = written(model, tmp_path)
    same(model, again)
    alike(ROBOTS / name, path)


# Breaks when links of a URDF lose their names, or hang elsewhere.
@pytest.mark.parametrize(
    "name", ["example-robot-data/robots/solo_description/robots/solo12.urdf", "bullet3/r2d2.urdf"]
)
def test_links_of_urdf(tmp_path, name):
    if not (ROBOTS / name).is_file():
        pytest.skip("no shared robots")
    model = quiet(amontons.load_model, ROBOTS / name)
    again, _, _ = written(model, tmp_path)
    assert again.link_names == model.link_names
    for one, other in zip(model.links, again.links, strict=True):
        assert list(differences(dataclasses.replace(one, joint=other.joint), other)) == []


# Breaks when what has no room to move comes to move: MuJoCo takes a range from 0 to 0 for none.
def test_limits_without_a_width(tmp_path):
    builder = amontons.ModelBuilder()
    solid = {"mass": 1, "inertia": (0.02, 0.02, 0.02)}
    builder.add_body("locked", position=(0.5, 0, 0), **solid)
    builder.add_revolute_joint("locked", point=(0, 0, 0), axis=(0, 1, 0), limits=(0, 0), name="locked")
    builder.add_body("ball", position=(0.3, 2, -0.4), **solid)
    builder.add_distance_joint(
        "ball", point_a=(0.3, 2, -0.4), point_b=(0, 2, 0), limits=(0.5, 0.5), name="rod"
    )
    builder.add_body("weight", position=(3, 0, 0), **solid)
    builder.add_tendon("rope", path=[(None, (3, 0, 1)), ("weight", (0, 0, 0))], limits=(1, 1))
    again, path, lost = written(builder.build(), tmp_path)
    assert lost == ()
    m = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(m)
    mujoco.mj_step(m, data, 200)
    assert abs(data.qpos[0]) < 0.02
    np.testing.assert_allclose(data.ten_length, (0.5, 1), atol=0.02)
    simulation = amontons.Simulation(again, dt=2e-3)
    simulation.run(0.4)
    assert abs(simulation.kinematics.coordinate("locked")) < 1e-6
    place = simulation.kinematics.link("ball")["position"]
    assert np.linalg.norm(place - (0, 2, 0)) == pytest.approx(0.5, abs=1e-4)
    assert simulation.kinematics.link("weight")["position"][2] == pytest.approx(0, abs=1e-4)


# Breaks when the obstacle of a tendon, or the volume of a sensor, is no geom or site of the model.
def test_parts_that_only_python_has(tmp_path):
    builder = amontons.ModelBuilder()
    builder.add_floor()
    builder.add_body("cube", shape=amontons.shapes.Box((0.1, 0.1, 0.1)), density=500, position=(0, 0, 0.1))
    drum = amontons.parts.PathElement(
        "cylinder", None, amontons.Transform((1, 0, 1)), radius=0.2, side=(1, 0, 2)
    )
    builder.add_tendon("rope", path=[("cube", (0, 0, 0.1)), drum, (None, (2, 0, 0.2))], limits=(None, 20))
    model = builder.build()
    feeler = amontons.parts.Sensor("feeler", "touch", 0)
    model = dataclasses.replace(model, sensors=(feeler,))
    again, _, lost = written(model, tmp_path)
    assert lost == ()
    lengths, forces = [], []
    for m in (model, again):
        simulation = amontons.Simulation(m)
        simulation.run(0.2)
        lengths.append(simulation.forces.tendon_efforts["length"][0])
        forces.append(simulation.sensors["feeler"])
    assert lengths[0] == pytest.approx(lengths[1], abs=1e-6)
    assert forces[0] == pytest.approx(8 * 0.1**3 * 500 * 9.81, rel=1e-3)
    assert forces[1] == pytest.approx(forces[0], rel=1e-3)


# Breaks when the coordinates of a keyframe are those of the other body, or of a ball that starts turned.
def test_keyframe_of_turned_joints(tmp_path):
    builder = amontons.ModelBuilder()
    turn = amontons.axis_angle((1, 2, 3), 0.7)
    for k, name in enumerate(("a", "b", "c")):
        builder.add_body(name, mass=1, inertia=(0.02, 0.03, 0.04), position=(0.5 * k, 0, 0), orientation=turn)
    builder.add_revolute_joint("a", point=(0, 0, 0.2), axis=(0, 1, 0.3), name="pin")
    builder.add_ball_joint("a", "b", point=(0.25, 0, 0), name="ball")  # a carries b
    builder.add_ball_joint("c", "b", point=(0.75, 0, 0), name="other")
    model = builder.build()
    simulation = amontons.Simulation(model)
    simulation.set_q({"pin": 0.4, "ball": (0.8, 0.6, 0, 0), "other": (0.5, -0.5, 0.5, 0.5)})
    simulation.set_qd(np.arange(model.nv) * 0.3)
    s = simulation.state
    rows = (tuple(map(tuple, np.array(getattr(s, name)))) for name in (
        "positions", "orientations", "linear_velocities", "angular_velocities"))  # fmt: skip
    frame = amontons.parts.Keyframe("later", 0.4, *rows, tuple(np.array(s.joint_coordinates)))
    model = dataclasses.replace(model, keyframes=(frame,))
    again, _, _ = written(model, tmp_path)
    other = amontons.Simulation(again)
    other.apply_keyframe("later")
    for name in model.body_names:
        for part in ("position", "linear_velocity", "angular_velocity"):
            np.testing.assert_allclose(
                other.kinematics.link(name)[part],
                simulation.kinematics.link(name)[part],
                atol=1e-9,
                err_msg=f"{name} {part}",
            )


# Breaks when MuJoCo refuses what it is given: a mesh of the ground that is flat, moments of a point mass.
def test_what_mujoco_refuses_otherwise(tmp_path):
    builder = amontons.ModelBuilder()
    square = ([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)])
    builder.add_geom(None, amontons.shapes.Mesh(*square), name="ground")
    builder.add_body("point", mass=2, inertia=(1e-20, 1e-20, 1e-20), position=(0, 0, 1))
    again, path, lost = written(builder.build(), tmp_path)
    assert mujoco.MjModel.from_xml_path(str(path)).nbody == 2
    assert [entry.part for entry in lost if entry.effect == "small"] == ['body "point"']
    assert again.bodies[0].mass == 2


# Breaks when a robot looks otherwise in MuJoCo: a mesh beside a hidden collider, and a colour of a geom.
def test_visuals(tmp_path):
    builder = amontons.ModelBuilder()
    builder.add_floor()
    builder.add_body("cube", shape=amontons.shapes.Box((0.1, 0.1, 0.1)), density=500, position=(0, 0, 0.1))
    wedge = amontons.parts.TriangleMesh([(0, 0, 0), (0.2, 0, 0), (0, 0.2, 0)], [(0, 1, 2)])
    builder.add_visual("cube", wedge, position=(0, 0, 0.1), colour=(0.75, 0.25, 0.5, 1))
    builder.add_body("ball", shape=amontons.shapes.Sphere(0.1), density=500, position=(1, 0, 0.1))
    builder.add_visual("ball", amontons.shapes.Sphere(0.1), colour=(1, 0, 0, 0.5))
    model = builder.build()
    again, path, lost = written(model, tmp_path)
    assert lost == ()
    assert len(again.geoms) == len(model.geoms)
    seen = {v.body: v for v in again.visuals}
    assert seen[0].colour == (0.75, 0.25, 0.5, 1)
    corners = [seen[0].frame(tuple(corner)) for corner in seen[0].shape.vertices.tolist()]
    assert sorted(map(tuple, np.round(corners, 6).tolist()))[-1] == (0.2, 0, 0.1)
    assert (seen[1].shape, seen[1].colour) == (amontons.shapes.Sphere(0.1), (1, 0, 0, 0.5))
    m = mujoco.MjModel.from_xml_path(str(path))
    assert [m.geom_group[k] for k in range(m.ngeom)].count(3) == 1  # the box, which the wedge stands in for
