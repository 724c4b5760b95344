"""Forces of springs, dampers and drag along qd, and the forces that hold a pose."""

from dataclasses import replace

import amontons
import numpy as np
import pytest
from amontons import ModelBuilder, Simulation, load_model, shapes

SPRINGS = """<mujoco>
  <option gravity="0 0 -9.81" density="800" viscosity="0.3" wind="0.4 -0.2 0.1">
    <flag contact="disable"/>
  </option>
  <worldbody>
    <body name="base" pos="0 0 1">
      <freejoint name="base"/>
      <geom type="box" size="0.2 0.15 0.1" mass="3"/>
      <site name="from" pos="0.2 0 0.1"/>
      <body name="upper" pos="0 0 -0.1">
        <joint name="hip" type="ball" stiffness="6" damping="0.5"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03" mass="1"/>
        <body name="lower" pos="0 0 -0.3">
          <joint name="knee" axis="0 1 0" stiffness="4" springref="0.3" damping="0.2"/>
          <joint name="slide" type="slide" axis="0 0 1" stiffness="90" damping="2"/>
          <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.5"/>
          <site name="to" pos="0.05 0 -0.1"/>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="string" stiffness="30" springlength="0.1 0.2" damping="1.5">
      <site site="from"/><site site="to"/>
    </spatial>
    <fixed name="sum" stiffness="2" damping="0.1">
      <joint joint="knee" coef="2"/><joint joint="slide" coef="-1"/>
    </fixed>
  </tendon>
</mujoco>"""


# Breaks when a spring, damper, tendon or drag is left out, or has another sign, rest, axes or law: MuJoCo's
# qfrc_passive is the same, and mj_inverse without contacts is inverse_dynamics(passive=True).
def test_beside_mujoco(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "springs.xml"
    path.write_text(SPRINGS)
    theirs = mujoco.MjModel.from_xml_path(str(path))
    data, sim = mujoco.MjData(theirs), Simulation(load_model(path))
    rng = np.random.default_rng(3)
    for _ in range(5):
        q = np.array(theirs.qpos0)
        mujoco.mj_integratePos(theirs, q, rng.normal(size=theirs.nv), 0.3)
        data.qpos[:], data.qvel[:], data.qacc[:] = q, rng.normal(size=theirs.nv), rng.normal(size=theirs.nv)
        mujoco.mj_inverse(theirs, data)
        sim.q, sim.qd = q, data.qvel
        scale = np.abs(data.qfrc_passive).max()
        assert sim.forces.passive_forces() == pytest.approx(data.qfrc_passive, abs=1e-9 * scale)
        found = sim.forces.inverse_dynamics(data.qacc, passive=True)
        assert found == pytest.approx(data.qfrc_inverse, abs=1e-9 * np.abs(data.qfrc_inverse).max())


def linkage():
    """Four bars with a spring at a pin that closes the loop; only the crank is meant to be driven."""
    builder = ModelBuilder()
    for name, x in (("crank", 0.0), ("rocker", 0.6)):
        builder.add_body(name, shape=shapes.Capsule(0.02, 0.15), mass=0.5, position=(x, 0, 0.15))
        builder.add_revolute_joint(name, axis=(0, 1, 0), point=(x, 0, 0), name=f"{name}_pin")
    builder.add_body("rod", shape=shapes.Capsule(0.02, 0.3), mass=0.7, position=(0.3, 0, 0.3),
                     orientation=amontons.axis_angle((0, 1, 0), np.pi / 2))  # fmt: skip
    builder.add_revolute_joint("rod", "crank", axis=(0, 1, 0), point=(0, 0, 0.3), name="near")
    builder.add_revolute_joint(
        "rod", "rocker", axis=(0, 1, 0), point=(0.6, 0, 0.3), name="far", stiffness=5.0
    )
    return builder.build()


# Breaks when springs do not help, torques are put on passive pins of loops, or the crank's torque is not the
# one with which the mechanism stays. A step of 1 ms moves it by the rounding of forces alone.
@pytest.mark.parametrize("joints", [None, ("crank_pin",)])
def test_a_linkage_is_held(joints):
    sim = Simulation(linkage(), dt=1e-3)
    sim.set_q({"crank_pin": 0.4})
    start = sim.q
    held = sim.forces.gravity_compensation(joints=joints)
    if joints:
        assert np.count_nonzero(held) == 1
    sim.state.joint_forces = held
    sim.run(0.3)
    assert sim.q == pytest.approx(start, abs=1e-5)
    loose = Simulation(sim.model, dt=1e-3)
    loose.q = start
    loose.state.joint_forces = loose.forces.gravity_compensation(joints=joints, springs=False)
    loose.run(0.3)
    assert np.abs(loose.q - start).max() > 1e-3


# Breaks when what nobody holds is held by forces that were not asked for.
def test_what_is_not_held():
    builder = ModelBuilder()
    builder.add_body("upper", shape=shapes.Capsule(0.03, 0.2), mass=2.0, position=(0.2, 0, 0),
                     orientation=amontons.axis_angle((0, 1, 0), np.pi / 2))  # fmt: skip
    builder.add_body("lower", shape=shapes.Capsule(0.03, 0.2), mass=1.0, position=(0.6, 0, 0),
                     orientation=amontons.axis_angle((0, 1, 0), np.pi / 2))  # fmt: skip
    builder.add_revolute_joint("upper", axis=(0, 1, 0), point=(0, 0, 0), name="shoulder")
    builder.add_revolute_joint("lower", "upper", axis=(0, 1, 0), point=(0.4, 0, 0), name="elbow")
    sim = Simulation(builder.build())
    with pytest.raises(amontons.InputError, match="cannot hold"):
        sim.forces.gravity_compensation(joints=["shoulder"])
    with pytest.raises(amontons.InputError, match="no coordinate .sholder."):
        sim.forces.gravity_compensation(joints=["sholder"])
    with pytest.raises(amontons.InputError, match="give several names"):
        sim.forces.gravity_compensation(joints="shoulder")
    with pytest.raises(amontons.InputError, match="a name is array"):
        sim.forces.gravity_compensation(joints=[np.zeros(2)])
    with pytest.raises(amontons.InputError, match="give a list"):
        sim.forces.gravity_compensation(joints=3)
    model = replace(sim.model)
    assert Simulation(model).forces.gravity_compensation(joints=["shoulder", "elbow"]) == pytest.approx(
        sim.forces.gravity_compensation()
    )
