"""Islands rest alone: what stands needs no iterations beside something that moves."""

import os
from dataclasses import replace
from pathlib import Path

import amontons
import numpy as np
import pytest
from amontons import Material, ModelBuilder, scenes, shapes

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = Path(os.environ.get("AMONTONS_DATA", ROOT.parent / "shared" / "data")) / "robots"


def add_boxes(b, columns, height, x=3.0):
    for place in np.ndindex(columns, height):
        b.add_body(
            position=(x + 0.5 * place[0], 0, 0.1 + 0.2 * place[1]),
            shape=shapes.Box((0.1, 0.1, 0.1)),
            density=1e3,
        )


def with_pendulum(columns):
    b = ModelBuilder()
    b.add_floor(material=Material(friction=0.6))
    add_boxes(b, columns, 3)
    bob = b.add_body("bob", position=(0.5, 0, 2), shape=shapes.Sphere(0.1), mass=1.0)
    b.add_revolute_joint(bob, None, point=(0, 0, 2), axis=(0, 1, 0))
    return b.build()


# Breaks when one body that moves keeps all others iterating: beside the stacks the pendulum takes as many
# iterations as alone.
def test_a_pendulum_does_not_wake_ten_stacks():
    beside, alone = (amontons.Simulation(with_pendulum(n), threads=1) for n in (10, 0))
    for sim in (beside, alone):
        for _ in range(50):
            sim.step()
    start = np.array(beside.state.positions[:-1])
    for _ in range(200):
        crowded, lonely = beside.step(), alone.step()
        assert crowded.converged
        assert crowded.iterations == lonely.iterations
    # What rests has no velocity at all, so that it cannot creep.
    assert np.array_equal(beside.state.positions[:-1], start)
    assert np.abs(beside.state.positions[-1] - (0.5, 0, 2)).max() > 0.1


# Breaks when an island that is hit goes on resting, or one that nobody touches wakes.
def test_a_stack_wakes_when_it_is_hit():
    b = ModelBuilder()
    b.add_floor(material=Material(friction=0.6))
    add_boxes(b, 2, 2)
    b.add_body("ball", position=(2.0, 0, 0.3), linear_velocity=(2, 0, 0), shape=shapes.Sphere(0.1), mass=4.0)
    sim = amontons.Simulation(b.build())
    for _ in range(200):
        assert sim.step().converged
    there = np.array(sim.state.positions)[:4, :2]
    moved = np.linalg.norm(there - [[3, 0], [3, 0], [3.5, 0], [3.5, 0]], axis=1)
    assert moved[:2].min() > 1e-3
    assert moved[2:].max() < 1e-6


def quadruped(boxes, trees):
    """A robot of four legs, and boxes that rest beside it in columns of three."""
    b = ModelBuilder()
    b.add_model(amontons.load_model(ROBOTS / "unitree_go1" / "scene.xml"))
    add_boxes(b, boxes // 3, 3)
    return replace(b.build(), trees=trees)


def driven(sim, steps):
    """Iterations of some steps, in which servos follow sines."""
    iterations = 0
    for _ in range(steps):
        phase = 10 * sim.time + np.arange(len(sim.state.controls))
        sim.state.controls[:] = 0.3 * np.sin(phase)
        iterations += sim.step().iterations
    return iterations


# Breaks when the contacts of the pile, some hundred, are solved with those of the robot: its 27 boxes then
# add 60 % to the iterations. In coordinates of its joints the robot has bodies that no row touches; breaks
# when these do not wake its island. The robot alone moves a little differently, because errors count relative
# to the size of the model.
@pytest.mark.parametrize("trees", ["none", "auto"])
def test_a_resting_pile_beside_a_robot_needs_no_iterations(trees):
    if not ROBOTS.exists():
        pytest.skip(f"no {ROBOTS}")
    pytest.importorskip("mujoco")
    alone, beside = (amontons.Simulation(quadruped(boxes, trees), dt=2e-3, threads=1) for boxes in (0, 27))
    for sim in (alone, beside):
        driven(sim, 100)
    assert driven(beside, 300) <= 1.1 * driven(alone, 300)


# Breaks when the error that a solve leaves in velocities is that of all bodies, and of those that touch
# nothing: grains stopped in the air beside one that rested. 0.1 sqrt(401) is the speed of two steps of fall.
def test_grains_fall_beside_one_that_rests():
    b = ModelBuilder()
    b.add_floor()
    b.add_body(position=(-3, 0, 0.1), shape=shapes.Box((0.1, 0.1, 0.1)), density=1e3)
    for place in np.ndindex(20, 20):
        b.add_body(position=(0.3 * place[0], 0.3 * place[1], 5), shape=shapes.Sphere(0.1), density=1e3)
    sim = amontons.Simulation(b.build(), tolerance=0.1)
    for _ in range(20):
        sim.step()
    assert len(sim.contacts) == 4
    fallen = 5 - np.array(sim.state.positions)[1:, 2]
    np.testing.assert_allclose(fallen, 0.5 * 9.81 * sim.time**2, rtol=0.1)


# Breaks when bodies that only touch each other stop in the air beside a scene at rest: the error of 400
# grains is twice g h.
def test_a_pair_falls_beside_a_scene_at_rest():
    b = ModelBuilder()
    b.add_floor()
    for place in np.ndindex(20, 20):
        b.add_body(position=(0.3 * place[0], 0.3 * place[1], 0.1), shape=shapes.Sphere(0.1), density=1e3)
    for x in (0.0, 0.2):
        b.add_body(position=(x, 0, 5), shape=shapes.Sphere(0.1), density=1e3)
    sim = amontons.Simulation(b.build(), tolerance=0.1)
    for _ in range(20):
        sim.step()
    fallen = 5 - np.array(sim.state.positions)[400:, 2]
    np.testing.assert_allclose(fallen, 0.5 * 9.81 * sim.time**2, rtol=0.1)


# Breaks when each of n bodies may have the velocity error of all together, 0.1 sqrt(100) g h: that stopped a
# hundred boxes on ice at once.
def test_boxes_glide_on_at_a_coarse_tolerance():
    b = ModelBuilder()
    ice = Material(friction=0)
    b.add_floor(material=ice)
    for place in np.ndindex(10, 10):
        b.add_body(
            position=(0.3 * place[0], 0.3 * place[1], 0.1),
            linear_velocity=(0.04, 0, 0),
            shape=shapes.Box((0.1, 0.1, 0.1)),
            density=1e3,
            material=ice,
        )
    sim = amontons.Simulation(b.build(), dt=1e-2, tolerance=0.1)
    for _ in range(20):
        sim.step()
    np.testing.assert_allclose(sim.state.linear_velocities[:, 0], 0.04, rtol=1e-9)


# Breaks when a heap comes to rest while it still settles: it stopped for good after 0.15 s.
def test_a_heap_settles_at_a_coarse_tolerance():
    settled = {}
    for tolerance in (0.1, 1e-3):
        sim = amontons.Simulation(scenes.spheres_in_box(count=100, mu=0.5), dt=1e-2, tolerance=tolerance)
        heights = []
        for _ in range(80):
            sim.step()
            heights.append(sim.state.positions[:, 2].mean())
        settled[tolerance] = heights[19] - heights[-1]
    # Velocities are right to the tolerance, and so is the way of a heap that goes on settling.
    np.testing.assert_allclose(settled[0.1], settled[1e-3], rtol=0.1)
