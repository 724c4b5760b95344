"""Pictures: what they show is where it is, and every shape can be drawn."""

import amontons
import numpy as np
import pytest
from amontons import shapes
from amontons.report.raster import Camera, Raster
from amontons.report.snapshots import Frame, Picture, View, snapshots_figure
from amontons.report.solids import solids_of

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


def camera(pixels=400, window=4.0):
    """The eye on the x axis: columns are y, rows are z."""
    axes = View(azimuth=0, elevation=0).axes()
    return Camera(*axes, -window / 2, -window / 2, window / pixels, pixels, pixels)


def drawn(*placed):
    """Shapes with their positions in the world, in this order."""
    builder = amontons.ModelBuilder()
    for shape, position in placed:
        builder.add_geom(None, shape, position=position)
    raster = Raster(camera())
    solids = solids_of(builder.build())
    frame = Frame(0.0, np.zeros((0, 3)), np.zeros((0, 4)))
    corners, normals, items = solids.placed(frame, np.ones(len(solids.bodies), dtype=bool))
    raster.triangles(corners, items, normals)
    return raster, solids


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
    raster, _ = drawn((shape, (0, 0, 0)))
    assert (raster.label == 0).sum() * raster.camera.pixel**2 == pytest.approx(area, rel=0.05)
    assert raster.depth.max() == pytest.approx(depth, rel=0.05)


# Breaks when what is behind covers what is in front, whatever is drawn first.
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_nearer_covers_farther(order):
    near, far = (shapes.Box((0.1, 0.1, 0.1)), (1.0, 0.0, 0.0)), (shapes.Sphere(1.0), (-1.0, 0.0, 0.0))
    raster, solids = drawn(*((near, far)[k] for k in order))
    assert solids.centres[raster.label[200, 200], 0] == pytest.approx(1.0)
    assert (raster.label == raster.label[200, 200]).sum() == 400
    assert (raster.label >= 0).sum() > 31000  # the ball around it


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
        raster = Raster(camera(pixels=203))
        raster.triangles(grid[triangles], np.zeros(len(triangles), dtype=np.int32))
        centres = -2.0 + (np.arange(203) + 0.5) * raster.camera.pixel
        inside = (abs(centres)[:, None] < 1) & (abs(centres)[None, :] < 1)
        assert np.array_equal(raster.label == 0, inside)


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
    assert picture.solids.moving.sum() == 6
    assert (~picture.solids.moving).sum() == 2
    image = picture.draw(frames[0], picture.bounds(frames), 200, 100)
    assert image.shape == (100, 200, 3)
    assert image.min() >= 0
    assert image.max() <= 1
    assert image.std() > 0.05


# Breaks when what is fixed hides what moves: a wall between the eye and a ball is left out.
def test_wall_before_the_eye_is_left_out():
    builder = amontons.ModelBuilder()
    builder.add_geom(None, shapes.Box((0.1, 2, 2)), position=(3, 0, 0))
    builder.add_geom(None, shapes.Box((0.1, 2, 2)), position=(-3, 0, 0))
    builder.add_body("ball", shape=shapes.Sphere(0.5), density=1000)
    picture = Picture(builder.build(), View(azimuth=0, elevation=0))
    frame = Frame(0.0, np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]))
    seen = picture.visible(frame)
    assert picture.solids.centres[seen, 0].tolist() == pytest.approx([-3, 0])


# Breaks when a model without geoms, or without bodies, cannot be pictured.
def test_nothing_to_see(tmp_path):
    builder = amontons.ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    frame = Frame(0.0, np.zeros((0, 3)), np.zeros((0, 4)))
    snapshots_figure(builder.build(), [frame], tmp_path / "a.png", width=100)
    assert (tmp_path / "a.png").exists()
