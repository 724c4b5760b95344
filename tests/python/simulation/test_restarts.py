"""Beginning again, going on in a copy, and the controls that both carry along."""

import copy
import math
import pickle

import numpy as np
import pytest
from amontons import InputError, ModelBuilder, Motor, Simulation, shapes
from floating_robot import box, robot

# Products of the same rotations in another order: a few roundings apart, of numbers around one.
ROUNDING = 1e-13


@pytest.fixture(scope="module")
def mujoco():
    return pytest.importorskip("mujoco")


# Breaks when time, state, controls or loads are not those of a new simulation or of the keyframe.
def test_reset(mujoco, tmp_path):
    model, m, _d = robot(mujoco, tmp_path)
    sim, new = Simulation(model), Simulation(model)
    view = sim.state.positions
    sim.state.forces[:] = 1
    sim.controls = (0.5, 0.1)
    sim.run(0.1)
    sim.reset()
    assert (sim.time, sim.steps, len(sim.contacts)) == (0, 0, 0)
    assert not sim.controls.any()
    assert not sim.state.forces.any()
    sim.run(0.05), new.run(0.05)
    np.testing.assert_array_equal(sim.state.positions, new.state.positions)
    assert view is sim.state.positions
    sim.reset("start", qd={"swing": 0.5})
    assert sim.time == 0.25
    assert sim.controls == pytest.approx([0.5, 0.25])
    np.testing.assert_allclose(sim.q, m.key_qpos[0], atol=ROUNDING)
    assert sim.kinematics.rate("swing") == pytest.approx(0.5)
    sim.step()
    assert sim.time == pytest.approx(0.25 + sim.dt)
    positions, time = sim.state.positions.copy(), sim.time
    for call, message in [
        (lambda: sim.reset("end"), 'no keyframe "end"; known are start'),
        (lambda: sim.reset("start", q={"hip": math.inf}), "is not finite"),
    ]:
        with pytest.raises(InputError, match=message):
            call()
        assert sim.time == time
        np.testing.assert_array_equal(sim.state.positions, positions)


# Breaks when controls are not clipped, not in the order of the actuators, or a bad one is taken.
def test_controls(mujoco, tmp_path):
    model, *_ = robot(mujoco, tmp_path)
    sim = Simulation(model)
    assert model.actuator_names == ("m", "p")
    sim.controls = (2.0, 0.7)
    assert sim.controls == pytest.approx([1.0, 0.7])
    sim.step()
    assert sim.forces.actuator_efforts["effort"][0] == pytest.approx(1.0)
    sim.set_control("m", -0.5)
    assert sim.controls == pytest.approx([-0.5, 0.7])
    for values, message in [((1.0,), r"shape \(1,\)"), ((math.nan, 0), 'control of "m" is nan')]:
        with pytest.raises(InputError, match=message):
            sim.controls = values
    assert sim.controls == pytest.approx([-0.5, 0.7])


def stack():
    builder = ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    for i in range(3):
        box(builder, f"box{i}", (0.01 * i, 0, 0.05 + 0.1 * i))
    builder.add_revolute_joint("box2", "box1", point=(0, 0, 0.2), axis=(0, 0, 1), name="pivot",
                               motor=Motor("velocity", 0.5, max_effort=5.0))  # fmt: skip
    return builder.build()


# Breaks when a copy does not go on bit for bit, or shares something with the original.
@pytest.mark.parametrize(
    "make",
    [lambda s: s.copy(), copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))],
    ids=["copy()", "copy.copy", "deepcopy", "pickle"],
)
def test_copies_go_on_bit_for_bit(make):
    sim = Simulation(stack(), dt=2e-3, restitution_speed=0.1)
    sim.run(0.1)
    other = make(sim)
    assert other.time == sim.time
    assert dict(other.options) == dict(sim.options)
    assert other.state.positions.base is not sim.state.positions.base
    expected = []
    for _ in range(20):
        sim.step()
        expected.append(sim.state.positions.copy())
    for positions in expected:  # after, so that a shared state would have moved
        other.step()
        np.testing.assert_array_equal(other.state.positions, positions)
    np.testing.assert_array_equal(other.forces.impulses, sim.forces.impulses)
    other.before_step.append(lambda sim: None)
    assert not sim.before_step


# Breaks when what the last step found is lost in a copy, or a subclass loses its own attributes.
def test_copies_keep_the_last_step():
    class Mine(Simulation):
        pass

    sim = Mine(stack())
    sim.notes = ["a"]
    sim.run(0.05)
    other, deep = sim.copy(), copy.deepcopy(sim)
    np.testing.assert_array_equal(other.contacts["force"], sim.contacts["force"])
    np.testing.assert_array_equal(other.qdd, sim.qdd)
    assert type(other) is Mine
    assert other.notes is sim.notes
    assert deep.notes == ["a"]
    assert deep.notes is not sim.notes
    assert deep.model is sim.model
    assert copy.deepcopy(sim.model) is sim.model
