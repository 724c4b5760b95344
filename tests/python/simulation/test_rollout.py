"""Many simulations at once: rollout."""

import signal
import sys
import threading
from dataclasses import replace
from pathlib import Path

import amontons
import numpy as np
import pytest
from amontons import ModelBuilder, Simulation, rollout, shapes
from amontons.model.sensing import Sensor

ROWS, REPEAT = 6, 2


def hopper() -> amontons.Model:
    """A foot that jumps by a motor in its slide, above a floor, with an actuator that clips."""
    builder = ModelBuilder()
    builder.add_floor()
    builder.add_body("body", shape=shapes.Sphere(0.1), density=1000, position=(0, 0, 0.6))
    builder.add_body("foot", shape=shapes.Sphere(0.05), density=2000, position=(0, 0, 0.1))
    builder.add_prismatic_joint("foot", "body", axis=(0, 0, 1), name="leg", stiffness=200)
    builder.add_body("arm", shape=shapes.Capsule(0.02, 0.1), density=500, position=(0.2, 0, 0.6))
    builder.add_revolute_joint("arm", "body", point=(0.1, 0, 0.6), axis=(0, 1, 0), name="arm")
    builder.add_actuator("jump", joint="leg", gain=(50, 0, 0), bias=(1, 0, 0), control_limits=(-1, 1))
    builder.add_actuator("swing", joint="arm", law="position", kp=2.0)
    return builder.build()


@pytest.fixture(scope="module")
def model():
    return hopper()


@pytest.fixture(scope="module")
def states(model):
    start = Simulation(model)
    states = np.tile(np.concatenate([start.q, start.qd]), (5, 1))
    states[:, model.nq :] += np.random.default_rng(3).normal(size=(5, model.nv))
    return states


@pytest.fixture(scope="module")
def controls(model):
    return 2 * np.random.default_rng(4).normal(size=(5, ROWS, len(model.actuators)))


def one_by_one(model, states, controls, **options):
    """The plain loop that rollout stands for."""
    q, qd, residuals = [], [], []
    for state, rows in zip(states, controls, strict=True):
        world = Simulation(model, **options)
        world.reset(q=state[: model.nq], qd=state[model.nq :])
        for row in rows:
            world.controls = row
            reports = [world.step() for _ in range(REPEAT)]
            q.append(world.q)
            qd.append(world.qd)
            residuals.append(max(report.residual for report in reports))
    shape = (len(states), ROWS, -1)
    return np.reshape(q, shape), np.reshape(qd, shape), np.reshape(residuals, shape[:2])


# Breaks when the bits of a world depend on threads or on the worlds beside it, when it gets the controls of
# another one, or clips or scales them otherwise than the simulation does.
@pytest.mark.parametrize("threads", [None, 1, 2, 7])
def test_same_bits_as_one_by_one(model, states, controls, threads):
    expected = one_by_one(model, states, controls, dt=2e-3)
    result = rollout(model, states, controls, repeat=REPEAT, threads=threads, dt=2e-3)
    for ours, reference in zip((result.q, result.qd, result.residuals), expected, strict=True):
        assert np.array_equal(ours, reference)
    assert result.time == pytest.approx(4e-3 * np.arange(1, ROWS + 1))
    assert result.q.shape == (5, ROWS, model.nq)
    assert np.abs(np.diff(result.q[:, :, -2:], axis=0)).max() > 1e-3  # the worlds are not alike


# Breaks when simulations that are handed in are changed, or lose what a saved state would keep of them.
def test_from_simulations(model, states, controls):
    start = Simulation(model, dt=4e-3)
    start.run(0.3)
    other = start.copy()
    other.state.linear_velocities[0, 2] += 1
    before = start.q
    result = rollout(model, [start, other], controls[:2], repeat=REPEAT)
    assert np.array_equal(start.q, before)
    assert start.steps == 75
    for k, world in enumerate((start, other)):
        for row in controls[k]:
            world.controls = row
            for _ in range(REPEAT):
                world.step()
        assert np.array_equal(result.q[k, -1], world.q)
        assert np.array_equal(result.simulations[k].q, world.q)
        assert result.simulations[k].step().residual == world.step().residual


# Breaks when sensors are read of another world, before the last step of a row, or reading them changes bits.
def test_sensors(states, controls):
    model = replace(
        hopper(),
        sensors=(Sensor("height", "framepos", body=0), Sensor("turn", "gyro", body=2)),
    )
    result = rollout(model, states, controls, repeat=REPEAT, sensors=True)
    plain = rollout(model, states, controls, repeat=REPEAT)
    assert np.array_equal(result.q, plain.q)
    assert plain.sensors.shape == (5, ROWS, 0)
    assert result.sensors.shape == (5, ROWS, 6)
    assert np.array_equal(result.sensors[:, :, :3], result.q[:, :, :3])  # the base is the body
    for k, world in enumerate(result.simulations):
        assert np.array_equal(result.sensors[k, -1], world.sensors.array)
    assert rollout(model, states, steps=2, sensors=True).sensors.shape == (5, 2, 6)


# Breaks when one row of controls for all worlds, or none, is read as something else.
def test_shapes_of_controls(model, states, controls):
    shared = rollout(model, states, controls[0])
    assert np.array_equal(shared.q, rollout(model, states, np.tile(controls[0], (5, 1, 1))).q)
    still = rollout(model, states, steps=3)
    np.testing.assert_array_equal(still.q, rollout(model, states, np.zeros((3, 2))).q)


# Breaks when steps that missed their tolerance pass without a word, or on_failure does not count.
def test_missed_steps(model, states):
    low = states.copy()
    low[:, 2] -= 0.35  # the foot in the floor
    options = dict(steps=20, max_iterations=1, method="gauss-seidel", tolerance=1e-12)
    with pytest.warns(amontons.StepWarning, match=r"^\d+ steps in \d+ of 100 rows did not conv.*of world \d"):
        result = rollout(model, low, **options)
    assert np.array_equal(result.residuals > 1e-12, result.missed > 0)
    with pytest.raises(amontons.SimulationError, match="did not converge"):
        rollout(model, low, **options, on_failure="raise")
    rollout(model, low, **options, on_failure="ignore")


def with_a_bad_one(model, **options):
    worlds = [Simulation(model, **options) for _ in range(3)]
    worlds[1].state.forces[0, 0] = 1.7e308
    worlds[1].state.linear_velocities[0, 0] = sys.float_info.max
    return worlds


# Breaks when a world whose velocities are no longer finite is reported as a motion or without its number, or
# takes the rows of the others away; when on_failure does not count.
@pytest.mark.parametrize("sensors", [False, True])
def test_not_finite(model, states, sensors):
    with pytest.warns(amontons.StepWarning, match=r"world 1, row 0: .*; look for loads.*its rows are NaN"):
        result = rollout(model, with_a_bad_one(model), steps=3, sensors=sensors)
    good = rollout(model, [Simulation(model), Simulation(model)], steps=3, sensors=sensors)
    for name in ("q", "qd", "residuals", "missed", "sensors"):
        assert np.array_equal(getattr(result, name)[[0, 2]], getattr(good, name)), name
    for name in ("q", "qd", "residuals"):
        assert np.isnan(getattr(result, name)[1]).all(), name
    assert [bool(why) for why in result.failures] == [False, True, False]
    assert "row 0" in result.failures[1]
    assert good.failures == ["", ""]
    with pytest.raises(amontons.SimulationError, match=r"world 1, row 0: .*; look for loads"):
        rollout(model, with_a_bad_one(model, on_failure="raise"), steps=3)
    silent = rollout(model, with_a_bad_one(model, on_failure="ignore"), steps=3)
    assert silent.failures[1]


# Breaks when Python's lock is held during a rollout, or Ctrl-C waits for its end.
def test_interrupt(model, states):
    # A shell starts what runs in the background with the signal ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()  # cannot run while the lock is held
    try:
        with pytest.raises(KeyboardInterrupt):
            rollout(model, states, steps=2, repeat=10**7)
    finally:
        signal.signal(signal.SIGINT, before)


WRONG = {
    "model": (dict(model="hopper"), "model is a str"),
    "one row": (dict(states=np.zeros(3)), "states has the shape (3,); it must be (worlds, 17)"),
    "no worlds": (dict(states=np.zeros((0, 17))), "states has the shape (0, 17)"),
    "columns": (dict(states=np.zeros((2, 5))), "states has the shape (2, 5)"),
    "text": (dict(states="here"), "states must hold real numbers"),
    "NaN": (dict(states=np.full((1, 17), np.nan)), "states[0]: q[0] is not finite"),
    "nothing to do": (dict(controls=None), "rollout needs controls, or steps"),
    "no steps": (dict(controls=None, steps=0), "steps = 0"),
    "both": (dict(steps=3), "steps = 3, but controls has 6 rows"),
    "columns of controls": (dict(controls=np.zeros((5, 6, 3))), "it must be (worlds, rows, controls) = (5,"),
    "worlds of controls": (dict(controls=np.zeros((4, 6, 2))), "controls has the shape (4, 6, 2)"),
    "no rows": (dict(controls=np.zeros((5, 0, 2))), "controls has the shape (5, 0, 2)"),
    "infinite control": (dict(controls=np.full((1, 2), np.inf)), "controls[0, 0, 0] is not finite"),
    "repeat": (dict(repeat=0), "repeat = 0"),
    "threads": (dict(threads=0), "threads = 0"),
    "option": (dict(dt=-1), "dt = -1"),
}


# Breaks when something that makes no sense is taken, or the message does not name it.
@pytest.mark.parametrize("case", WRONG)
def test_wrong(model, states, controls, case):
    arguments, message = WRONG[case]
    with pytest.raises(amontons.InputError) as error:
        rollout(**{"model": model, "states": states, "controls": controls, **arguments})
    assert message in str(error.value)


# Breaks when simulations of other models, or with steps of other lengths, run side by side.
def test_wrong_simulations(model):
    for states, message in (
        ([Simulation(model), Simulation(hopper())], r"states\[1\] is a simulation of another model"),
        (
            [Simulation(model), Simulation(model, dt=1e-3)],
            r"states\[1\] has dt = 0.001 s, states\[0\] 0.005 s",
        ),
    ):
        with pytest.raises(amontons.InputError, match=message):
            rollout(model, states, steps=1)
    with pytest.raises(amontons.InputError, match="dt: simulations have their own options"):
        rollout(model, [Simulation(model)], steps=1, dt=1e-3)


def test_motors_that_turn_a_robot_round_make_no_energy():
    # Random efforts that change every 20 ms. Breaks when the balance of energy allows for kinetic energy and
    # gravity only, which are nothing where an arm turns round, and calls what the motors do there a gain.
    arm = amontons.load_model(Path(__file__).parents[3] / "examples" / "models" / "arm.xml")
    start = Simulation(arm, dt=2e-3)
    start.reset("bent")
    rng = np.random.default_rng(seed=1)
    states = np.tile(np.concatenate([start.q, start.qd]), (20, 1))
    states[:, 0] += rng.uniform(-0.1, 0.1, 20)
    controls = rng.uniform((-1, -2), (1, 0), (20, 50, 2))
    course = rollout(arm, states[12:13], controls[12:13], repeat=10, dt=2e-3)
    assert course.residuals.max() <= 1e-6
    assert course.missed.sum() == 0


# Breaks when a world of a variant has the bits of another model, or its controls are clipped by its limits.
def test_variants(model, states, controls):
    variants = [model.with_(mass_scale={"foot": 1 + 0.2 * k}) for k in range(5)]
    result = rollout(variants, states, controls, repeat=REPEAT, dt=2e-3)
    for k, variant in enumerate(variants):
        alone = rollout(variant, states[k : k + 1], controls[k : k + 1], repeat=REPEAT, dt=2e-3)
        assert np.array_equal(result.q[k], alone.q[0])
    assert np.ptp(result.q[:, -1, 2]) > 1e-6
    onwards = rollout([s.model for s in result.simulations], result.simulations, controls)
    assert onwards.q.shape == result.q.shape
    watched = rollout(variants, states, controls, repeat=REPEAT, dt=2e-3, before_step=lambda world: None)
    assert np.array_equal(result.q, watched.q)


# Breaks when models that cannot share rows are taken side by side.
def test_wrong_variants(model, states):
    other = ModelBuilder()
    other.add_body("ball", shape=shapes.Sphere(0.1), mass=1.0)
    with pytest.raises(amontons.InputError, match="model 1 has other nq than model 0"):
        rollout([model, other.build()], states[:2], steps=1)
    with pytest.raises(amontons.InputError, match="2 models but 5 states"):
        rollout([model, model], states, steps=1)
    with pytest.raises(amontons.InputError, match="model is empty"):
        rollout([], states, steps=1)
