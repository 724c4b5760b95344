"""Softness of contacts, margins and limits of MJCF, at rest and in a bounce, against MuJoCo's own motion."""

import amontons
import pytest
from amontons.io.models import load_model
from problems import DATA

mujoco = pytest.importorskip("mujoco")


def both(tmp_path, text):
    path = tmp_path / "model.xml"
    path.write_text(text)
    return load_model(path, strict=True), mujoco.MjModel.from_xml_path(str(path))


def settle(model, m, seconds=3.0, dt=2e-3):
    """The simulations at rest."""
    d, sim = mujoco.MjData(m), amontons.Simulation(model, dt=dt)
    while d.time < seconds:
        mujoco.mj_step(m, d)
    sim.run(seconds)
    return d, sim


BALL = """<mujoco><option timestep="1e-3" cone="{cone}" impratio="{impratio}"/><worldbody>
<geom type="plane" size="1 1 1" {floor}/>
<body pos="0 0 0.1"><freejoint/><geom size="0.1" mass="2" {ball}/></body></worldbody></mujoco>"""


# Breaks when stiffness, impedance, mixing, priority, the cone or condim go into the compliance otherwise than
# into MuJoCo's rest. Impedances at the load of the rest: the depth is exact.
@pytest.mark.parametrize(
    ("ball", "floor", "cone", "impratio"),
    [
        ('solref="0.06 1"', "", "elliptic", 1),
        ('solref="0.06 1"', "", "pyramidal", 1),
        ('solref="0.2 1" condim="6" friction="0.7 0.01 0.001"', 'friction="0.2"', "pyramidal", 2),
        ('solref="0.06 1" condim="1"', 'condim="1"', "pyramidal", 1),
        ('solref="0.04 0.9" solimp="0.2 0.7 0.02 0.3 3" priority="1"', "", "elliptic", 100),
        ('solimp="0.015 1 0.022" priority="1" solref="0.02 1"', "", "elliptic", 1),
        ('solref="-300 -40" solimp="0.9 0.9 0.001"', 'solref="-200 -50"', "elliptic", 1),
        ('solref="0.06 1" solmix="3"', 'solref="0.1 1" solimp="0.5 0.6 0.01"', "elliptic", 1),
        ("", 'solref="0.1 1" priority="1"', "elliptic", 1),
    ],
)
def test_rest_depth(tmp_path, ball, floor, cone, impratio):
    text = BALL.format(ball=ball, floor=floor, cone=cone, impratio=impratio)
    d, sim = settle(*both(tmp_path, text))
    depth = 0.1 - d.qpos[2]
    assert depth > 5e-4
    assert 0.1 - sim.state.positions[0, 2] == pytest.approx(depth, rel=1e-3)


# Breaks when the override of contact parameters leaves those of a geom.
def test_override(tmp_path):
    option = """<option o_margin="0.03" o_solref="0.1 1" o_solimp="0.5 0.6 0.01" o_friction="0.3 0.3 0 0 0">
    <flag override="enable"/></option><worldbody>"""
    text = BALL.format(ball='priority="1" friction="0.7"', floor='margin="0.01"', cone="elliptic", impratio=1)
    d, sim = settle(*both(tmp_path, text.replace("<worldbody>", option)))
    assert sim.state.positions[0, 2] == pytest.approx(d.qpos[2], abs=1e-5)
    assert sim.contacts["friction"].tolist() == [0.3]


# Breaks when contacts as stiff as MuJoCo's defaults, or stiffer, become springs: those rest without a depth.
@pytest.mark.parametrize("ball", ["", 'solref="0.005 1"', 'solimp="0.95 0.99 0.001"', 'solref="-20000 -300"'])
def test_stiff_contacts_stay_rigid(tmp_path, ball):
    model, _ = both(tmp_path, BALL.format(ball=ball, floor="", cone="elliptic", impratio=1))
    assert [g.material.compliance for g in model.geoms] == [0, 0]
    assert model.pair_materials == ()


# Breaks when the weight of a robot is not shared by what it stands on, of which each point then sinks in as
# MuJoCo's do: four feet of a cart, its load in the middle, with feet that get stiffer under load.
def test_feet_share_the_weight(tmp_path):
    feet = "".join(
        f'<body pos="{x} {y} -0.1"><geom size="0.03" mass="0.1" solimp="0.015 1 0.022" priority="1"/></body>'
        for x in (-0.2, 0.2)
        for y in (-0.1, 0.1)
    )
    text = f"""<mujoco><option timestep="1e-3" cone="elliptic"/><worldbody><geom type="plane" size="1 1 1"/>
    <body pos="0 0 0.13"><freejoint/><geom type="box" size="0.2 0.1 0.05" mass="10"/>{feet}</body>
    </worldbody></mujoco>"""
    d, sim = settle(*both(tmp_path, text))
    depth = 0.13 - d.qpos[2]
    assert depth > 5e-3
    assert 0.13 - sim.state.positions[0, 2] == pytest.approx(depth, rel=0.05)


# Breaks when limits and equalities that give way in MuJoCo are hard here and nobody is told, or when those
# that are about as stiff as usual make noise.
def test_soft_limits_and_equalities_are_listed(tmp_path):
    text = """<mujoco><worldbody><body><joint name="a" range="-1 1" solreflimit="{0} 1"/><geom size="0.1"/>
    <body><joint name="b"/><geom size="0.1"/></body></body></worldbody>
    <equality><joint joint1="b" solref="{0} 1"/></equality></mujoco>"""
    path = tmp_path / "model.xml"
    path.write_text(text.format(0.03))
    assert load_model(path, strict=True).unread == ()
    path.write_text(text.format(0.1))
    with pytest.warns(amontons.UnsupportedWarning, match="Does not change the motion"):
        unread = load_model(path, strict=True).unread
    assert [entry.what.split(";")[0] for entry in unread] == ["a soft limit", "a soft equality"]


# A quadruped of others stands on its soft feet as deep as in MuJoCo; breaks when its softness, margins or
# servos are read otherwise. MuJoCo's feet creep outwards by millimetres in that time, which lowers the trunk.
def test_go1_rests_as_in_mujoco():
    path = DATA / "robots/unitree_go1/scene.xml"
    if not path.exists():
        pytest.skip(f"no model {path}")
    m = mujoco.MjModel.from_xml_path(str(path))
    d, sim = mujoco.MjData(m), amontons.Simulation(load_model(path, strict=True), dt=5e-3)
    mujoco.mj_resetDataKeyframe(m, d, m.key("home").id)
    sim.apply_keyframe("home")
    while d.time < 2.0:
        mujoco.mj_step(m, d)
    sim.run(2.0)
    trunk = sim.model.body_index("trunk")
    assert sim.state.positions[trunk, 2] == pytest.approx(d.xpos[m.body("trunk").id, 2], abs=1.5e-3)


# Breaks when a contact with little damping does not bounce, or bounces otherwise: after a fall from 0.5 m it
# rises as high as in MuJoCo, where a step of 0.1 ms leaves it what its damping ratio says.
@pytest.mark.parametrize("solref", ["-20000 -20", "-500 -5"])
def test_bounce(tmp_path, solref):
    text = BALL.format(ball=f'solref="{solref}" priority="1"', floor="", cone="elliptic", impratio=1)
    model, m = both(tmp_path, text.replace("1e-3", "1e-4").replace("0 0 0.1", "0 0 0.6"))
    d, sim = mujoco.MjData(m), amontons.Simulation(model, dt=1e-3)
    heights, ours = [], []
    while d.time < 0.7:
        mujoco.mj_step(m, d)
        heights.append(d.qpos[2])
    sim.run(0.7, after_step=lambda s, _: ours.append(s.state.positions[0, 2]))
    rise = max(heights[heights.index(min(heights)) :]) - 0.1
    assert rise > 0.1
    assert max(ours[ours.index(min(ours)) :]) - 0.1 == pytest.approx(rise, rel=0.15)


# Breaks when margins are not where things rest in MuJoCo: of geoms, of a pair, of a joint's limit.
def test_margins(tmp_path):
    text = """<mujoco><option timestep="1e-3"/><worldbody>
    <geom name="floor" type="plane" size="1 1 1" margin="0.01"/>
    <body pos="0 0 0.3"><freejoint/><geom name="a" size="0.1" margin="0.02" gap="0.005"/></body>
    <body pos="1 0 0.3"><freejoint/><geom name="b" size="0.1"/></body>
    <body pos="2 0 1"><joint type="slide" axis="0 0 1" range="-0.1 0.1" limited="true" margin="0.03"/>
    <geom size="0.1"/></body></worldbody>
    <contact><pair geom1="floor" geom2="b" margin="0.05"/></contact></mujoco>"""
    d, sim = settle(*both(tmp_path, text))
    # MuJoCo's contacts with its defaults give way by g (1 - d) / (d k): 0.4 mm.
    assert sim.state.positions[:2, 2] == pytest.approx(d.xpos[1:3, 2], abs=1e-3)
    assert sim.state.positions[:2, 2] == pytest.approx([0.13, 0.15], abs=1e-6)
    assert sim.state.joint_coordinates[0] == pytest.approx(-0.07, abs=1e-6)
    assert d.qpos[14] == pytest.approx(-0.07, abs=1e-3)
