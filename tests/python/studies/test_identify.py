"""Parameters from recorded motion: identify."""

from dataclasses import replace

import amontons
import numpy as np
import pytest
from amontons import Material, ModelBuilder, ModelWarning, Motion, Motor, Simulation, identify, shapes
from amontons.studies.identify import _slope

DT = 2e-3


def arm():
    builder = ModelBuilder()
    builder.add_body("upper", shape=shapes.Capsule(0.03, 0.2), mass=2.0, position=(0, 0, -0.2))
    builder.add_body("lower", shape=shapes.Capsule(0.03, 0.2), mass=1.0, position=(0, 0, -0.6))
    builder.add_revolute_joint("upper", axis=(0, 1, 0), point=(0, 0, 0), name="shoulder", damping=0.3,
                               motor=Motor("effort"))  # fmt: skip
    builder.add_revolute_joint(
        "lower", "upper", axis=(0, 1, 0), point=(0, 0, -0.4), name="elbow", damping=0.1
    )
    return replace(builder.build(), trees="auto")  # whose states are q and qd alone


def swing(model, steps=400):
    """Motion under a known torque."""
    sim = Simulation(model, dt=DT)
    rows = [(sim.q, sim.qd, sim.controls.copy())]
    for _ in range(steps):
        sim.controls = [4 * np.sin(5 * sim.time)]
        sim.step()
        rows.append((sim.q, sim.qd, sim.controls.copy()))
    return Motion(*map(np.array, zip(*rows, strict=True)), interval=DT)


TRUTH = {"damping:shoulder": 0.45, "damping:elbow": 0.06, "mass:lower": 1.3}


@pytest.fixture(scope="module")
def motion():
    return swing(arm().with_(damping={"shoulder": 0.45, "elbow": 0.06}, mass={"lower": 1.3}))


@pytest.fixture(scope="module")
def nearly():
    """All right but for the damping of the elbow."""
    return arm().with_(damping={"shoulder": 0.45}, mass={"lower": 1.3})


# Breaks when residuals or their derivatives belong to other parameters, frames or controls: the same model
# has made the motion. A piece begins with the recorded rates, whose error is h^2 / 2 of the change of the
# acceleration: 2e-6 w^2 of the rate, 1e-4 with w = 7 rad/s. In 0.2 s the weakest damper, of d / I = 0.75 / s,
# takes 0.14 of the rate, so that its bias is within 1e-4 / 0.14 and that of the others less.
def test_finds_what_made_the_motion(motion):
    fit = identify(arm(), motion, list(TRUTH), piece=100)
    assert fit.values == pytest.approx(list(TRUTH.values()), rel=1e-3)
    assert fit.error < 1e-5
    assert fit.held_out < 1e-3 * fit.held_out_before
    assert fit.model.joints[1].dofs[0].damping == fit["damping:elbow"]
    assert fit["mass:lower"] == fit.values[2]


# Breaks when a parameter that the model has as 0, its bound, stays there: the first step of the optimiser is
# as long as the value.
def test_starts_from_zero(motion, nearly):
    fit = identify(nearly.with_(damping={"elbow": 0.0}), motion, ["damping:elbow"], piece=100)
    assert fit["damping:elbow"] == pytest.approx(0.06, rel=1e-3)


# Breaks when standard deviations are not those of estimates: with noise of a known size on all but the
# starts, estimates of many runs spread as one run says, within the error of a deviation from 20 runs, a
# factor of 1.5.
def test_deviations(motion, nearly):
    rng = np.random.default_rng(1)
    found = []
    for _ in range(20):
        noisy = motion.q + rng.normal(0, 1e-4, motion.q.shape)
        noisy[::20] = motion.q[::20]
        fit = identify(nearly, Motion(noisy, motion.qd, motion.controls, DT), ["damping:elbow"], robust=False,
                       holdout=0.0)  # fmt: skip
        found.append((fit.values[0], fit.deviations[0]))
    values, deviations = np.array(found).T
    assert np.std(values) == pytest.approx(np.mean(deviations), rel=0.5)
    assert np.isnan(fit.held_out)


# Breaks when a few frames that are far off draw the estimate.
def test_outliers(motion, nearly):
    q = motion.q.copy()
    q[33::70] += 0.2
    spoiled = Motion(q, motion.qd, motion.controls, DT)
    plain = identify(nearly, spoiled, ["damping:elbow"], robust=False)["damping:elbow"]
    robust = identify(nearly, spoiled, ["damping:elbow"])["damping:elbow"]
    assert abs(robust - 0.06) < 0.2 * abs(plain - 0.06)


# Breaks when friction and mass of a pushed box cannot be told from a recording, with contacts that slide.
def test_a_pushed_box(tmp_path):
    builder = ModelBuilder()
    builder.add_floor(material=Material(friction=0.5))
    builder.add_body(
        "box",
        shape=shapes.Box((0.1, 0.1, 0.05)),
        mass=1.5,
        position=(0, 0, 0.05),
        material=Material(friction=0.5),
    )
    builder.add_body(
        "hand", shape=shapes.Sphere(0.03), mass=0.5, position=(-0.2, 0, 0.05), material=Material(friction=0.0)
    )
    builder.add_prismatic_joint("hand", axis=(1, 0, 0), name="rail", damping=2.0)
    builder.add_actuator("push", joint="rail")
    model = builder.build()
    sim = Simulation(model.with_(friction={"box": 0.35}, mass={"box": 1.2}), dt=DT)
    with amontons.record(tmp_path / "push.h5", sim) as recorder:
        for _ in range(500):
            sim.controls = [6 + 4 * np.sin(9 * sim.time)]
            recorder.add(sim.step())
    with amontons.read_recording(tmp_path / "push.h5") as recording:
        fit = identify(model, recording, ["friction:box", "mass:box"])
    assert fit.values == pytest.approx([0.35, 1.2], rel=1e-3)


# Breaks when a jump of a residual, as a contact that comes a step later on one side, counts as a slope: the
# deviations of estimates are then far too small.
def test_slopes_beside_jumps():
    here = np.zeros(4)
    up, down = np.array([2e-4, 1.0, 2e-4, -1.0]), np.array([-2e-4, -1e-4, -1.0, 1e-5])
    slope = _slope(down, here, up, 1e-4, 1e-4)
    np.testing.assert_allclose(slope, [2, 1, 2, -0.1])


# Breaks when a parameter that moves nothing gets a number as if it had been measured.
def test_without_influence(motion):
    with pytest.warns(ModelWarning, match="no influence on the motion: friction:upper"):
        fit = identify(arm(), motion, ["friction:upper", "damping:elbow"])
    assert fit.not_identifiable == ("friction:upper",)
    assert fit["friction:upper"] == arm().geoms[0].material.friction
    assert fit.deviations[0] == np.inf


def test_plot(motion, tmp_path):
    pytest.importorskip("matplotlib")
    identify(arm(), motion, ["damping:elbow"]).plot(tmp_path / "fit.png")
    assert (tmp_path / "fit.png").stat().st_size > 1000


WRONG = {
    "parameter": ({"parameters": ["elbow"]}, "give a quantity and a name"),
    "none": ({"parameters": []}, "parameters is empty"),
    "bounds": ({"bounds": {"mass:lower": (0, 1)}}, "mass:lower is no parameter of the fit"),
    "start": ({"bounds": {"damping:elbow": (1, 2)}}, "outside of its bounds"),
    "piece": ({"piece": 1000}, "no motion has more than piece = 1000 frames"),
    "dt": ({"dt": 1.5e-3}, "does not divide the interval"),
    "holdout": ({"holdout": 1.0}, "holdout = 1"),
    "data": ({"data": 3}, "data is a int"),
}


# Breaks when a slip is taken or the message does not name it.
@pytest.mark.parametrize("case", WRONG)
def test_wrong(motion, case):
    change, message = WRONG[case]
    with pytest.raises(amontons.InputError) as error:
        identify(**{"model": arm(), "data": motion, "parameters": ["damping:elbow"], **change})
    assert message in str(error.value)
