"""Slips of newcomers: the error names the thing and says what to do."""

import inspect
import math

import amontons
import pytest
from amontons import Material, ModelBuilder, Simulation, cli, scenes, shapes
from typer.testing import CliRunner

BALL = shapes.Sphere(0.1)


def builder():
    made = ModelBuilder()
    made.add_body("ball", shape=BALL, density=1000)
    return made


def simulation():
    return Simulation(builder().build())


def hinge(**options):
    builder().add_revolute_joint("ball", **({"point": (0, 0, 1), "axis": (0, 1, 0)} | options))


SLIPS = {
    "edges apart": (lambda: shapes.Box(1, 2, 3), r"Box: 3 numbers are given apart; write Box\(\(1, 2, 3\)\)"),
    "one edge": (lambda: shapes.Box(1), "Box: half is 1; .* 3 numbers: half edge lengths along x, y and z"),
    "no edges": (lambda: shapes.Box(), r"Box: half is missing; it is Box\(half\)"),
    "whole edges": (lambda: shapes.Box(size=(1, 1, 1)), "'size'; did you mean 'half', half of it"),
    "radius as text": (lambda: shapes.Sphere("1"), "Sphere: radius is '1'; it must be a number"),
    "radius below zero": (lambda: shapes.Sphere(-1), "radius must be positive"),
    "r": (lambda: shapes.Sphere(r=1), "there is no argument 'r'; did you mean 'radius'"),
    "no height": (lambda: shapes.Cylinder(1), r"half_length is missing; it is Cylinder\(radius, half"),
    "height": (lambda: shapes.Cylinder(1, height=2), "'height'; did you mean 'half_length', half of it"),
    "plane's normal": (lambda: shapes.Plane((0, 0, 1)), r"one argument too many; it is Plane\(\)"),
    "cube": (lambda: shapes.Cube(1), "there is no shape 'Cube'; known are Sphere, Box"),
    "shape without name": (
        lambda: builder().add_body("b", BALL),
        r"add_body: Sphere\(radius=0.1\) stands where .* give it by name; it is add_body\(name=, \*, pos",
    ),
    "shape as text": (lambda: builder().add_body(shape="box", mass=1), "give one of amontons.shapes, as Sph"),
    "position of two": (
        lambda: builder().add_body(shape=BALL, mass=1, position=(0, 1)),
        r"position is \(0, 1\); it must have 3 numbers",
    ),
    "pos": (lambda: builder().add_body(pos=(0, 0, 1)), "no argument 'pos'; did you mean 'position'"),
    "misspelled": (lambda: builder().add_body(postion=(0, 0, 1)), "'postion'; did you mean 'position'"),
    "angles": (
        lambda: builder().add_body(shape=BALL, mass=1, orientation=(0, 0, 90)),
        "4 numbers: w, x, y, z of a unit quaternion, as amontons.axis_angle",
    ),
    "friction of a body": (
        lambda: builder().add_body(shape=BALL, friction=0.5),
        "'friction'; did you mean 'material=Material",
    ),
    "material as number": (lambda: builder().add_geom("ball", BALL, material=0.5), r"as Material\(friction="),
    "mu": (lambda: Material(mu=0.5), "'mu'; did you mean 'friction'"),
    "plane that moves": (
        lambda: builder().add_body(shape=shapes.Plane(), mass=1),
        r"a Plane does not move by forces; put it on the world by add_geom\(None, shape\)",
    ),
    "plane of nobody": (
        lambda: builder().add_geom(shapes.Plane()),
        r"shape is missing; .*add_geom\(body, sh",
    ),
    "name twice": (lambda: builder().add_body("ball"), 'there is a body "ball" already'),
    "hinge without point": (
        lambda: builder().add_revolute_joint("ball", axis=(0, 1, 0)),
        r"point is missing; .*\*, point, axis, .*\*\*options",
    ),
    "axis as text": (lambda: hinge(axis="z"), "axis is 'z'; it must have 3 numbers"),
    "motor as text": (lambda: hinge(motor="position"), r"give a Motor, as Motor\(\"position\", kp=100\)"),
    "body that is not there": (
        lambda: builder().add_revolute_joint("bal", point=(0, 0, 1), axis=(0, 1, 0)),
        r"no body \"bal\" \(did you mean 'ball'",
    ),
    "not built": (lambda: Simulation(builder()), r"is a ModelBuilder; give what its build\(\) returns"),
    "scene by name": (lambda: Simulation("wall"), r"if it is a scene, give amontons.scenes.wall\(\)"),
    "file by name": (lambda: Simulation("a/b.xml"), r"read it by amontons.load_model\('a/b.xml'\)"),
    "scene not called": (lambda: Simulation(scenes.wall), r"is a function; call it: wall\(\)"),
    "simulation of one": (lambda: Simulation(simulation()), "is a Simulation; give its model"),
    "number as model": (lambda: Simulation(3), "is a int; give a Model, as builder.build"),
    "timestep": (lambda: Simulation(builder().build(), timestep=1e-3), "did you mean 'dt'"),
    "step without name": (lambda: Simulation(builder().build(), 1e-3), r"0.001 stands where .* by name"),
    "duration as text": (lambda: simulation().run("1"), "duration = '1'; it must be a number"),
    "no such scene": (lambda: scenes.walls(), "there is no scene 'walls'; known are arch"),
    "no such parameter": (lambda: scenes.arch(blocks=3), r"'blocks'; it is arch\(\*, stones="),
    "no such joint": (lambda: simulation().set_control("elbow", 1), 'there is no control "elbow"; known'),
    "no step yet": (lambda: simulation().problem(), r"call step\(\) first"),
    "picture of a model": (lambda: amontons.render(builder().build()), r"give amontons.Simulation\(model\)"),
    "grid forgotten": (lambda: amontons.sweep(print), r"grid is missing; it is sweep\(run, grid, \*, out="),
    "model that is not there": (lambda: amontons.load_model("gone.xml"), "gone.xml: no such file"),
}


# Breaks when one of these errors no longer says what to do.
@pytest.mark.parametrize("slip", SLIPS)
def test_remedy_is_told(slip):
    call, message = SLIPS[slip]
    with pytest.raises((amontons.InputError, TypeError, AttributeError, FileNotFoundError), match=message):
        call()


# Breaks when files of other kinds are taken for what they are not.
@pytest.mark.parametrize(
    ("read", "name", "message"),
    [
        (amontons.load_model, "a.stl", "a.stl: unknown kind of file; known suffixes are .xml"),
        (amontons.vi.read_problem, "a.txt", "a.txt: unknown kind of file; known suffixes are .hdf5"),
        (amontons.read_recording, "a.csv", "a.csv: is no HDF5 file"),
        (lambda path: amontons.record(path, simulation()), "b.csv", "b.csv: .* HDF5 files: name it b.h5"),
    ],
)
def test_kind_of_file_is_told(tmp_path, read, name, message):
    (tmp_path / "a.stl").write_text("solid")
    (tmp_path / "a.txt").write_text("1")
    (tmp_path / "a.csv").write_text("1,2")
    with pytest.raises(amontons.FileError, match=message):
        read(tmp_path / name)
    assert not (tmp_path / "b.csv").exists()


# Breaks when nothing at all can be simulated without a word.
def test_model_without_bodies_warns():
    with pytest.warns(amontons.ModelWarning, match="no bodies: nothing will move; add_body") as record:
        Simulation(ModelBuilder().build())
    assert record[0].filename == __file__


# Breaks when a robot without a floor falls for ever without a word, or one that is held or floats is warned.
@pytest.mark.parametrize(
    ("world", "gravity", "told"),
    [
        ("", "0 0 -9.81", True),
        ('<geom type="plane" size="1 1 1"/>', "0 0 -9.81", False),
        ('<geom type="plane" size="1 1 1" contype="0" conaffinity="0"/>', "0 0 -9.81", True),
        ("", "0 0 0", False),
        ('<body><joint axis="0 1 0"/><geom size="0.1"/></body>', "0 0 -9.81", False),
    ],
)
def test_forgotten_floor_is_told(tmp_path, world, gravity, told):
    pytest.importorskip("mujoco")
    (tmp_path / "a.xml").write_text(
        f'<mujoco><option gravity="{gravity}"/><worldbody>{world}'
        '<body pos="0 0 1"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>'
    )
    result = CliRunner().invoke(cli.app, ["run", str(tmp_path / "a.xml"), "--duration", "0.01"])
    assert result.exit_code == 0
    assert ("nothing is there to fall on; write a floor into the file" in result.stderr) == told


# Breaks when a TypeError of a function's own body is taken for one of its call.
def test_errors_of_functions_stay_theirs():
    def callback(first, second, third):
        raise AssertionError

    with pytest.raises(TypeError, match="missing 1 required positional argument: 'third'"):
        simulation().run(0.1, after_step=callback)


# Breaks when tools no longer see the signature, the name or the documentation of a function.
def test_signature_is_seen():
    assert list(inspect.signature(ModelBuilder.add_geom).parameters)[:3] == ["self", "body", "shape"]
    assert ModelBuilder.add_geom.__doc__.startswith("Add a shape")
    assert list(inspect.signature(shapes.Box).parameters) == ["half"]


# Breaks when the quaternion turns the other way or by another angle.
def test_axis_angle():
    turned = amontons.Transform((0, 0, 0), amontons.axis_angle((0, 0, 2), math.radians(90)))((1, 0, 0))
    assert turned == pytest.approx((0, 1, 0), abs=1e-15)
    with pytest.raises(amontons.InputError, match="angle is 'x'"):
        amontons.axis_angle((0, 0, 1), "x")
