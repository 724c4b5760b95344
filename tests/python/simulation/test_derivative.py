"""Derivatives of a step on the faces of its solution, beside central differences of whole steps."""

from dataclasses import replace

import amontons
import numpy as np
import pytest
from amontons import Dof, Joint, Material, ModelBuilder, Motor, Simulation, Transform, shapes
from amontons.parts import PathElement
from amontons.simulation.tangent import along_velocities, difference, integrate

CHANGE = 1e-6
"""of the differences that tests make; their error is the square of it times the third derivative"""


def sliding_box():
    """A box on four corners that slides and turns; a compliance makes its impulses unique."""
    builder = ModelBuilder()
    builder.add_floor(material=Material(friction=0.4, compliance=1e-6))
    builder.add_body("box", shape=shapes.Box((0.2, 0.15, 0.1)), mass=2.0, position=(0, 0, 0.1),
                     linear_velocity=(1.0, 0.3, 0), angular_velocity=(0, 0, 0.5),
                     material=Material(friction=0.4))  # fmt: skip
    return builder.build(), 1, {}, {}


def rolling_ball():
    """A ball that rolls: stick on a curved surface."""
    builder = ModelBuilder()
    builder.add_floor(material=Material(friction=0.6))
    builder.add_body("ball", shape=shapes.Sphere(0.1), mass=1.0, position=(0, 0, 0.1),
                     linear_velocity=(0.5, 0.1, 0), angular_velocity=(-1.0, 5.0, 0.2),
                     material=Material(friction=0.6))  # fmt: skip
    return builder.build(), 3, {}, {}


def bouncing_cube():
    """A cube that strikes with a corner, slips and bounces: an impact is a problem of its own in its step."""
    law, turn = Material(friction=0.3, restitution=0.5), np.array((0.9, 0.3, 0.2, 0.1))
    builder = ModelBuilder()
    builder.add_floor(material=law)
    builder.add_body("cube", shape=shapes.Box((0.05,) * 3), mass=0.37, position=(0, 0, 0.12),
                     orientation=turn / np.linalg.norm(turn), linear_velocity=(1, 0.2, -1),
                     angular_velocity=(3, 2, 1), material=law)  # fmt: skip
    return builder.build(), 7, {}, {}


def arm():
    """Hinges with spring, damper, armature, dry friction that slides, a servo and a motor, at a limit."""
    builder = ModelBuilder()
    builder.add_body("upper", shape=shapes.Capsule(0.03, 0.2), mass=2.0, position=(0, 0, 0.2))
    builder.add_body("lower", shape=shapes.Capsule(0.03, 0.2), mass=1.0, position=(0, 0, 0.6))
    builder.add_revolute_joint("upper", axis=(0, 1, 0), point=(0, 0, 0), name="shoulder", damping=0.4,
                               stiffness=3.0, armature=0.02, friction=0.3,
                               motor=Motor("effort", 0.5))  # fmt: skip
    builder.add_revolute_joint("lower", "upper", axis=(0, 1, 0), point=(0, 0, 0.4), name="elbow",
                               damping=0.1, limits=(-0.4, 2.5))  # fmt: skip
    builder.add_actuator("servo", joint="elbow", law="position", kp=4.0, kd=0.2, control=-1.0)
    return builder.build(), 10, {"shoulder": 0.5, "elbow": 1.5}, {"shoulder": 1.0, "elbow": -0.5}


def loop():
    """A four-bar linkage, closed by a joint, with a spring."""
    builder = ModelBuilder()
    for name, x in (("crank", 0.0), ("rocker", 0.6)):
        builder.add_body(name, shape=shapes.Capsule(0.02, 0.15), mass=0.5, position=(x, 0, 0.15))
        builder.add_revolute_joint(name, axis=(0, 1, 0), point=(x, 0, 0), name=f"{name}_pin", damping=0.05)
    builder.add_body("rod", shape=shapes.Capsule(0.02, 0.3), mass=0.7, position=(0.3, 0, 0.3),
                     orientation=amontons.axis_angle((0, 1, 0), np.pi / 2))  # fmt: skip
    builder.add_revolute_joint("rod", "crank", axis=(0, 1, 0), point=(0, 0, 0.3), name="near")
    builder.add_revolute_joint("rod", "rocker", axis=(0, 1, 0), point=(0.6, 0, 0.3), name="far")
    return builder.build(), 20, {"crank_pin": 0.3}, {"crank_pin": 1.0}


def rope():
    """A rope that slips on a drum, whose angle changes as the weights swing towards it."""
    builder = ModelBuilder()
    for name, x, mass in (("heavy", 0.0, 3.0), ("light", 0.4, 1.0)):
        builder.add_body(name, mass=mass, inertia=(mass,) * 3, position=(x, 0, 0))
        slides = tuple(Dof("slide", axis) for axis in ((1, 0, 0), (0, 0, 1)))
        builder.add_joint(Joint(name, body_a=name, dofs=slides, frame_b=Transform((x, 0, 0))))
    frame = Transform((0.2, 0, 1.5), (0.5**0.5, 0.5**0.5, 0, 0))
    drum = PathElement("cylinder", None, frame, 0.2, (0.2, 0, 2), friction=0.2)
    ends = [("heavy", (0, 0, 0)), drum, ("light", (0, 0, 0))]
    builder.add_tendon("rope", path=ends, stiffness=1e4, rest=3 + 0.2 * np.pi)
    return builder.build(), 10, {}, {"light[0]": 0.3}


def free_flight():
    """A body that tumbles in air with drag: no rows at all."""
    builder = ModelBuilder()
    builder.add_body("stone", shape=shapes.Box((0.1, 0.2, 0.3)), mass=3.0, angular_velocity=(3, 2, 1))
    return builder.build(), 5, {}, {}


def after(model, before, change, by, options, control=None, inputs="controls"):
    """A simulation after a step from a state that is changed; bodies start where the joints put them.

    Its rates are those of the middle of the step.
    """
    sim = Simulation(model, **options)
    sim._core.restore(before)
    sim._core.show_middle()
    q, qd = sim.q, sim.qd
    sim.q = q if change is None else integrate(model, q, by * change[: model.nv])
    sim.qd = qd if change is None else qd + by * change[model.nv :]
    if control is not None:
        getattr(sim._core, inputs)[control] += by
    sim._core.begin_with_shown(False)
    sim.step()
    sim._core.show_middle()
    return sim


def central(model, sim, options, change=None, control=None, inputs="controls"):
    before = sim._core.copy()
    before.restore_last()
    snapshot = before.snapshot()
    # Loops are closed by positions, whose rounding over dt is in the velocities. Without contacts no border
    # is near, so that a larger change shows the slope.
    by = CHANGE if len(sim.contacts) else 10 * CHANGE
    ends = [after(model, snapshot, change, way, options, control, inputs) for way in (by, -by)]
    moved = [difference(model, sim.q, end.q) for end in ends]
    return np.concatenate([moved[0] - moved[1], ends[0].qd - ends[1].qd]) / (2 * by)


MODELS = {
    "slip": sliding_box,
    "stick": rolling_ball,
    "bounce": bouncing_cube,
    "rows of joints": arm,
    "closed loop": loop,
    "rope that slips": rope,
    "no rows": free_flight,
}
CASES = [
    (name, trees) for name in MODELS for trees in ("none", "auto") if (name, trees) != ("closed loop", "auto")
]
"""Redundant rows of loops of trees are solved to 1e-8 alone, which differences of 1e-6 do not bear."""


# Breaks when a kind of row, its face, or a stage of the step beside the solve is missing in the derivative:
# whole steps, solved to 1e-12, that start 1e-5 to both sides must show it. Errors are 1e-10 times the third
# derivative, and 1e-12 / 1e-5 of the solves.
@pytest.mark.parametrize(("name", "trees"), CASES)
def test_state_and_controls(name, trees):
    sim, options = started(name, trees)
    model = sim.model
    found = sim.derivative()
    assert found.differentiable, found.reason
    assert found.margin > 1e-5
    random = np.random.default_rng(1)
    for _ in range(4):
        change = random.normal(size=2 * model.nv) * np.repeat([0.1, 1.0], model.nv)
        if name == "closed loop":  # only changes that the loop allows have steps to compare with
            change[: model.nv] = 0
            probe = sim.copy()
            probe.qd = change[model.nv :]
            change[model.nv :] = probe.qd
        expected = central(model, sim, options, change)
        np.testing.assert_allclose(found.A @ change, expected, atol=3e-6 * np.abs(expected).max())
    for k in range(len(model.control_names)):
        expected = central(model, sim, options, control=k)
        np.testing.assert_allclose(found.B[:, k], expected, atol=3e-6 * np.abs(found.B).max())
        expected = central(model, sim, options, control=k, inputs="held_controls")
        np.testing.assert_allclose(found.B_before[:, k], expected, atol=3e-6 * np.abs(found.B).max())


def started(name, trees="none"):
    """After some steps with a tight tolerance, in motion."""
    model, steps, q, qd = MODELS[name]()
    options = {"dt": 5e-3, "tolerance": 1e-12, "warm_start": False, "on_failure": "ignore"}
    sim = Simulation(replace(model, trees=trees), **options)
    sim.set_q(q)
    sim.set_qd(qd)
    for _ in range(steps):
        sim.step()
    return sim, options


PARAMETERS = {
    "slip": ("friction:*", "mass:box"),
    "stick": ("mass:ball",),
    "bounce": ("friction:*", "restitution:*"),
    "rows of joints": ("damping:shoulder", "armature:shoulder", "mass:lower", "gain:servo"),
    "closed loop": ("damping:crank_pin", "mass:rod"),
}


# Breaks when a parameter reaches the step by another way than the derivative knows: the coefficients of sets,
# inertia, rows of dampers and drives.
@pytest.mark.parametrize("name", PARAMETERS)
def test_parameters(name):
    sim, options = started(name)
    model = sim.model
    found = sim.derivative(parameters=PARAMETERS[name])
    before = sim._core.copy()
    before.restore_last()
    snapshot = before.snapshot()
    for k, parameter in enumerate(PARAMETERS[name]):
        what, pattern = parameter.split(":")
        value = value_of(model, what, pattern)
        by, ends = 1e-4 * value, []
        for sign in (1, -1):
            other = Simulation(model.with_(**{what: {pattern: value + sign * by}}), **options)
            arrays = snapshot.arrays
            scalars = {n: arrays.pop(n) for n in ("time", "steps", "impulse_step", "last_step")}
            other._core.restore(amontons._core.State(other.model.core, arrays=arrays, **scalars))
            other._core.show_middle()
            other.q, other.qd = other.q, other.qd  # bodies are where the joints put them
            other._core.begin_with_shown(False)
            other.step()
            other._core.show_middle()
            ends.append(np.concatenate([difference(model, sim.q, other.q), other.qd]))
        expected = (ends[0] - ends[1]) / (2 * by)
        assert np.abs(expected).max() > 1e-9 or name == "stick"
        np.testing.assert_allclose(found.P[:, k], expected, atol=1e-6 * np.abs(expected).max() + 1e-9)


# Breaks when each derivative over a parameter compiles its variants anew, or another model has them.
def test_variants_of_a_parameter_are_made_once(monkeypatch):
    sim, _ = started("rows of joints")
    first = sim.derivative(parameters=["mass:lower"], inputs="none")
    with monkeypatch.context() as patch:
        patch.setattr("amontons.simulation.derivative.with_values", None)
        again = sim.derivative(parameters=["mass:lower"], inputs="none")
    np.testing.assert_array_equal(first.P, again.P)
    heavier = Simulation(sim.model.with_(mass={"lower": 3.0}), dt=5e-3)
    heavier.step()
    assert heavier.derivative(parameters=["mass:lower"], inputs="none").P.any()
    assert heavier.model._neighbours is not sim.model._neighbours


def value_of(model, what, pattern):
    from amontons.model.quantities import places, values_of

    return values_of(what, model, places(what, model, pattern))[0]


# Breaks when an input of the step before counts as a load that is not one: the aim of a motor is that of this
# step, and so is the control that an activation follows. Of loads the impulse is the mean of both steps, so
# that equal steps have equal columns.
def test_inputs_of_the_step_before():
    builder = ModelBuilder()
    for k, (name, motor) in enumerate((("turned", Motor("velocity", kd=2.0)), ("pushed", Motor("effort")))):
        builder.add_body(name, shape=shapes.Sphere(0.1), mass=1.0, position=(k, 0, 0))
        builder.add_revolute_joint(name, axis=(0, 1, 0), point=(k, 0, 0.5), name=f"{name} pin", motor=motor)
    builder.add_body("filtered", shape=shapes.Sphere(0.1), mass=1.0, position=(2, 0, 0))
    builder.add_revolute_joint("filtered", axis=(0, 1, 0), point=(2, 0, 0.5), name="pin")
    builder.add_actuator("muscle", joint="pin", dynamics="filter", time_constant=0.05)
    model = replace(builder.build(), trees="auto")
    options = {"dt": 5e-3, "tolerance": 1e-12, "warm_start": False}
    sim = Simulation(model, **options)
    for _ in range(3):
        sim.controls = [0.3, 0.4, 0.5]
        sim.step()
    found = sim.derivative()
    assert model.control_names == ("muscle", "turned pin", "pushed pin")
    size = 2 * model.nv
    for k in range(3):
        for columns, inputs in ((found.B, "controls"), (found.B_before, "held_controls")):
            expected = central(model, sim, options, control=k, inputs=inputs)
            np.testing.assert_allclose(columns[:size, k], expected, atol=1e-6 * np.abs(found.B).max())
    np.testing.assert_allclose(found.B_before[:, 2], found.B[:, 2], atol=1e-12)
    assert found.B[size, 0] == pytest.approx(1 - np.exp(-0.1), rel=0.06)  # w' = (control - w) / time constant
    assert not found.B_before[size].any()


# Breaks when the transposed products are not those of the derivative, or the derivatives of steps do not
# multiply: a loss of the state after 50 steps, differentiated backwards, and by differences of whole runs.
def test_adjoint_of_many_steps():
    model = replace(arm()[0], trees="auto")
    options = {"dt": 2e-3, "tolerance": 1e-12, "warm_start": False}
    sim = Simulation(model, **options)
    sim.set_q({"shoulder": 0.5, "elbow": 1.5})
    start, tape = sim.q, []
    for _ in range(50):
        sim.step()
        tape.append(sim.derivative(parameters=["damping:elbow"]))
    cotangent, parameter, control, third = np.array([1.0, -0.5, 0.3, 0.2]), 0.0, 0.0, 0.0
    for k, step in reversed(list(enumerate(tape))):
        back = step.vjp(cotangent)
        cotangent, parameter = back.state, parameter + back.parameters[0]
        control += back.inputs[0] + back.inputs_before[0]
        third += (k == 3) * back.inputs[0] + (k == 4) * back.inputs_before[0]  # of one step alone

    def loss(damping=0.1, effort=-1.0, change=0.0, once=0.0):
        run = Simulation(model.with_(damping={"elbow": damping}), **options)
        run.set_q(start + [change, 0])
        for k in range(50):
            run.controls = [effort + (k == 3) * once, *run.controls[1:]]
            run.step()
        run._core.show_middle()
        return np.concatenate([difference(model, sim.q, run.q), run.qd]) @ [1.0, -0.5, 0.3, 0.2]

    for found, name, at in (
        (parameter, "damping", 0.1),
        (control, "effort", -1.0),
        (third, "once", 0.0),
        (cotangent[0], "change", 0.0),
    ):
        expected = (loss(**{name: at + 1e-5}) - loss(**{name: at - 1e-5})) / 2e-5
        # The control of one step counts for little: what 50 steps of a precision of 1e-8 leave shows there.
        assert found == pytest.approx(expected, rel=1e-5, abs=1e-7)


# Breaks when a product with a row vector is not that of the matrices, entries of quaternions are mixed up, or
# it changes the simulation.
@pytest.mark.parametrize("name", MODELS)
def test_vjp(name):
    sim, _ = started(name)
    model, random = sim.model, np.random.default_rng(2)
    before, start = sim._core.snapshot().arrays, sim.copy()
    start._core.restore_last()
    names = list(PARAMETERS.get(name, ()))
    by_q, by_qd = random.normal(size=model.nq), random.normal(size=model.nv)
    state = random.normal(size=2 * model.nv)
    back = sim.vjp(by_q, by_qd, state=state, parameters=names, inputs="joint_forces")
    after = sim._core.snapshot().arrays
    assert before.keys() == after.keys()
    assert all(np.array_equal(before[key], after[key]) for key in before)
    d = sim.derivative(parameters=names, inputs="joint_forces")
    rows = np.concatenate([d.A, d.rates[:, : len(d.A)]])
    state[: model.nv] += along_velocities(model, sim.q, by_q)
    w = np.concatenate([state, by_qd])
    np.testing.assert_allclose(back.state, w @ rows, rtol=1e-10, atol=1e-10 * np.abs(back.state).max())
    columns = np.split(d.rates[:, len(d.A) :], [model.nv, 2 * model.nv], axis=1)
    for mine, matrix, shown in zip(
        (back.inputs, back.inputs_before, back.parameters), (d.B, d.B_before, d.P), columns, strict=True
    ):
        np.testing.assert_allclose(mine, state @ matrix + by_qd @ shown, rtol=1e-10, atol=1e-10)
    np.testing.assert_array_equal(back.qd, back.state[model.nv :])
    np.testing.assert_allclose(
        along_velocities(model, start.q, back.q), back.state[: model.nv], atol=1e-12 * np.abs(back.q).max()
    )
    assert (back.differentiable, back.margin, back.reason) == (d.differentiable, d.margin, d.reason)


# Breaks when a border is called smooth: a ball that just touches, a table whose legs share its weight in many
# ways while they slide.
def test_where_there_is_none():
    builder = ModelBuilder()
    builder.add_floor(material=Material(friction=0.5))
    builder.add_body(
        "box",
        shape=shapes.Box((0.2, 0.15, 0.1)),
        mass=2.0,
        position=(0, 0, 0.1),
        material=Material(friction=0.5),
    )
    sim = Simulation(builder.build(), dt=2e-3)
    sim.run(0.05)
    resting = sim.derivative()
    assert resting.differentiable  # impulses are many, the velocities one
    sim.state.forces = [[0.5 * 2.0 * 9.81, 0, 0]]  # at the border of the friction cone
    sim.run(4e-3)  # in the first step a half of the kick has the old load
    border = sim.derivative()
    assert not border.differentiable
    assert border.reason
    assert border.margin < 1e-4


# Breaks when a closed clearance is not a face: a shaft that rests in its bearing swings as a pendulum of the
# length of the clearance, x'' = -g x / clearance. The normal is that at the shaft's place after the step.
def test_a_journal_in_its_bearing():
    builder = ModelBuilder(gravity=(0, -9.81, 0))
    builder.add_body("shaft", mass=2, inertia=(0.01,) * 3)
    builder.add_revolute_joint("shaft", point=(0, 0, 0), axis=(0, 0, 1), clearance=1e-3, name="pin")
    sim = Simulation(builder.build(), dt=2e-3)
    sim.run(0.2)
    found = sim.derivative()
    assert found.differentiable, found.reason
    stiffness = 2e-3 * 9.81 / 1e-3
    np.testing.assert_allclose(found.A[3, [0, 3]], [-stiffness, 1 - 2e-3 * stiffness], rtol=1e-6)
    np.testing.assert_allclose(found.A[4, [1, 4]], [-1 / 2e-3, 0], atol=1e-4)  # what is closed stays closed


# Breaks when a friction that remembers the slip of the last step passes for a function of q and qd.
def test_friction_that_remembers_its_slip():
    for speed, smooth in ((0.0, True), (0.5, False)):
        law = Material(friction=0.3, friction_static=0.5, stribeck_speed=speed)
        builder = ModelBuilder()
        builder.add_floor(material=law)
        builder.add_body("ball", shape=shapes.Sphere(0.1), mass=1, position=(0, 0, 0.1),
                         linear_velocity=(2, 0, 0), material=law)  # fmt: skip
        sim = Simulation(builder.build(), dt=2e-3)
        sim.run(0.02)
        found = sim.derivative()
        assert found.differentiable == smooth, found.reason
        assert smooth or "depends on the slip of the step before" in found.reason


# Breaks when contacts of a stance open and close in its linear model, or are held elsewhere than they are:
# its regulator then does not bring the robot back. Pushed by 25 N for 0.2 s it returns to rounding of the
# stance, 1e-5; with contacts that are free it stays 4e-3 beside it.
def test_regulator_of_a_standing_robot(root):
    model = replace(amontons.load_model(root / "examples" / "models" / "quadruped.xml"), trees="auto")
    sim = Simulation(model, dt=2e-3)
    sim.reset("stand")
    stand = sim.q
    motors = [model.coordinates[name] for name in model.actuator_names]
    in_q, in_qd = ([getattr(c, name).start for c in motors] for name in ("q", "qd"))

    def hold(world):
        world.controls = 200 * (stand - world.q)[in_q] - 4 * world.qd[in_qd]

    sim.run(1.5, before_step=hold)
    stance, effort = sim.q, sim.controls.copy()
    with pytest.warns(amontons.StepWarning, match="differences to both sides disagree"):
        assert sim.linearise().nonsmooth
    linear = sim.linearise(contacts="held")
    assert not linear.nonsmooth
    A, B, nv = linear.A, linear.B, model.nv
    cost = np.diag(np.repeat([100.0, 1.0], nv))
    P = cost
    for _ in range(3000):  # the horizon: a foot that sticks cannot be moved, and has no stationary regulator
        K = np.linalg.solve(1e-3 * np.eye(len(motors)) + B.T @ P @ B, B.T @ P @ A)
        P = cost + A.T @ P @ (A - B @ K)
        P = (P + P.T) / 2

    def regulate(world):
        world.controls = effort - K @ np.concatenate([difference(model, stance, world.q), world.qd])

    sim.state.forces[model.body_index("trunk")] = (15, 25, 0)
    sim.run(0.2, before_step=regulate)
    assert np.abs(difference(model, stance, sim.q)).max() > 5e-3
    sim.state.forces = 0
    sim.run(3.0, before_step=regulate)
    assert np.abs(difference(model, stance, sim.q)).max() < 1e-4


# Breaks when a limit that acts is no face: weight presses a bar against it. A change of q by 1e-6, which the
# limit allows, is back at the limit after a step, at the rate -1e-6 / dt; a rate of 1 is stopped.
@pytest.mark.parametrize("trees", ["none", "auto"])
def test_a_joint_that_rests_at_its_limit(trees):
    def bar(lower):
        builder = ModelBuilder()
        builder.add_body("bar", shape=shapes.Capsule(0.03, 0.2), mass=1.0, position=(0.2, 0, 0))
        builder.add_revolute_joint("bar", axis=(0, -1, 0), point=(0, 0, 0), name="hinge", limits=(lower, 1.0))
        return Simulation(replace(builder.build(), trees=trees), dt=2e-3, tolerance=1e-12)

    sim, free = bar(-0.1), bar(-1.0)
    sim.run(0.5)
    free.q = sim.q
    free.step()
    found = sim.derivative()
    assert found.differentiable, found.reason
    if trees == "auto":  # the border is where the limit no longer presses: at the rate of the bar without it
        assert found.margin == pytest.approx(sim.model.length * -free.qd[0], rel=1e-6)
    np.testing.assert_allclose(found.A, [[0, 0], [-1 / 2e-3, 0]], atol=1e-4)


# Breaks when a slip is taken or the message does not name it.
def test_wrong():
    model = arm()[0]
    sim = Simulation(model)
    with pytest.raises(amontons.InputError, match="no step yet"):
        sim.derivative()
    sim.step()
    for arguments, message in (
        ({"parameters": ["elbow"]}, "give a quantity and a name"),
        ({"parameters": ["colour:elbow"]}, "unknown quantity 'colour'"),
        ({"parameters": ["damping:ebow"]}, 'there is no degree of freedom "ebow"'),
        ({"inputs": "forces"}, "unknown inputs 'forces'"),
    ):
        with pytest.raises(amontons.InputError, match=message):
            sim.derivative(**arguments)
    for name, shape in (("q", model.nq), ("qd", model.nv), ("state", 2 * model.nv)):
        with pytest.raises(
            amontons.InputError, match=rf"{name} has the shape \(7,\); it must be \({shape},\)"
        ):
            sim.vjp(**{name: np.zeros(7)})
    with pytest.raises(amontons.InputError, match="no step yet"):
        Simulation(model).vjp()
    with pytest.raises(amontons.InputError, match="cotangent has 3 entries"):
        sim.derivative().vjp(np.zeros(3))
    with pytest.raises(amontons.InputError, match="rates has 3 entries"):
        sim.derivative().vjp(np.zeros(2 * sim.model.nv), np.zeros(3))
