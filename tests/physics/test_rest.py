"""A scene in which nothing moves needs no iterations: its start is a fixed point of the step."""

import amontons
import numpy as np
import pytest
from amontons import Material, ModelBuilder, shapes
from measures import simulate


def iterating(sim, steps=100):
    """How many of the next steps needed iterations; all of them converge."""
    reports = [sim.step() for _ in range(steps)]
    assert all(r.converged for r in reports)
    return sum(r.iterations > 0 for r in reports)


def cubes():
    b = ModelBuilder()
    b.add_floor(material=Material(friction=0.6))
    for place in np.ndindex(3, 3, 3):
        b.add_body(
            position=0.2 * np.array(place) + (0, 0, 0.1), shape=shapes.Box((0.1, 0.1, 0.1)), density=1e3
        )
    return b.build()


def hull_on_its_face():
    """A flat dish of 200 corners: which of them carry it must not change from step to step."""
    angle = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(100)], axis=1)
    b = ModelBuilder()
    b.add_floor(material=Material(friction=0.6))
    points = np.concatenate([0.1 * rim, 0.07 * rim + (0, 0, 0.05)])
    b.add_body(position=(0, 0, 0.0), shape=shapes.Hull(points), mass=1.0)
    return b.build()


# Bodies that rest move by the error of the accepted start, at most tolerance x g h. Were that velocity kept,
# the next starts would be off by 3, 6, 10 times as much, and the solver would be called again and again:
# fallen dominoes took 200, 83 and 0 iterations in turn, for ever.
def test_fallen_dominoes_come_to_rest():
    sim = simulate("domino_run")
    for _ in range(1500):
        sim.step()
    assert iterating(sim) <= 10


@pytest.mark.parametrize("make", [cubes, hull_on_its_face])
def test_what_stands_comes_to_rest(make):
    sim = amontons.Simulation(make())
    for _ in range(200):
        sim.step()
    assert iterating(sim) <= 10
