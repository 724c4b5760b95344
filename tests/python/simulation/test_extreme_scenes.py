"""What a step keeps in scenes of extremes: tiny bodies, overlapping starts, rough walls, mass ratios."""

import amontons
import numpy as np
import pytest
from amontons import Material, ModelBuilder, shapes
from middle import energies_in_the_middle


def small_shapes(size):
    """Of half extents from 0.4 sizes on."""
    box = shapes.Box((size, 0.6 * size, 0.8 * size))
    return [
        shapes.Sphere(size),
        box,
        shapes.Capsule(0.5 * size, 0.6 * size),
        shapes.Cylinder(0.7 * size, 0.4 * size),
    ]


# Breaks when a length of our own, in m and not of the model, is in the way of tiny bodies: a margin, a gap
# that counts as closed, a speed of recovery. Gravity makes them fall half their size in 3 ms.
@pytest.mark.parametrize("ground", ["plane", "box", "field"])
def test_bodies_of_a_tenth_of_a_millimetre_stay_on_their_floor(ground):
    size, builder = 1e-4, ModelBuilder()
    floor = {
        "plane": (shapes.Plane(), (0, 0, 0)),
        "box": (shapes.Box((40 * size, 40 * size, size)), (0, 0, -size)),
        "field": (shapes.HeightField(np.zeros((5, 5)), 80 * size, 80 * size), (0, 0, 0)),
    }[ground]
    builder.add_geom(None, floor[0], position=floor[1])
    for i in range(12):
        at = np.array([i % 3 - 1.0, i // 3 % 2 - 0.5, 2 + i // 6]) * 2.5 * size
        velocity = 0.1 * np.array([np.cos(i), np.sin(i), -1])
        builder.add_body(shape=small_shapes(size)[i % 4], density=1000, position=at, linear_velocity=velocity)
    sim = amontons.Simulation(builder.build(), dt=2e-4, on_failure="ignore")
    for _ in range(400):
        sim.step()
        # The smallest half extent is 0.4 sizes, of the cylinder.
        assert sim.state.positions[:, 2].min() > 0.3 * size
    boxes = sim.state.linear_velocities[1::4]
    assert np.abs(boxes).max() < 1e-3


# Breaks when moving bodies out of each other gives them velocities, or turns a spinning body and keeps its
# angular momentum where that is more energy: there is no gravity, so that nothing may speed up. The
# allowance is that of the solve, tolerance 1e-6, in the mean over a step.
@pytest.mark.parametrize("spin", [0.0, 6.0])
def test_overlapping_starts_give_no_energy(spin):
    rng, builder = np.random.default_rng(5), ModelBuilder(gravity=(0, 0, 0))
    for i in range(12):
        builder.add_body(
            shape=[shapes.Box((0.3, 0.1, 0.05)), shapes.Capsule(0.08, 0.25)][i % 2],
            density=1000,
            position=0.25 * rng.standard_normal(3),
            angular_velocity=spin * rng.standard_normal(3),
            material=Material(friction=0.5),
        )
    sim = amontons.Simulation(builder.build(), dt=5e-3, on_failure="ignore")
    before, deepest = np.inf, 0.0
    for _ in range(200):
        report = sim.step()
        deepest = max(deepest, report.penetration)
        assert report.balanced
        now, _ = energies_in_the_middle(sim)
        assert now <= before * (1 + 1e-5) + 1e-15
        before = now
    assert deepest > 0.02  # they did start inside each other
    assert report.penetration < 0.1 * deepest


# Breaks when a cone with half an angle of 89.9 degrees lets slide what it holds: a plate on a wall that hangs
# back by 10 degrees.
def test_two_thousandfold_friction_holds_a_plate_on_a_wall():
    angle = np.radians(80)
    builder = ModelBuilder(gravity=9.81 * np.array([np.sin(angle), 0, -np.cos(angle)]))
    rough = Material(friction=2000)
    builder.add_geom(None, shapes.Plane(), material=rough)
    plate = shapes.Box((0.2, 0.2, 0.02))
    builder.add_body(shape=plate, density=1000, position=(0, 0, 0.02), material=rough)
    sim = amontons.Simulation(builder.build(), dt=5e-3)
    for _ in range(200):
        assert sim.step().converged
    np.testing.assert_allclose(sim.state.positions[0], [0, 0, 0.02], atol=1e-4)


# Breaks when light bodies are lost in a heavy one: boxes of some mg come down on a block of thousands of
# tonnes that lands with them. That errors of light bodies are seen at all has a test in test_unseen.cpp.
@pytest.mark.parametrize("method", ["auto", "apgd"])
def test_light_boxes_stay_on_a_heavy_block(method):
    builder = ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    builder.add_body(shape=shapes.Box((1, 1, 1)), density=1e6, position=(0, 0, 1.05))
    boxes = [
        builder.add_body(
            shape=shapes.Box((0.15, 0.1, 0.1)),
            density=1e-3,
            orientation=(0.9, 0.3, 0.1, 0.3),
            position=(0.4 * x, 0.4 * y, 2.25),
            linear_velocity=(0.3 * x, 0.3 * y, -2),
        )
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    sim = amontons.Simulation(builder.build(), dt=5e-3, tolerance=1e-3, method=method, on_failure="ignore")
    for _ in range(100):
        sim.step()
        assert sim.state.positions[boxes, 2].min() > 2 + 0.09


# Breaks when a residual is relative to rounding: spheres that touch side by side fall freely, and no contact
# approaches but for rounding. What they do is slide, as they spin, or not even that.
@pytest.mark.parametrize("spin", [0.0, 1e-17, 0.1])
@pytest.mark.parametrize("velocity", [0.0, 1e-17])
def test_spheres_that_fall_side_by_side_are_solved(spin, velocity):
    rng, builder = np.random.default_rng(0), ModelBuilder()
    for i in range(75):
        builder.add_body(
            shape=shapes.Sphere(0.1),
            density=1000,
            position=(0.2 * (i % 15), 0.2 * (i // 15), 1),
            linear_velocity=velocity * rng.standard_normal(3),
            angular_velocity=spin * rng.standard_normal(3),
        )
    sim = amontons.Simulation(builder.build(), dt=5e-3, tolerance=1e-5)
    for _ in range(12):
        report = sim.step()
        assert report.converged
        assert report.contacts == 130
        assert report.factorizations == 0
