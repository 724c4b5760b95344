"""One array of controls over actuators and motors, forces along joints, functions around steps."""

import math
import pickle

import amontons
import numpy as np
import pytest
from amontons import InputError, ModelBuilder, Motor, Simulation, load_model, rollout, shapes

G = 9.81
URDF = """<robot name="r"><link name="base"/>
<link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/>
<inertia ixx="0.02" iyy="0.02" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><origin xyz="0 0 -0.2"/><mass value="0.5"/>
<inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="finger"><inertial><mass value="0.1"/>
<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hip" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="30" velocity="1"/></joint>
<joint name="knee" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/>
<axis xyz="0 1 0"/></joint>
<joint name="grip" type="prismatic"><parent link="lower"/><child link="finger"/><origin xyz="0 0 -0.4"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="5" velocity="1"/><mimic joint="knee"/></joint>
</robot>"""


def chain(motor=None):
    """A trunk that floats, an arm on a hinge and a slide, a ball with a link turned the other way round, and
    a point on a line: every kind of coordinate."""
    b = ModelBuilder()
    box = dict(shape=shapes.Box((0.1, 0.05, 0.2)), density=800)
    b.add_body("trunk", position=(0, 0, 1), **box)
    b.add_body("arm", position=(0.4, 0, 1), **box)
    b.add_body("hand", position=(0.8, 0.1, 1), **box)
    b.add_body("ring", position=(0, 0.5, 1), **box)
    b.add_body("bead", position=(0, 1, 1), **box)
    b.add_revolute_joint("arm", "trunk", point=(0.2, 0, 1), axis=(0.1, 1, 0.3), name="hinge", motor=motor)
    b.add_prismatic_joint("hand", "arm", axis=(1, 0.2, 0), name="slide")
    b.add_ball_joint("trunk", "ring", point=(0, 0.3, 1), name="ball")
    b.add_point_on_line_joint("bead", "ring", point=(0, 0.8, 1), axis=(0.1, 0.2, 1), name="line")
    return b.build()


def pendulum(**options):
    b = ModelBuilder()
    b.add_body("rod", shape=shapes.Box((0.5, 0.02, 0.02)), mass=1.0, position=(0.5, 0, 1))
    b.add_revolute_joint("rod", point=(0, 0, 1), axis=(0, 1, 0), name="hinge", **options)
    return b.build()


# Breaks when a force along a coordinate is not that of the equations of motion, M qdd + c = tau: in sign, in
# axes, at the point where it acts, or where a joint has dofs and a ball. The step is first order in h: the
# accelerations of the free motion from rest differ by less than h times the largest rate.
def test_joint_forces_are_generalised_forces():
    model = chain()
    assert model.nv == 6 + 1 + 1 + 3 + 4
    random = np.random.default_rng(2)
    for _ in range(3):
        sim = Simulation(model, dt=1e-6, tolerance=1e-13)
        q = sim.q + 0.2 * random.standard_normal(model.nq)
        sim.reset(q=q)
        tau = 20 * random.standard_normal(model.nv)
        expected = np.linalg.solve(sim.forces.mass_matrix(), tau - sim.forces.bias_forces())
        sim.state.joint_forces = tau
        sim.step()
        np.testing.assert_allclose(sim.qd / sim.dt, expected, rtol=1e-4, atol=1e-4 * abs(expected).max())


# Breaks when a constant force does not act on a joint without a motor, through the whole run: on a slider
# v = F t / m, and a torque of m g l / 2 holds a rod level.
def test_constant_forces():
    b = ModelBuilder(gravity=(0, 0, 0))
    b.add_body("slider", shape=shapes.Box((0.1, 0.1, 0.1)), mass=2.0)
    b.add_prismatic_joint("slider", axis=(1, 0, 0), name="rail")
    sim = Simulation(b.build())
    sim.state.joint_forces[0] = 3.0
    sim.run(1.0)
    assert sim.kinematics.rate("rail") == pytest.approx(1.5, rel=1e-12)
    sim = Simulation(pendulum())
    sim.state.joint_forces[0] = -0.5 * G
    sim.run(1.0)
    assert abs(sim.kinematics.coordinate("hinge")) < 1e-6


# Breaks when forces that hold a chain against gravity, by the equations of motion, do not: it would fall.
def test_joint_forces_hold_a_chain():
    sim = Simulation(chain(), dt=2e-3)
    at = sim.q
    sim.run(0.3, before_step=lambda s: s.state.__setattr__("joint_forces", s.forces.bias_forces()))
    np.testing.assert_allclose(sim.q, at, atol=1e-6)


# Breaks when forces are lost in a saved state, a copy or a pickle, or stay after a reset.
def test_joint_forces_are_part_of_the_state(tmp_path):
    sim = Simulation(pendulum())
    sim.state.joint_forces[0] = 2.0
    sim.run(0.1)
    sim.save(tmp_path / "sim.h5")
    for other in (sim.copy(), pickle.loads(pickle.dumps(sim)), Simulation.load(tmp_path / "sim.h5")):
        branch = sim.copy()
        other.run(0.1), branch.run(0.1)
        np.testing.assert_array_equal(other.q, branch.q)
    view = sim.state.joint_forces
    sim.reset()
    assert view[0] == 0
    view[0] = math.nan
    with pytest.raises(InputError, match=r"joint_forces\[0\] is not finite"):
        sim.step()


# Breaks when rows of forces go to another world or row, or a world has other bits than by itself.
def test_joint_forces_in_rollouts():
    model = pendulum()
    forces = np.random.default_rng(1).uniform(-5, 5, (3, 4, 1))
    result = rollout(model, np.zeros((3, 2)), joint_forces=forces, repeat=2)
    for k in range(3):
        alone = Simulation(model)
        alone.reset(q=[0.0], qd=[0.0])
        for row in range(4):
            alone.state.joint_forces = forces[k, row]
            alone.run(2 * alone.dt)
            np.testing.assert_array_equal(result.q[k, row], alone.q)
    with pytest.raises(
        InputError, match=r"joint_forces has the shape \(4,\); it must be \(worlds, rows, nv\)"
    ):
        rollout(model, np.zeros((3, 2)), joint_forces=np.zeros(4))
    with pytest.raises(InputError, match="controls has 2 rows, but joint_forces has 4"):
        rollout(pendulum(motor=Motor("effort")), np.zeros((3, 2)), np.zeros((2, 1)), joint_forces=forces)


def both():
    """A hinge with a motor and an actuator of the name of the hinge, and another joint with a motor alone."""
    b = ModelBuilder(gravity=(0, 0, 0))
    for k, name in enumerate(("elbow", "wrist", "loose")):
        b.add_body(name, shape=shapes.Box((0.1, 0.05, 0.2)), density=800, position=(0, k, 0))
        motor = None if name == "loose" else Motor("effort", control=0.5, max_effort=2.0)
        b.add_revolute_joint(name, point=(0, k, 0), axis=(0, 0, 1), name=name, motor=motor)
    b.add_actuator("elbow", joint="elbow", control_limits=(-1, 1))
    return b.build()


# Breaks when an entry of the one array is another drive's, a name is given twice, or a limit is not kept.
def test_controls_of_actuators_and_motors():
    model = both()
    assert model.control_names == ("elbow", "elbow motor", "wrist")
    assert model.control_limits == ((-1, 1), (-2, 2), (-2, 2))
    sim = Simulation(model)
    np.testing.assert_array_equal(sim.controls, (0, 0.5, 0.5))
    sim.controls = (5, 0, -5)
    np.testing.assert_array_equal(sim.controls, (1, 0, -2))
    sim.set_control("elbow motor", 0.25)
    sim.step()
    assert sim.forces.effort("elbow").motor == pytest.approx(1.25)  # of the actuator and the motor
    assert sim.forces.effort("elbow").control == 0.25
    assert sim.forces.effort("wrist").motor == pytest.approx(-2)
    assert math.isnan(sim.forces.effort("loose").control)
    result = rollout(model, [sim], np.full((3, 3), 9.0))
    np.testing.assert_array_equal(result.simulations[0].controls, (1, 2, 2))


# Breaks when a joint without a motor takes a control without a word, or the message does not name joint and
# remedy.
def test_joint_without_a_motor():
    sim = Simulation(both())
    with pytest.raises(
        InputError, match=r'joint "loose" has no motor; .*builder.set_motor\(.loose., Motor'
    ) as e:
        sim.set_control("loose", 1.0)
    assert "state.joint_forces" in str(e.value)
    assert "motors=Motor" in str(e.value)
    assert not hasattr(sim.state, "targets")
    with pytest.raises(AttributeError, match="the state has no targets"):
        sim.state.targets = 1.0


# Breaks when a joint with several motors takes a control by its name alone.
def test_several_motors_of_a_joint():
    b = ModelBuilder(gravity=(0, 0, 0))
    b.add_body("rod", shape=shapes.Sphere(0.1), mass=1.0)
    b.add_cylindrical_joint("rod", point=(0, 0, 0), axis=(0, 0, 1), name="shaft", motor=Motor("velocity"))
    sim = Simulation(b.build())
    assert sim.model.control_names == ("shaft[0]", "shaft[1]")
    with pytest.raises(InputError, match=r"have the controls shaft\[0\], shaft\[1\]; name one"):
        sim.set_control("shaft", 1.0)
    sim.set_control("shaft[1]", 2.0)
    sim.step()
    np.testing.assert_allclose(sim.qd, (0, 2), atol=1e-9)


# Breaks when gains that a motor does not have are taken without a word.
@pytest.mark.parametrize(
    ("given", "said"),
    [
        (dict(kind="velocity", kp=1), "kp is of position motors; a motor of the kind velocity takes kd"),
        (dict(kind="effort", kp=1), "kp is of position motors"),
        (dict(kind="effort", kd=1), "kd is of velocity motors, and of position motors with kp"),
        (dict(kind="position", kd=1), "kd is of velocity motors, and of position motors with kp"),
        (
            dict(kind="speed"),
            "unknown motor kind 'speed' .here it is called 'velocity'.; known are none, effort, velocity, ",
        ),
    ],
)
def test_gains_without_effect(given, said):
    with pytest.raises(InputError, match=said):
        Motor(**given)


# Breaks when the names of version 0.1.0 are taken for nothing in particular.
@pytest.mark.parametrize(("old", "new"), [("gain", "kp"), ("damping_gain", "kd"), ("target", "control")])
def test_old_names(old, new):
    with pytest.raises(TypeError, match=f"did you mean '{new}'"):
        Motor("position", **{old: 1.0})


# Breaks when motors= leaves a joint out, drives one that follows another, or loses the effort of the file.
def test_motors_of_a_urdf(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(URDF)
    with pytest.warns(amontons.ModelWarning):
        plain = load_model(path)
    assert plain.control_names == ()
    with pytest.warns(amontons.ModelWarning):
        model = load_model(path, motors=Motor("position", kp=400, kd=40, max_effort=100))
    assert model.control_names == ("hip", "knee")
    motors = [model.joints[model.joint_index(name)].dofs[0].motor for name in ("hip", "knee", "grip")]
    assert [motor.max_effort for motor in motors] == [30, 100, 5]
    assert motors[2].kind == "none"
    sim = Simulation(model)
    sim.controls = (0.3, -0.5)
    sim.run(3.0)
    assert sim.kinematics.coordinate("knee") == pytest.approx(-0.5, abs=0.02)
    with pytest.raises(InputError, match=r"motors is 3; give a Motor"):
        load_model(path, motors=3)
    mjcf = tmp_path / "m.xml"
    mjcf.write_text('<mujoco><worldbody><body><joint/><geom size="0.1"/></body></worldbody></mujoco>')
    with pytest.raises(InputError, match="motors is for URDF"):
        load_model(mjcf, motors=Motor("effort"))


# Breaks when what is called before and after steps is not called in the order of the lists and then of the
# run, or stays after the run.
def test_before_and_after():
    sim, told = Simulation(pendulum()), []
    sim.before_step.append(lambda s: told.append("list"))
    sim.after_step.append(lambda s, r: told.append(r.time))
    sim.run(sim.dt, before_step=lambda s: told.append("run"), after_step=lambda s, r: told.append("end"))
    assert told == ["list", "run", sim.dt, "end"]
    told.clear()
    sim.step()
    assert told == ["list", 2 * sim.dt]
    sim.after_step.append(lambda s, r: s.steps == 5)
    assert sim.run(1.0).time == pytest.approx(5 * sim.dt)
    with pytest.raises(InputError, match="make no step of their own simulation"):
        sim.run(0.1, after_step=lambda s, r: s.step())
    with pytest.raises(InputError, match="before_step is a int; it must be callable"):
        sim.run(0.1, before_step=3)


# Breaks when a rollout with functions has other bits than one without, does not call them, or goes on after
# one ends its world.
def test_before_and_after_in_rollouts():
    model = pendulum(motor=Motor("effort"))
    controls = np.random.default_rng(1).uniform(-5, 5, (2, 4, 1))
    plain = rollout(model, np.zeros((2, 2)), controls, repeat=3)
    calls = []
    watched = rollout(
        model, np.zeros((2, 2)), controls, repeat=3,
        before_step=lambda s: calls.append(s.time), after_step=lambda s, r: calls.append(r.time),
    )  # fmt: skip
    np.testing.assert_array_equal(plain.q, watched.q)
    assert len(calls) == 2 * 2 * 4 * 3
    ended = rollout(model, np.zeros((2, 2)), controls, repeat=3, after_step=lambda s, r: s.steps == 6)
    np.testing.assert_array_equal(ended.q[:, :2], plain.q[:, :2])
    assert np.isnan(ended.q[:, 2:]).all()
    worlds = [Simulation(model) for _ in range(2)]
    worlds[1].before_step.append(lambda s: s.set_control("hinge", 3.0))
    assert rollout(model, worlds, steps=1).simulations[1].controls == [3.0]


# Breaks when a recorder is no function to be called after steps.
def test_recorder_after_steps(tmp_path):
    sim = Simulation(pendulum())
    with amontons.record(tmp_path / "run.h5", sim) as recorder:
        sim.run(0.1, after_step=recorder)
    assert len(amontons.read_recording(tmp_path / "run.h5")) == 21
    recorder = amontons.record(tmp_path / "other.h5", sim)
    with recorder, pytest.raises(InputError, match="records another simulation"):
        sim.copy().run(0.1, after_step=recorder)


# Breaks when keyframes are not found by number, or the message does not list them.
def test_keyframes_by_name_and_number():
    model = load_model("examples/models/arm.xml")
    assert model.keyframes[model.keyframe_index("bent")].name == "bent"
    one, two = Simulation(model), Simulation(model)
    one.reset("bent")
    two.reset(model.keyframe_index("bent"))
    np.testing.assert_array_equal(one.q, two.q)
    with pytest.raises(InputError, match=r'no keyframe "bend" \(did you mean .bent.\?\); known are'):
        one.apply_keyframe("bend")
    with pytest.raises(InputError, match="there is no keyframe 9; the model has"):
        one.reset(9)
