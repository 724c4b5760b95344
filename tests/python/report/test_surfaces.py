"""Shapes as triangles, and where batches of them are drawn."""

import numpy as np
import pytest
from amontons import Model, ModelBuilder, Transform, shapes
from amontons.model.parts import WORLD
from amontons.model.visuals import TriangleMesh, Visual
from amontons.report.batches import shapes_of, visuals_of
from amontons.report.surfaces import AROUND, form_of, surface_of

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
SOLIDS = [
    shapes.Sphere(0.3),
    shapes.Ellipsoid((0.1, 0.2, 0.4)),
    shapes.Box((0.1, 0.2, 0.3)),
    shapes.Cylinder(0.2, 0.5),
    shapes.Capsule(0.2, 0.5),
    shapes.Hull(CORNERS),
]


def signed_volume(vertices, triangles):
    """By Gauss: a sixth of the sum of triple products, negative where triangles are clockwise."""
    a, b, c = (vertices[triangles[:, k]].astype(float) for k in range(3))
    return (a * np.cross(b, c)).sum() / 6


# Breaks when a face is missing or seen from inside, or the scale is not that of the shape. A circle of n
# corners has the area n/2 sin(2 pi/n) r^2, by 1 - (2 pi/n)^2/6 less than its own; round shapes lose as much
# again along the meridian.
@pytest.mark.parametrize("shape", SOLIDS, ids=lambda shape: type(shape).__name__)
def test_volume(shape):
    surface, form = surface_of(shape), form_of(shape)
    volume = signed_volume(surface.vertices * np.array(form.scale), surface.triangles)
    loss = (2 * np.pi / AROUND) ** 2 / 6
    flat = isinstance(shape, shapes.Box | shapes.Hull)
    assert volume <= shape.volume() * (1 + 1e-6)
    assert volume >= shape.volume() * (1 - (1e-6 if flat else 2.5 * loss))


# Breaks when shapes that are alike but for their size no longer share a surface, or others do.
def test_alike_shapes_share_a_surface():
    assert form_of(shapes.Sphere(1)).key == form_of(shapes.Sphere(2)).key
    assert form_of(shapes.Capsule(1, 2)).key == form_of(shapes.Capsule(2, 4)).key
    assert form_of(shapes.Capsule(1, 2)).key != form_of(shapes.Capsule(1, 3)).key
    assert form_of(shapes.Plane()) is None


# Breaks when the pose of an instance is not body frame after geom frame: `Transform` says it point by point.
def test_instances_follow_their_bodies():
    builder = ModelBuilder()
    frame = Transform((0.1, -0.2, 0.3), (0.5, 0.5, -0.5, 0.5))
    for k in range(3):
        builder.add_body(f"b{k}", mass=1, inertia=(1, 1, 1), position=(k, 0, 0))
        builder.add_geom(
            f"b{k}", shapes.Box((1, 2, 3 + k)), position=frame.position, orientation=frame.rotation
        )
    model = builder.build()
    rng = np.random.default_rng(1)
    positions, q = rng.normal(size=(3, 3)), rng.normal(size=(3, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    (batch,) = shapes_of(model)
    assert batch.scales.tolist() == [[1, 2, 3], [1, 2, 4], [1, 2, 5]]
    at, turned = batch.placed(positions, q)
    for k in range(3):
        expected = Transform(tuple(positions[k]), tuple(q[k])) @ frame
        drawn = Transform(tuple(at[k]), tuple(turned[k]))
        for point in np.eye(3):
            np.testing.assert_allclose(drawn(point), expected(point), atol=1e-12)


# Breaks when a body with visuals is drawn by its collision shapes, one without disappears, or what is fixed
# to the world is not drawn where it is.
def test_visuals_stand_for_their_bodies():
    builder = ModelBuilder()
    for name in ("seen", "plain"):
        builder.add_body(name, shape=shapes.Sphere(0.5), density=1)
    builder.add_geom(None, shapes.Box((1, 1, 1)), position=(0, 0, -3))
    model = builder.build()
    mesh = TriangleMesh(CORNERS, [(0, 1, 2)])
    visuals = (
        Visual("skin", 0, shape=mesh, colour=(1, 0, 0, 1)),
        Visual("none", 0, shape=mesh, colour=(0,) * 4),
    )
    model = Model(**{f: getattr(model, f) for f in ("bodies", "geoms")}, visuals=visuals)
    drawn = visuals_of(model)
    assert [(len(b.surface.triangles), b.bodies.tolist()) for b in drawn if b.bodies[0] == 0] == [(1, [0])]
    assert drawn[0].colours.tolist() == [[255, 0, 0]]
    assert sorted(int(b.bodies[0]) for b in drawn) == [WORLD, 0, 1]
    (ground,) = [batch for batch in drawn if not batch.moves]
    assert ground.positions.tolist() == [[0, 0, -3]]


# Breaks when a picture of a million grains takes more memory than machines have, when one of a few thousand
# loses its round balls, or when a coarse ball has a hole.
def test_many_balls_have_few_corners():
    fine, few = surface_of(shapes.Sphere(1.0)), surface_of(shapes.Sphere(1.0), 7800)
    np.testing.assert_array_equal(few.triangles, fine.triangles)
    for count in (20_000, 100_000, 1_000_000):
        coarse = surface_of(shapes.Sphere(1.0), count)
        assert count * len(coarse.triangles) <= max(8_000_000, 24 * count)
        assert 0.5 < signed_volume(coarse.vertices, coarse.triangles) / (4 / 3 * np.pi) < 1
