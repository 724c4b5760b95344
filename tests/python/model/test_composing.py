"""Models put together: ModelBuilder.add_model, add_floor, on_floor."""

import math
from dataclasses import fields, replace

import amontons
import numpy as np
import pytest
from amontons import Material, Model, ModelBuilder, Motor, Simulation, shapes
from amontons.io.recordings.model_json import model_from_json, model_to_json
from amontons.model.transforms import Transform, axis_angle, multiply, rotate
from amontons.model.visuals import TriangleMesh
from amontons.parts import Actuator, Fluid, FluidBox, Keyframe, PathElement, Transmission

SHIFT, TURN = (3.0, -2.0, 0.5), axis_angle((0, 0, 1), 0.7)
STILL = {"mass": 1.0, "inertia": (0.1, 0.2, 0.25)}


def machine() -> Model:
    """One of everything: a jointed pair, a rope, a coupling, materials, belts, a keyframe and an actuator."""
    builder = ModelBuilder()
    builder.add_geom(
        None, shapes.Box((2, 2, 0.1)), position=(0, 0, -0.1), name="belt", surface_velocity=(0.3, 0.1, 0),
        material=Material(0.3, friction_across=0.1), friction_direction=(1, 0.2, 0),
    )  # fmt: skip
    builder.add_body("post", motion="static", position=(0, 0, 0.5), shape=shapes.Sphere(0.05))
    builder.add_body("arm", position=(0.3, 0, 1), shape=shapes.Capsule(0.05, 0.2), density=500)
    builder.add_body(
        "fist", position=(0.6, 0, 1.2), orientation=axis_angle((1, 1, 0), 0.4), mass=1,
        shape=shapes.Sphere(0.1), linear_velocity=(0, 1, 0), angular_velocity=(1, 0, 0),
    )  # fmt: skip
    builder.add_body("box", position=(0, 0.8, 0.1), shape=shapes.Box((0.1, 0.1, 0.1)), density=300)
    builder.add_revolute_joint(
        "arm",
        point=(0, 0, 1),
        axis=(0, 1, 0),
        name="shoulder",
        damping=0.1,
        motor=Motor("effort", control=1.0),
    )
    builder.add_revolute_joint("fist", "arm", point=(0.5, 0, 1), axis=(0, 1, 0.2), name="wrist")
    builder.add_distance_joint("fist", "post", point_a=(0.6, 0, 1.2), point_b=(0, 0, 0.5), limits=(None, 1.5))
    builder.add_coupling("wrist", "shoulder", coefficients=(0, 0.5), name="gear", compliance=1e-4)
    builder.add_tendon(
        "rope",
        path=[
            ("post", (0, 0.03, 0.1)),
            PathElement("cylinder", "arm", radius=0.06, side=(0.3, 0.5, 0), side_body="arm"),
            ("fist", (0, 0, 0.1)),
            PathElement("pulley", divisor=2),
            (None, (0, 1, 0)),
            ("box", (0, 0, 0)),
        ],
        stiffness=20,
        rest=(0.2, 0.5),
        damping=0.3,
    )
    builder.add_tendon("sum", joints={"shoulder": 1, "wrist": 2}, damping=0.1)
    builder.add_coupling(tendon_a="sum", coefficients=(0.2,), compliance=1e-2, name="kept")
    builder.add_actuator("drive", joint="shoulder", gear=2.0, control_limits=(-1, 1))
    builder.add_actuator(
        "pull", tendon="rope", law="position", kp=3.0, kd=0.1, dynamics="filter", time_constant=0.1
    )
    builder.add_actuator(
        "crank",
        transmission=Transmission("slider_crank", body="fist", reference_body="post", rod=2.0),
        control=0.2,
    )
    builder.set_pair_material("belt", 4, Material(0.6))
    builder.exclude("fist", "post")
    model = builder.build()
    start = Simulation(model).state
    rows = {
        name: tuple(map(tuple, getattr(start, name).tolist()))
        for name in ("positions", "orientations", "linear_velocities", "angular_velocities")
    }
    lifted = (*rows["positions"][:3], (0.0, 0.8, 0.4))
    key = Keyframe(
        "up",
        2.0,
        **{**rows, "positions": lifted},
        joint_coordinates=(0.0, 0.0),
        controls=(0.1, 0.4, -0.2, 3.0),
        activations=(0.0, 0.3, 0.0),
    )
    return replace(model, keyframes=(key,))


def motion(simulation: Simulation, bodies, steps: int = 60):
    """Positions and orientations of some bodies over time."""
    rows = []
    for _ in range(steps):
        simulation.step()
        rows.append((simulation.state.positions[bodies].copy(), simulation.state.orientations[bodies].copy()))
    return rows


# Breaks when a part stays behind, keeps a wrong index or its place in the old world. A turn about the
# direction of gravity and a shift change nothing but where things are; what differs is rounding, which
# sliding over 60 steps keeps below 1e-9.
@pytest.mark.parametrize("keyframe", [None, "up"])
def test_a_part_moves_like_the_whole(keyframe):
    model = machine()
    builder = ModelBuilder()
    builder.add_body("other", shape=shapes.Box((0.1, 0.1, 0.1)), density=1, position=(50, 0, 0))
    builder.add_prismatic_joint("other", axis=(1, 0, 0))
    builder.add_tendon(joints={0: 1})
    builder.add_actuator(joint=0, name="other")
    builder.add_floor(height=-5)
    added = builder.add_model(model, position=SHIFT, orientation=TURN, prefix="m_")
    assert added.bodies == (1, 2, 3, 4)
    assert added.geoms == range(2, 2 + len(model.geoms))
    assert added.joints == range(1, 4)
    assert added.couplings == range(2)
    whole = builder.build()
    assert whole.keyframe_names == ("m_up",)
    assert whole.actuator_names == ("other", "m_drive", "m_pull", "m_crank")
    assert (added.tendons, added.actuators) == (range(1, 3), range(1, 4))
    alone, together = Simulation(model, tolerance=1e-10), Simulation(whole, tolerance=1e-10)
    if keyframe:
        alone.apply_keyframe("up")
        together.apply_keyframe("m_up")
        assert together.state.positions[0, 0] == 50
    alone.set_control("drive", 0.7)
    together.set_control("m_drive", 0.7)
    place = Transform(SHIFT, TURN)
    pairs = zip(motion(alone, [0, 1, 2, 3]), motion(together, list(added.bodies)), strict=True)
    for (position, orientation), (moved, turned) in pairs:
        np.testing.assert_allclose(moved, [place(p) for p in position], atol=1e-9)
        np.testing.assert_allclose(turned, [multiply(TURN, q) for q in orientation], atol=1e-9)
    assert np.linalg.norm(position[1:] - np.array([b.pose.position for b in model.bodies[1:]])) > 0.05


# Breaks when models get parts of a new kind that add_model would leave behind: teach it, then add them here.
def test_every_part_is_known():
    known = {
        "gravity", "friction_rule", "bodies", "geoms", "joints", "couplings", "pair_materials",
        "excluded_bodies", "excluded_geoms", "keyframes", "actuators", "tendons", "unread", "sites",
        "sensors", "core", "fluid", "fluid_boxes", "bonds", "visuals", "links", "trees",
    }  # fmt: skip
    assert {f.name for f in fields(Model)} == known


# Breaks when what feels the fluid does not come along, on the body that it belongs to there.
def test_fluid_boxes_come_along():
    model = replace(
        cube(), fluid=Fluid(1000.0), fluid_boxes=(FluidBox(0, Transform((0, 0, 0.1)), (1, 2, 3)),)
    )
    builder = ModelBuilder(fluid=model.fluid)
    builder.add_model(model, prefix="a ")
    builder.add_model(model, prefix="b ", position=(5, 0, 0))
    again = builder.build()
    assert again.fluid == model.fluid
    assert [box.body for box in again.fluid_boxes] == [0, 1]
    assert again.fluid_boxes[1].frame == model.fluid_boxes[0].frame


def cube() -> Model:
    builder = ModelBuilder()
    builder.add_body("cube", shape=shapes.Box((0.1, 0.1, 0.1)), mass=1.0)
    return builder.build()


# Breaks when a model that is added as it is does not come out as it went in.
def test_the_same_again():
    model = machine()
    builder = ModelBuilder()
    builder.add_model(model)
    again = builder.build()
    assert again == model
    assert again.keyframes == model.keyframes
    assert again.actuators == model.actuators


def cart(builder: ModelBuilder, motion: str = "dynamic") -> None:
    builder.add_body(
        "cart", position=(1, 0, 1), orientation=axis_angle((0, 0, 1), 0.5), motion=motion, **STILL
    )


def free_tool() -> Model:
    builder = ModelBuilder()
    builder.add_body("palm", position=(0, 0, 0.2), **STILL)
    builder.add_body("finger", position=(0, 0, 0.4), **STILL)
    builder.add_revolute_joint("finger", "palm", point=(0, 0, 0.3), axis=(1, 0, 0), name="knuckle")
    return builder.build()


# Breaks when a part without a hold on its world is not held by its parent where it was put, or more than its
# first body is.
def test_a_tool_in_a_hand():
    builder = ModelBuilder()
    cart(builder)
    builder.add_model(free_tool(), parent="cart", position=(0, 0.5, 0), prefix="tool_")
    model = builder.build()
    assert model.joint_names == ("tool_knuckle", "tool_palm_mount")
    simulation = Simulation(model)
    simulation.state.angular_velocities[0] = (1, 2, 3)
    simulation.run(0.5)
    cart_pose, palm = (
        Transform(tuple(simulation.state.positions[i]), tuple(simulation.state.orientations[i]))
        for i in (0, 1)
    )
    np.testing.assert_allclose(palm.position, cart_pose((0, 0.5, 0.2)), atol=1e-4)
    assert abs(simulation.kinematics.coordinate("tool_knuckle")) > 1e-3


# Breaks when what was fixed to the world of a model does not hold on to the body that takes its place: a base
# with mass by a joint, one without as a part of it, joints and shapes of the world directly.
@pytest.mark.parametrize("mass", [0.0, 2.0])
@pytest.mark.parametrize("motion", ["dynamic", "kinematic", "static"])
def test_an_arm_on_a_cart(mass, motion):
    arm = ModelBuilder()
    solid = dict(mass=mass, inertia=(1, 1, 1)) if mass else {}
    arm.add_body("base", motion="static", position=(0, 0, 0.1), **solid)
    arm.add_geom("base", shapes.Box((0.1, 0.1, 0.1)), name="foot", surface_velocity=(1, 0, 0))
    arm.add_geom(None, shapes.Sphere(0.01), position=(0, 0, 2), name="lamp")
    arm.add_body("link", position=(0.2, 0, 0.2), **STILL)
    arm.add_revolute_joint("link", "base", point=(0, 0, 0.2), axis=(0, 1, 0), name="shoulder")
    arm.add_body("door", position=(0, 1, 0), **STILL)
    arm.add_revolute_joint("door", point=(0, 1, 0), axis=(0, 0, 1), name="hinge")
    builder = ModelBuilder()
    cart(builder, motion)
    added = builder.add_model(arm.build(), parent="cart", position=(0, 0, 0.5), orientation=TURN)
    model = builder.build()
    merged = not mass and motion != "static"
    assert added.bodies == ((0, 1, 2) if merged else (1, 2, 3))
    assert ("base_mount" in model.joint_names) == (not merged and motion != "static")
    assert model.geoms[1].body == 0  # the lamp
    if merged:
        np.testing.assert_allclose(model.geoms[0].surface_velocity, rotate(TURN, (1, 0, 0)))
    simulation = Simulation(model)
    if motion != "static":
        simulation.state.linear_velocities[0] = (1, 2, 0)
        simulation.state.angular_velocities[0] = (0, 0, 1)
    report = simulation.run(0.5)
    assert report.joint_error < 1e-3
    # Where the cart is, the hinge of the link is 0.2 above the seat.
    cart_pose = Transform(tuple(simulation.state.positions[0]), tuple(simulation.state.orientations[0]))
    seat = cart_pose @ Transform((0, 0, 0.5), TURN)
    link = added.bodies[1]
    pose = Transform(tuple(simulation.state.positions[link]), tuple(simulation.state.orientations[link]))
    np.testing.assert_allclose(pose((-0.2, 0, 0)), seat((0, 0, 0.2)), atol=1e-3)


# Breaks when models do not stand where `on` says: on the top of a geom or a body, turned as they are.
def test_an_object_on_a_table():
    builder = ModelBuilder()
    builder.add_floor()
    builder.add_body("table", motion="static", position=(1, 0, 0.4), shape=shapes.Box((0.5, 0.5, 0.3)))
    cube = ModelBuilder()
    cube.add_body("cube", shape=shapes.Box((0.1, 0.1, 0.1)), density=300, position=(0, 0, 7))
    cube.add_geom("cube", shapes.Sphere(3), category=0, mask=0)  # only to be seen
    for k, on in enumerate(("table", "floor")):
        on_edge = axis_angle((1, 0, 0), math.pi / 4)
        builder.add_model(
            cube.build(),
            on=on,
            position=(1 + k, 0, 0.01),
            orientation=on_edge if k else (1, 0, 0, 0),
            prefix=on,
        )
    table, floor = builder.build().bodies[1:]
    np.testing.assert_allclose(table.pose.position, (1, 0, 0.7 + 0.1 + 0.01), atol=1e-12)
    # Turned about x, 7 m along z become 7 m along (-y + z) / sqrt 2.
    np.testing.assert_allclose(
        floor.pose.position, (2, -7 / math.sqrt(2), 0.1 * math.sqrt(2) + 0.01), atol=1e-12
    )


# Breaks when a floor does not carry what has bits of its own, lies elsewhere than at the lowest shape, or
# moves the indices, names or the gravity of the robot.
def test_on_floor():
    builder = ModelBuilder(gravity=(0, 0, -3), friction_rule="minimum")
    builder.add_geom(None, shapes.Box((0.1, 0.1, 0.1)), position=(5, 0, -3), name="floor")
    builder.add_body("ball", position=(0, 0, 2))
    builder.add_geom("ball", shapes.Sphere(0.2), density=100, category=4, mask=0)
    builder.add_geom("ball", shapes.Sphere(0.5), category=0, mask=0)
    model = builder.build()
    standing = amontons.on_floor(model, material=Material(0.9))
    assert standing.gravity == model.gravity
    assert standing.friction_rule == "minimum"
    assert standing.geom_names[:-1] == model.geom_names
    assert standing.geoms[-1].material.friction == 0.9
    simulation = Simulation(standing)
    report = simulation.run(0.5)
    assert report.contacts == 1
    np.testing.assert_allclose(simulation.state.positions[0], (0, 0, 0.2), atol=1e-9)


# Breaks when keyframes of two parts with one name are not one keyframe, or parts without it do not start it
# as they stand.
def test_keyframes_of_two():
    builder = ModelBuilder()
    builder.add_model(machine(), prefix="a_")
    renamed = replace(machine().keyframes[0], name="a_up")
    builder.add_model(replace(machine(), keyframes=(renamed,)), position=(9, 0, 0))
    cart(builder)
    model = builder.build()
    assert model.keyframe_names == ("a_up",)
    key = model.keyframes[model.keyframe_index("a_up")]
    heights = [p[2] for p in key.positions]
    assert heights[3] == heights[7] == 0.4
    assert key.positions[8] == (1, 0, 1)
    assert key.controls == (0.1, 0.4, -0.2) * 2 + (3.0, 3.0)  # actuators of both, then motors of both


def twice(builder: ModelBuilder) -> None:
    builder.add_model(free_tool())
    builder.add_model(free_tool())


def floor_on_a_cart(builder: ModelBuilder) -> None:
    cart(builder)
    builder.add_model(amontons.on_floor(machine()), parent="cart")


WRONG = {
    "no model": (
        lambda b: b.add_model("arm.xml"),
        "model is a str; read it by amontons.load_model('arm.xml')",
    ),
    "the same names": (twice, 'add_model: there is a body "palm" already; give the model a prefix='),
    "prefix": (lambda b: b.add_model(free_tool(), prefix=1), "prefix is 1; give a string"),
    "parent": (lambda b: b.add_model(free_tool(), parent="hand"), 'there is no body "hand"'),
    "on nothing": (lambda b: b.add_model(machine(), on="table"), 'on="table" is no geom or body'),
    "on a number": (lambda b: b.add_model(machine(), on=0), "on is 0; give the name of a geom or body"),
    "no shapes": (
        lambda b: [b.add_floor(), b.add_model(free_tool(), on="floor")],
        'on="floor" needs shapes on both that can touch',
    ),
    "both": (lambda b: b.add_model(machine(), on="a", parent="b"), "on and parent are both given"),
    "position": (lambda b: b.add_model(machine(), position=(0, 0)), "add_model: position is (0, 0)"),
    "a plane that moves": (floor_on_a_cart, 'geom "floor" of body "cart": a Plane does not move by forces'),
    "no floor without shapes": (lambda b: amontons.on_floor(free_tool()), "no body of the model has a shape"),
    "floor under nothing": (lambda b: amontons.on_floor("robot"), "on_floor: model is a str"),
}


# Breaks when something that cannot be put together is, or the message does not say what to do.
@pytest.mark.parametrize("case", WRONG)
def test_wrong(case):
    call, message = WRONG[case]
    with pytest.raises(amontons.InputError) as error:
        call(ModelBuilder())
    assert message in str(error.value)


# Breaks when a model that is refused leaves parts behind.
def test_nothing_is_left_behind():
    builder = ModelBuilder()
    builder.add_model(machine())
    before = builder.build()
    for name in ("body", "geom", "joint", "coupling", "tendon", "actuator"):
        other = machine()
        if name == "actuator":
            other = replace(free_tool(), actuators=(Actuator("drive", Transmission(joint=0)),))
        with pytest.raises(amontons.InputError, match="already"):
            builder.add_model(other)
        assert builder.build() == before


# Breaks when what a model looks like does not come along with the body that it belongs to, or is lost on the
# way into a recording's text and back.
def test_visuals_come_along():
    builder = ModelBuilder()
    builder.add_body("cube", shape=shapes.Box((0.1, 0.1, 0.1)), mass=1.0)
    mesh = TriangleMesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    builder.add_visual("cube", mesh, position=(0, 0, 0.1), colour=(1, 0, 0, 0.5))
    builder.add_visual(None, shapes.Sphere(1))
    model = builder.build()
    two = ModelBuilder()
    two.add_model(model, prefix="a ")
    two.add_model(model, prefix="b ", position=(5, 0, 0))
    for again in (two.build(), model_from_json(model_to_json(two.build()))):
        assert [v.body for v in again.visuals] == [0, -1, 1, -1]
        assert again.visuals[2].frame == model.visuals[0].frame
        assert again.visuals[3].frame.position == (5, 0, 0)
        assert tuple(again.visuals[2].colour) == (1, 0, 0, 0.5)
        assert again.visuals[3].colour is None
        assert np.array_equal(again.visuals[2].shape.vertices, mesh.vertices)
        assert again.visuals[0].shape is again.visuals[2].shape
    with pytest.raises(amontons.InputError, match="colour"):
        builder.add_visual("cube", mesh, colour=(2, 0, 0, 1))
    with pytest.raises(amontons.InputError, match="vertex 3"):
        TriangleMesh(mesh.vertices, [(0, 1, 3)])


@pytest.mark.parametrize(
    ("given", "parts", "expected"),
    [
        (None, ["none"], "none"),
        (None, ["none", "auto", "none"], "auto"),
        ("none", ["auto"], "none"),
        ("auto", ["none"], "auto"),
    ],
)
def test_the_form_of_joints_comes_with_the_models(given, parts, expected):
    """Breaks when a robot of a file, put on a table by a builder, falls back to joints as rows."""
    builder = ModelBuilder(trees=given)
    for i, form in enumerate(parts):
        builder.add_model(replace(machine(), trees=form), prefix=f"{i}_")
    assert builder.build().trees == expected
