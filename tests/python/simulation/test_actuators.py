"""Actuators: efforts of every law and transmission against MuJoCo, motions, activations, bad input."""

from __future__ import annotations

import math

import amontons
import numpy as np
import pytest
from amontons import InputError, Transform
from amontons.parts import Actuator, PathElement, Tendon, Transmission
from test_tendons import compiled, differences, put, refusal

mujoco = pytest.importorskip("mujoco")

ARM = """
<option gravity="0 0 -3"><flag contact="disable"/></option>
<worldbody>
  <site name="ground" pos="0.2 0.1 0.6" euler="10 20 30"/>
  <body name="upper" pos="0 0 1">
    <joint name="hip" axis="0 1 0.2" damping="0.05"/>
    <joint name="knee" axis="1 0 0" pos="0 0 0.02" damping="0.05"/>
    <geom type="capsule" size="0.05" fromto="0 0 0 0.3 0.1 0" mass="1"/>
    <site name="mid" pos="0.1 0.05 0.1" euler="40 0 10"/>
    <body name="lower" pos="0.3 0.1 0">
      <joint name="reach" type="slide" axis="1 0 1" damping="0.5"/>
      <geom type="box" size="0.1 0.06 0.03" mass="0.5"/>
      <site name="tip" pos="0.1 0.02 0.05" euler="0 70 20"/>
      <body name="hand" pos="0.1 0 0.1"><joint name="wrist" type="ball" damping="0.01"/>
        <geom type="box" size="0.04 0.08 0.06" pos="0.05 0 0" mass="0.3"/></body>
    </body>
  </body>
  <body name="drone" pos="0 -1 1"><freejoint name="free"/><geom type="box" size="0.1 0.15 0.05" mass="0.8"/>
    <site name="rotor" pos="0.1 0.1 0.02" euler="5 10 0"/></body>
</worldbody>
<tendon>
  <fixed name="sum"><joint joint="hip" coef="1.5"/><joint joint="knee" coef="-0.5"/></fixed>
  <spatial name="rope"><site site="ground"/><site site="mid"/><site site="tip"/></spatial>
</tendon>
"""

ON = {
    "hinge": 'joint="hip" gear="-3"',
    "slide": 'joint="reach" gear="2"',
    "ball": 'joint="wrist" gear="0.2 -0.1 0.3"',
    "ball in parent": 'jointinparent="wrist" gear="0.2 -0.1 0.3"',
    "free, force": 'joint="free" gear="1 2 3 0 0 0"',
    "free, torque": 'joint="free" gear="0 0 0 0.3 0.2 0.1"',
    "free in parent": 'jointinparent="free" gear="1 -1 2 0.3 0.2 0.1"',
    "fixed tendon": 'tendon="sum" gear="1.3"',
    "spatial tendon": 'tendon="rope" gear="-0.7"',
    "site": 'site="rotor" gear="0.1 0.2 1 0 0 0.05"',
    "site on an arm": 'site="tip" gear="1 0.5 -0.3 0.02 0 0.05"',
    "site from another": 'site="tip" refsite="ground" gear="1 -2 0.5 0.1 0.2 -0.1"',
    "slider-crank": 'cranksite="tip" slidersite="ground" cranklength="0.9" gear="1.4"',
    "slider-crank out of reach": 'cranksite="tip" slidersite="ground" cranklength="0.01" gear="1.4"',
}


# Breaks when a transmission has another length or acts along another line than MuJoCo's: the rates are
# products of all entries of the moment arms with velocities at random.
@pytest.mark.parametrize("name", ON)
def test_transmissions(tmp_path, name):
    text = f'{ARM}<actuator><motor name="m" {ON[name]}/></actuator>'
    model, m, d = compiled(tmp_path, text)
    sim = amontons.Simulation(model)
    random = np.random.default_rng(5)
    has_length = not ("free" in name or name in ("site", "site on an arm"))
    for _ in range(50):
        d.qpos[:] = random.uniform(-0.4, 0.4, m.nq)
        d.qpos[3:7] += [1, 0, 0, 0]
        d.qvel[:] = random.normal(size=m.nv)
        mujoco.mj_normalizeQuat(m, d.qpos)
        put(sim, m, d)
        (row,) = sim.forces.actuator_efforts
        if has_length:
            assert row["length"] == pytest.approx(d.actuator_length[0], abs=1e-10)
        assert row["rate"] == pytest.approx(d.actuator_velocity[0], abs=1e-10)


LAWS = {
    "motor": "<motor {}/>",
    "motor, limits of force": '<motor forcerange="-0.3 0.1" {}/>',
    "position": '<position kp="6" kv="0.4" {}/>',
    "position, limits of force": '<position kp="6" kv="0.4" forcerange="-0.5 0.2" {}/>',
    "velocity": '<velocity kv="0.7" {}/>',
    "integrated velocity": '<intvelocity kp="5" kv="0.2" actrange="-0.3 0.4" {}/>',
    "filtered position": '<position kp="6" kv="0.2" timeconst="0.1" {}/>',
    "damper": '<damper kv="0.8" ctrlrange="0 2" {}/>',
    "cylinder": '<cylinder area="0.6" timeconst="0.2" bias="0.1 -0.5 -0.2" {}/>',
    "general": '<general gaintype="affine" gainprm="0.4 -0.8 -0.3" biastype="affine" biasprm="0.2 0.5 0.1"'
    " {}/>",
    "early": '<general dyntype="filterexact" dynprm="0.05" actearly="true" gainprm="0.7" {}/>',
    "negative": '<general biastype="affine" biasprm="0.1 0.8 0.3" {}/>',
}


def one(law, on):
    drive = law.format('name="m" ' + on)
    return f"{ARM}<actuator>{drive}</actuator>"


# Breaks when an effort is not MuJoCo's. In a first step of ten nanoseconds what acts within the step has no
# time to differ from what MuJoCo takes from its start: what is left is rounding of that step, over the
# softness of a row.
@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("on", ["hinge", "spatial tendon", "site from another", "ball"])
def test_laws(tmp_path, name, on):
    if (name, on) == ("general", "ball"):
        pytest.skip("which of the lengths that differ by turns counts is said for servos only")
    text = one(LAWS[name], ON[on])
    model, m, d = compiled(tmp_path, text)
    dt = m.opt.timestep = 1e-8
    random = np.random.default_rng(7)
    limited = 0
    for _ in range(20):
        sim = amontons.Simulation(model, dt=dt, tolerance=1e-12)
        mujoco.mj_resetData(m, d)
        d.qpos[:3], d.qvel[:] = random.uniform(-0.4, 0.4, 3), random.normal(size=m.nv)
        d.ctrl[0] = random.uniform(-1, 2)
        d.act[:] = random.uniform(-0.3, 0.3)
        put(sim, m, d)
        sim.set_control("m", d.ctrl[0])
        sim.state.activations = d.act if m.na else 0.0
        expected = d.actuator_force[0]
        sim.step()
        (row,) = sim.forces.actuator_efforts
        assert row["effort"] == pytest.approx(expected, abs=1e-4)
        mujoco.mj_step(m, d)
        if m.na and on != "ball":  # MuJoCo takes turns off the activation
            assert row["activation"] == pytest.approx(d.act[0], abs=1e-12)
        limited += any(abs(expected - x) < 1e-12 for x in m.actuator_forcerange[0])
    assert limited > 0 or "limits" not in name


# Breaks when an effort that is known before the step is not MuJoCo's to rounding.
@pytest.mark.parametrize("on", ON)
def test_known_efforts(tmp_path, on):
    text = f'{ARM}<actuator><motor name="m" {ON[on]} forcerange="-0.5 2"/></actuator>'
    model, m, d = compiled(tmp_path, text)
    random = np.random.default_rng(8)
    for _ in range(5):
        sim = amontons.Simulation(model, dt=1e-4)
        mujoco.mj_resetData(m, d)
        d.qpos[:3], d.ctrl[0] = random.uniform(-0.4, 0.4, 3), random.uniform(-1, 1)
        put(sim, m, d)
        sim.set_control("m", d.ctrl[0])
        sim.step()
        assert sim.forces.actuator_efforts[0]["effort"] == pytest.approx(d.actuator_force[0], rel=1e-12)


# Breaks when an actuator moves bodies otherwise than in MuJoCo, over half a second: both are of first order.
@pytest.mark.parametrize("on", ON)
@pytest.mark.parametrize("law", ["motor", "position"])
def test_motions(tmp_path, on, law):
    control = {"motor": 0.5, "position": 0.3}[law]
    text = one(LAWS[law], ON[on])
    if law == "position" and ("free" in on or (on.startswith("site") and "another" not in on)):
        pytest.skip("these have no length for MuJoCo")
    model, m, d = compiled(
        tmp_path, text.replace('gravity="0 0 -3"', 'gravity="0 0 -3" integrator="implicit"')
    )
    worst = []
    for dt in (2e-3, 1e-3):
        mujoco.mj_resetData(m, d)
        d.ctrl[0] = control
        worst.append(differences(model, m, d, dt=dt, duration=0.3, control=control))
    assert worst[0] < 2e-2
    assert worst[1] < 0.65 * worst[0] + 1e-5


# Breaks when limits of the effort of a joint or tendon are lost: they hold for what drives it alone,
# whichever way its gear turns; for the sum of several whose efforts depend on the control alone; what is left
# is listed.
def test_limits_of_joints_and_tendons(tmp_path):
    body = """<worldbody><body><joint name="j" actuatorfrcrange="-3 4"/><geom size="0.1"/>
    <body><joint name="k" actuatorfrcrange="-1 1"/><geom size="0.1" pos="1 0 0"/><site name="s"/>
    </body></body></worldbody>
    <tendon><fixed name="t" actuatorfrcrange="-5 6"><joint joint="j" coef="1"/></fixed></tendon>"""
    text = f"""{body}<actuator><motor name="a" joint="j" gear="-2" forcerange="-1 9"/>
    <motor name="b" joint="k"/><motor name="c" joint="k"/><position name="d" tendon="t" kp="1"/>
    <motor name="e" site="s"/></actuator>"""
    path = tmp_path / "model.xml"
    path.write_text(f"<mujoco>{text}</mujoco>")
    with pytest.warns(amontons.UnsupportedWarning):
        model = amontons.load_model(path)
    limits = {a.name: (a.lower_force, a.upper_force) for a in model.actuators}
    free = (-math.inf, math.inf)
    assert limits == {"a": (-1.0, 1.5), "b": free, "c": free, "d": (-5.0, 6.0), "e": free}
    dofs = [joint.dofs[0] for joint in model.joints]
    assert [(d.lower_effort, d.upper_effort) for d in dofs] == [free, (-1.0, 1.0)]
    listed = [(u.element, u.what) for u in model.unread]
    assert [element.split('"')[1] for element, _ in listed] == ["d", "e"]
    assert all("actuatorfrcrange" in what for _, what in listed)


WRONG = {
    "nothing": (dict(), "give one of joint, tendon, body and transmission"),
    "two places": (dict(joint="j", body="b"), "give one of joint"),
    "no such joint": (dict(joint="knee"), 'there is no joint "knee"'),
    "no such dof": (dict(joint="j", dof=1), 'joint "j" has no degree of freedom 1'),
    "no such tendon": (dict(tendon="t"), 'there is no tendon "t"'),
    "a law": (dict(joint="j", law="torque"), "unknown law of an actuator 'torque'; known are"),
    "negative": (dict(joint="j", law="position", kp=-1), "kp = -1; it must not be negative"),
    "kp of an effort": (dict(joint="j", kp=1), 'kp is of the law "position"; that of "effort" takes kd'),
    "both laws": (dict(joint="j", kd=1, gain=(1, 0, 0)), "gain and bias say the whole law"),
    "limits": (dict(joint="j", force_limits=(1, -1)), "lower_force 1 exceeds upper_force -1; swap them"),
    "infinite": (dict(joint="j", gain=(math.inf, 0, 0)), "gain"),
    "time": (dict(joint="j", dynamics="filter", time_constant=-1), "the time constant must be finite"),
    "rod": (
        dict(transmission=Transmission("slider_crank", body="b", reference_body=None)),
        "the rod of a slider-crank must have a positive length",
    ),
}


# Breaks when an actuator that cannot work is taken, or the message does not name it and the remedy.
@pytest.mark.parametrize("name", WRONG)
def test_wrong_actuators(name):
    arguments, message = WRONG[name]
    assert message in refusal("actuator", "drive", arguments)


# Breaks when a part as a whole is another one than that of a call with keywords, or its names are not found.
def test_parts_as_a_whole():
    models = []
    for whole in (True, False):
        builder = amontons.ModelBuilder()
        builder.add_body("b", shape=amontons.shapes.Sphere(0.1), density=1000)
        builder.add_revolute_joint("b", point=(0, 0, 1), axis=(0, 1, 0), name="j")
        if whole:
            path = (PathElement(body="b"), PathElement(frame=Transform((0, 0, 2))))
            builder.add(Tendon("rope", path=path, upper=3.0))
            builder.add(Actuator("pull", Transmission("tendon", tendon="rope", gear=2.0)))
            builder.add(Actuator("turn", Transmission(joint="j"), gain=(4, 0, 0), bias=(0, -4, 0)))
        else:
            builder.add_tendon("rope", path=[("b", (0, 0, 0)), (None, (0, 0, 2))], limits=(None, 3))
            builder.add_actuator("pull", tendon="rope", gear=2.0)
            builder.add_actuator("turn", joint="j", law="position", kp=4)
        models.append(builder.build())
    assert models[0] == models[1]
    with pytest.raises(InputError, match='actuator "lost": there is no joint "k"; known are j'):
        builder.add(Actuator("lost", Transmission(joint="k")))
    with pytest.raises(InputError, match="is no part; give one of Body, Geom, Joint"):
        builder.add("drive")


# Breaks when controls of no actuator, or that are no numbers, are taken.
def test_wrong_controls():
    builder = amontons.ModelBuilder()
    builder.add_body("b", shape=amontons.shapes.Sphere(0.1), density=1000)
    builder.add_revolute_joint("b", point=(0, 0, 1), axis=(0, 1, 0), name="j")
    builder.add_actuator("drive", joint="j", control_limits=(-1, 1))
    sim = amontons.Simulation(builder.build())
    sim.set_control("drive", 5)
    assert sim.controls == [1.0]
    with pytest.raises(InputError, match='there is no control "motor"; known are drive'):
        sim.set_control("motor", 1)
    with pytest.raises(InputError, match="control is nan"):
        sim.set_control(0, math.nan)
    with pytest.raises(InputError, match='joint "j" has no motor; the actuator "drive" drives it'):
        sim.set_control("j", 1.0)
    sim.state.controls[0] = math.inf
    with pytest.raises(InputError, match='actuator "drive": the control or activation is not finite'):
        sim.step()


# Breaks when the sum of efforts on a joint is not bounded as in MuJoCo, by whatever motors and fixed tendons
# it comes: two wheels on one axle, driven by one tendon and steered by another.
def test_sums_of_efforts(tmp_path):
    wheel = """<body pos="0 {y} 0"><joint name="{n}" axis="0 1 0" actuatorfrcrange="-0.5 0.4"/>
    <geom size="0.1"/></body>"""
    text = f"""<worldbody>{wheel.format(y=1, n="l")}{wheel.format(y=-1, n="r")}</worldbody>
    <tendon><fixed name="on"><joint joint="l" coef="0.5"/><joint joint="r" coef="0.5"/></fixed>
    <fixed name="turn"><joint joint="l" coef="-0.5"/><joint joint="r" coef="0.5"/></fixed></tendon>
    <actuator><motor tendon="on"/><motor tendon="turn"/><motor joint="l" gear="-2"/></actuator>"""
    model, m, d = compiled(tmp_path, text)
    random = np.random.default_rng(4)
    for _ in range(20):
        mujoco.mj_resetData(m, d)
        sim = amontons.Simulation(model, dt=m.opt.timestep, tolerance=1e-12)
        d.ctrl[:] = random.uniform(-1, 1, 3)
        sim.controls = d.ctrl
        mujoco.mj_step(m, d)
        sim.step()
        np.testing.assert_allclose(sim.qd, d.qvel, rtol=1e-9)


# Breaks when a keyframe loses controls or activations, or gives them to other actuators.
def test_keyframes(tmp_path):
    text = f"""{ARM}<actuator><motor name="a" joint="hip"/>
    <general name="b" joint="knee" dyntype="integrator" actlimited="true" actrange="-1 1"/></actuator>
    <keyframe><key name="k" ctrl="0.3 -0.2" act="0.7"/></keyframe>"""
    model, _m, _d = compiled(tmp_path, text)
    sim = amontons.Simulation(model)
    sim.reset("k")
    assert sim.controls == pytest.approx([0.3, -0.2])
    assert sim.state.activations == pytest.approx([0, 0.7])
    sim.step()
    assert sim.forces.actuator_efforts["effort"] == pytest.approx([0.3, 0.7])
    assert sim.state.activations[1] == pytest.approx(0.7 - 0.2 * sim.dt)
