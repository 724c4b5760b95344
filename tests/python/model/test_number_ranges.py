"""Every number of the interface has a range, checked where it is handed in and told in docs/python.md."""

import math
import re

import amontons
import numpy as np
import pytest
from amontons import ranges, scenes
from amontons.checks import shown

SIMULATION = (
    "dt", "tolerance", "budget", "margin", "recovery_speed", "restitution_speed", "threads", "max_iterations",
    "max_substeps",
)  # fmt: skip
SOLVE = ("tolerance", "max_iterations", "deadline", "threads")
NEVER = [math.nan, -math.inf, -1, 10**400, -(10**400), "1", None, 1j, [1.0], True, np.array([1.0, 2.0])]


@pytest.fixture(scope="module")
def model():
    return scenes.make("stack", boxes=1)


def outside(name):
    """Values that the option cannot have; None stands for the default of some."""
    range_ = ranges.OPTIONS[name]
    values = [v for v in NEVER if v is not None]
    if range_.least > 0:
        values += [0, range_.least / 2]
    if range_.most < math.inf:
        values += [math.inf, 1e300, range_.most * 2]
    if range_.whole:
        values += [2**63, 2**64]
    return values


# Breaks when a number is given to the core as it is: integers beyond 64 bits raised errors of the binding.
@pytest.mark.parametrize("name", SIMULATION)
def test_options_of_simulations(name, model):
    for value in outside(name):
        with pytest.raises(amontons.InputError, match=rf"{name} (=|is) "):
            amontons.Simulation(model, **{name: value})
    range_ = ranges.OPTIONS[name]
    ends = [range_.least, min(range_.most, 2**10)] if range_.whole else [range_.least, range_.most]
    for value in ends:
        amontons.Simulation(model, **{name: int(value) if range_.whole else value})


@pytest.mark.parametrize("name", SOLVE)
def test_options_of_solves(name):
    for value in outside(name):
        with pytest.raises(amontons.InputError, match=rf"{name} (=|is) "):
            amontons.vi.solve(np.eye(3), np.ones(3), "bilateral", **{name: value})


# Breaks when a duration or an interval of frames goes through unchecked.
def test_options_of_runs(model, tmp_path):
    sim = amontons.Simulation(model)
    for value in outside("duration"):
        with pytest.raises(amontons.InputError, match="duration ="):
            sim.run(value)
    for value in outside("every"):
        with pytest.raises(amontons.InputError, match="every ="):
            amontons.record(tmp_path / "a.h5", sim, every=value)
    for value in outside("repeat"):
        with pytest.raises(amontons.InputError, match="repeat ="):
            amontons.rollout(model, [sim], steps=1, repeat=value)
    assert list(tmp_path.iterdir()) == []


# Breaks when a number of a model is beyond its range and is taken: positions of 1e200 were.
@pytest.mark.parametrize("value", [1e200, -1e16, 10**400, math.nan])
def test_numbers_of_models(value):
    builder = amontons.ModelBuilder()
    with pytest.raises(amontons.InputError, match="position"):
        builder.add_body("a", shape=amontons.shapes.Sphere(0.1), density=1, position=(value, 0, 0))
    with pytest.raises(amontons.InputError, match="position"):
        amontons.Transform((0, value, 0))
    with pytest.raises(amontons.InputError, match="radius"):
        amontons.shapes.Sphere(value * 10**15)
    with pytest.raises(amontons.InputError, match="mass"):
        amontons.parts.Body(mass=value * 10**15)


# Breaks when a value that cannot be printed, or is endless, breaks or fills the message.
def test_messages_stay_short():
    class Unshown:
        def __repr__(self):
            raise RuntimeError

    assert shown(Unshown()) == "a Unshown"
    assert shown(10**5000) == "a int"
    assert len(shown("x" * 10**6)) < 100
    with pytest.raises(amontons.InputError, match="tolerance = a Unshown; it must be a number"):
        amontons.vi.solve(np.eye(3), np.ones(3), "bilateral", tolerance=Unshown())


# Breaks when an option has a range that the documents do not tell.
def test_ranges_are_documented(root):
    text = (root / "docs" / "python.md").read_text()
    table = text[text.index("## Ranges of numbers") : text.index("## Files")]
    assert set(ranges.OPTIONS) <= set(re.findall(r"`(\w+)`", table))
    assert f"{ranges.FARTHEST:g}".replace("+", "") in table
    assert f"{ranges.LARGEST:g}".replace("+", "") in table


# Breaks when what is no text, number, flag or array of numbers goes on to where NumPy or Python raises an
# error of its own: each of these did, found by the soak.
@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: amontons.rollout(m, [amontons.Simulation(m)], steps=1, sensors=np.eye(3)), "sensors ="),
        (lambda m: amontons.ModelBuilder().add_tendon(joints=np.array([]), rest=np.array(1)), "rest"),
        (lambda m: amontons.ModelBuilder().add_tendon(joints=np.array([1.0, 2.0])), "joints has"),
        (lambda m: amontons.vi.Problem(np.eye(1), [1], "bilateral", name=np.eye(3)), "name is"),
        (lambda m: amontons.vi.Problem(np.eye(1), [1], "bilateral", notes=[1]), r"notes\[0\] is"),
        (lambda m: amontons.parts.Actuator(name=object()), "name of actuator"),
        (lambda m: amontons.vi.Factored([1.0], "x", [0], [-1], np.ones((1, 6)), None), "inverse_inertia"),
        (lambda m: amontons.vi.Factored([1.0], 10**400, [0], [-1], np.ones((1, 6)), None), "inverse_inertia"),
        (lambda m: amontons.vi.Problem(np.eye(1), [1], "bilateral").write("x" * 10**5), "too long"),
    ],
)
def test_things_of_another_kind(call, message, model):
    with pytest.raises(amontons.InputError, match=message) as raised:
        call(model)
    assert len(str(raised.value)) < 1000
    assert amontons.vi.EllipticFriction(0.3, rolling=()).rows == 0


# Breaks when a yes or no is whatever counts as one: of an array NumPy cannot say, and raised its own error.
@pytest.mark.parametrize("value", [1, "yes", np.ones((3, 3)), None])
def test_flags_of_parts(value):
    for make in (lambda: amontons.Joint(closes_loop=value), lambda: amontons.parts.Actuator(early=value)):
        with pytest.raises(amontons.InputError, match="must be True or False"):
            make()


# Breaks when parts that only Python knows end in an error from inside.
@pytest.mark.parametrize("name", ["keyframes", "unread", "sites", "sensors", "visuals", "links"])
@pytest.mark.parametrize("value", [float("nan"), ("foot",), None])
def test_parts_that_are_none(name, value):
    with pytest.raises(amontons.InputError, match=f"{name} = .*; give a tuple of"):
        amontons.Model(**{name: value})
