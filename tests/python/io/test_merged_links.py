"""What a fixed joint of a file holds is part of one body; its name, frame, shapes and forces remain."""

import copy
from dataclasses import replace

import amontons
import numpy as np
import pytest
from amontons import InputError, Link, ModelBuilder, Simulation, shapes
from amontons.io.recordings.model_json import model_from_json, model_to_json
from amontons.report.batches import visuals_of
from mjcf import index, load, mujoco
from sensors import compare_sensors

G = 9.81

# A crane: a mast that turns, a boom fixed on it, on the boom a lamp with a camera frame without mass, and on
# the lamp a cord that swings with a hook.
CRANE = """
<body name="mast"><joint name="turn" axis="0 0 1"/><geom name="mast" type="box" size="0.1 0.1 1" mass="10"/>
  <body name="boom" pos="0 0 1" euler="0 0 90">
    <geom name="boom" type="box" size="0.5 0.05 0.05" pos="0.5 0 0" mass="4"/>
    <site name="root" euler="0 0 30"/>
    <body name="lamp" pos="1 0 0.2"><geom name="lamp" size="0.05" mass="2"/>
      <body name="camera" pos="0.1 0 0" euler="0 90 0"><site name="camera"/></body>
      <body name="cord" pos="0 0 -0.3"><joint name="swing" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.02" mass="1"/>
        <body name="hook" pos="0 0 -0.4"><geom size="0.05" mass="3"/><site name="hook"/></body></body>
    </body>
  </body>
</body>"""
SENSORS = """<sensor><force name="f" site="root"/><torque name="t" site="root"/><force name="fh" site="hook"/>
<torque name="th" site="hook"/><force name="fc" site="camera"/><accelerometer name="a" site="camera"/>
<subtreecom name="com" body="boom"/><subtreelinvel name="v" body="lamp"/><subtreeangmom name="l" body="boom"/>
<framepos name="p" objtype="xbody" objname="hook" reftype="xbody" refname="lamp"/></sensor>"""


# Breaks when what is fixed is a body with rows of its own, or its name, carrier, frame or mass is lost.
def test_fixed_bodies_are_links(tmp_path):
    model, m = load(tmp_path, CRANE)
    assert model.body_names == ("mast", "cord")
    assert model.joint_names == ("turn", "swing")
    assert model.link_names == ("mast", "cord", "boom", "lamp", "camera", "hook")
    assert [(link.body, link.carrier, link.mass) for link in model.links] == [
        (0, -1, 4), (0, 0, 2), (0, 1, 0), (1, -1, 3)
    ]  # fmt: skip
    assert [body.mass for body in model.bodies] == pytest.approx([16, 4])
    assert Simulation(replace(model, trees="none")).step().joint_rows == 10  # two hinges
    sim = Simulation(model)
    report = sim.step()
    assert report.joint_rows == 0  # of a tree
    sim.q, sim.qd = (0.7, 0.4), (2.0, -3.0)
    d = mujoco.MjData(m)
    d.qpos[:], d.qvel[:] = sim.q, sim.qd
    mujoco.mj_forward(m, d)
    for name in model.link_names:
        i, row = index(m, name), sim.link(name)
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(m, d, mujoco.mjtObj.mjOBJ_XBODY, i, velocity, 0)
        np.testing.assert_allclose(row["position"], d.xpos[i], atol=1e-13)
        assert abs(row["orientation"] @ d.xquat[i]) == pytest.approx(1, abs=1e-13)
        np.testing.assert_allclose(row["linear_velocity"], velocity[3:], atol=1e-12)
        np.testing.assert_allclose(row["angular_velocity"], velocity[:3], atol=1e-12)
        J = sim.jacobian(name, (0.1, 0.2, 0.3))
        spin = np.cross(velocity[:3], d.xmat[i].reshape(3, 3) @ (0.1, 0.2, 0.3))
        np.testing.assert_allclose(J @ sim.qd, [*velocity[3:] + spin, *velocity[:3]], atol=1e-12)
    with pytest.raises(
        InputError, match='"boom" is a link of the body "mast".*"boom_fixed".*Simulation.link'
    ):
        model.body_index("boom")


# Breaks when a sensor on a link, or a sum over what hangs on one, is not MuJoCo's, whose links are bodies.
def test_sensors_on_links_are_those_of_mujoco(tmp_path, monkeypatch):
    path = tmp_path / "crane.xml"
    path.write_text(f"<mujoco><worldbody>{CRANE}</worldbody>{SENSORS}</mujoco>")
    for seed in range(3):
        model, compared = compare_sensors(mujoco, monkeypatch, path, seed)
    assert len(model.sensors) == 10
    assert compared == {sensor.kind for sensor in model.sensors}


# Breaks when the forces of a fixed joint are not what holds its part: a centripetal force m r w^2 inwards, a
# weight upwards and their torque, exact for a steady turn but for the error O(h) of a mean over a step whose
# direction turns by w h = 0.02.
def test_reactions_hold_what_hangs(tmp_path):
    arm = """<body name="hub"><joint name="spin" axis="0 0 1"/><geom size="0.1" mass="1"/>
    <body name="tip" pos="2 0 0"><geom size="0.1" mass="3" pos="0.5 0 0"/></body></body>"""
    model, _ = load(tmp_path, arm)
    sim = Simulation(model, dt=5e-3)
    assert not sim.link_reactions["force"].any()  # before the first step
    sim.qd = [4.0]
    sim.run(1.0)
    (row,) = sim.link_reactions
    inwards = -(sim.link("tip")["position"]) / 2
    assert model.link_names[row["link"]] == "tip"
    pull = 3 * 2.5 * 4.0**2
    np.testing.assert_allclose(row["force"], pull * inwards + (0, 0, 3 * G), atol=0.02 * pull)
    np.testing.assert_allclose(row["torque"], np.cross(-0.5 * inwards, (0, 0, 3 * G)), atol=0.02 * pull)
    np.testing.assert_allclose(row["point"], sim.link("tip")["position"])


# Breaks when contacts, rays, touch and range sensors do not tell the links of a body apart. A table of two
# legs and 6 kg stands on the floor, which pushes on each leg with 3 g; the leg of 1 kg hands on 2 g.
def test_contacts_and_rays_name_the_link(tmp_path):
    table = """<geom type="plane" size="0 0 1"/><body name="top" pos="0 0 1"><freejoint/>
    <geom name="top" type="box" size="1 0.2 0.1" mass="4"/>
    <site name="eye" pos="-0.7 0 -0.15" euler="0 180 0"/>
    <body name="left" pos="-0.7 0 -0.6"><geom name="l" type="box" size="0.2 0.2 0.4" mass="1"/>
    <site name="l" pos="0 0 -0.4" size="0.3" /></body>
    <body name="right" pos="0.7 0 -0.6"><geom name="r" type="box" size="0.2 0.2 0.4" mass="1"/></body>
    </body>"""
    sensors = '<sensor><touch name="touch" site="l"/><rangefinder name="range" site="eye"/></sensor>'
    model, _ = load(tmp_path, table, tail=sensors)
    assert model.body_names == ("top",)
    sim = Simulation(model)
    sim.run(0.5)
    rows = sim.contacts
    named = [{model.link_names[a], "world" if b < 0 else ""} for a, b in rows[["link_a", "link_b"]]]
    assert sorted(map(sorted, named)) == [
        sorted({leg, "world"}) for leg in ("left", "right") for _ in range(4)
    ]
    assert sim.sensors["touch"][0] == pytest.approx(3 * G, rel=1e-3)
    assert sim.sensors["range"][0] == pytest.approx(0.05, abs=1e-6)  # to the other link, of the same body
    for row in sim.link_reactions:
        np.testing.assert_allclose(row["force"], (0, 0, G - 3 * G), atol=1e-2)
    hit = sim.ray((0.7, 0, -1), (0, 0, 1), exclude=(None, "left"))
    assert (model.geom_names[hit.geom], model.link_names[hit.link]) == ("r", "right")
    assert model.link_names[sim.ray((0.7, 0, -1), (0, 0, 1), exclude=(None, "right")).link] == "top"
    assert sim.ray((0.7, 0, -1), (0, 0, 1), exclude=(None, "top")).geom == -1  # with the body go its links


# Breaks when an exclusion of one link excludes its whole body, or none.
def test_exclusion_of_a_link(tmp_path):
    body = """<body name="cart"><freejoint/><geom name="cart" size="0.5"/>
    <body name="arm" pos="1 0 0"><geom name="arm" size="0.5"/></body></body>
    <body name="ball" pos="5 0 0"><freejoint/><geom name="ball" size="0.5"/></body>"""
    model, _ = load(tmp_path, body, tail='<contact><exclude body1="arm" body2="ball"/></contact>')
    cart, arm, ball = map(model.geom_index, ("cart", "arm", "ball"))
    assert model.core.may_touch(cart, ball)
    assert not model.core.may_touch(arm, ball)
    assert not model.core.may_touch(cart, arm)


# Breaks when a part that floats falls with its body: it is a body of its own, unless one of both has no mass.
def test_a_part_with_gravity_of_its_own_stays_a_body(tmp_path):
    body = """<body name="box"><freejoint/><geom size="0.1" mass="1"/>
    <body name="balloon" pos="0 0 1" gravcomp="3"><geom size="0.1" mass="1"/></body>
    <body name="frame" gravcomp="1"/></body>"""
    model, _ = load(tmp_path, body)
    assert model.body_names == ("box", "balloon")
    assert [link.name for link in model.links] == ["frame"]
    sim = Simulation(model, dt=1e-3)
    sim.run(0.1)
    assert sim.momentum()[0][2] == pytest.approx(0.1 * G, rel=1e-6)  # 1 kg falls, 1 kg rises with 2 g


# Breaks when a model with links does not come along: under a prefix, on a link of another one, through JSON;
# or when what is put on a link by its name does not lie in its frame.
def test_links_compose(tmp_path):
    crane, _ = load(tmp_path, CRANE, tail=SENSORS)
    assert model_from_json(model_to_json(crane)) == crane
    builder = ModelBuilder(friction_rule=crane.friction_rule, trees=crane.trees)
    builder.add_model(crane)
    assert builder.build() == crane
    builder.add_model(crane, prefix="b/", parent="lamp", position=(0, 0, 1))
    geom = builder.add_geom("camera", shapes.Sphere(0.1), position=(0, 0, 0.5), density=1000)
    builder.add_site("b/camera", position=(0, 0, 1), name="eye")
    builder.add_body("load", mass=1, inertia=(1, 1, 1), position=(0, 1, 0))
    joint = builder.add_ball_joint("load", "b/lamp", point=(0, 1, 0))
    model = builder.build()
    assert model.link_names[-4:] == ("b/boom", "b/lamp", "b/camera", "b/hook")
    assert model.links[-1].joint == "b/hook_fixed"
    lamp = crane.bodies[0].pose @ crane.links[1].frame
    again = model.bodies[model.body_index("b/mast")].pose
    np.testing.assert_allclose(again.position, lamp((0, 0, 1)), atol=1e-15)
    assert model.links[model.joints[model.joint_index("b/turn")].link_b].name == "lamp"
    assert model.links[model.joints[joint].link_b].name == "b/lamp"
    assert model.links[model.geoms[geom].link].name == "camera"
    camera = model.links[2]
    assert camera.mass == pytest.approx(1000 * 4 / 3 * np.pi * 1e-3)
    assert model.bodies[0].mass == pytest.approx(16 + camera.mass)
    sim = Simulation(model)
    np.testing.assert_allclose(
        sim.site("eye")["position"],
        amontons.Transform(
            tuple(sim.link("b/camera")["position"]), tuple(sim.link("b/camera")["orientation"])
        )((0, 0, 1)),
        atol=1e-14,
    )
    sim.step()
    held = {model.link_names[row["link"]]: row["force"] for row in sim.link_reactions}
    # The lamp carries itself, its camera, the cord with the hook, and the second crane with the load.
    assert held["lamp"][2] > held["b/boom"][2] > held["b/lamp"][2] > 0
    with pytest.raises(InputError, match='a body "lamp" already'):
        builder.add_body("lamp")
    with pytest.raises(InputError, match="never touches itself"):
        builder.exclude("mast", "lamp")


# Breaks when a fixed body without mass loses its name on a parent that moves.
def test_a_fixed_frame_becomes_a_link(tmp_path):
    base = '<body name="base" pos="0 0 1"><body name="arm"><joint name="j"/><geom size="0.1"/></body></body>'
    robot, _ = load(tmp_path, base)
    builder = ModelBuilder()
    builder.add_body("cart", shape=shapes.Box((1, 1, 1)), density=1)
    builder.add_model(robot, parent="cart", position=(0, 2, 0))
    model = builder.build()
    assert model.body_names == ("cart", "arm")
    (link,) = model.links
    assert (link.name, link.body, link.frame.position) == ("base", 0, (0, 2, 1))
    assert model.joints[0].link_b == 0


# Breaks when shapes of a link without visuals are not shown because another part of the body has some.
def test_shapes_of_links_are_shown(tmp_path):
    box = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
    inertia = (
        '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    ball = '<visual><geometry><sphere radius="1"/></geometry></visual>'
    path = tmp_path / "robot.urdf"
    path.write_text(
        f"""<robot name="r"><link name="base">{inertia}{ball}{box}</link>
        <link name="tool">{inertia}{box}</link><joint name="f" type="fixed"><origin xyz="2 0 0"/>
        <parent link="base"/><child link="tool"/></joint></robot>"""
    )
    model = amontons.load_model(path, floating_base=True)
    assert len(model.bodies) == 1
    shown = [float(batch.positions[0, 0]) for batch in visuals_of(model)]
    assert sorted(shown) == [0, 2]


# Breaks when a model takes a link that does not exist, names one twice, or loses them in copies.
def test_links_are_checked(tmp_path):
    model, _ = load(tmp_path, CRANE)
    assert copy.copy(model).links == replace(model).links == model.links
    wrong = {
        "there is no body 7": {"links": (Link("a", 7),)},
        'link "cord": there is another link or a body': {"links": (Link("cord", 0),)},
        "its carrier must be": {"links": (Link("a", 0, carrier=0),)},
        'geom "boom": its body has no link 0': {"links": ()},
    }
    for message, changes in wrong.items():
        with pytest.raises(InputError, match=message):
            replace(model, **changes)
    with pytest.raises(InputError, match="there is no link \"cors\" .*'cord'.*known are mast, cord, boom"):
        model.link_index("cors")
