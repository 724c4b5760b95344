"""Sites, sensors and rays against MuJoCo and closed forms."""

import copy
import math

import amontons
import numpy as np
import pytest
from amontons import InputError, ModelBuilder, Simulation, shapes
from amontons.model.sensing import SENSORS
from problems import robot_file
from sensors import compare_sensors

G = 9.81

# Every kind of sensor, on a floating base with two hinges, a ball and a weld that closes a loop.
SENSING = """
<mujoco>
  <option gravity="0.5 0.3 -9.81" magnetic="0.1 -0.4 0.2"/>
  <worldbody>
    <site name="origin" pos="0.3 0.2 0.1" euler="20 30 40"/>
    <body name="post" pos="0 3 0">
      <geom size="0.1"/>
      <site name="on_post" pos="0.1 0.2 0.3"/>
      <body name="vane">
        <joint name="vane" axis="0 0 1"/><geom type="capsule" size="0.02 0.3" euler="0 90 0"/>
      </body>
    </body>
    <body name="base" pos="0 0 2">
      <freejoint/>
      <geom type="box" size="0.3 0.2 0.1"/>
      <camera name="eye" pos="0.3 0 0.1" euler="0 -90 0"/>
      <site name="imu" pos="0.1 0 0.05" euler="10 0 70"/>
      <site name="big" pos="0.3 0 -0.2" type="cylinder" size="0.3 0.35" euler="10 0 70"/>
      <body name="upper" pos="0.3 0 0">
        <joint name="hip" axis="0 1 0.2" range="-20 20" limited="true"/>
        <geom name="thigh" type="capsule" fromto="0 0 0 0 0 -0.4" size="0.05"/>
        <site name="knee_site" pos="0 0 -0.4" euler="0 0 30"/>
        <body name="lower" pos="0 0 -0.4">
          <joint name="knee" axis="0 1 0"/>
          <geom type="capsule" fromto="0 0 0 0.1 0 -0.4" size="0.04"/>
          <site name="foot" pos="0.1 0 -0.4" size="0.06" euler="0 180 0"/>
          <body name="tag" pos="0.02 0.1 -0.1" euler="10 20 30"><site name="tag" pos="0.1 0 0"/></body>
        </body>
      </body>
      <body name="ball" pos="-0.3 0 0"><joint name="socket" type="ball"/>
        <geom type="box" size="0.05 0.1 0.2" pos="0 0 -0.2"/></body>
    </body>
  </worldbody>
  <sensor>
    <accelerometer name="acc" site="imu"/><accelerometer name="acc_foot" site="foot" cutoff="30"/>
    <velocimeter name="vel" site="imu"/><gyro name="gyro" site="imu"/><magnetometer name="mag" site="foot"/>
    <force name="f_knee" site="foot"/><torque name="t_knee" site="foot"/>
    <force name="f_hip" site="knee_site"/><torque name="t_hip" site="knee_site"/>
    <force name="f_post" site="on_post"/><torque name="t_post" site="on_post"/>
    <force name="f_base" site="imu"/>
    <accelerometer name="acc_tag" site="tag"/><framepos name="fp_tag" objtype="body" objname="tag"/>
    <framequat name="fq_tag" objtype="xbody" objname="tag" reftype="xbody" refname="ball"/>
    <subtreecom name="sc_lower" body="lower"/>
    <rangefinder name="range" site="foot"/><touch name="touch" site="foot"/>
    <jointpos name="p" joint="knee"/><jointvel name="v" joint="knee"/>
    <ballquat name="bq" joint="socket"/><ballangvel name="bw" joint="socket"/>
    <framepos name="fp" objtype="body" objname="upper"/>
    <framepos name="fp_r" objtype="geom" objname="thigh" reftype="site" refname="imu"/>
    <framequat name="fq" objtype="geom" objname="thigh"/>
    <framequat name="fq_r" objtype="site" objname="foot" reftype="body" refname="base"/>
    <framexaxis name="fx" objtype="xbody" objname="lower"/>
    <frameyaxis name="fy" objtype="xbody" objname="lower" reftype="site" refname="origin"/>
    <framezaxis name="fz" objtype="camera" objname="eye"/>
    <framelinvel name="fv" objtype="body" objname="lower"/>
    <framelinvel name="fv_r" objtype="site" objname="foot" reftype="body" refname="base"/>
    <frameangvel name="fw" objtype="site" objname="foot"/>
    <frameangvel name="fw_r" objtype="site" objname="foot" reftype="xbody" refname="upper"/>
    <framelinacc name="fa" objtype="site" objname="foot"/>
    <frameangacc name="faa" objtype="xbody" objname="lower"/>
    <subtreecom name="sc" body="base"/><subtreelinvel name="sv" body="upper"/>
    <subtreeangmom name="sl" body="base"/><clock name="t"/>
    <insidesite name="in" site="big" objtype="xbody" objname="lower"/>
    <insidesite name="out" site="big" objtype="site" objname="foot"/>
    <user name="mine" dim="2"/>
  </sensor>
</mujoco>
"""


@pytest.fixture(scope="module")
def mujoco():
    return pytest.importorskip("mujoco")


def load(tmp_path, text):
    path = tmp_path / "model.xml"
    path.write_text(text)
    return path


# Breaks when a sensor measures something else than MuJoCo's, or is not read or not listed.
def test_sensors_are_those_of_mujoco(mujoco, tmp_path, monkeypatch):
    path = load(tmp_path, SENSING)
    for seed in range(3):
        with pytest.warns(amontons.UnsupportedWarning, match="Does not change the motion"):
            model, compared = compare_sensors(mujoco, monkeypatch, path, seed)
    # Those of actuators, tendons and limits are in test_sensors_of_drives and test_sensors_of_what_stands.
    others = {kind for kind in SENSORS if kind.startswith(("actuator", "tendon", "jointlimit", "jointact"))}
    assert compared == set(SENSORS) - others
    (unread,) = model.unread
    assert unread.element == '<user name="mine">'
    assert not unread.changes_motion
    monkeypatch.undo()
    sim = Simulation(model)
    sim.set_q({"hip": 0.4, "base": (0, 0, 0, 1, 0, 0, 0)})
    assert list(sim.sensors) == [s.name for s in model.sensors]
    assert np.asarray(sim.sensors).shape == (sum(s.size for s in model.sensors),)
    assert abs(sim.sensors["acc_foot"]).max() <= 30.0


# Breaks when sensors of models that others made are read wrongly.
@pytest.mark.parametrize("name", ["dm_suite/humanoid", "dm_suite/quadruped", "dm_suite/finger", "car/car"])
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_sensors_of_robots(mujoco, monkeypatch, name):
    compare_sensors(mujoco, monkeypatch, robot_file(name), 1)


DRIVEN = """
<mujoco>
  <worldbody>
    <body name="a"><joint name="a" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.05"/>
      <site name="low" pos="0 0 -0.4"/>
      <body name="b" pos="0 0 -0.5"><joint name="b" axis="0 1 0"/><geom size="0.1" pos="0 0 -0.2"/></body>
    </body>
    <site name="high" pos="0.5 0 0.2"/>
  </worldbody>
  <tendon>
    <fixed name="both" range="-0.1 0.1" limited="true">
      <joint joint="a" coef="2"/><joint joint="b" coef="-1"/>
    </fixed>
    <spatial name="rope"><site site="high"/><site site="low"/></spatial>
  </tendon>
  <actuator>
    <motor name="motor" joint="b" gear="3"/><motor name="winch" tendon="rope" gear="0.5"/>
    <motor name="pull" tendon="rope"/>
  </actuator>
  <sensor>
    <actuatorpos name="ap" actuator="motor"/><actuatorvel name="av" actuator="winch"/>
    <actuatorfrc name="af" actuator="motor"/><jointactuatorfrc name="jf" joint="b"/>
    <tendonpos name="tp" tendon="rope"/><tendonvel name="tv" tendon="both"/>
    <tendonactuatorfrc name="tf" tendon="rope"/>
    <tendonlimitpos name="tl" tendon="both"/><tendonlimitvel name="tlv" tendon="both"/>
    <tendonlimitfrc name="tlf" tendon="both"/>
  </sensor>
</mujoco>
"""


# Breaks when a sensor of a drive is another one's, lacks the gear, or limits tell the wrong side.
def test_sensors_of_drives(mujoco, tmp_path):
    path = load(tmp_path, DRIVEN)
    model, m = amontons.load_model(path), mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    sim = Simulation(model, tolerance=1e-12)
    d.qpos[:], d.qvel[:], d.ctrl[:] = (0.3, 0.2), (0.5, -0.2), (0.7, -2.0, 3.0)
    mujoco.mj_forward(m, d)
    sim.q, sim.qd, sim.controls = d.qpos, d.qvel, d.ctrl

    def same(*names):
        for name in names:
            i = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_SENSOR, name)
            assert sim.sensors[name] == pytest.approx(d.sensordata[m.sensor_adr[i]], abs=1e-10), name

    same("ap", "av", "tp", "tv", "tl", "tlv")  # beyond the limit: 2 a - b = 0.4
    assert sim.sensors["tl"] == pytest.approx(0.1 - 0.4)
    assert sim.sensors["tlf"] == 0
    sim.step()
    same("af", "jf", "tf")
    assert sim.sensors["tlf"] > 0


STANDING = """
<mujoco>
  <worldbody>
    <geom type="plane" size="0 0 1"/>
    <body name="block" pos="0 0 0.5">
      <freejoint/>
      <geom type="box" size="0.2 0.2 0.1" mass="3"/>
      <body name="leg" pos="0 0 -0.1">
        <geom type="capsule" fromto="0 0 -0.1 0 0 -0.3" size="0.1" mass="1"/>
        <geom type="box" size="0.3 0.3 0.05" pos="0 0 -0.35" mass="1"/>
        <site name="ankle" pos="0 0 -0.3" euler="90 0 0"/>
        <site name="sole" pos="0.15 0 -0.4" type="box" size="0.2 0.4 0.02"/>
        <site name="sky" pos="0.1 0.1 1"/>
      </body>
    </body>
    <body name="door" pos="2 0 1">
      <joint name="stop" axis="0 1 0" range="-10 0"/><geom size="0.1" pos="0.5 0 0" mass="2"/>
    </body>
  </worldbody>
  <sensor>
    <force name="force" site="ankle"/><torque name="torque" site="ankle"/><touch name="half" site="sole"/>
    <touch name="nothing" site="sky"/><accelerometer name="acc" site="ankle"/>
    <jointlimitpos name="lp" joint="stop"/><jointlimitvel name="lv" joint="stop"/>
    <jointlimitfrc name="lf" joint="stop"/>
  </sensor>
</mujoco>
"""


# Breaks when contacts are left out of forces, or touch counts what its volume does not see.
def test_sensors_of_what_stands(mujoco, tmp_path):
    sim = Simulation(amontons.load_model(load(tmp_path, STANDING)), tolerance=1e-10)
    sim.run(0.5)
    r = sim.sensors
    # The block weighs on the leg; the axes of the site are turned by 90 degrees about x.
    np.testing.assert_allclose(r["force"], (0, -3 * G, 0), atol=1e-5)
    np.testing.assert_allclose(r["torque"], 0, atol=1e-5)
    np.testing.assert_allclose(r["acc"], (0, G, 0), atol=1e-5)
    # The volume of "half" is over the corners at x = 0.3 and the tip of the capsule at x = 0.
    seen = sim.contacts[sim.contacts["point"][:, 0] > -0.05]
    assert 0 < len(seen) < len(sim.contacts)
    assert r["half"] == pytest.approx(seen["force"][:, 2].sum(), rel=1e-12)
    assert r["nothing"] == 0
    # At its stop, q = 0 at the upper limit, the door's weight acts at 0.5 m.
    assert r["lf"] == pytest.approx(2 * G * 0.5, rel=1e-4)
    sim.set_q({"stop": 0.01})
    sim.set_qd({"stop": 0.5})
    assert sim.sensors["lp"] == pytest.approx(-0.01)
    assert sim.sensors["lv"] == pytest.approx(-0.5)
    again = copy.deepcopy(sim)
    np.testing.assert_array_equal(again.sensors.array, sim.sensors.array)


# Breaks when a site of the builder is in another place, moves otherwise, or is lost in a file or a part.
def test_sites(mujoco, tmp_path):
    builder = ModelBuilder(gravity=(0, 0, 0))
    builder.add_body("a", shape=shapes.Sphere(0.1), mass=1.0, position=(1, 0, 0), angular_velocity=(0, 0, 2),
                     orientation=(0.5**0.5, 0, 0, 0.5**0.5))  # fmt: skip
    builder.add_site("a", position=(0.5, 0, 0), name="tip")
    builder.add_site(None, position=(0, 0, 3))
    sim = Simulation(builder.build())
    tip = sim.kinematics.site("tip")
    np.testing.assert_allclose(tip["position"], (1, 0.5, 0), atol=1e-15)
    np.testing.assert_allclose(tip["orientation"], (0.5**0.5, 0, 0, 0.5**0.5))
    np.testing.assert_allclose(tip["linear_velocity"], (-1, 0, 0), atol=1e-15)
    np.testing.assert_allclose(sim.kinematics.site_jacobian("tip") @ sim.qd, (-1, 0, 0, 0, 0, 2), atol=1e-15)
    assert sim.kinematics.sites["body"].tolist() == [0, -1]
    assert not sim.kinematics.site_jacobian(1).any()
    with pytest.raises(InputError, match='no site "toe"; known are tip, site1'):
        sim.kinematics.site("toe")
    with pytest.raises(InputError, match='there is a site "tip" already'):
        builder.add_site("a", name="tip")
    part = amontons.load_model(load(tmp_path, STANDING))
    whole = ModelBuilder()
    for k in range(2):
        whole.add_model(part, position=(5 * k, 0, 0), prefix=f"{k}/")
    model = whole.build()
    assert model.site_names == ("0/ankle", "0/sole", "0/sky", "1/ankle", "1/sole", "1/sky")
    sim = Simulation(model, tolerance=1e-10)
    sim.run(0.3)
    for k in range(2):
        assert sim.sensors[f"{k}/force"][1] == pytest.approx(-3 * G, rel=1e-5)
        assert sim.sensors[f"{k}/lf"] == pytest.approx(G, rel=1e-3)
    sim.save(tmp_path / "s.h5")
    again = Simulation.load(tmp_path / "s.h5")
    assert again.model.sites == model.sites
    assert len(again.model.sensors) == len(model.sensors)
    sim.step(), again.step()
    np.testing.assert_array_equal(again.sensors.array, sim.sensors.array)


SCENE = """
<mujoco>
  <worldbody>
    <geom type="plane" size="0 0 1" pos="0 0 -0.5" euler="5 3 0"/>
    <geom type="sphere" size="0.3" pos="1 0 0"/>
    <geom type="capsule" size="0.2 0.4" pos="-1 0 0" euler="20 50 0"/>
    <geom type="cylinder" size="0.3 0.4" pos="0 1 0" euler="40 10 0"/>
    <geom type="box" size="0.3 0.2 0.4" pos="0 -1 0" euler="40 10 70"/>
    <geom type="ellipsoid" size="0.4 0.2 0.3" pos="0 0 1" euler="10 80 70"/>
  </worldbody>
</mujoco>
"""


# Breaks when the first surface on a ray is missed, or a distance or a normal is wrong; from inside as well.
def test_rays_are_those_of_mujoco(mujoco, tmp_path):
    path = load(tmp_path, SCENE)
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    sim = Simulation(amontons.load_model(path))
    rng = np.random.default_rng(3)
    # From afar towards the middle, and from within shapes.
    origins = rng.normal(size=(4000, 3)) * rng.choice([1.0, 4.0], size=(4000, 1))
    origins[:, 2] = np.abs(origins[:, 2])
    origins[:200] = d.geom_xpos[1 + np.arange(200) % 5] + 0.05 * rng.normal(size=(200, 3))
    directions = rng.normal(size=(4000, 3)) * 0.5 - origins
    directions[:200] = rng.normal(size=(200, 3))
    distances, geoms, normals = sim.kinematics.rays(origins, directions)
    hit, normal = np.zeros(1, np.int32), np.zeros(3)
    for i in range(len(origins)):
        along = directions[i] / np.linalg.norm(directions[i])
        expected = mujoco.mj_ray(m, d, origins[i], along, None, 1, -1, hit, normal)
        if expected < 0:
            assert geoms[i] == -1
            assert distances[i] == math.inf
            continue
        assert distances[i] == pytest.approx(expected, abs=1e-10)
        if i >= 200:  # from within, MuJoCo's normal may point inwards
            assert geoms[i] == hit[0]
            np.testing.assert_allclose(normals[i], normal, atol=1e-7)
    assert set(geoms) == {-1, 0, 1, 2, 3, 4, 5}


def surface_points(vertices, triangles, rng, n):
    chosen = vertices[triangles[rng.integers(len(triangles), size=n)]]
    weights = rng.dirichlet(np.ones(3), size=n)
    return np.einsum("nk,nkx->nx", weights, chosen)


# Breaks when a triangle is missed, also by a ray that passes through an edge or a corner.
def test_rays_against_hulls_meshes_and_height_fields():
    rng = np.random.default_rng(4)
    ball = rng.normal(size=(60, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    hull = shapes.Hull(ball)
    heights = 0.2 * rng.normal(size=(9, 13))
    field = shapes.HeightField(heights, 3.0, 2.0)
    x, y = np.meshgrid(np.linspace(-1.5, 1.5, 13), np.linspace(-1, 1, 9))
    vertices = np.stack([x.ravel(), y.ravel(), heights.ravel()], axis=1)
    r, c = np.meshgrid(np.arange(8), np.arange(12), indexing="ij")
    a = (13 * r + c).ravel()
    triangles = np.concatenate([np.stack([a, a + 1, a + 14], 1), np.stack([a, a + 14, a + 13], 1)])
    mesh = shapes.Mesh(vertices, triangles)
    for _ in range(500):
        origin, towards = rng.normal(size=3) * 3 + (0, 0, 4), rng.normal(size=3)
        towards = surface_points(vertices, triangles, rng, 1)[0] - origin
        expected = plain_rays(vertices[triangles], origin, towards)
        for shape in (mesh, field):
            distance, normal = shape.core.cast_ray(tuple(origin), tuple(towards / np.linalg.norm(towards)))
            assert distance == pytest.approx(expected, abs=1e-10)
            assert np.linalg.norm(normal) == pytest.approx(1)
            assert normal[2] > 0
    for v in vertices:  # straight down through corners
        if abs(v[0]) < 1.5 and abs(v[1]) < 1:
            for shape in (mesh, field):
                assert shape.core.cast_ray((v[0], v[1], 5.0), (0, 0, -1))[0] == pytest.approx(5 - v[2])
    corners = np.array(hull.vertices)[np.array(hull.triangles)] if hasattr(hull, "triangles") else None
    for _ in range(200):
        origin = rng.normal(size=3) * 2
        along = -origin + 0.3 * rng.normal(size=3)
        along /= np.linalg.norm(along)
        distance, normal = hull.core.cast_ray(tuple(origin), tuple(along))
        if corners is not None and np.isfinite(distance):
            assert distance == pytest.approx(plain_rays(corners, origin, along), abs=1e-9)
        if np.isfinite(distance):
            p = origin + distance * along
            assert (ball @ np.array(normal)).max() == pytest.approx(p @ np.array(normal), abs=1e-9)


def plain_rays(triangles, origin, direction):
    """The nearest triangle on a ray, by solving for barycentric coordinates one by one."""
    direction = direction / np.linalg.norm(direction)
    nearest = math.inf
    for a, b, c in triangles:
        A = np.stack([b - a, c - a, -direction], axis=1)
        if abs(np.linalg.det(A)) < 1e-14:
            continue
        u, v, t = np.linalg.solve(A, origin - a)
        if min(u, v) >= -1e-12 and u + v <= 1 + 1e-12 and t >= 0:
            nearest = min(nearest, t)
    return nearest


# Breaks when exclusion, units of direction or bad input are not handled.
def test_rays_past_bodies():
    builder = ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    builder.add_body("ball", shape=shapes.Sphere(0.5), mass=1.0, position=(0, 0, 2))
    sim = Simulation(builder.build())
    hit = sim.kinematics.ray((0, 0, 5), (0, 0, -3))
    assert (hit.distance, hit.geom, hit.normal) == (2.5, sim.model.geom_index(1), (0, 0, 1))
    assert sim.kinematics.ray((0, 0, 5), (0, 0, -1), exclude=("ball",)).distance == 5
    assert sim.kinematics.ray((0, 0, 5), (0, 0, -1), exclude=("ball", None)) == (math.inf, -1, (0, 0, 0), -1)
    assert sim.kinematics.ray((0, 0, 5), (0, 0, -1), exclude=np.int32(0)).distance == 5
    assert sim.kinematics.ray((0, 0, 5), (0, 0, -1), exclude=None).distance == 2.5
    assert sim.kinematics.ray((0, 0, 2), (1, 0, 0)).distance == 0.5  # from inside to where it leaves
    for call, message in [
        (lambda: sim.kinematics.ray((0, 0, 5), (0, 0, 0)), "a direction is zero"),
        (lambda: sim.kinematics.ray((0, 0, math.nan), (0, 0, 1)), r"origin\[2\] is nan"),
        (lambda: sim.kinematics.ray((0, 0, 5), (0, 0, 1), exclude=("cube",)), 'no body "cube"'),
        (lambda: sim.kinematics.rays(np.zeros((2, 2)), (0, 0, 1)), r"origins has the shape \(2, 2\)"),
    ]:
        with pytest.raises(InputError, match=message):
            call()
