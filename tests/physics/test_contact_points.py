"""How many contact points a step takes, and that nothing is felt of those that it leaves out."""

import math

import numpy as np
import pytest
from amontons import Material, ModelBuilder, Simulation, shapes
from measures import energy_in_the_middle, force_on, run

G = 9.81


def sole(n=40):
    """The hull of a foot with rounded corners: sole of half lengths 0.125 and 0.048 m at z = -0.02."""
    a = 2 * np.pi * np.arange(n) / n
    c, s = np.cos(a), np.sin(a)
    x, y = 0.13 * np.sign(c) * np.sqrt(np.abs(c)), 0.05 * np.sign(s) * np.sqrt(np.abs(s))
    levels = [(-0.02, 0.96), (-0.019, 0.985), (-0.015, 1.0), (0.02, 1.0)]
    return np.concatenate([np.stack([k * x, k * y, np.full(n, z)], axis=1) for z, k in levels])


def ball(n=642, radius=0.1):
    """The hull of points spread evenly over a sphere."""
    i = np.arange(n) + 0.5
    polar, around = np.arccos(1 - 2 * i / n), math.pi * (1 + math.sqrt(5)) * i
    return radius * np.stack(
        [np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar), np.cos(polar)], axis=1
    )


def floor(kind):
    """A level floor at z = 0 as a plane, a box, a mesh or a height field."""
    if kind == "plane":
        return shapes.Plane(), (0, 0, 0)
    if kind == "box":
        return shapes.Box((5, 5, 0.5)), (0, 0, -0.5)
    if kind == "field":
        return shapes.HeightField(np.zeros((41, 41)), 4.0, 4.0), (0, 0, 0)
    n, cells = 41, 40
    x, y = np.meshgrid(np.linspace(-2, 2, n), np.linspace(-2, 2, n), indexing="ij")
    first = (np.arange(cells)[:, None] * n + np.arange(cells)).ravel()
    triangles = np.concatenate(
        [np.stack([first, first + n, first + n + 1], 1), np.stack([first, first + n + 1, first + 1], 1)]
    )
    return shapes.Mesh(np.stack([x.ravel(), y.ravel(), np.zeros(n * n)], 1), triangles), (0, 0, 0)


def on_floor(kind, shape, *, friction=0.5, h=5e-3, **body):
    b = ModelBuilder()
    ground, position = floor(kind)
    b.add_geom(None, ground, position=position, material=Material(friction=friction))
    b.add_body("body", shape=shape, material=Material(friction=friction), **{"mass": 1.0, **body})
    return Simulation(b.build(), dt=h)


FLOORS = ("plane", "box", "mesh", "field")


@pytest.mark.parametrize("kind", FLOORS)
def test_a_hull_rests_on_the_corners_of_its_sole(kind):
    # 80 corners lie within the margin; twelve hold what they all do. The weight is carried, by points on the
    # rim of the sole, and nothing moves: breaks when points flicker or the choice loses a side.
    sim = on_floor(kind, shapes.Hull(sole()), position=(0.013, 0.021, 0.02))
    run(sim, 0.2)
    start = np.concatenate([sim.state.positions[0], sim.state.orientations[0]])
    counts = {report.contacts for report in run(sim, 1.0)}
    assert max(counts) <= 12
    assert len(counts) == 1
    assert force_on(sim, "body")[2] == pytest.approx(G, rel=1e-5)
    end = np.concatenate([sim.state.positions[0], sim.state.orientations[0]])
    assert np.abs(end - start).max() < 1e-9
    points = sim.contacts["point"][:, :2] - sim.state.positions[0, :2]
    rim = (points[:, 0] / (0.96 * 0.13)) ** 4 + (points[:, 1] / (0.96 * 0.05)) ** 4
    assert rim == pytest.approx(np.ones(len(rim)), abs=1e-6)


@pytest.mark.parametrize("kind", FLOORS)
@pytest.mark.parametrize("roughness", [1e-7, 1e-6, 1e-5])
def test_a_rough_sole_comes_to_rest(kind, roughness):
    # Corners of files are rounded to single precision, and a sole of 240 corners is no plane: it stands on
    # three of them, which are known only when it does. Breaks when those are left out for points nearby: the
    # foot then sinks in by about the roughness, is pushed out, and rattles (1e-4 m/s) for ever.
    rng = np.random.default_rng(1)
    corners = np.concatenate([sole(60), 0.9 * sole(60) - [0, 0, 0.002]])
    corners += roughness * rng.standard_normal(corners.shape)
    sim = on_floor(kind, shapes.Hull(corners), position=(0.013, 0.021, 0.0205))
    run(sim, 1.5)
    for report in run(sim, 0.1):
        assert report.contacts <= 20
        assert np.abs(sim.state.linear_velocities).max() < 1e-7


@pytest.mark.parametrize("kind", ["plane", "box"])
def test_a_hull_tips_over_the_edge_of_its_sole(kind):
    # The centre of mass hangs over the front of the sole, which reaches 0.96 * 0.13 m: behind that it stays,
    # beyond it tips. Twelve of the forty corners reach as far but for 1 %.
    for beyond in (False, True):
        reach = 0.96 * 0.13 * (1.01 if beyond else 0.98)
        b = ModelBuilder()
        ground, position = floor(kind)
        b.add_geom(None, ground, position=position)
        b.add_body("body", mass=1.0, inertia=(1e-3, 1e-3, 1e-3), position=(reach, 0, 0.02))
        b.add_geom("body", shapes.Hull(sole()), position=(-reach, 0, 0))
        sim = Simulation(b.build())
        run(sim, 0.5)
        tilt = 2 * abs(sim.state.orientations[0, 2])
        assert tilt > 0.05 if beyond else tilt < 1e-6


@pytest.mark.parametrize("kind", FLOORS)
@pytest.mark.parametrize("h", [1e-2, 2e-3])
def test_points_left_out_are_never_felt(kind, h):
    # A foot that falls on its toe and slams down, a ball of 642 corners that rolls and one that falls
    # spinning: corners that had no rows when the step began are what it lands on. Breaks when those are not
    # looked at after the solve: overlaps are then as deep as a corner moves in a step (1e-2 m). A spare
    # corner may come in by a hundredth of the margin, a face that turns by a tenth.
    for shape, motion in (
        (shapes.Hull(sole()), {"position": (0, 0, 0.1), "angular_velocity": (1, 2, 0)}),
        (shapes.Hull(ball()), {"position": (-0.5, 0, 0.1), "linear_velocity": (1, 0, 0),
                               "angular_velocity": (0, 10, 0)}),
        (shapes.Hull(ball()), {"position": (0, 0, 0.3), "angular_velocity": (20, -10, 30)}),
    ):  # fmt: skip
        sim = on_floor(kind, shape, h=h, **motion)
        energies = []
        reports = run(sim, 1.0, lambda s, _, energies=energies: energies.append(energy_in_the_middle(s)))
        assert max(r.penetration for r in reports) < 0.1 * sim.margin
        assert np.diff(energies).max() < 1e-3 * G * 0.1
        assert np.mean([r.contacts for r in reports]) <= 13


@pytest.mark.parametrize("kind", ["mesh", "field"])
@pytest.mark.parametrize("cells", [20, 80, 160])
def test_a_box_lies_still_on_bumps(kind, cells):
    # Over 50 to 3200 triangles of bumps of 2 mm it comes to rest on three of them, wherever under it they
    # are, and stays. Breaks when points inside the outline of those within the margin are left out: it then
    # sinks in beside the deepest one, is pushed out, and never rests (2 cm/s, 1 mm deep).
    x = np.linspace(-2, 2, cells + 1)
    x, y = np.meshgrid(x, x, indexing="ij")
    rng = np.random.default_rng(0)
    z = 0.002 * np.sin(20 * x) * np.sin(20 * y) + 0.01 / cells * rng.standard_normal(x.shape)
    if kind == "field":
        ground = shapes.HeightField(np.ascontiguousarray(z.T), 4.0, 4.0)
    else:
        first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
        diagonal = first + cells + 2
        triangles = np.concatenate(
            [np.stack([first, diagonal - 1, diagonal], 1), np.stack([first, diagonal, first + 1], 1)]
        )
        ground = shapes.Mesh(np.stack([x.ravel(), y.ravel(), z.ravel()], 1), triangles)
    b = ModelBuilder()
    b.add_geom(None, ground)
    b.add_body("box", shape=shapes.Box((0.5, 0.5, 0.1)), mass=1.0, position=(0, 0, 0.11))
    sim = Simulation(b.build(), dt=5e-3)
    run(sim, 0.5)
    for report in run(sim, 0.25):
        assert report.contacts <= 12
        assert report.penetration < 1e-5  # far below 1e-4 lengths, which would be corrected
        assert np.abs(sim.state.linear_velocities).max() < 1e-8
    assert force_on(sim, "box")[2] == pytest.approx(G, rel=1e-5)


def test_corners_of_boxes_all_stay():
    # Boxes have few corners, each a row of its own: one that rocks keeps those that hang in the air.
    b = ModelBuilder()
    b.add_geom(None, shapes.Plane())
    b.add_body("box", shape=shapes.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.1))
    sim = Simulation(b.build(), dt=5e-3)
    sim.state.orientations[0] = (math.cos(0.002), math.sin(0.002), 0, 0)
    assert sim.step().contacts == 4
