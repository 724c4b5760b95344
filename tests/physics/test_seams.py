"""Flush neighbours are one surface: what rolls or slides over the joint feels nothing; real edges stay."""

import math

import numpy as np
import pytest
from amontons import Material, ModelBuilder, Simulation, shapes
from measures import middle, run

G = 9.81
R, V = 0.1, 2.0
GRIP = Material(friction=0.8)
ABOUT_X = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)  # an axis along z comes to lie along y


def cuboid(x, y, z):
    return np.array([[i * x, j * y, k * z] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])


def tile(half, cells=5):
    x, y = np.meshgrid(np.linspace(-half, half, cells + 1), np.linspace(-1, 1, cells + 1), indexing="ij")
    first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    across = first + cells + 2
    triangles = [np.stack([first, across - 1, across], 1), np.stack([first, across, first + 1], 1)]
    return shapes.Mesh(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1), np.concatenate(triangles))


def floor(b, kind, count=10, half=0.25, gap=0.0, step=0.0, material=GRIP):
    """Ten slabs in a row along x from -0.3 m on, with their tops at z = 0."""
    for i in range(count):
        position = (i * (2 * half + gap) + half - 0.3, 0, -0.1 + (step if i else 0))
        slab = shapes.Box((half, 1, 0.1))
        if kind == "boxes":
            b.add_geom(None, slab, position=position, material=material)
        elif kind == "hulls":
            b.add_geom(None, shapes.Hull(cuboid(half, 1, 0.1)), position=position, material=material)
        elif kind == "fixed bodies":
            b.add_body(f"slab {i}", motion="static", position=position)
            b.add_geom(f"slab {i}", slab, material=material)
        elif kind == "loose bodies":
            if i == 0:
                b.add_geom(None, shapes.Plane(), position=(0, 0, -0.2), material=material)
            b.add_body(f"slab {i}", shape=slab, mass=50, position=position, material=material)
        elif kind in ("meshes", "height fields", "boxes and tiles"):
            if kind == "boxes and tiles" and i % 2:
                b.add_geom(None, slab, position=position, material=material)
            else:
                surface = shapes.HeightField(np.zeros((5, 6)), 2 * half, 2.0)
                surface = tile(half) if kind == "meshes" else surface
                b.add_geom(None, surface, position=(position[0], 0, position[2] + 0.1), material=material)
        else:  # every other slab is a part of the plane
            if i == 0:
                b.add_geom(None, shapes.Plane(), material=material)
            if i % 2:
                b.add_geom(None, slab, position=position, material=material)


ROLLING = {
    "sphere": (shapes.Sphere(R), (1, 0, 0, 0)),
    "ellipsoid": (shapes.Ellipsoid((R, 0.2, R)), (1, 0, 0, 0)),
    "cylinder": (shapes.Cylinder(R, 0.1), ABOUT_X),
    "capsule": (shapes.Capsule(R, 0.1), ABOUT_X),
}


def roll(shape, h, build, *, speed=V, heading=0.0, position=(0, 0, R), material=GRIP):
    """A body that rolls without slip; it is the last one of the model."""
    b = ModelBuilder()
    build(b)
    body, orientation = ROLLING[shape]
    c, s = math.cos(heading), math.sin(heading)
    w, x, y, z = orientation
    ch, sh = math.cos(heading / 2), math.sin(heading / 2)
    b.add_body(
        "roller",
        shape=body,
        mass=1.0,
        position=position,
        orientation=(ch * w - sh * z, ch * x - sh * y, ch * y + sh * x, ch * z + sh * w),
        linear_velocity=(speed * c, speed * s, 0),
        angular_velocity=(-speed / R * s, speed / R * c, 0),
        material=material,
    )
    return Simulation(b.build(), dt=h)


def track(sim, duration):
    """Heights of the roller, and the velocities with which it moved."""
    body = sim.model.body_index("roller")
    heights, velocities = [], []

    def note(s, _):
        heights.append(s.state.positions[body, 2])
        velocities.append(np.array(middle(s).state.linear_velocities[body]))

    run(sim, duration, note)
    return np.array(heights), np.array(velocities)


FLOORS = ("boxes", "hulls", "fixed bodies", "loose bodies", "beside a plane", "meshes", "height fields",
          "boxes and tiles")  # fmt: skip


@pytest.mark.parametrize("kind", FLOORS)
@pytest.mark.parametrize("h", [1e-2, 5e-3])
@pytest.mark.parametrize("shape", ROLLING)
def test_rolling_over_ten_slabs_is_rolling_on_a_plane(shape, h, kind):
    # Height and velocity are constant. A step closes its gap to 1e-6 of g h^2, 1e-9 m, and leaves 1e-6 of g h
    # in the velocity, which need not cancel over 200 steps: 2e-5 m/s; of loose slabs of 50 kg the residual is
    # relative to their weight: 3e-4 m/s, and h times that in the height. Contact with the edge of the next
    # slab, d ahead, leans back by d / R and acts before it touches: it
    # lifted a ball by 2.6 mm and took 13 % of its speed at 10 ms.
    sim = roll(shape, h, lambda b: floor(b, kind))
    heights, velocities = track(sim, 2.0)
    assert np.abs(heights - R).max() < (3e-4 * h if kind == "loose bodies" else 1e-7)
    assert np.abs(velocities - [V, 0, 0]).max() < (3e-4 if kind == "loose bodies" else 2e-5)


@pytest.mark.parametrize("shape", ROLLING)
def test_rolling_askew_and_along_a_joint(shape):
    # The joints are crossed at 17 degrees, by one end of a cylinder after the other, and followed for 0.8 m
    # with the joint under the roller. A contact of one end with the next slab turns a cylinder aside.
    for heading, position in ((0.3, (0, -0.4, R)), (math.pi / 2, (0.2, -0.8, R))):
        sim = roll(shape, 1e-2, lambda b: floor(b, "boxes"), heading=heading, position=position)
        heights, velocities = track(sim, 0.8)
        assert np.abs(heights - R).max() < 2e-7
        expected = [V * math.cos(heading), V * math.sin(heading), 0]
        assert np.abs(velocities - expected).max() < 2e-5


def test_a_soft_floor_has_no_joints():
    # A ball sinks by e m g = 1 mm and stays there, below the tops of the slabs, whose sides must not stop it.
    # As on a plane, to the tolerance.
    soft = Material(friction=0.8, compliance=1e-4)
    start = (0, 0, R - 1e-4 * G)
    on_plane = track(
        roll("sphere", 5e-3, lambda b: b.add_geom(None, shapes.Plane(), material=soft), position=start), 1.8
    )
    found = track(roll("sphere", 5e-3, lambda b: floor(b, "boxes", material=soft), position=start), 1.8)
    assert np.abs(found[0] - on_plane[0]).max() < 1e-7
    assert np.abs(found[1] - on_plane[1]).max() < 2e-5
    assert found[1][-1, 0] > 0.99 * V


@pytest.mark.parametrize("kind", FLOORS)
def test_a_box_slides_over_ten_slabs(kind):
    # 2 m/s for 2 s without friction. The side of the next slab, or the border of the next tile, is where the
    # box would come to touch it first.
    b = ModelBuilder()
    smooth = Material(friction=0.0)
    floor(b, kind, material=smooth)
    b.add_body("roller", shape=shapes.Box((R, R, R)), mass=1.0, position=(0.01, 0.02, R),
               linear_velocity=(V, 0, 0), material=smooth)  # fmt: skip
    heights, velocities = track(Simulation(b.build(), dt=1e-2), 2.0)
    assert np.abs(heights - R).max() < 1e-7
    assert np.abs(velocities - [V, 0, 0]).max() < 2e-5


@pytest.mark.parametrize("tiles", [2, 4, 8])
def test_tiles_of_one_terrain_are_the_terrain(tiles):
    # Waves of 2 cm in one height field and in several that share their borders: a ball rolls alike over both,
    # to the tolerance of the solver, although the ground bends at the joints, up as well as down.
    def build(b, count):
        for i in range(count):
            length = 4 / count
            x = np.linspace(i * length, (i + 1) * length, 160 // count + 1) - 1
            z = np.tile(0.02 * np.sin(3 * x), (9, 1))
            b.add_geom(
                None,
                shapes.HeightField(z, length, 2.0),
                position=((i + 0.5) * length - 1, 0, 0),
                material=GRIP,
            )

    start = (0.013, 0.11, R + 1e-3)
    one, many = (
        track(roll("sphere", 5e-3, lambda b, n=n: build(b, n), speed=1.0, position=start), 2.0)
        for n in (1, tiles)
    )
    assert np.abs(many[0] - one[0]).max() < 1e-8
    assert np.abs(many[1] - one[1]).max() < 1e-6


@pytest.mark.parametrize("angle", [0.1, 0.5])
def test_a_ridge_is_left_along_the_slab_before_it(angle):
    # Behind 0.2 m the floor falls by an angle, in a slab of its own that shares the upper edge. The ball
    # comes to the ridge unbraked, and flies off it.
    def build(b):
        floor(b, "boxes", count=1)
        c, s = math.cos(angle), math.sin(angle)
        centre = (0.2 + 0.5 * c - 0.1 * s, 0, -0.5 * s - 0.1 * c)
        turned = (math.cos(angle / 2), 0, math.sin(angle / 2), 0)
        b.add_geom(None, shapes.Box((0.5, 1, 0.1)), position=centre, orientation=turned, material=GRIP)

    h = 1e-2
    heights, velocities = track(roll("sphere", h, build), 0.2)
    before = V * h * np.arange(1, len(heights) + 1) < 0.2
    assert np.abs(heights[before] - R).max() < 1e-7
    assert np.abs(velocities[before] - [V, 0, 0]).max() < 2e-5
    assert velocities[:, 0].min() > 0.998 * V  # the slope, where the ball comes down on it, takes little
    assert heights[-1] < R - 5e-3


@pytest.mark.parametrize("h", [1e-3, 2.5e-4])
def test_a_step_of_a_millimetre_is_felt(h):
    # The angular momentum about the edge that is struck is kept: m v (R - s) + 2/5 m R v = 7/5 m R v', or
    # v' = v (1 - 5 s / (7 R)), along the tangent at the edge. Found up to v h ahead, the edge is struck as
    # from there: at an angle of up to (v h + sqrt(2 R s)) / R in the place of sqrt(2 s / R).
    s = 1e-3
    sim = roll("sphere", h, lambda b: floor(b, "boxes", count=2, step=s))
    heights, velocities = track(sim, 0.2)
    least = 5 / 7 * s / R
    most = 5 / 14 * ((V * h + math.sqrt(2 * R * s)) / R) ** 2
    speeds = np.linalg.norm(velocities, axis=1)
    after = speeds[speeds < V * (1 - 0.5 * least)][0]
    assert V * (1 - 1.1 * most) < after < V * (1 - 0.9 * least)
    assert heights.max() > R + s


def test_a_gap_is_fallen_into():
    # Slowly over a gap of 4 cm a ball sinks between the edges by R - sqrt(R^2 - w^2 / 4), and loses speed at
    # the second one. Breaks when slabs that are level count as one floor however far apart.
    w, speed, h = 0.04, 0.3, 1e-3
    sim = roll("sphere", h, lambda b: floor(b, "boxes", count=2, gap=w), speed=speed)
    heights, velocities = track(sim, 1.2)
    depth = R - math.sqrt(R * R - w * w / 4)
    assert 0.5 * depth < R - heights.min() < 1.01 * depth
    assert velocities[-1, 0] < 0.95 * speed


def test_a_corner_between_floor_and_wall_stops():
    # The wall stands beside the floor and on it. Rolling into the corner ends there, at R from both.
    for base in (0.0, -0.2):

        def build(b, base=base):
            floor(b, "boxes", count=1)
            b.add_geom(None, shapes.Box((0.1, 1, 0.3)), position=(0.3 + (0 if base else -0.1), 0, base + 0.3))

        sim = roll("sphere", 5e-3, build, speed=1.0, material=Material(friction=0.0))
        heights, velocities = track(sim, 1.0)
        edge = 0.2 if base else 0.1
        body = sim.model.body_index("roller")
        assert sim.state.positions[body, 0] == pytest.approx(edge - R, abs=1e-6)
        assert np.abs(velocities[-1]).max() < 1e-5
        assert heights == pytest.approx(np.full(len(heights), R), abs=1e-6)


def test_loads_are_shared_by_both_sides_of_a_joint():
    # A box astride the joint rests on both slabs, each of which carries what its share of the box weighs: 3/4
    # and 1/4 of the moments' balance. Breaks when one slab's contacts are taken for the other's.
    b = ModelBuilder()
    floor(b, "fixed bodies", count=2)
    b.add_body("roller", shape=shapes.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0.15, 0, 0.1))
    sim = Simulation(b.build())
    run(sim, 0.5)
    carried = np.zeros(2)
    for c in sim.contacts:
        carried[int(c["body_b"])] += c["force"][2]
    assert carried.sum() == pytest.approx(G, rel=1e-5)
    assert carried.min() > 0.01 * G
    assert np.abs(sim.state.positions[sim.model.body_index("roller")] - [0.15, 0, 0.1]).max() < 1e-8
