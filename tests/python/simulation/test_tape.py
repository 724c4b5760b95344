"""Derivatives of losses over rollouts, beside central differences of whole rollouts."""

from dataclasses import replace

import amontons
import numpy as np
import pytest
from amontons import Material, ModelBuilder, Motor, Simulation, rollout, shapes
from amontons.simulation.tangent import along_velocities, integrate, of_coordinates

OPTIONS = {"dt": 2e-3, "tolerance": 1e-12, "warm_start": False}


def arm():
    """With a servo, a motor within +-2, damping and dry friction."""
    builder = ModelBuilder()
    builder.add_body("upper", shape=shapes.Capsule(0.03, 0.2), mass=2.0, position=(0, 0, 0.2))
    builder.add_body("lower", shape=shapes.Capsule(0.03, 0.2), mass=1.0, position=(0, 0, 0.6))
    builder.add_revolute_joint("upper", axis=(0, 1, 0), point=(0, 0, 0), name="shoulder", damping=0.4,
                               stiffness=3.0, friction=0.1, motor=Motor("effort", 0.5))  # fmt: skip
    builder.add_revolute_joint("lower", "upper", axis=(0, 1, 0), point=(0, 0, 0.4), name="elbow", damping=0.1)
    builder.add_actuator("servo", joint="elbow", law="position", kp=4.0, kd=0.2, control_limits=(-2, 2))
    return replace(builder.build(), trees="auto")


def thrown_cube(height=0.12):
    """Strikes with a corner, bounces, and slips once more; free, so that q holds a quaternion."""
    law, turn = Material(friction=0.3, restitution=0.5), np.array((0.9, 0.3, 0.2, 0.1))
    builder = ModelBuilder()
    builder.add_floor(material=law)
    builder.add_body("cube", shape=shapes.Box((0.05,) * 3), mass=0.37, position=(0, 0, height),
                     orientation=turn / np.linalg.norm(turn), linear_velocity=(1, 0.2, -1),
                     angular_velocity=(3, 2, 1), material=law)  # fmt: skip
    return builder.build()


def starts(model, **changes):
    sim = Simulation(model, **OPTIONS)
    sim.set_q(changes)
    return np.concatenate([sim.q, sim.qd])


# Breaks when the steps of the way back are not those of the rollout, when their derivatives belong to other
# rows, or when a cotangent is added at another step: an arm over 200 steps, two worlds, a loss over all rows.
# Errors are 1e-10 of the differences and 1e-9 of each derivative.
def test_an_adjoint_of_200_steps():
    model, random = arm(), np.random.default_rng(1)
    states = np.array([starts(model, shoulder=0.5, elbow=1.5), starts(model, shoulder=-1.0, elbow=0.3)])
    controls = random.uniform(-1, 1, (2, 100, 2))
    weights = random.normal(size=(2, 2, 100, 2))
    result = rollout(model, states, controls, repeat=2, tape=True, **OPTIONS)
    names = ["damping:elbow", "mass:lower", "gain:servo"]
    found = result.vjp(*weights, parameters=names)
    assert found.differentiable.mean() > 0.95

    def losses(model=model, states=states, controls=controls):
        run = rollout(model, states, controls, repeat=2, **OPTIONS)
        return np.einsum("kwrn,kwrn->w", weights, np.array([run.q, run.qd]))

    def check(mine, change, by=1e-5):
        expected = (losses(**change(by)) - losses(**change(-by))) / (2 * by)
        np.testing.assert_allclose(mine, expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())

    for k in range(2):
        entry = np.eye(4)[k]
        check(found.q[:, k], lambda by, entry=entry: {"states": states + by * entry})
        check(found.qd[:, k], lambda by, k=k: {"states": states + by * np.eye(4)[2 + k]})
        for row in (0, 37, 99):
            one = np.zeros((100, 2))
            one[row, k] = 1
            check(found.inputs[:, row, k], lambda by, one=one: {"controls": controls + by * one})
    for k, (what, part, value) in enumerate(
        (("damping", "elbow", 0.1), ("mass", "lower", 1.0), ("gain", "servo", 4.0))
    ):
        check(
            found.parameters[:, k],
            lambda by, what=what, part=part, value=value: {
                "model": model.with_(**{what: {part: value + by}})
            },
        )


# Breaks when bounces lose their derivative, or when entries of quaternions are mixed up on either end.
def test_a_thrown_cube():
    model = thrown_cube()
    states = starts(model)[None]
    weights = np.random.default_rng(2).normal(size=13)

    def loss(model=model, states=states):
        run = rollout(model, states, steps=60, **OPTIONS)
        return np.concatenate([run.q[0, -1], run.qd[0, -1]]) @ weights

    result = rollout(model, states, steps=60, tape=True, **OPTIONS)
    slopes = np.zeros((1, 60, 13))
    slopes[0, -1] = weights
    found = result.vjp(slopes[..., :7], slopes[..., 7:], parameters=["friction:*", "restitution:*"])
    assert found.differentiable.all()
    assert np.isfinite(found.margin).any()  # a bounce
    for k, (what, value) in enumerate((("friction", 0.3), ("restitution", 0.5))):
        ends = [loss(model.with_(**{what: {"*": value + by}})) for by in (1e-5, -1e-5)]
        assert found.parameters[0, k] == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-6)
    for entry in np.eye(6):
        moved = [states.copy() for _ in range(4)]
        for state, by in zip(moved, (1e-6, -1e-6, 1e-6, -1e-6), strict=True):
            if state is moved[0] or state is moved[1]:
                state[0, :7] = integrate(model, state[0, :7], by * entry)
            else:
                state[0, 7:] += by * entry
        up, down, faster, slower = (loss(states=state) for state in moved)
        by_q = along_velocities(model, states[0, :7], found.q[0]) @ entry
        assert by_q == pytest.approx((up - down) / 2e-6, rel=1e-5, abs=1e-5)
        assert found.qd[0] @ entry == pytest.approx((faster - slower) / 2e-6, rel=1e-5, abs=1e-5)


# Breaks when either map between entries of q and changes along qd is not that of `integrate`.
def test_entries_of_quaternions():
    model, q = thrown_cube(), starts(thrown_cube())[:7]
    slope = np.random.default_rng(3).normal(size=7)
    along = along_velocities(model, q, slope)
    for k, entry in enumerate(np.eye(6)):
        ends = [integrate(model, q, by * entry) @ slope for by in (1e-6, -1e-6)]
        assert along[k] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-9)
    back = of_coordinates(model, q, along)
    np.testing.assert_allclose(along_velocities(model, q, back), along, atol=1e-14)
    assert abs(back[3:] @ q[3:]) < 1e-14


# Breaks when a tape changes the bits of a rollout, or joint forces that were given have no derivative.
def test_joint_forces_and_bits():
    model, random = arm(), np.random.default_rng(4)
    states, forces = starts(model, elbow=1.0)[None], random.uniform(-1, 1, (1, 30, 2))
    plain = rollout(model, states, joint_forces=forces, **OPTIONS)
    taped = rollout(model, states, joint_forces=forces, tape=True, **OPTIONS)
    assert np.array_equal(plain.q, taped.q)
    slope = np.zeros_like(taped.q)
    slope[0, -1, 1] = 1
    found = taped.vjp(slope)
    change = np.zeros_like(forces)
    change[0, 10, 0] = 1e-2
    ends = [
        rollout(model, states, joint_forces=forces + by * change, **OPTIONS).q[0, -1, 1] for by in (1, -1)
    ]
    assert found.inputs[0, 10, 0] == pytest.approx((ends[0] - ends[1]) / 2e-2, rel=1e-5)
    half = slope.copy()
    half[0, -1, 1], half[0, 14, 1] = 0, 1
    assert not taped.vjp(half).inputs[0, 15:].any()  # rows after the loss


# Breaks when a gradient without inputs is another one over the rest.
def test_without_inputs():
    result = rollout(arm(), starts(arm(), elbow=1.0)[None], np.zeros((1, 5, 2)), tape=True, **OPTIONS)
    slope = np.ones_like(result.q)
    whole, part = (result.vjp(slope, parameters=["mass:lower"], inputs=i) for i in ("controls", "none"))
    assert whole.inputs.shape == (1, 5, 2)
    assert part.inputs.shape == (1, 5, 0)
    for name in ("q", "qd", "parameters", "differentiable"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name))


# Breaks when a control beyond its limit, which moves nothing, has a derivative.
def test_controls_beyond_limits():
    model = arm()
    controls = np.zeros((1, 5, 2))
    controls[0, :, model.control_names.index("servo")] = 3.0
    result = rollout(model, starts(model)[None], controls, tape=True, **OPTIONS)
    found = result.vjp(np.ones_like(result.q))
    assert not found.inputs[..., model.control_names.index("servo")].any()
    assert found.inputs.any()


WRONG = {
    "no tape": (lambda run: rollout(arm(), starts(arm())[None], steps=2).vjp(), "the rollout has no tape"),
    "shape": (lambda run: run.vjp(np.zeros(3)), "q has the shape"),
    "inputs": (lambda run: run.vjp(inputs="forces"), "unknown inputs 'forces'"),
    "parameter": (lambda run: run.vjp(run.q, parameters=["damping:ebow"]), "no degree of freedom"),
    "function": (
        lambda run: rollout(arm(), starts(arm())[None], steps=2, tape=True, after_step=print),
        "tape: functions before and after steps have no derivative",
    ),
}


# Breaks when a slip is taken or the message does not name it.
@pytest.mark.parametrize("case", WRONG)
def test_wrong(case):
    run = rollout(arm(), starts(arm())[None], steps=2, tape=True)
    slip, message = WRONG[case]
    with pytest.raises(amontons.InputError, match=message):
        slip(run)
