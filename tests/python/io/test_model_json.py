"""Models as JSON: what Python writes is what C++ and Python read, to the last bit."""

import json
import math

import amontons
import numpy as np
import pytest
from amontons import _core, scenes
from amontons.io.recordings.model_json import model_from_json, model_to_json
from every_part import every_part

MODELS = ("arm.xml", "dog.urdf", "gripper.xml", "quadruped.xml")


# Breaks when a field is not written, is read into another one, or loses a digit: Python's model is the same
# again, and the compiled model that C++ reads from the file moves like it bit for bit.
@pytest.mark.parametrize("name", ["every part", *MODELS, "tracked_vehicle", "hopper", "wall_at_rest"])
def test_same_model_in_both_languages(root, tmp_path, name):
    if name == "every part":
        model = every_part()
    elif name in MODELS:
        pytest.importorskip("mujoco")
        model = amontons.load_model(root / "examples" / "models" / name)
    else:
        model = scenes.make(name)
    file = tmp_path / "model.json"
    amontons.write_model(model, file)
    again = amontons.load_model(file)
    assert again == model
    assert again.keyframes == model.keyframes
    assert again.sites == model.sites
    ours, theirs = (_core.Simulation(m.core, _core.SimulationOptions()) for m in (model, again))
    for _ in range(3):
        ours.step(), theirs.step()
        for key, values in ours.snapshot().arrays.items():
            np.testing.assert_array_equal(values, theirs.snapshot().arrays[key], key)


# Breaks when what is read and written again is another text, or a shape that geoms share becomes several.
def test_written_again(tmp_path):
    hull = amontons.shapes.Hull(np.random.default_rng(3).normal(size=(40, 3)))
    builder = amontons.ModelBuilder()
    for k in range(3):
        builder.add_body(f"b{k}", shape=hull, density=1, position=(9 * k, 0, 0))
    looks = amontons.parts.TriangleMesh(hull.vertices, hull.triangles)
    builder.add_visual("b0", looks)
    builder.add_visual("b1", looks)
    text = model_to_json(builder.build())
    again = model_from_json(text)
    assert model_to_json(again) == text
    assert len({id(geom.shape) for geom in again.geoms}) == 1
    assert len({id(visual.shape) for visual in again.visuals}) == 1
    assert len(json.loads(text)["shapes"]) == 2


# Breaks when a point at an origin is taken for none: a tendon through an obstacle whose side is its middle.
def test_zero_is_not_nothing():
    builder = amontons.ModelBuilder()
    builder.add_body("b", shape=amontons.shapes.Sphere(1), density=1)
    ends = [amontons.parts.PathElement(body="b", frame=amontons.Transform((x, 0, 3))) for x in (-2, 2)]
    drum = amontons.parts.PathElement("cylinder", radius=1.0, side=(0, 0, 0))
    builder.add_tendon("rope", path=[ends[0], drum, ends[1]], stiffness=1.0)
    model = builder.build()
    assert model.tendons[0].path[1].side == (0, 0, 0)
    assert model_from_json(model_to_json(model)) == model


# Breaks when the file is no JSON that others read, or a name that is the word for infinity becomes a number.
def test_json_of_the_standard(tmp_path):
    builder = amontons.ModelBuilder()
    builder.add_body("Infinity", mass=1, inertia=(1, 1, 1))
    builder.add_revolute_joint(
        "Infinity", point=(0, 0, 0), axis=(0, 0, 1), limits=(None, 1), name="-Infinity"
    )
    amontons.write_model(builder.build(), tmp_path / "m.json")

    def refuse(constant):
        raise AssertionError(constant)

    text = (tmp_path / "m.json").read_text()
    json.loads(text, parse_constant=refuse)
    again = model_from_json(text)
    assert again.body_names == ("Infinity",)
    assert again.joint_names == ("-Infinity",)
    assert again.joints[0].dofs[0].lower == -math.inf


# Breaks when a text that is no JSON is not told by line and column, or a limit or an option is passed over.
def test_other_refusals(tmp_path):
    file = tmp_path / "m.json"
    file.write_text('{"bodies": [\n 1, }')
    with pytest.raises(amontons.FileError, match="no JSON: parse error at line 2, column 5"):
        amontons.load_model(file)
    with pytest.raises(amontons.FileError, match=r"more than limits\.memory"):
        amontons.load_model(file, limits=amontons.Limits(memory=3))
    with pytest.raises(amontons.InputError, match="options are for MJCF and URDF"):
        amontons.load_model(file, strict=True)
    with pytest.raises(amontons.FileError, match=r"models are written to \.json"):
        amontons.write_model(scenes.make("stack"), tmp_path / "m.sdf")
    with pytest.raises(amontons.InputError, match="give a Model"):
        amontons.write_model(3, file)
