"""Tendons: lengths and moment arms against MuJoCo, motions against MuJoCo and closed forms."""

from __future__ import annotations

import amontons
import numpy as np
import pytest
from amontons import InputError
from amontons.parts import PathElement, TendonTerm

mujoco = pytest.importorskip("mujoco")

ROUNDING = 1e-9
"""m, m/s: lengths of about 3 m at speeds of about 3 m/s; MuJoCo takes arcs from arc cosines."""


def compiled(tmp_path, text):
    """Our model and MuJoCo's, of the same MJCF text."""
    path = tmp_path / "model.xml"
    path.write_text(f"<mujoco>{text}</mujoco>")
    model = amontons.load_model(path, strict=True)
    m = mujoco.MjModel.from_xml_path(str(path))
    return model, m, mujoco.MjData(m)


def put(sim, m, d):
    """MuJoCo's state of bodies and velocities into ours."""
    mujoco.mj_forward(m, d)
    names = [m.body(b).name for b in range(m.nbody)]
    for i, body in enumerate(sim.model.bodies):
        b = names.index(body.name)
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(m, d, mujoco.mjtObj.mjOBJ_XBODY, b, velocity, 0)
        sim.state.positions[i], sim.state.orientations[i] = d.xpos[b], d.xquat[b]
        sim.state.angular_velocities[i], sim.state.linear_velocities[i] = velocity[:3], velocity[3:]


BODIES = """
<option gravity="0 0 0"><flag contact="disable"/></option>
<worldbody>
  <body name="a"><freejoint/><geom size="0.05" mass="1"/><site name="a" pos="0.1 0.02 0"/></body>
  <body name="b"><freejoint/><geom size="0.05" mass="1"/><site name="b" pos="0 0.1 -0.03"/></body>
  <body name="c"><freejoint/>
    <geom name="ball" type="sphere" size="0.4" pos="0.1 0 0.05" mass="1"/>
    <geom name="roll" type="cylinder" size="0.3 0.2" pos="0 0.05 0" euler="20 30 40" mass="1"/>
    <site name="out" pos="0.6 0.5 0.3"/><site name="within" pos="0.15 0.05 0.1"/>
    <site name="axis" pos="0.02 0.06 0.03"/><site name="high" pos="0.311 0.007 0.531"/>
    <site name="c" pos="0.9 0.4 -0.5"/></body>
  <site name="fixed" pos="0.3 -0.4 1.2"/>
</worldbody>
"""
PATHS = {
    "straight": '<site site="a"/><site site="b"/><site site="fixed"/>',
    "sphere": '<site site="a"/><geom geom="ball"/><site site="b"/>',
    "sphere, side": '<site site="a"/><geom geom="ball" sidesite="out"/><site site="b"/>',
    "through the sphere": '<site site="a"/><geom geom="ball" sidesite="within"/><site site="b"/>',
    "cylinder": '<site site="a"/><geom geom="roll"/><site site="b"/>',
    "cylinder, side": '<site site="a"/><geom geom="roll" sidesite="out"/><site site="b"/>',
    "cylinder, side high up": '<site site="a"/><geom geom="roll" sidesite="high"/><site site="b"/>',
    "through the cylinder": '<site site="a"/><geom geom="roll" sidesite="axis"/><site site="b"/>',
    "pulley": '<site site="a"/><geom geom="ball"/><site site="b"/><pulley divisor="3"/><site site="b"/>'
    '<site site="fixed"/><pulley divisor="2"/><site site="c"/><geom geom="roll"/><site site="a"/>',
    "a pulley first": '<pulley divisor="2"/><site site="a"/><geom geom="ball"/><site site="b"/>',
}


# Breaks when a path takes another way than MuJoCo's (side, inside, pulley), or forces act along another line:
# the rate for velocities of all bodies at random is the product with every entry of the moment arms.
@pytest.mark.parametrize("name", PATHS)
def test_paths(tmp_path, name):
    text = f'{BODIES}<tendon><spatial name="t">{PATHS[name]}</spatial></tendon>'
    model, m, d = compiled(tmp_path, text)
    sim = amontons.Simulation(model)
    random = np.random.default_rng(3)
    bent = 0
    for _ in range(300):
        d.qpos[:], d.qvel[:] = random.uniform(-1, 1, m.nq), random.uniform(-1, 1, m.nv)
        put(sim, m, d)
        (row,) = sim.forces.tendon_efforts
        assert row["length"] == pytest.approx(d.ten_length[0], abs=ROUNDING)
        # The point of a way through an obstacle is found by Newton's method, in MuJoCo to 1e-6.
        loose = 3e-6 if "through" in name else ROUNDING
        assert row["rate"] == pytest.approx(d.ten_velocity[0], abs=loose)
        straight = m.tendon_num[0] - PATHS[name].count("geom=") - PATHS[name].count("pulley")
        bent += d.ten_wrapnum[0] > straight
    assert bent > 5 or name == "straight"  # the way around was taken


CHAIN = """
<option gravity="0 0 -9.81" integrator="implicitfast"><flag contact="disable"/></option>
<worldbody>{}</worldbody>
"""


def chain(count, tail):
    """A chain of hinges about changing axes, with a site at the end of each link."""
    text = "".join(
        f'<body name="l{i}" pos="0.3 0 0">'
        f'<joint name="j{i}" axis="0 {int(i % 2 == 0)} {int(i % 2)}" damping="0.02"/>'
        '<geom type="capsule" size="0.02" fromto="0 0 0 0.3 0 0" mass="0.3"/>'
        f'<site name="s{i}" pos="0.15 0 0.05"/>'
        for i in range(count)
    )
    return CHAIN.format('<site name="s" pos="0 0 0.3"/>' + text + "</body>" * count) + tail


TENDONS = {
    "spring": '<tendon><spatial stiffness="10" springlength="0.5">{}</spatial></tendon>',
    "dead band": '<tendon><spatial stiffness="20" springlength="0.3 1.2">{}</spatial></tendon>',
    "damper": '<tendon><spatial damping="3">{}</spatial></tendon>',
    "armature": '<tendon><spatial armature="2">{}</spatial></tendon>',
}


WRONG = {
    "neither": (dict(), "give either joints with coefficients or a path"),
    "both": (dict(joints={"j": 1}, path=[]), "give either joints"),
    "no such joint": (dict(joints={"k": 1}), 'there is no joint "k"'),
    "no such dof": (dict(joints=[TendonTerm("j", 2)]), 'joint "j" has no degree of freedom 2'),
    "no term": (dict(joints=["j"]), "give {joint: coefficient} or TendonTerms"),
    "no point": (dict(path=[(None, (0, 0, 0)), "b"]), "give (body, position in its frame)"),
    "no such body": (dict(path=[(None, (0, 0, 0)), ("c", (0, 0, 0))]), 'there is no body "c"'),
    "one point": (dict(path=[("b", (0, 0, 0))]), "its path must end with a part of two points"),
    "an end": (
        dict(path=[("b", (0, 0, 0)), (None, (0, 0, 1)), PathElement("sphere", radius=1)]),
        "its path must end with",
    ),
    "two obstacles": (
        dict(path=[("b", (0, 0, 0)), PathElement("sphere", radius=1), PathElement("sphere", radius=1)]),
        "without a point before it",
    ),
    "a pulley too early": (
        dict(path=[("b", (0, 0, 0)), PathElement("pulley", divisor=2), ("b", (0, 0, 0))]),
        "a part of a single point",
    ),
    "divisor": (
        dict(path=[("b", (0, 0, 0)), (None, (0, 0, 1)), PathElement("pulley", divisor=0)]),
        "the divisor of a pulley must be positive",
    ),
    "radius": (
        dict(path=[("b", (0, 0, 0)), PathElement("sphere"), (None, (0, 0, 1))]),
        "the radius of an obstacle must be positive",
    ),
    "limits": (dict(joints={"j": 1}, limits=(2, 1)), "the lower limit 2 exceeds the upper one 1"),
    "stiffness": (dict(joints={"j": 1}, stiffness=-1), "stiffness must be finite and not negative"),
    "rest": (dict(joints={"j": 1}, rest=(2, 1)), "the lower one first"),
    "rests": (dict(joints={"j": 1}, rest=(1, 2, 3)), "give one number, or two"),
}


def refusal(kind, name, arguments):
    """What a builder says that gets a wrong tendon or actuator on a body "b" with a hinge "j"."""
    builder = amontons.ModelBuilder()
    builder.add_body("b", shape=amontons.shapes.Sphere(0.1), density=1000)
    builder.add_revolute_joint("b", point=(0, 0, 1), axis=(0, 1, 0), name="j")
    with pytest.raises(InputError) as error:  # noqa: PT012
        getattr(builder, f"add_{kind}")(name, **arguments)
        builder.build()
    assert f'{kind} "{name}"' in str(error.value)
    return str(error.value)


# Breaks when a tendon that cannot be is taken, or the message does not name it and the remedy.
@pytest.mark.parametrize("name", WRONG)
def test_wrong_tendons(name):
    arguments, message = WRONG[name]
    assert message in refusal("tendon", "string", arguments)


def differences(model, m, d, *, dt, duration, control=None):
    """Largest difference of body positions (m) between MuJoCo and us over a motion from its data."""
    sim = amontons.Simulation(model, dt=dt, tolerance=1e-10)
    put(sim, m, d)
    if control is not None:
        sim.set_control(0, control)
    m.opt.timestep = dt
    names = [m.body(b).name for b in range(m.nbody)]
    rows = [names.index(body.name) for body in model.bodies]
    worst = 0.0
    for _ in range(round(duration / dt)):
        mujoco.mj_step(m, d)
        sim.step()
        mujoco.mj_kinematics(m, d)
        worst = max(worst, np.abs(sim.state.positions - d.xpos[rows]).max())
    return worst


# Breaks when springs, dead bands, dampers or the inertia of tendons have another size or sign than MuJoCo's:
# halving the step halves the difference, as both are of first order, and without the tendon it is much more.
@pytest.mark.parametrize("name", TENDONS)
def test_forces_move_like_mujoco(tmp_path, name):
    path = '<site site="s"/><site site="s1"/><site site="s3"/>'
    model, m, d = compiled(tmp_path, chain(4, TENDONS[name].format(path)))
    worst = []
    for dt in (2e-3, 1e-3):
        mujoco.mj_resetData(m, d)
        d.qpos[:] = [0.3, 0.2, -0.5, 0.4]
        worst.append(differences(model, m, d, dt=dt, duration=0.2))
    assert worst[0] < 4e-3
    assert worst[1] < 0.65 * worst[0] + 1e-5
