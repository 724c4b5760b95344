"""MJCF files in motion: closed forms, and MuJoCo with a tiny step."""

import amontons
import numpy as np
import pytest
from mjcf import load, mujoco

PENDULUM = """<option timestep="1e-4" integrator="RK4"/><compiler angle="radian"/>"""


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
