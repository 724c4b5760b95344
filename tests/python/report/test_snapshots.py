"""Pictures: what they show is where it is, and every shape can be drawn."""

import time

import amontons
import numpy as np
import pytest
from amontons import scenes, shapes
from amontons.report.extents import FAR, MARGIN
from amontons.report.force_lines import force_lines, forces_of
from amontons.report.picture import FIXED, Frame, Framing, Picture, View, frame_of
from amontons.report.snapshots import snapshots_figure

TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) - 0.25
MOVING = (
    shapes.Sphere(0.5),
    shapes.Box((0.5, 0.3, 0.2)),
    shapes.Capsule(0.2, 0.4),
    shapes.Cylinder(0.3, 0.4),
    shapes.Ellipsoid((0.5, 0.3, 0.2)),
    shapes.Hull(TETRAHEDRON),
)
STATIC = (
    shapes.Plane(),
    shapes.Mesh(TETRAHEDRON, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])),
    shapes.HeightField(np.arange(12.0).reshape(3, 4) / 20, 2.0, 2.0),
)


PIXEL = 0.01


def drawn(*placed):
    """Fixed shapes at positions in the world, in this order, seen along x: columns are y, rows are z. What is
    seen by pixel, and how far towards the eye (m); and the picture."""
    builder = amontons.ModelBuilder()
    for shape, position in placed:
        builder.add_geom(None, shape, position=position)
    picture = Picture(builder.build(), View(azimuth=0, elevation=0))
    frame = Frame(0.0, np.zeros((0, 3)), np.zeros((0, 4)))
    return *picture.probe(frame, Framing(np.zeros(3), 400 * PIXEL), 400, 400), picture


# Breaks when a shape is drawn too large, too small or from the wrong side: areas seen along x. Pixels on the
# outline, of 0.01, bound the error by its length times half a pixel; round shapes are polyhedra of 32 sides.
@pytest.mark.parametrize(
    ("shape", "area", "depth"),
    [
        (shapes.Sphere(0.5), np.pi * 0.25, 0.5),
        (shapes.Box((0.5, 0.3, 0.2)), 4 * 0.3 * 0.2, 0.5),
        (shapes.Cylinder(0.3, 0.4), 4 * 0.3 * 0.4, 0.3),
        (shapes.Capsule(0.2, 0.4), 4 * 0.2 * 0.4 + np.pi * 0.04, 0.2),
        (shapes.Ellipsoid((0.5, 0.3, 0.2)), np.pi * 0.06, 0.5),
        (shapes.Hull(TETRAHEDRON), 0.5, 0.75),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, shapes.Shape) else "",
)
def test_size(shape, area, depth):
    labels, depths, _ = drawn((shape, (0, 0, 0)))
    assert (labels == 0).sum() * PIXEL**2 == pytest.approx(area, rel=0.05)
    assert depths.max() == pytest.approx(depth, rel=0.05)


# Breaks when a pixel is left out between triangles that share an edge, or counted for one that does not hold
# its centre: many small and few large triangles of a square show the same, those inside by comparison.
def test_pixels_are_those_whose_centres_lie_inside():
    for parts in (1, 7, 60):
        x = np.linspace(-1, 1, parts + 1)
        y, z = (v.ravel() for v in np.meshgrid(x, x))
        grid = np.column_stack((np.zeros(len(y)), y, z))
        index = np.arange((parts + 1) ** 2).reshape(parts + 1, parts + 1)
        a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
        triangles = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
        labels, _, _ = drawn((shapes.Mesh(grid, triangles), (0, 0, 0)))
        centres = -2.0 + (np.arange(400) + 0.5) * PIXEL
        inside = (abs(centres)[:, None] < 1) & (abs(centres)[None, :] < 1)
        assert np.array_equal(labels == 0, inside)


# Breaks when a shape cannot be drawn, or the picture is empty. The floor hides nothing that stands on it.
def test_every_kind_of_shape(tmp_path):
    builder = amontons.ModelBuilder()
    for k, shape in enumerate(STATIC):
        builder.add_geom(None, shape, position=(0, 2.0 * k, 0))
    for k, shape in enumerate(MOVING):
        builder.add_body(f"{k}", shape=shape, density=1000, position=(2, 2.0 * k, 1))
    model = builder.build()
    sim = amontons.Simulation(model)
    frames = [Frame(t, sim.state.positions, sim.state.orientations) for t in (0.0, 0.5, 1.0)]
    snapshots_figure(model, frames, tmp_path / "a.png", width=300)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    picture = Picture(model, View())
    assert (picture.balls.bodies >= 0).sum() == 6
    assert (picture.balls.bodies < 0).sum() == 2
    image = picture.draw(frames[0], picture.framing(frames, 2.0), 200, 100)
    assert image.shape == (100, 200, 3)
    assert image.std() > 0.05 * 255


def walled():
    """A ball between two fixed walls of 4 m; seen along x, one stands before it."""
    builder = amontons.ModelBuilder(gravity=(0, 0, 0))
    for x in (3, -3):
        builder.add_geom(None, shapes.Box((0.1, 2, 2)), position=(x, 0, 0))
    builder.add_body("ball", shape=shapes.Sphere(0.5), density=1000)
    return amontons.Simulation(builder.build())


# Breaks when fixed geometry is dropped without being told to, hides what moves behind it although it is of
# glass, or is drawn although it is to be hidden: pixels at the ball, in the wall beside it, and outside.
def test_what_is_fixed():
    view = {"azimuth": 0, "elevation": 0, "target": (0, 0, 0), "width": 5}
    ball, wall, outside = (50, 50), (50, 25), (50, 2)
    seen = {kind: amontons.render(walled(), (100, 100), fixed=kind, **view).astype(int) for kind in FIXED}
    grey = seen["show"][wall]
    assert np.ptp(grey) < 40  # the colour of what is fixed
    assert abs(seen["show"][ball] - grey).max() <= 3
    blue = seen["hide"][ball]
    assert blue[2] > blue[0] + 30
    assert (seen["hide"][wall] == 255).all()
    assert abs(seen["glass"][wall] - grey).max() <= 3
    assert abs(seen["glass"][ball] - (0.75 * blue + 0.25 * grey)).max() <= 3
    assert all((image[outside] == 255).all() for image in seen.values())


# Breaks when the walls of a hopper disappear: fixed things cover most of the picture beside the grains.
def test_walls_of_a_hopper_are_drawn():
    simulation = amontons.Simulation(scenes.make("hopper", count=20))
    picture = Picture(simulation.model, View())
    frame = frame_of(simulation)
    labels, _ = picture.probe(frame, picture.framing([frame], 1.0), 200, 200)
    fixed = picture.balls.bodies[np.maximum(labels, 0)] < 0
    assert ((labels >= 0) & fixed).mean() > 0.3


# Breaks when one body that flew away shrinks all others: the window stays that of the others, to the last
# bit, while the body is too far; it grows by a body that is near enough.
def test_a_body_that_flew_away_does_not_count():
    def width(far):
        builder = amontons.ModelBuilder()
        for k in range(30):
            x, y = (far, 0) if k == 29 else (k % 6, k // 6)
            builder.add_body(shape=shapes.Box((0.2, 0.2, 0.2)), density=1000, position=(x, y, 0))
        frame = frame_of(amontons.Simulation(model := builder.build()))
        return Picture(model, View()).framing([frame], 1.0).width

    assert width(1e6) == width(1e3) < 10
    assert width(1e3) < width(2.5 * FAR)
    two = amontons.ModelBuilder()  # of a few nobody knows which one flew away
    for x in (0, 100):
        two.add_body(shape=shapes.Box((0.2, 0.2, 0.2)), density=1000, position=(0.0, x, 0))
    assert amontons.render_view(amontons.Simulation(two.build()), azimuth=0)["width"] > 100


# Breaks when the window is that of the ball around a long thing: a beam of 4 m with sides of 0.2 m, seen from
# its end and turned by 30 degrees about the line of sight, is 0.2 m (cos + sin) wide.
def test_the_window_fits_a_beam_seen_from_its_end():
    builder = amontons.ModelBuilder(gravity=(0, 0, 0))
    turn = amontons.axis_angle((1, 0, 0), np.pi / 6)
    builder.add_body(shape=shapes.Box((2.0, 0.1, 0.1)), density=1000, orientation=turn)
    frame = frame_of(amontons.Simulation(model := builder.build()))
    width = Picture(model, View(azimuth=0, elevation=0)).framing([frame], 1.0).width
    sides = 0.2 * (np.cos(np.pi / 6) + np.sin(np.pi / 6))
    assert width == pytest.approx((1 + 2 * MARGIN) * sides, rel=1e-6)


# Breaks when target, width or distance are not what they say: the ball of 1 m is in the middle, at 10 pixels
# to the metre, though it moves; an eye at 10 m sees a ball 5 m nearer twice as large.
def test_target_width_distance():
    simulation = walled()
    simulation.state.linear_velocities[0] = (0, 3, 1)
    simulation.run(1.0)
    view = {"azimuth": 0, "elevation": 0, "fixed": "hide", "width": 10}
    for target in ("ball", 0, (0, 3, 1)):
        rows, columns = np.nonzero(
            (amontons.render(simulation, (100, 100), target=target, **view) < 255).any(-1)
        )
        assert (rows.mean(), columns.mean()) == pytest.approx((49.5, 49.5), abs=1)
        assert np.ptp(columns) + 1 == pytest.approx(10, abs=1)
    image = amontons.render(simulation, (100, 100), target=(-5, 3, 1), distance=10, **view)
    columns = np.nonzero((image < 255).any(-1))[1]
    assert np.ptp(columns) + 1 == pytest.approx(
        20, abs=1.5
    )  # 0.3 % more: the outline of a ball seen from 5 m
    plain = amontons.render(simulation, (100, 100), target=(-5, 3, 1), distance=10, azimuth=0, elevation=0)
    assert plain.std() > 0


# Breaks when forces are not those of the pairs: a stack of three cubes of 1 kg presses with the weight above,
# from centre to face and from face to centre, on lines whose widths are as the forces.
def test_force_lines_are_as_wide_as_forces():
    builder = amontons.ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    for k in range(3):
        builder.add_body(shape=shapes.Box((0.1, 0.1, 0.1)), density=125, position=(0, 0, 0.1 + 0.2 * k))
    simulation = amontons.Simulation(builder.build(), tolerance=1e-9)
    simulation.run(0.2)
    acting = forces_of(simulation.contacts)
    assert sorted(acting.forces) == pytest.approx([9.81, 19.62, 29.43], rel=1e-6)
    assert acting.points[np.argsort(acting.points[:, 2])] == pytest.approx(
        np.array([(0, 0, 0), (0, 0, 0.2), (0, 0, 0.4)]), abs=1e-4
    )
    frame = frame_of(simulation, forces=True)
    start, end, width, _ = force_lines(
        simulation.model, frame.positions, frame.orientations, frame.contacts, 0.01
    )
    assert len(start) == 5  # one to the ground, two in each gap
    assert np.linalg.norm(end - start, axis=1) == pytest.approx(0.1, abs=1e-4)
    assert sorted(width) == pytest.approx([0.0981, 0.0981, 0.1962, 0.1962, 0.2943], rel=1e-6)
    # 200 pixels to the metre: the line to the ground is 59 pixels wide, in green.
    image = amontons.render(
        simulation, (200, 200), azimuth=0, elevation=0, target=(0, 0, 0.3), width=1, forces=0.01
    )
    row = image[200 - 1 - round((0.05 - 0.3 + 0.5) * 200)].astype(int)
    assert (abs(row - (40, 130, 70)).max(axis=1) < 3).sum() == pytest.approx(59, abs=1)
    assert amontons.render_view(simulation, forces=True)["forces"] == pytest.approx(
        0.4 * 0.2 / 29.4, rel=0.02
    )


# Breaks when a frame costs seconds again: 30 boxes on 960 x 540 pixels take 0.06 s of a core, and 1 s with
# the rasteriser in NumPy that this one replaced. It is the time of the process: tests share the cores.
def test_a_frame_is_fast():
    builder = amontons.ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    for k in range(30):
        position = (0.5 * (k % 6), 0.5 * (k // 6), 0.1)
        builder.add_body(shape=shapes.Box((0.2, 0.15, 0.1)), density=1000, position=position)
    simulation = amontons.Simulation(builder.build())
    times = []
    for _ in range(5):
        start = time.process_time()
        amontons.render(simulation, (960, 540))
        times.append(time.process_time() - start)
    assert min(times) < 0.3


# Breaks when a model without geoms, or without bodies, cannot be pictured.
def test_nothing_to_see(tmp_path):
    builder = amontons.ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    frame = Frame(0.0, np.zeros((0, 3)), np.zeros((0, 4)))
    snapshots_figure(builder.build(), [frame], tmp_path / "a.png", width=100)
    assert (tmp_path / "a.png").exists()
