"""Mortar in a simulation: bonds that bear tension and cohesion, and break for good."""

import amontons
import numpy as np
import pytest
from amontons import InputError, ModelBuilder, shapes
from amontons.studies import Assembly, horizontal, stability
from blocks import box, column

AREA = 1.0


def hung(tension):
    """The verdict of a stone under a slab, held by mortar of this strength over its weight."""
    slab, stone = box("slab", (0, 0, 1), (1, 1, 0.2), fixed=True), box("stone", (0, 0, 0.5), (1, 1, 0.5))
    weight = 9.81 * stone.mass.mass
    return stability(Assembly((slab, stone)), tension=tension * weight / AREA)


def moved(simulation, seconds):
    start = simulation.state.positions.copy()
    simulation.run(seconds)
    return float(np.abs(simulation.state.positions - start).max())


# A stone hangs by mortar that bears a little more than its weight, and falls with a little less, by the
# verdict and in time. Breaks if the pull is shared out, or acts, wrongly.
@pytest.mark.parametrize(("tension", "stands"), [(1.05, True), (0.95, False)])
def test_a_stone_hangs_by_its_mortar(tension, stands):
    verdict = hung(tension)
    assert verdict.stands is stands
    simulation = amontons.Simulation(verdict.model(), dt=2e-3)
    assert bool(moved(simulation, 0.5) < 1e-4) is stands
    assert bool(np.all(simulation.state.bond_openings < 1e-4)) is stands


# A flat block with mortar slides under mu (W + f A), by the verdict's factor and in time.
# Breaks if the cohesion of the joint is not that of the verdict.
def test_cohesion_in_time():
    verdict = stability(column(2.0, 0.2, mu=0.5), tension=5e3, loads=[horizontal(1)])
    factor, mass = verdict.factors[0], verdict.assembly.blocks[1].mass.mass
    for share, stands in ((0.95, True), (1.05, False)):
        simulation = amontons.Simulation(verdict.model(), dt=2e-3)
        simulation.state.forces[0, 0] = share * factor.upper * 9.81 * mass
        assert bool(moved(simulation, 0.5) < 1e-4) is stands, share


# A wall of two leaves of mortar bends under a push: verdict and time agree on both sides of the factor.
def test_a_tower_in_mortar_is_pushed_over():
    tower = Assembly(
        (
            box("base", (0, 0, -0.5), (0.4, 0.4, 0.5), fixed=True, friction=0.9),
            *(box(f"course {k}", (0, 0, 0.3 * k), (0.4, 0.4, 0.3), friction=0.9) for k in range(4)),
        )
    )
    verdict = stability(tower, tension=2e4, loads=[horizontal(1)])
    assert verdict.factors[0].lower > 1.5 * stability(tower, loads=[horizontal(1)]).factors[0].upper
    for share, stands in ((0.93, True), (1.07, False)):
        simulation = amontons.Simulation(verdict.model(), dt=2e-3)
        push = share * verdict.factors[0].upper * 9.81
        for k, block in enumerate(tower.blocks[1:]):
            simulation.state.forces[k, 0] = push * block.mass.mass
        assert bool(moved(simulation, 0.6) < 2e-3) is stands, share


def broken():
    """A stone that was torn off its slab, and put back to where it was."""
    simulation = amontons.Simulation(hung(2.0).model(), dt=2e-3)
    simulation.state.forces[0, 2] = -1.5 * 9.81 * 1200
    start = simulation.state.positions.copy()
    simulation.run(0.1)
    simulation.state.forces[0, 2] = 0.0
    simulation.state.positions = start
    simulation.state.linear_velocities = 0.0
    return simulation


# Mortar that broke once bears nothing, even where its sides meet again. Breaks if it heals.
def test_broken_once_stays_broken():
    assert moved(amontons.Simulation(hung(2.0).model(), dt=2e-3), 0.2) < 1e-4
    simulation = broken()
    assert np.all(simulation.state.bond_openings > 1e-4)
    assert moved(simulation, 0.2) > 0.1


# What is broken is part of the state: a copy, a saved file and a second run go on with the same bits.
def test_what_is_broken_is_in_the_state(tmp_path):
    simulation = broken()
    path = tmp_path / "state.h5"
    simulation.save(path)
    others = [simulation.copy(), amontons.Simulation.load(path), broken()]
    simulation.run(0.1)
    for other in others:
        other.run(0.1)
        assert np.array_equal(other.state.positions, simulation.state.positions)
        assert np.array_equal(other.state.bond_openings, simulation.state.bond_openings)


# A model keeps its bonds as JSON, and within another model where it is moved and turned.
def test_bonds_travel_with_their_model(tmp_path):
    model = hung(1.2).model()
    path = tmp_path / "model.json"
    amontons.write_model(model, path)
    assert amontons.load_model(path).bonds == model.bonds
    builder = ModelBuilder(gravity=(-9.81, 0, 0))
    builder.add_model(model, position=(3, 0, 0), orientation=amontons.axis_angle((0, 1, 0), np.pi / 2))
    assert moved(amontons.Simulation(builder.build(), dt=2e-3), 0.3) < 1e-4


# Bad bonds are refused by what is wrong with them.
def test_bad_bonds():
    builder = ModelBuilder()
    builder.add_body("a", shape=shapes.Sphere(0.1), mass=1)
    good = {"point": (0, 0, 0), "normal": (0, 0, 1), "tension": 1.0, "opening": 1e-4}
    for change, match in (
        ({"tension": -1.0}, "tension is -1"),
        ({"opening": 0.0}, "opening is 0"),
        ({"normal": (0, 0, 0)}, "normal"),
    ):
        with pytest.raises(InputError, match=match):
            builder.add_bond("a", None, **(good | change))
    with pytest.raises(InputError, match="two bodies"):
        builder.add_bond("a", "a", **good)
    with pytest.raises(InputError, match="opening is 0"):
        hung(1.2).model(opening=0.0)
