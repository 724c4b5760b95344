"""A model for tests of formats."""

from __future__ import annotations

import amontons


def every_part() -> amontons.Model:
    """A model with a value that is no default in every field of every part."""
    builder = amontons.ModelBuilder(gravity=(0.1, 0.2, -3), friction_rule="minimum")
    rubber = amontons.Material(0.7, 0.1, 1e-6, 0.02, 1e-3, 0.4, 0.003, 0.002, 0.9, 0.05)
    tetrahedron = ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    shapes = amontons.shapes
    builder.add_floor()
    builder.add_geom(None, shapes.Mesh(*tetrahedron), position=(9, 9, 9), name="rock")
    builder.add_geom(None, shapes.HeightField([[0, 1, 2], [1, 0, 1]], 2, 3), position=(-9, 9, 0))
    solids = (
        shapes.Sphere(0.1),
        shapes.Box((0.1, 0.2, 0.3)),
        shapes.Capsule(0.1, 0.2),
        shapes.Cylinder(0.1, 0.2),
        shapes.Ellipsoid((0.1, 0.2, 0.3)),
        shapes.Hull(*tetrahedron),
    )
    for k, shape in enumerate(solids):
        body = builder.add_body(
            f"b{k}",
            shape=shape,
            density=300 + k,
            position=(2 * k, 0.5, 3),
            orientation=amontons.axis_angle((1, 2, 3), 0.3 * k),
            linear_velocity=(0.1, 0, 0.2),
            angular_velocity=(0, 0.3, 0),
            gravity_scale=0.5,
        )
        builder.add_geom(
            body,
            shapes.Sphere(0.05),
            material=rubber,
            friction_direction=(1, 0, 0),
            surface_velocity=(0.1, 0.2, 0.3),
            surface_spin=(0.3, 0.2, 0.1),
            category=2**32 - 1,
            mask=5,
        )
    builder.add_body("k", motion="kinematic", linear_velocity=(0, 0, 1), position=(0, 5, 5))
    builder.add_revolute_joint(
        "b0", "b1", point=(1, 0.5, 3), axis=(1, 1, 0), limits=(-1, None), stiffness=3, rest=0.1, damping=2,
        friction=0.3, friction_static=0.4, stribeck_speed=0.1,
        armature=0.01, motor=amontons.Motor("position", 0.2, 50, 10, 1), collide=True,
        name="pin",
    )  # fmt: skip
    builder.add_ball_joint(
        "b2", "b3", point=(5, 0.5, 3), limit=1, stiffness=1, damping=2, friction=3, armature=4
    )
    builder.add_distance_joint("b4", "b5", point_a=(8, 0.5, 3), point_b=(10, 0.5, 3), limits=(1, None))
    builder.add_prismatic_joint("b1", axis=(0, 0, 1), name="slide", compliance=1e-5)
    builder.add_coupling("pin", "slide", coefficients=(0.1, 2, 0.3), compliance=1e-4)
    builder.add_revolute_joint(
        "b4",
        point=(8, 0.5, 3),
        axis=(0, 0, 1),
        clearance=0.01,
        journal_radius=0.1,
        clearance_friction=0.2,
        name="shaft",
    )
    builder.add_prismatic_joint(
        "b5",
        axis=(0, 0, 1),
        clearance=0.01,
        guide_length=0.3,
        guide_normal=(1, 0, 0),
        clearance_friction=0.2,
        name="guide",
    )
    builder.add_coupling("shaft", "slide", dof_a=2, backlash=0.02)
    drum = amontons.parts.PathElement(
        "cylinder", "k", radius=0.1, friction=0.2, turns=1, side=(0, 5, 6), side_body="b0"
    )
    builder.add_tendon("rope", path=[("b2", (0, 0, 0)), drum, ("b3", (0, 0, 0))], limits=(None, 20))
    wheels = [
        amontons.parts.PathElement("cylinder", body, amontons.Transform(at), 0.1, friction=0.3)
        for body, at in (("k", (1, 0, 0)), (None, (3, 5, 5)))
    ]
    builder.add_tendon("belt", path=wheels, closed=True, stiffness=10, rest=3)
    builder.set_pair_material("geom4", "rock", rubber)
    builder.exclude("b0", "b4")
    return builder.build()
