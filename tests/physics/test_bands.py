"""Small scenes stay within the bands of bands.csv, under other methods too; faults leave them."""

import dataclasses

import amontons
import bands
import numpy as np
import pytest

ROWS = bands.read_bands()
PHYSICS = {"residual", *bands.ERRORS, *bands.CENTRED}
FRICTIONAL = ("wall", "hopper", "card_house", "tracked_vehicle")
TOUCHING = (*FRICTIONAL, "wall_at_rest", "newtons_cradle")
# Steps above the tolerance warn; their residual is what is looked at.
pytestmark = pytest.mark.filterwarnings("ignore::amontons.StepWarning")


def left(found, name, law):
    """The quantities of physics that are outside their bands."""
    return PHYSICS.intersection(bands.outside(found, ROWS[name, law]))


# Breaks when a change of the step or of a solver changes what a scene does, needs more than three times the
# work, or misses the tolerance in some step.
@pytest.mark.parametrize(("name", "law"), ROWS)
def test_scenes_are_within_their_bands(name, law):
    found = bands.measured(name, law)
    assert bands.outside(found, ROWS[name, law]) == [], found


# Breaks when a band is so narrow that it excludes another algorithm for the same equations, which none of the
# variants has.
@pytest.mark.parametrize(("name", "law"), [entry for entry in ROWS if entry[0] != "tracked_vehicle"])
def test_another_method_is_within_the_bands(name, law):
    found = bands.measured(name, law, method="interior-point", tolerance=1e-5)
    assert not left(found, name, law), found


def scaled_impulses(sim, step):
    """The impulses of all contacts are 1.1 times as large, in velocities and positions."""
    contacts, state = sim.contacts, sim.state
    dynamic = np.array([body.motion == "dynamic" for body in sim.model.bodies])
    for side, sign in (("body_a", 0.1), ("body_b", -0.1)):
        bodies, impulses = contacts[side], sign * contacts["impulse"]
        for body in np.flatnonzero(dynamic):
            change = impulses[bodies == body].sum(axis=0) / sim.model.bodies[body].mass
            state.linear_velocities[body] += change
            state.positions[body] += change * sim.dt


def lost_body(sim, step):
    """A body is found a metre lower, as if it had fallen through what carries it."""
    if step == 0:
        dynamic = [body.motion == "dynamic" for body in sim.model.bodies]
        sim.state.positions[dynamic.index(True), 2] -= 1.0


# Breaks when the bands are so wide that contacts may push a tenth too much.
@pytest.mark.parametrize(("name", "law"), [entry for entry in ROWS if entry[0] in TOUCHING])
def test_scaled_impulses_leave_the_bands(name, law):
    sim = bands.scene(name, law)
    assert left(bands.measure(sim, bands.SCENES[name][1], scaled_impulses), name, law)


# Breaks when the bands are so wide that friction may be missing.
@pytest.mark.parametrize(("name", "law"), [entry for entry in ROWS if entry[0] in FRICTIONAL])
def test_missing_friction_leaves_the_bands(name, law):
    sim = bands.scene(name, law)
    smooth = amontons.Material(friction=0.0)
    geoms = tuple(dataclasses.replace(geom, material=smooth) for geom in sim.model.geoms)
    model = dataclasses.replace(sim.model, geoms=geoms, pair_materials=())
    sim = amontons.Simulation(model, **sim.options)
    assert left(bands.measure(sim, bands.SCENES[name][1]), name, law)


# Breaks when the bands are so wide that a body may get lost.
@pytest.mark.parametrize(("name", "law"), ROWS)
def test_lost_body_leaves_the_bands(name, law):
    sim = bands.scene(name, law)
    assert left(bands.measure(sim, bands.SCENES[name][1], lost_body), name, law)


# Breaks when steps that end before the tolerance pass.
def test_unfinished_solves_leave_the_bands():
    name, law = "wall_at_rest", "coulomb"
    assert left(bands.measured(name, law, max_iterations=20), name, law) >= {"residual"}


# Breaks when a number that is not finite counts as inside.
@pytest.mark.parametrize(
    "quantity", sorted({"residual", *bands.WORK, *bands.ERRORS, *bands.CENTRED} - {"solves"})
)
def test_no_band_holds_what_is_not_finite(quantity):
    name, law = "chain", "coulomb"
    found = bands.measured(name, law)
    assert bands.outside({**found, quantity: float("nan")}, ROWS[name, law]) == [quantity]
