"""What a builder tells of the parts that it holds."""

import math

import amontons
import pytest
from amontons import ModelBuilder, Transform, shapes


# Breaks when a builder does not tell what it holds, or takes a mass that no solid has.
def test_what_a_builder_holds():
    builder = ModelBuilder()
    solid = shapes.Box((0.1, 0.2, 0.3)).mass_properties(500.0)
    box = builder.add_body("box", position=(1, 2, 3), mass=1, inertia=(1, 1, 1))
    wall = builder.add_body("wall", motion="static")
    builder.add_geom("box", shapes.Sphere(0.1), name="ball")
    assert (*builder.names("body"),) == ("box", "wall")
    assert builder.part("geom", "ball").body == box
    assert builder.pose("box").position == (1, 2, 3)
    assert builder.pose(None) == builder.pose(-1) == Transform()
    assert [builder.is_fixed(body) for body in (box, wall, "world")] == [False, True, True]
    builder.set_mass(box, solid)
    assert builder.build().bodies[box].inertia == solid.inertia
    with pytest.raises(amontons.InputError, match="none"):
        builder.set_mass("none", solid)
    with pytest.raises(amontons.InputError, match='body "box": mass is nan'):
        builder.set_mass(box, solid.scaled(math.nan))
    with pytest.raises(amontons.InputError, match="kind"):
        builder.part("shape", 0)
