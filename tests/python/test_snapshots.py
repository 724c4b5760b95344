"""Pictures: what they show is where it is, and every shape can be drawn."""

import amontons
import numpy as np
import pytest
from amontons import Geom, shapes
from amontons.report.raster import Camera, Raster
from amontons.report.snapshots import Frame, Picture, View, snapshots_figure
from amontons.report.solids import solid_of

COLOUR = np.ones(3)
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


def drawn(*geoms):
    raster = Raster(camera())
    frame = Frame(0.0, np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]))
    for label, geom in enumerate(geoms):
        solid_of(geom, COLOUR).draw(raster, frame, label)
    return raster


# Breaks when a shape is drawn too large, too small or from the wrong side: areas seen along x. Pixels on the
# outline, of 0.01, bound the error by its length times half a pixel; round shapes are polyhedra of 20 sides.
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
    raster = drawn(Geom(shape=shape))
    assert (raster.label == 0).sum() * raster.camera.pixel**2 == pytest.approx(area, rel=0.05)
    assert raster.depth.max() == pytest.approx(depth, rel=0.05)


# Breaks when what is behind covers what is in front, whatever is drawn first.
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_nearer_covers_farther(order):
    near = Geom(shape=shapes.Box((0.1, 0.1, 0.1)), frame=amontons.Transform((1.0, 0.0, 0.0)))
    far = Geom(shape=shapes.Sphere(1.0), frame=amontons.Transform((-1.0, 0.0, 0.0)))
    geoms = [(near, far)[k] for k in order]
    raster = drawn(*geoms)
    middle = raster.label[200, 200]
    assert geoms[middle] is near
    assert (raster.label == order.index(1)).sum() > 30000  # the ball around it


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
    assert len(picture.moving) == 6
    assert len(picture.fixed) == 2
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
    assert [solid.position[0] for solid in picture._visible(frame)] == [-3]


# Breaks when a model without geoms, or without bodies, cannot be pictured.
def test_nothing_to_see(tmp_path):
    builder = amontons.ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    frame = Frame(0.0, np.zeros((0, 3)), np.zeros((0, 4)))
    snapshots_figure(builder.build(), [frame], tmp_path / "a.png", width=100)
    assert (tmp_path / "a.png").exists()
