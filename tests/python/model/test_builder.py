"""Shapes and their mass properties, the model builder, and what both refuse."""

import copy
import math
import pickle
import re
from dataclasses import replace

import amontons
import numpy as np
import pytest
from amontons import Dof, Joint, Material, ModelBuilder, Motor, Transform, parts, shapes
from amontons.model.transforms import axis_angle, rotate, rotation_matrix

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
TURNED = axis_angle((1, 2, 3), 0.7)


def slices(radius_x, radius_y, bottom, top):
    """Mass and moments of a solid of ellipses (radius_x(z), radius_y(z)), by Gauss-Legendre quadrature.

    An ellipse a, b has the area pi a b; x^2 and y^2 have the integrals pi a b a^2 / 4 and pi a b b^2 / 4.
    """
    z, w = np.polynomial.legendre.leggauss(40)
    z, w = bottom + (top - bottom) * (z + 1) / 2, w * (top - bottom) / 2
    a, b = radius_x(z), radius_y(z)
    area = math.pi * a * b
    xx, yy, zz = w @ (area * a * a / 4), w @ (area * b * b / 4), w @ (area * z * z)
    return w @ area, (yy + zz, xx + zz, xx + yy)


def cap(r):
    return lambda z: np.sqrt(np.maximum(r * r - z * z, 0))


# Breaks when a closed form of a mass or moment is wrong. Quadrature is exact for these polynomials in z.
@pytest.mark.parametrize(
    ("shape", "parts"),
    [
        (shapes.Sphere(0.3), [(cap(0.3), cap(0.3), -0.3, 0.3)]),
        (shapes.Cylinder(0.2, 0.5), [(lambda z: 0.2 + 0 * z, lambda z: 0.2 + 0 * z, -0.5, 0.5)]),
        (
            shapes.Capsule(0.2, 0.5),
            [
                (lambda z: cap(0.2)(z + 0.5), lambda z: cap(0.2)(z + 0.5), -0.7, -0.5),
                (lambda z: 0.2 + 0 * z, lambda z: 0.2 + 0 * z, -0.5, 0.5),
                (lambda z: cap(0.2)(z - 0.5), lambda z: cap(0.2)(z - 0.5), 0.5, 0.7),
            ],
        ),
        (
            shapes.Ellipsoid((0.3, 0.2, 0.5)),
            [(lambda z: 0.6 * cap(0.5)(z), lambda z: 0.4 * cap(0.5)(z), -0.5, 0.5)],
        ),
    ],
    ids=lambda value: type(value).__name__,
)
def test_round_solids(shape, parts):
    sums = [slices(*part) for part in parts]
    solid = shape.mass_properties(2.0)
    assert shape.volume() == pytest.approx(sum(mass for mass, _ in sums), rel=1e-12)
    assert solid.mass == pytest.approx(2 * shape.volume(), rel=1e-15)
    moments = 2 * np.sum([moment for _, moment in sums], axis=0)
    np.testing.assert_allclose(solid.inertia, np.diag(moments), rtol=1e-12)


# Breaks when the integrals over tetrahedra lose a term: the unit simplex has volume 1/6, centre 1/4, second
# moments 1/60 (squares) and 1/120 (products) about the origin, hence 1/160 and -1/480 about the centre.
def test_simplex():
    hull = shapes.Hull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    solid = hull.mass_properties()
    assert solid.mass == pytest.approx(1 / 6, rel=1e-14)
    np.testing.assert_allclose(solid.centre_of_mass, 1 / 4, rtol=1e-14)
    np.testing.assert_allclose(solid.inertia, np.full((3, 3), 1 / 480) + (1 / 80 - 1 / 480) * np.eye(3))


# Breaks when a hull depends on the unit of length, keeps points that are no corners, or faces inwards.
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_hull_of_a_box(scale):
    middle = [(0, 0, 1), (1, 0, 1), (0, 1, -1), (0, 0, 0), (1, 1, 0)]  # of a face, of edges, inside
    hull = shapes.Hull(scale * (np.array([*CUBE, *middle, CUBE[3]]) * (1, 2, 3) + 5))
    box = shapes.Box(scale * np.array([1, 2, 3]))
    assert len(hull.vertices) == 8
    assert len(hull.triangles) == 12
    assert hull.volume() == pytest.approx(box.volume(), rel=1e-12)
    np.testing.assert_allclose(hull.mass_properties().centre_of_mass, np.full(3, 5 * scale), rtol=1e-12)
    np.testing.assert_allclose(
        hull.mass_properties().inertia, box.mass_properties().inertia, atol=1e-10 * scale**5
    )


def test_hull_of_a_finely_divided_surface():
    # Between two faces of it is a sliver of which only the two ends are corners, which is no flat body. No
    # point may lie outside, and each is as near to the hull as coplanar triangles are to their plane.
    points = np.array([
        (-0.07829148, -0.24660123, 0.01707006),
        (0.09222696, -0.24623546, 0.01477359),
        (0.09640794, -0.24626061, 0.01489711),
        (0.02250141, -0.24630635, 0.01529331),
        (-0.06779121, -0.24595792, 0.01366163),
        (-0.05402673, -0.24616514, 0.0147126),
        (0.09173244, -0.24610314, 0.01408133),
        (0.09595194, -0.24326903, 0.00011522),
        (-0.09947563, 0.96689888, -0.10556454),
        (-0.09923564, 1.0, 0.00095969),
    ])  # fmt: skip
    hull = shapes.Hull(points)
    faces = hull.vertices[hull.triangles]
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    heights = points @ normals.T - np.einsum("fi,fi->f", normals, faces[:, 0])
    assert heights.max() < 1e-5
    assert np.abs(heights).min(axis=1).max() < 1e-5


# Breaks when mass properties move or add up wrongly: two halves make the box, wherever it is.
def test_compound_body():
    builder = ModelBuilder()
    builder.add_body("whole", shape=shapes.Box((0.1, 0.2, 0.3)), density=100.0)
    builder.add_body("halves")
    for sign in (-1, 1):
        builder.add_geom("halves", shapes.Box((0.05, 0.2, 0.3)), position=(0.05 * sign, 0, 0), density=100.0)
    builder.add_body("turned")
    builder.add_geom(
        "turned", shapes.Box((0.1, 0.2, 0.3)), position=(1, 2, 3), orientation=TURNED, density=100.0
    )
    whole, halves, turned = builder.build().bodies
    assert halves.mass == pytest.approx(whole.mass, rel=1e-14)
    np.testing.assert_allclose(halves.inertia, whole.inertia, atol=1e-14)
    assert turned.centre_of_mass == pytest.approx((1, 2, 3))
    R = np.array(rotation_matrix(TURNED))
    np.testing.assert_allclose(turned.inertia, R @ np.array(whole.inertia) @ R.T, atol=1e-14)


# Breaks when a mass that was given is not the mass that is used, or scales the inertia wrongly.
def test_mass_instead_of_density():
    builder = ModelBuilder()
    builder.add_body("a", shape=shapes.Sphere(0.1), mass=0.3)
    builder.add_body("b", mass=2.0, inertia=(1, 2, 2.5), centre_of_mass=(0, 0, 1))
    a, b = builder.build().bodies
    assert a.mass == 0.3
    assert a.inertia[0][0] == pytest.approx(0.4 * 0.3 * 0.01)
    assert (b.mass, b.centre_of_mass) == (2.0, (0.0, 0.0, 1.0))
    assert b.inertia == ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 2.5))


def two_bodies():
    builder = ModelBuilder()
    options = dict(mass=1.0, inertia=(1, 1, 1))
    builder.add_body("a", position=(1, 2, 3), orientation=TURNED, **options)
    builder.add_body("b", position=(-1, 0, 2), orientation=axis_angle((0, 1, 1), 2.0), **options)
    return builder


POINT, AXIS, SECOND = (0.5, 0.25, -1.0), (1.0, -2.0, 0.5), (0.5, 0.25, 0.0)
JOINTS = {
    "ball": (dict(point=POINT), [], True),
    "revolute": (dict(point=POINT, axis=AXIS), [("hinge", AXIS)], False),
    "prismatic": (dict(axis=AXIS), [("slide", AXIS)], False),
    "cylindrical": (dict(point=POINT, axis=AXIS), [("slide", AXIS), ("hinge", AXIS)], False),
    "universal": (
        dict(point=POINT, axis_1=AXIS, axis_2=SECOND),
        [("hinge", AXIS), ("hinge", SECOND)],
        False,
    ),
    "planar": (dict(normal=AXIS), [("slide", None), ("slide", None), ("hinge", AXIS)], False),
    "fixed": ({}, [], False),
    "point_on_line": (dict(point=POINT, axis=AXIS), [("slide", AXIS)], True),
}


# Breaks when a joint's frames do not meet at the initial poses, or an axis is not where it was asked for.
@pytest.mark.parametrize("b", ["b", None], ids=["two-bodies", "world"])
@pytest.mark.parametrize("kind", JOINTS)
def test_joint_frames(kind, b):
    arguments, dofs, spherical = JOINTS[kind]
    builder = two_bodies()
    getattr(builder, f"add_{kind}_joint")("a", b, **arguments)
    model = builder.build()
    joint = model.joints[0]
    in_a = model.bodies[0].pose @ joint.frame_a
    in_b = (model.bodies[1].pose if b else Transform()) @ joint.frame_b
    np.testing.assert_allclose(in_a.position, in_b.position, atol=1e-14)
    np.testing.assert_allclose(rotation_matrix(in_a.rotation), rotation_matrix(in_b.rotation), atol=1e-14)
    np.testing.assert_allclose(in_a.position, arguments.get("point", (1, 2, 3)), atol=1e-14)
    assert joint.spherical == spherical
    assert [dof.kind for dof in joint.dofs] == [kind for kind, _ in dofs]
    for dof, (_, axis) in zip(joint.dofs, dofs, strict=True):
        world = rotate(in_b.rotation, dof.axis)
        if axis is None:  # a slide in the plane
            assert abs(np.dot(world, AXIS)) < 1e-14
        else:
            np.testing.assert_allclose(world, axis / np.linalg.norm(axis), atol=1e-14)


# Breaks when the options of degrees of freedom get lost or mixed up.
def test_joint_options():
    builder = two_bodies()
    motor = Motor("velocity", 2.0, max_effort=3.0)
    builder.add_revolute_joint(
        "a", point=POINT, axis=AXIS, limits=(-1, None), stiffness=5.0, rest=0.5, damping=0.25, motor=motor
    )
    builder.add_cylindrical_joint(
        0, 1, point=POINT, axis=AXIS, limits=[(0, 1), None], damping=2.0, friction=[3, 4], motor=[None, motor]
    )
    builder.add_distance_joint("a", "b", point_a=(1, 2, 3), point_b=(1, 2, 1), name="rod")
    builder.add_distance_joint("a", "b", point_a=(1, 2, 3), point_b=(1, 2, 1), limits=(None, 4), name="rope")
    model = builder.build()
    hinge, cylindrical, rod, rope = model.joints
    assert hinge.dofs == (Dof(lower=-1, stiffness=5, rest=0.5, damping=0.25, motor=motor),)
    slide, turn = cylindrical.dofs
    assert slide == Dof("slide", lower=0, upper=1, damping=2, friction=3)
    assert turn == Dof(damping=2, friction=4, motor=motor)
    assert (rod.lower_distance, rod.upper_distance) == (2, 2)
    assert (rope.lower_distance, rope.upper_distance) == (0, 4)
    assert model.joint_names == ("joint0", "joint1", "rod", "rope")
    assert [model.dof_index(1, k) for k in (0, 1)] == [1, 2]


# Breaks when general joints, couplings, pair materials or exclusions do not arrive in the model.
def test_other_parts():
    builder = two_bodies()
    first = builder.add_joint(Joint(name="screw", body_a="a", body_b=None, dofs=[Dof(), Dof("slide")]))
    builder.add_coupling("screw", first, dof_a=1, coefficients=(0, 0.01))
    balls = [builder.add_geom(body, shapes.Sphere(1)) for body in ("a", "b")]
    builder.set_pair_material(*balls, Material(friction=0.1))
    builder.exclude("a", None)
    model = builder.build()
    assert model.joints[0].body_b == -1
    assert (model.couplings[0].dof_a, model.couplings[0].dof_b) == (1, 0)
    assert model.pair_materials[0].material.friction == 0.1
    assert model.excluded_bodies == ((0, -1),)
    assert model.geom_names == ("geom0", "geom1")


# Breaks when `add` takes a kind of part otherwise than its own function, or loses a reference by name.
def test_parts_as_a_whole():
    by_function, by_part = two_bodies(), two_bodies()
    for builder in (by_function, by_part):
        for name in ("x", "y"):
            builder.add_revolute_joint("a", point=POINT, axis=AXIS, name=name)
    at = Transform((0, 0, 1), TURNED)
    here = dict(position=at.position, orientation=at.rotation)
    by_function.add_geom("b", BOX, name="g", mask=3, **here)
    by_function.add_visual("b", BOX, **here)
    by_function.add_site(None, name="s", **here)
    by_function.add_coupling("x", "y", name="c", compliance=1e-3)
    by_part.add(parts.Geom("g", "b", at, shape=BOX, mask=3))
    by_part.add(parts.Visual("", "b", at, shape=BOX))
    by_part.add(parts.Site("s", "world", at))
    assert by_part.add(parts.Coupling("c", "x", 0, "y", compliance=1e-3)) == 0
    by_part.add(parts.PairMaterial("g", 0, Material()))
    by_part.add(parts.Bond("a", None, (0, 0, 0), (1, 2, 3), (0, 0, 1), tension=1, opening=1))
    made, expected = by_part.build(), by_function.build()
    assert made.geoms == expected.geoms
    assert made.visuals == expected.visuals
    assert made.sites == expected.sites
    assert made.couplings == expected.couplings
    assert (made.bonds[0].body_a, made.bonds[0].body_b) == (0, -1)
    for part, message in (
        (BOX, "is no part; give one of Body, Geom"),
        (parts.Geom("h", "c", shape=BOX), 'geom "h": there is no body "c"; known are a, b'),
        (parts.Geom("h", "a", shape=shapes.Plane()), 'geom "h" of body "a": a Plane does not move'),
        (parts.Coupling("d", "x", 1, "y"), 'coupling "d": joint "x" has no degree of freedom 1'),
        (parts.Tendon("t", terms=[parts.TendonTerm(-1)]), 'tendon "t": there is no joint -1'),
        (parts.Actuator("m", parts.Transmission("tendon")), 'actuator "m": there is no tendon -1'),
    ):
        with pytest.raises(amontons.InputError, match=re.escape(message)):
            by_part.add(part)
    assert by_part.build() == made


# Breaks when coefficients or directions of friction do not arrive in the model and the contact. The steps are
# those of two boxes with a pair of their own on a floor: mu_t of the pair, the larger of those of the floor.
def test_frictions():
    builder = ModelBuilder(friction_rule="maximum")
    rough = Material(0.3, friction_across=0.1, torsional_friction=0.01, rolling_friction=0.02)
    floor = builder.add_geom(None, shapes.Plane(), material=rough, friction_direction=(0, 3, 0))
    for i in range(2):
        material = Material(0.2, rolling_friction=0.03 * i)
        builder.add_body(shape=BOX, mass=1.0, position=(3 * i, 0, 1), material=material)
    builder.set_pair_material(floor, 1, Material(0.4, friction_across=0.5))
    model = builder.build()
    assert model.geoms[0].friction_direction == (0, 1, 0)
    assert model.geoms[1].friction_direction is None
    assert model.pair_materials[0].material.friction_across == 0.5
    simulation = amontons.Simulation(model)
    simulation.step()
    cones = simulation.problem()
    assert cones.rows == 4 * 3 + 4 * 6
    assert set(simulation.contacts["friction"]) == {0.3, 0.4}
    plain = tuple(replace(g, material=Material(), friction_direction=None) for g in model.geoms)
    with pytest.raises(amontons.InputError, match='give one of "geom0" and "geom1" a friction_direction'):
        replace(model, geoms=plain)


# Breaks when a model can no longer be copied or sent to another process, or shapes lose their equality.
def test_model_copies():
    builder = two_bodies()
    builder.add_geom("a", shapes.Hull(CUBE))
    builder.add_geom(None, shapes.HeightField(np.zeros((2, 3)), 1, 1))
    model = builder.build()
    assert pickle.loads(pickle.dumps(model)) == copy.deepcopy(model) == model
    assert shapes.Hull(CUBE) == shapes.Hull(CUBE)
    assert shapes.Hull(CUBE) != shapes.Hull(2 * CUBE)
    assert len({shapes.Sphere(1), shapes.Sphere(1.0), shapes.Sphere(2)}) == 2


NAN = float("nan")
BOX = shapes.Box((1, 1, 1))
INERT = dict(mass=1.0, inertia=(1, 1, 1))
WRONG_BODIES = {
    "negative mass": (dict(mass=-1.0, inertia=(1, 1, 1)), "mass is -1"),
    "negative density": (dict(shape=BOX, density=-1.0), "density is -1"),
    "mass twice": (dict(shape=BOX, density=1.0, mass=1.0), "keep one"),
    "mass alone": (dict(mass=1.0), "give inertia"),
    "density alone": (dict(density=1.0), "without a shape"),
    "NaN mass": (dict(mass=NAN, inertia=(1, 1, 1)), "mass is nan"),
    "inertia of two": (dict(mass=1.0, inertia=(1, 1)), "(3, 3)"),
    "skew inertia": (dict(mass=1.0, inertia=[[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]), "not symmetric"),
    "NaN position": (dict(position=(0, NAN, 0), **INERT), "position[1] is nan"),
    "two coordinates": (dict(position=(0, 0), **INERT), "3 numbers"),
    "zero quaternion": (dict(orientation=(0, 0, 0, 0), **INERT), "unit quaternion"),
    "long quaternion": (dict(orientation=(1, 1, 0, 0), **INERT), "unit quaternion"),
    "infinite velocity": (dict(linear_velocity=(math.inf, 0, 0), **INERT), "linear_velocity[0] is inf"),
    "motion": (dict(motion="fixed", **INERT), "dynamic, kinematic, static"),
    "plane that moves": (dict(shape=shapes.Plane(), **INERT), "Plane does not move by forces"),
    "mesh that moves": (
        dict(shape=shapes.Mesh(CUBE, shapes.Hull(CUBE).triangles), **INERT),
        "shapes.Hull(vertices)",
    ),
    "static with velocity": (dict(motion="static", angular_velocity=(0, 0, 1)), "make it kinematic"),
    "no shape": (dict(shape="ball", **INERT), "amontons.shapes"),
    "friction across nothing": (
        dict(shape=BOX, density=1.0, material=Material(friction_across=0.1)),
        "friction_across = 0.1 is friction across a direction; give friction_direction",
    ),
    "zero direction": (dict(shape=BOX, density=1.0, friction_direction=(0, 0, 0)), "direction is zero"),
    "direction alone": (dict(friction_direction=(1, 0, 0), **INERT), "friction_direction is given without"),
    "material alone": (dict(material=Material(), **INERT), "without a shape"),
}


# Breaks when a bad body is taken, its message does not name it, or something of it stays.
@pytest.mark.parametrize("case", WRONG_BODIES)
def test_wrong_body(case):
    arguments, message = WRONG_BODIES[case]
    builder = two_bodies()
    before = builder.build()
    with pytest.raises(amontons.InputError) as error:
        builder.add_body("wheel", **arguments)
    assert message in str(error.value)
    if case != "motion":
        assert "wheel" in str(error.value)
    assert builder.build() == before


WRONG_CALLS = {
    "same body name": (lambda b: b.add_body("a", **INERT), 'a body "a" already'),
    "body named world": (lambda b: b.add_body("world", **INERT), "world"),
    "name of half a character": (lambda b: b.add_body("a\ud800", **INERT), "half of a character"),
    "unknown body": (lambda b: b.add_geom("c", BOX), 'no body "c"; known are a, b'),
    "body index": (lambda b: b.add_geom(2, BOX), "there is no body 2"),
    "no shape": (lambda b: b.add_geom("a", "ball"), "amontons.shapes"),
    "mask": (lambda b: b.add_geom("a", BOX, mask=-1), "32 bits"),
    "plane on a body": (lambda b: b.add_geom("a", shapes.Plane(), name="floor"), 'geom "floor" of body "a"'),
    "material": (lambda b: b.add_geom("a", BOX, material=0.5), "give a Material"),
    "friction across nothing": (
        lambda b: b.add_geom("a", BOX, name="g", material=Material(friction_across=0.1)),
        'geom "g": friction_across = 0.1',
    ),
    "pair across nothing": (
        lambda b: [
            b.add_geom("a", BOX, name="g"),
            b.add_geom("b", BOX, name="h"),
            b.set_pair_material("g", "h", Material(friction_across=0.1)),
        ],
        'pair "g", "h": friction_across needs a friction_direction',
    ),
    "negative moments": (
        lambda b: b.add_geom("a", BOX, material=Material(rolling_friction=-1)),
        "rolling_friction is -1",
    ),
    "same geom name": (lambda b: [b.add_geom("a", BOX, name="g") for _ in range(2)], 'a geom "g" already'),
    "joint to itself": (lambda b: b.add_ball_joint("a", "a", point=POINT), 'joins body "a" to itself'),
    "joint of the world": (lambda b: b.add_fixed_joint(None, "a"), "swap the bodies"),
    "joint of nothing": (
        lambda b: b.add_fixed_joint("a", "c", name="weld"),
        'joint "weld": there is no body',
    ),
    "inverted limits": (
        lambda b: b.add_revolute_joint("a", point=POINT, axis=AXIS, limits=(1, -1), name="knee"),
        'joint "knee": the lower limit 1 exceeds the upper one -1; swap them',
    ),
    "one limit": (lambda b: b.add_prismatic_joint("a", axis=AXIS, limits=1), "(lower, upper)"),
    "limits of a rope": (
        lambda b: b.add_distance_joint("a", "b", point_a=POINT, point_b=AXIS, limits=(2, 1)),
        "lower <= upper",
    ),
    "rod without length": (
        lambda b: b.add_distance_joint("a", "b", point_a=POINT, point_b=POINT),
        "use a ball joint",
    ),
    "zero axis": (lambda b: b.add_prismatic_joint("a", axis=(0, 0, 0)), "axis is zero"),
    "parallel axes": (
        lambda b: b.add_universal_joint("a", point=POINT, axis_1=AXIS, axis_2=AXIS),
        "parallel",
    ),
    "motor": (lambda b: b.add_prismatic_joint("a", axis=AXIS, motor="speed"), "give a Motor"),
    "three dampings": (
        lambda b: b.add_cylindrical_joint("a", point=POINT, axis=AXIS, damping=[1, 2, 3]),
        "2 degrees of freedom",
    ),
    "coupling": (lambda b: b.add_coupling("shaft", None), 'no joint "shaft"; known are none'),
    "pair": (lambda b: b.set_pair_material(0, 1, Material()), "no geom 0"),
    "motor of nothing": (lambda b: b.set_motor("shaft", Motor()), 'no joint "shaft"'),
    "no motor": (
        lambda b: b.set_motor(b.add_fixed_joint("a", name="weld"), "speed"),
        "set_motor: joint \"weld\": motor is 'speed'; give a Motor",
    ),
    "motor of a weld": (
        lambda b: b.set_motor(b.add_fixed_joint("a", name="weld"), Motor()),
        'joint "weld" has 0 degrees of freedom; dof = 0 is none of them',
    ),
    "exclude": (lambda b: b.exclude("a", "a"), "two bodies"),
}


# Breaks when a motor goes to another degree of freedom, or the largest effort of a file is lost without one.
def test_motor_of_a_joint():
    builder = two_bodies()
    file = Motor(max_effort=30.0)  # as URDF's <limit effort>
    builder.add_cylindrical_joint("a", point=POINT, axis=AXIS, name="shaft", motor=file)
    before = builder.build()
    builder.set_motor("shaft", Motor("position", kp=5.0), dof=1)
    way, turn = builder.build().joints[0].dofs
    assert way.motor == file
    assert turn.motor == Motor("position", kp=5.0, max_effort=30.0)
    builder.set_motor(0, Motor("velocity", max_effort=40.0), dof=1)
    assert builder.build().joints[0].dofs[1].motor.max_effort == 40.0
    assert before.joints[0].dofs[1].motor == file


# Breaks when a bad call is taken or leaves something behind.
@pytest.mark.parametrize("case", WRONG_CALLS)
def test_wrong_call(case):
    call, message = WRONG_CALLS[case]
    builder = two_bodies()
    before = builder.build()
    with pytest.raises(amontons.InputError) as error:
        call(builder)
    assert message in str(error.value)
    if case not in (
        "same geom name",
        "pair across nothing",
        "no motor",
        "motor of a weld",
    ):  # of which the first calls are good
        assert builder.build() == before


def build(**body):
    builder = ModelBuilder()
    builder.add_body("wheel", **body)
    return builder.build()


# Breaks when build() takes what only the model as a whole shows.
@pytest.mark.parametrize(
    ("body", "message"),
    [
        ({}, 'body "wheel" is dynamic but has no mass'),
        (dict(mass=1.0, inertia=(1, 1, 0)), "positive definite"),
        (dict(mass=1.0, inertia=(1, 1, 3)), "exceeds the sum of the others"),
    ],
)
def test_wrong_model(body, message):
    with pytest.raises(amontons.InputError) as error:
        build(**body)
    assert message in str(error.value)
    assert "wheel" in str(error.value)


# Breaks when a shape that cannot be is taken: the message names the shape and what is wrong.
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: shapes.Sphere(-1), "radius"),
        (lambda: shapes.Sphere(NAN), "Sphere: radius is nan"),
        (lambda: shapes.Box((1, 0, 1)), "half"),
        (lambda: shapes.Hull(CUBE[:3]), "at least four"),
        (lambda: shapes.Hull(CUBE * (1, 1, 0)), "in a plane"),
        (lambda: shapes.Hull(CUBE * (1, 1, 1e-12)), "in a plane"),
        (lambda: shapes.Hull(np.zeros((5, 3))), "the same"),
        (lambda: shapes.Hull([[0, 0, NAN]]), "vertices[0, 2] is not finite"),
        (lambda: shapes.Hull(CUBE[:, :2]), "(n, 3)"),
        (lambda: shapes.Mesh(CUBE, [[0, 1, 8]]), "8"),
        (lambda: shapes.Mesh(CUBE, [[0, 1, -1]]), "-1"),
        (lambda: shapes.Mesh(CUBE, [[0, 1, 1]]), "triangle"),
        (lambda: shapes.Mesh(CUBE, [[0.0, 1.0, 2.0]]), "integers"),
        (lambda: shapes.HeightField(np.zeros((1, 4)), 1, 1), "at least (2, 2)"),
        (lambda: shapes.HeightField(np.zeros((2, 2)), 1, 0), "size"),
        (lambda: shapes.Plane().volume(), "no volume"),
        (lambda: Material(friction=-1), "friction is -1"),
        (lambda: Material(restitution=2), "[0, 1]"),
        (
            lambda: Motor("torque"),
            "'torque' (here it is called 'effort'); known are none, effort, velocity, position",
        ),
        (lambda: ModelBuilder(trees="reduced"), "'reduced' (here it is called 'auto'); known are none, auto"),
        (lambda: ModelBuilder().add_body("a", motion="fixed"), "'fixed' (here it is called 'static')"),
        (lambda: ModelBuilder(friction_rule="product"), "geometric_mean, maximum, minimum, mean"),
        (lambda: ModelBuilder(gravity=9.81), "3 numbers"),
    ],
)
def test_wrong_part(make, message):
    with pytest.raises(amontons.InputError) as error:
        make()
    assert message in str(error.value)


# Breaks when a misspelt option of a joint is taken and does nothing.
@pytest.mark.parametrize("kind", [*JOINTS, "distance"])
def test_unknown_joint_option(kind):
    arguments = JOINTS[kind][0] if kind in JOINTS else dict(point_a=POINT, point_b=AXIS)
    builder = two_bodies()
    with pytest.raises(TypeError, match=rf"add_{kind}_joint\(\) got .* 'dampign'; options are .*collide"):
        getattr(builder, f"add_{kind}_joint")("a", "b", **arguments, dampign=1.0)
    assert builder.build().joints == ()


# Breaks when an error of a named joint does not say which joint it is.
@pytest.mark.parametrize(
    "add",
    [
        lambda b: b.add_revolute_joint(0, point=(0, 0, 0), axis=(0, 0, 0), name="elbow"),
        lambda b: b.add_planar_joint(0, normal=(0, 0, 0), name="elbow"),
        lambda b: b.add_prismatic_joint(0, axis=(0, 0, 1), limits=(float("nan"), 1), name="elbow"),
        lambda b: b.add_universal_joint(0, point=(0, 0, 0), axis_1=(0, 0, 1), axis_2=(0, 0, 2), name="elbow"),
    ],
)
def test_errors_name_the_joint(add):
    b = ModelBuilder()
    b.add_body(mass=1, inertia=(1, 1, 1))
    with pytest.raises(amontons.InputError, match='^joint "elbow": '):
        add(b)
