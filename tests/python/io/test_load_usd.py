# ruff: noqa: E501  (lines of files as their authors write them)
"""USD with physics: units, axes, joints, drives, mass, materials, filters. Files as Isaac Sim writes them."""

import math

import amontons
import numpy as np
import pytest
from amontons import FileError, Limits, UnsupportedWarning, load_model, shapes
from problems import quiet, silent

pytest.importorskip("pxr", reason="needs usd-core")

BODY = '(prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])'
SOLID = '(prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsCollisionAPI", "PhysicsMassAPI", "MaterialBindingAPI"])'


def moved(x, y, z, scale=None):
    ops = ["xformOp:translate"] + (["xformOp:scale"] if scale else [])
    lines = [f"double3 xformOp:translate = ({x}, {y}, {z})"]
    lines += [f"float3 xformOp:scale = {scale}"] if scale else []
    return "\n".join([*lines, f"uniform token[] xformOpOrder = {ops}".replace("'", '"')])


def body(name, place="", more="", kind="Xform", api=BODY):
    return f'def {kind} "{name}" {api}\n{{\n{place}\n{more}\n}}\n'


def written(folder, content, metre=1.0, up="Z", name="scene.usda", head=""):
    path = folder / name
    path.write_text(
        f'#usda 1.0\n(\n    defaultPrim = "World"\n    metersPerUnit = {metre}\n    upAxis = "{up}"\n{head})\n'
        f'def Xform "World"\n{{\n{content}\n}}\n'
    )
    return path


BALL = "float physics:mass = 2\nfloat3 physics:diagonalInertia = (0.1, 0.1, 0.1)"


# Breaks when lengths in centimetres, masses in grams, or y up are taken for metres, kilograms or z up: a box of
# 10 x 20 x 10 cm and 2000 g, 50 cm up, comes to rest on the plane at its half height, 0.1 m.
def test_units_and_axes(tmp_path):
    path = written(
        tmp_path,
        'def PhysicsScene "scene"\n{\nvector3f physics:gravityDirection = (0, -1, 0)\n'
        "float physics:gravityMagnitude = 981\n}\n"
        'def Plane "ground" (prepend apiSchemas = ["PhysicsCollisionAPI"])\n{\nuniform token axis = "Y"\n}\n'
        + body(
            "box", moved(0, 50, 0, (1, 2, 1)), "double size = 10\nfloat physics:mass = 2000", "Cube", SOLID
        ),
        0.01,
        "Y",
        head="    kilogramsPerUnit = 0.001\n",
    )
    model = silent(load_model, path)
    assert model.gravity == pytest.approx((0, 0, -9.81))
    box = model.bodies[0]
    assert box.mass == pytest.approx(2)
    # Its long edge, y of the body, points up.
    np.testing.assert_allclose(np.diag(box.inertia), 2 / 12 * np.array((0.05, 0.02, 0.05)), rtol=1e-6)
    simulation = amontons.Simulation(model, dt=2e-3)
    simulation.run(1.0)
    np.testing.assert_allclose(simulation.state.positions[0], (0, 0, 0.1), atol=1e-6)


# Breaks when gains per degree, limits in degrees, friction and armature of PhysX, or the frames of a joint
# are read otherwise. In centimetres: 1 kg cm^2 / s^2 is 1e-4 N m.
def test_revolute_joint(tmp_path):
    path = written(
        tmp_path,
        body("a", moved(0, 0, 0), BALL)
        + body("b", moved(30, 0, 0), BALL)
        + """def PhysicsRevoluteJoint "hinge" (prepend apiSchemas = ["PhysicsDriveAPI:angular", "PhysxJointAPI"])
        {
        uniform token physics:axis = "Z"
        rel physics:body0 = </World/a>
        rel physics:body1 = </World/b>
        point3f physics:localPos0 = (10, 0, 0)
        point3f physics:localPos1 = (-20, 0, 0)
        float physics:lowerLimit = -90
        float physics:upperLimit = 45
        float drive:angular:physics:stiffness = 1000
        float drive:angular:physics:damping = 100
        float drive:angular:physics:targetPosition = 30
        float drive:angular:physics:maxForce = 50000
        float physxJoint:armature = 200
        float physxJoint:jointFriction = 400
        }""",
        0.01,
    )
    joint = silent(load_model, path).joints[0]
    (dof,) = joint.dofs
    assert (joint.body_a, joint.body_b, dof.kind, dof.axis) == (1, 0, "hinge", (0, 0, 1))
    np.testing.assert_allclose(joint.frame_a.position, (-0.2, 0, 0))
    np.testing.assert_allclose(joint.frame_b.position, (0.1, 0, 0))
    np.testing.assert_allclose((dof.lower, dof.upper), (-math.pi / 2, math.pi / 4))
    motor = dof.motor
    expected = (0.1 * 180 / math.pi, 0.01 * 180 / math.pi, math.pi / 6, 5, 0.02, 0.04)
    found = (motor.kp, motor.kd, motor.control, motor.max_effort, dof.armature, dof.friction)
    np.testing.assert_allclose(found, expected, rtol=1e-6)


# Breaks when a joint to the world, or one whose moving body is body0, swings to the wrong side: both are a
# pendulum of 1 m that starts level and falls; as body0 its coordinate has the other sign.
@pytest.mark.parametrize("first", [False, True])
def test_ends(tmp_path, first):
    end, world = (0, 1) if first else (1, 0)
    path = written(
        tmp_path,
        body("a", moved(1, 0, 2), BALL)
        + f"""def PhysicsRevoluteJoint "hinge"
        {{
        uniform token physics:axis = "Y"
        rel physics:body{end} = </World/a>
        point3f physics:localPos{world} = (0, 0, 2)
        point3f physics:localPos{end} = (-1, 0, 0)
        }}""",
    )
    simulation = amontons.Simulation(silent(load_model, path), dt=1e-3)
    simulation.run(0.2)
    assert (-1 if first else 1) * simulation.kinematics.coordinate("hinge") == pytest.approx(
        0.5 * 9.81 * 2 / 2.1 * 0.2**2, rel=0.02
    )


# Breaks when the general joint keeps another set of its six degrees of freedom: limits in the wrong order lock.
def test_general_joint(tmp_path):
    names = ["transX", "transY", "transZ", "rotX", "rotY", "rotZ"]
    locked = [n for n in names if n not in ("transY", "rotZ")]
    apis = [f'"PhysicsLimitAPI:{n}"' for n in names if n != "rotZ"]
    limits = "\n".join(f"float limit:{n}:physics:low = 1\nfloat limit:{n}:physics:high = -1" for n in locked)
    path = written(
        tmp_path,
        body("a", moved(0, 0, 0), BALL)
        + body("b", moved(0, 0, 1), BALL)
        + f"""def PhysicsJoint "six" (prepend apiSchemas = [{", ".join(apis)}])
        {{
        rel physics:body0 = </World/a>
        rel physics:body1 = </World/b>
        point3f physics:localPos0 = (0, 0, 1)
        float limit:transY:physics:low = -0.5
        float limit:transY:physics:high = 0.25
        {limits}
        }}""",
    )
    slide, hinge = silent(load_model, path).joints[0].dofs
    assert (slide.kind, slide.axis, slide.lower, slide.upper) == ("slide", (0, 1, 0), -0.5, 0.25)
    assert (hinge.kind, hinge.axis, hinge.lower) == ("hinge", (0, 0, 1), -math.inf)


# Breaks when prismatic, spherical, distance and fixed joints, or one outside of the articulation, are lost.
def test_other_joints(tmp_path):
    kinds = {
        "Prismatic": 'uniform token physics:axis = "Y"\nfloat physics:lowerLimit = -1\nfloat physics:upperLimit = 2',
        "Spherical": 'uniform token physics:axis = "X"',
        "Distance": "float physics:minDistance = 0.5\nfloat physics:maxDistance = 3",
        "Fixed": "uniform bool physics:excludeFromArticulation = 1",
    }
    joints = "".join(
        f'def Physics{kind}Joint "{kind}"\n{{\nrel physics:body0 = </World/b{k}>\nrel physics:body1 = '
        f"</World/b{k + 1}>\npoint3f physics:localPos1 = (-1, 0, 0)\n{more}\n}}\n"
        for k, (kind, more) in enumerate(kinds.items())
    )
    path = written(tmp_path, "".join(body(f"b{k}", moved(k, 0, 0), BALL) for k in range(5)) + joints)
    slide, ball, rope, weld = silent(load_model, path).joints
    assert [(d.kind, d.axis, d.lower, d.upper) for d in slide.dofs] == [("slide", (0, 1, 0), -1, 2)]
    assert (ball.spherical, ball.dofs, rope.kind) == (True, (), "distance")
    assert (rope.lower_distance, rope.upper_distance) == (0.5, 3)
    assert (weld.dofs, weld.spherical, weld.closes_loop) == ((), False, True)


# Breaks when the order of MassAPI is another one: mass before density, of the collider before that of the body,
# before that of the material, before 1000 kg/m^3; or centre, moments or their axes are lost.
def test_mass(tmp_path):
    mass = '(prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMassAPI", "MaterialBindingAPI"])'
    cube = 'def Cube "c" ' + mass + "\n{{\ndouble size = 1\n{}\n}}\n"
    bound = "rel material:binding:physics = </World/heavy>"
    path = written(
        tmp_path,
        'def Material "heavy" (prepend apiSchemas = ["PhysicsMaterialAPI"])\n{\nfloat physics:density = 7\n}\n'
        + body("plain", moved(0, 0, 0), cube.format(""))
        + body("material", moved(2, 0, 0), cube.format(bound))
        + body("dense", moved(4, 0, 0), "float physics:density = 5\n" + cube.format(bound))
        + body(
            "part", moved(6, 0, 0), "float physics:density = 5\n" + cube.format("float physics:density = 3")
        )
        + body(
            "weighed", moved(8, 0, 0), "float physics:density = 5\n" + cube.format("float physics:mass = 11")
        )
        + body("given", moved(10, 0, 0), "float physics:mass = 2\n" + cube.format("float physics:mass = 11"))
        + body(
            "whole",
            moved(12, 0, 0, (2, 2, 2)),
            "float physics:mass = 1\npoint3f physics:centerOfMass = (1, 0, 0)\nfloat3 physics:diagonalInertia = "
            "(1, 2, 2.5)\nquatf physics:principalAxes = (0.70710678, 0, 0, 0.70710678)",
        ),
    )
    model = silent(load_model, path)
    assert [b.mass for b in model.bodies] == pytest.approx([1000, 7, 5, 3, 11, 2, 1])
    np.testing.assert_allclose(np.diag(model.bodies[5].inertia), 2 / 6)
    np.testing.assert_allclose(np.diag(model.bodies[6].inertia), (2, 1, 2.5), rtol=1e-6)
    assert model.bodies[6].centre_of_mass == (2, 0, 0)


# Breaks when a mass without moments gets any that are not told, with its kilograms.
def test_made_up_moments(tmp_path):
    path = written(tmp_path, body("a", moved(0, 0, 0), "float physics:mass = 3"))
    with pytest.warns(amontons.ModelWarning, match=r'ball of 1000 kg/m\^3: "a" 3 kg'):
        load_model(path)


# Breaks when a shape below scales, an instance, or a mesh in a mirror has another size or place.
def test_shapes(tmp_path):
    api = '(prepend apiSchemas = ["PhysicsCollisionAPI"])'
    path = written(
        tmp_path,
        'def Xform "proto"\n{\ndef Sphere "ball" ' + api + "\n{\ndouble radius = 0.5\n}\n}\n"
        'def Xform "one" (instanceable = true\nprepend references = </World/proto>)\n{\n'
        + moved(1, 0, 0, (2, 2, 2))
        + "\n}\n"
        + 'def Capsule "rod" '
        + api
        + '\n{\nuniform token axis = "X"\ndouble radius = 0.1\ndouble height = 2\n}\n'
        + 'def Mesh "tet" '
        + api
        + "\n{\npoint3f[] points = [(0,0,0), (1,0,0), (0,1,0), (0,0,1)]\nint[] faceVertexCounts = [3,3,3,3]\n"
        "int[] faceVertexIndices = [0,2,1, 0,1,3, 0,3,2, 1,2,3]\n" + moved(0, 0, 0, (-1, 1, 1)) + "\n}\n",
    )
    model = silent(load_model, path)
    by_name = {geom.name: geom for geom in model.geoms}
    assert by_name["one/ball"].shape == shapes.Sphere(1.0)
    assert by_name["one/ball"].frame.position == (1, 0, 0)
    assert by_name["rod"].shape == shapes.Capsule(0.1, 1.0)
    rod = by_name["rod"].frame
    np.testing.assert_allclose(np.abs(rod((0, 0, 1))), (1, 0, 0), atol=1e-12)
    assert by_name["tet"].shape.volume() == pytest.approx(1 / 6)  # outward again in the mirror
    assert by_name["tet"].shape.vertices.min() == -1


# Breaks when the material of a purpose, a filter of pairs, groups, or self-collisions of an articulation
# is lost.
def test_contacts(tmp_path):
    def ball(name, x, more="", extra=""):
        api = SOLID.replace('"PhysicsMassAPI"', f'"PhysicsMassAPI", "PhysicsFilteredPairsAPI"{extra}')
        return body(name, moved(x, 0, 0), more, "Sphere", api)

    path = written(
        tmp_path,
        'def Material "ice" (prepend apiSchemas = ["PhysicsMaterialAPI"])\n{\nfloat physics:dynamicFriction = 0.1\n'
        "float physics:staticFriction = 0.1\nfloat physics:restitution = 0.4\n}\n"
        + ball("a", 0, "rel material:binding:physics = </World/ice>\nrel physics:filteredPairs = </World/b>")
        + ball("b", 10)
        + ball("c", 20)
        + ball("d", 30)
        + 'def Xform "robot" (prepend apiSchemas = ["PhysicsArticulationRootAPI", "PhysxArticulationAPI"])\n{\n'
        "bool physxArticulation:enabledSelfCollisions = 0\n" + ball("e", 40) + ball("f", 50) + "}\n"
        'def PhysicsCollisionGroup "g" (prepend apiSchemas = ["CollectionAPI:colliders"])\n{\n'
        "rel collection:colliders:includes = </World/c>\nrel physics:filteredGroups = </World/h>\n}\n"
        'def PhysicsCollisionGroup "h" (prepend apiSchemas = ["CollectionAPI:colliders"])\n{\n'
        "rel collection:colliders:includes = </World/d>\n}\n",
    )
    model = silent(load_model, path)
    ice = model.geoms[0].material
    assert (ice.friction, ice.restitution) == (pytest.approx(0.1), pytest.approx(0.4))
    assert model.geoms[1].material.friction == 0.5
    pairs = {tuple(sorted(model.geoms[g].name for g in pair)) for pair in model.excluded_geoms}
    assert pairs == {("a", "b"), ("c", "d"), ("e", "f")}


# Breaks when velocities, a kinematic or a disabled body, or one that feels no gravity, are read otherwise.
def test_states(tmp_path):
    path = written(
        tmp_path,
        body(
            "a",
            moved(0, 0, 0),
            BALL + "\nvector3f physics:velocity = (1, 2, 3)\nvector3f physics:angularVelocity = (0, 0, 180)",
        )
        + body("b", moved(0, 0, 1), "bool physics:kinematicEnabled = 1")
        + body("c", moved(0, 0, 2), "bool physxRigidBody:disableGravity = 1\n" + BALL)
        + body("d", moved(0, 0, 3), "bool physics:rigidBodyEnabled = 0", "Cube", SOLID),
    )
    a, b, c = silent(load_model, path).bodies
    np.testing.assert_allclose((*a.linear_velocity, *a.angular_velocity), (1, 2, 3, 0, 0, math.pi), rtol=1e-6)
    assert (b.motion, c.gravity_scale) == ("kinematic", 0.0)
    assert silent(load_model, path).geoms[0].body == -1


# Breaks when something of physics that is not read is lost without a word.
def test_listed(tmp_path):
    path = written(
        tmp_path,
        body("a", moved(0, 0, 0), BALL + "\nfloat physxRigidBody:linearDamping = 0.5")
        + """def PhysicsRevoluteJoint "j" (prepend apiSchemas = ["PhysxMimicJointAPI:rotZ"])
        {
        rel physics:body1 = </World/a>
        rel physxMimicJoint:rotZ:referenceJoint = </World/k>
        float physxMimicJoint:rotZ:gearing = -2
        float physxMimicJoint:rotZ:offset = 90
        }
        def PhysicsRevoluteJoint "k"
        {
        rel physics:body1 = </World/b>
        }
        """
        + 'def PhysxPhysicsGearJoint "gear"\n{\n}\n'
        + body(
            "b",
            moved(9, 0, 0),
            BALL,
            api=BODY.replace('"PhysicsMassAPI"', '"PhysicsMassAPI", "PhysxVehicleAPI"'),
        ),
    )
    with pytest.warns(UnsupportedWarning, match="this kind of joint"):
        model = load_model(path)
    (mimic,) = model.couplings  # q + gearing q_k + offset = 0
    np.testing.assert_allclose(mimic.coefficients, (-math.pi / 2, 2))
    listed = {(entry.place.rpartition("/")[2], entry.what) for entry in model.unread}
    assert ("a", "physxRigidBody:linearDamping: this attribute") in listed
    assert ("b", "PhysxVehicleAPI: this schema") in listed
    assert ("gear", "this kind of joint") in listed


# Breaks when a damaged file has no FileError with its line, or a layer outside of the folder is read unasked.
def test_refused(tmp_path):
    path = written(tmp_path, body("a", moved(0, 0, 0), BALL))
    whole = path.read_text()
    path.write_text(whole.replace("float physics:mass = 2", "float physics:mass ="))
    line = whole.split("\n").index("float physics:mass = 2") + 1
    with pytest.raises(FileError, match=rf"scene.usda:({line}|{line + 1}): "):
        load_model(path)
    for name, data in (
        ("a.usdc", b"PXR-USDC" + bytes(80)),
        ("b.usd", b"x"),
        ("c.usdz", b"PK"),
        ("d.usda", b""),
    ):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(FileError, match=name):
            load_model(tmp_path / name)
    (tmp_path / "in").mkdir()
    written(tmp_path, body("a", moved(0, 0, 0), BALL), name="payload.usda")
    path = written(tmp_path / "in", 'def "x" (prepend payload = @../payload.usda@)\n{\n}\n')
    with pytest.raises(FileError, match="payload.usda@ lies outside"):
        load_model(path)
    assert silent(load_model, path, limits=Limits(folder=tmp_path)).body_names == ("a",)
    path = written(tmp_path, 'def Xform "nothing"\n{\n}\n')
    with pytest.raises(FileError, match="holds no physics"):
        load_model(path)


# Breaks when a mesh that faces inwards, or is open, refuses a body that collides as its hull, or when the list
# asks the stage after it is gone.
@pytest.mark.parametrize("faces", ["0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2", "0, 2, 1, 0, 1, 3, 0, 3, 2"])
def test_meshes_that_are_no_solid(tmp_path, faces):
    count = len(faces.split(",")) // 3
    mesh = (
        "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]\n"
        f"int[] faceVertexCounts = {[3] * count}\nint[] faceVertexIndices = [{faces}]"
    )
    shape = f'def Mesh "shape" (prepend apiSchemas = ["PhysicsCollisionAPI"])\n{{\n{mesh}\n}}'
    path = written(tmp_path, body("part", more=shape))
    with pytest.warns(UnsupportedWarning, match="shape: Mesh: the mesh is not closed, or faces inwards"):
        model = load_model(path)
    assert model.geoms[0].shape.volume() == pytest.approx(1 / 6)


# Breaks when attributes that change nothing are listed: a velocity of zero of another name, a material that no
# collider has, a drive between two fixed bodies, settings of the solver of a scene.
def test_what_changes_nothing_is_not_listed(tmp_path):
    content = (
        body("ball", more="vector3f physics:linearVelocity = (0, 0, 0)\n" + BALL)
        + 'def Material "spare" (prepend apiSchemas = ["PhysicsMaterialAPI"])\n{\n'
        "float physics:dynamicFriction = 0.7\n}\n"
        'def Material "rubber" (prepend apiSchemas = ["PhysicsMaterialAPI"])\n{\n'
        "float physics:dynamicFriction = 0.7\n}\n"
        'def Sphere "rock" (prepend apiSchemas = ["PhysicsCollisionAPI", "MaterialBindingAPI"])\n{\n'
        "rel material:binding:physics = </World/rubber>\n}\n"
        'def PhysicsRevoluteJoint "still" (prepend apiSchemas = ["PhysicsDriveAPI:angular"])\n{\n'
        "rel physics:body1 = </World/rock>\nfloat drive:angular:physics:damping = 3\n}\n"
        'def PhysicsScene "scene" (prepend apiSchemas = ["NewtonSceneAPI"])\n{\n'
        "int newton:maxSolverIterations = 9\n}\n"
    )
    model = quiet(load_model, written(tmp_path, content))
    assert [str(entry) for entry in model.unread if entry.changes_motion] == []
