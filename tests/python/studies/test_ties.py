"""Joints of models in a verdict: hinges, welds, rods and ropes, against closed forms and the simulation."""

import math

import amontons
import numpy as np
import pytest
from amontons import InputError, Material, ModelBuilder, Motor, shapes
from amontons.studies import horizontal, point_load, stability

LENGTH, WEIGHT = 2.0, 9.81 * 50.0


def lever(ropes=(), **hinge):
    """A bar of 2 m and 50 kg along x that a hinge at its left end carries, and ropes to points above."""
    builder = ModelBuilder()
    builder.add_body("bar", shape=shapes.Box((LENGTH / 2, 0.05, 0.05)), mass=50, position=(LENGTH / 2, 0, 0))
    builder.add_revolute_joint("bar", None, name="hinge", point=(0, 0, 0), axis=(0, 1, 0), **hinge)
    for k, (at, anchor) in enumerate(ropes):
        far = math.dist(at, anchor)
        builder.add_distance_joint(
            "bar", None, name=f"rope {k}", point_a=at, point_b=anchor, limits=(0.0, far)
        )
    return builder.build()


# A hinge alone lets the bar fall; a rope at its end takes half of the weight.
# Breaks if the rows of joints, or the sign of a rope, are wrong.
def test_a_bar_on_a_hinge_and_a_rope():
    alone = stability(lever())
    assert alone.verdict == "falls"
    assert alone.mechanism[0, 4] > 0  # turns with its end down
    assert math.isinf(alone.equilibrium.reach) or alone.equilibrium.reach > 1e3
    held = stability(lever([((LENGTH, 0, 0), (LENGTH, 0, 3))]))
    assert held.stands
    force, _ = held.tie_forces["rope 0"]
    assert force == pytest.approx((0, 0, WEIGHT / 2), abs=1e-5 * WEIGHT)
    force, moment = held.tie_forces["hinge"]
    assert force == pytest.approx((0, 0, WEIGHT / 2), abs=1e-5 * WEIGHT)
    assert moment[1] == pytest.approx(0, abs=1e-6 * WEIGHT)
    assert stability(lever([((LENGTH, 0, 0), (LENGTH, 0, -3))])).verdict == "falls"  # a rope does not push


# A weld bears any load: no factor; the moment about its point is that of the weight.
def test_a_weld_bears_force_and_moment():
    builder = ModelBuilder()
    builder.add_body("bar", shape=shapes.Box((LENGTH / 2, 0.05, 0.05)), mass=50, position=(LENGTH / 2, 0, 0))
    builder.add_fixed_joint("bar", None, name="weld", point=(0, 0, 0))
    found = stability(builder.build(), loads=[point_load("bar", (0, 0, -1))])
    assert found.stands
    assert math.isinf(found.factors[0].upper)
    force, moment = found.tie_forces["weld"]
    assert force == pytest.approx((0, 0, WEIGHT), abs=1e-5 * WEIGHT)
    assert abs(moment[1]) == pytest.approx(WEIGHT * LENGTH / 2, rel=1e-5)


# A hinge with a limit at which it stands bears a moment of one sign.
def test_a_hinge_at_its_limit():
    sides = [stability(lever(limits=limits)).verdict for limits in ((0.0, 1.0), (-1.0, 0.0))]
    assert sorted(sides) == ["falls", "stands"]
    assert stability(lever(limits=(-1.0, 1.0))).verdict == "falls"


def portal(tied):
    """Two bars that lean on each other over smooth ground, with a tie rod between their feet."""
    builder = ModelBuilder()
    half, thick, angle = 1.0, 0.05, math.radians(50)
    builder.add_floor(material=Material(friction=0.0))
    for side in (-1, 1):
        turn = amontons.axis_angle((0, 1, 0), side * angle)
        centre = (side * half * math.cos(angle), 0, half * math.sin(angle) + 0.5)
        builder.add_body(
            f"bar {side}", shape=shapes.Box((half, 0.2, thick)), mass=10, position=centre, orientation=turn
        )
        foot = (2 * side * half * math.cos(angle), 0.0, 0.5)
        builder.add_body(
            f"foot {side}", shape=shapes.Box((0.2, 0.3, 0.25)), mass=20, position=(foot[0], 0, 0.25)
        )
        builder.add_revolute_joint(
            f"bar {side}", f"foot {side}", name=f"foot hinge {side}", point=foot, axis=(0, 1, 0)
        )
    top = (0, 0, 2 * half * math.sin(angle) + 0.5)
    builder.add_revolute_joint("bar -1", "bar 1", name="ridge", point=top, axis=(0, 1, 0))
    if tied:
        ends = [(2 * side * half * math.cos(angle), 0.0, 0.5) for side in (1, -1)]
        builder.add_distance_joint("foot 1", "foot -1", name="tie", point_a=ends[0], point_b=ends[1])
    return builder.build(), 10 * 9.81 / 2 / math.tan(angle)


# The thrust of two bars that lean on each other is W / 2 / tan(angle) each: on smooth ground they stand only
# with a tie bar, which bears it. The simulation says the same. Breaks if contacts and joints are not balanced
# together.
@pytest.mark.parametrize("tied", [True, False])
def test_a_tie_bar(tied):
    model, thrust = portal(tied)
    found = stability(model, loads=[horizontal(0, 1)] if tied else ())
    assert found.stands is tied
    if tied:
        assert np.linalg.norm(found.tie_forces["tie"][0]) == pytest.approx(thrust, rel=1e-4)
        assert found.factors[0].upper < 1e-3  # smooth ground
    simulation = amontons.Simulation(model, dt=2e-3)
    start = simulation.state.positions.copy()
    simulation.run(0.3)
    assert bool(np.abs(simulation.state.positions - start).max() < 1e-4) is tied


# What has no force at rest that does not depend on a displacement is refused by name, with a remedy.
def test_what_a_verdict_does_not_know_of_joints():
    with pytest.raises(InputError, match='joint "hinge" has a spring.*fix it'):
        stability(lever(stiffness=10.0))
    with pytest.raises(InputError, match='joint "hinge" has a motor.*add_fixed_joint'):
        stability(lever(motor=Motor("velocity")))
    noted = stability(lever([((LENGTH, 0, 0), (LENGTH, 0, 3))], friction=1.0))
    assert any('joint "hinge": its friction is left out' in note for note in noted.notes)
