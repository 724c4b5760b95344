"""Malformed model files of every format: the error names the file, the thing and the remedy."""

import json
import warnings

import amontons
import pytest
from amontons import FileError, InputError, UnsupportedWarning
from every_part import every_part
from problems import quiet

pytest.importorskip("mujoco")


def refused(path, *parts):
    """The file is refused with all parts in one message that starts with its path."""
    with warnings.catch_warnings(action="ignore"), pytest.raises(InputError) as caught:
        amontons.load_model(path)
    message = str(caught.value)
    assert message.startswith(str(path)), message
    for part in parts:
        assert part in message


URDF = """<robot name="r">
<link name="base"><inertial><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="arm"><inertial><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/>
  <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""
MJCF = """<mujoco>
<asset><mesh name="wedge" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>
<worldbody><body name="arm"><joint name="hinge" range="-1 1"/><geom name="ball" size="0.1"/>
  <geom type="mesh" mesh="wedge"/></body></worldbody>
<actuator><motor name="drive" joint="hinge"/></actuator>
</mujoco>"""
SDF = """<sdf version="1.9"><model name="m">
<link name="arm"><inertial><mass>1</mass></inertial>
  <collision name="ball"><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link>
<joint name="hinge" type="revolute"><parent>world</parent><child>arm</child>
  <axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""
USD = """#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "arm" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
{
    float physics:mass = 1
    double3 xformOp:translate = (0, 0, 1)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Sphere "ball" (prepend apiSchemas = ["PhysicsCollisionAPI"])
    {
        double radius = 0.1
    }
}
def PhysicsRevoluteJoint "hinge"
{
    rel physics:body1 = </arm>
    uniform token physics:axis = "X"
    float physics:lowerLimit = -1
}
"""
GOOD = {".urdf": URDF, ".xml": MJCF, ".sdf": SDF, ".usda": USD}

# suffix, what is replaced by what, and what the message says: the thing, and what to do.
WRONG = [
    (".urdf", '<child link="arm"/>', '<child link="leg"/>', '<joint name="hinge">', 'no link "leg"',
     "its child; there are base, arm"),
    (".urdf", '<parent link="base"/>', '<parent link="trunk"/>', '<joint name="hinge">', 'no link "trunk"'),
    (".urdf", '<parent link="base"/>', "", '<joint name="hinge">', "no <parent", "name a link"),
    (".urdf", '<child link="arm"/>', '<child link="base"/>', '<joint name="hinge">', "base -> base",
     "one link must have no parent"),
    (".urdf", "</robot>", '<joint name="back" type="fixed"><parent link="arm"/><child link="base"/></joint>'
     "</robot>", "-> ", "carry each other", "one link must have no parent"),
    (".urdf", "</robot>", '<joint name="two" type="fixed"><parent link="base"/><child link="arm"/></joint>'
     "</robot>", '<joint name="two">', 'hangs on the joint "hinge" already', "<loop>"),
    (".urdf", "</robot>", '<link name="arm"/></robot>', '<link name="arm">', "line 5", "rename one"),
    (".urdf", '<link name="arm">', "<link>", ":5: <link>", "no name", "give it one"),
    (".urdf", "revolute", "wobbly", '<joint name="hinge">', '"wobbly"', "give one of revolute"),
    (".urdf", ' type="revolute"', "", '<joint name="hinge">', "no type", "give one of revolute"),
    (".urdf", 'xyz="0 0 1"', 'xyz="0 0 0"', ":8: <axis>", "zero", "give the direction"),
    (".urdf", 'xyz="0 0 1"', 'xyz="0 1"', ":8: <axis>", '"0 1"', "three numbers"),
    (".urdf", 'xyz="0 0 1"', 'xyz="0 0 ${z}"', ":8: <axis>", "must be run first"),
    (".urdf", 'radius="0.1"', 'radius="-1"', ":4: <sphere>", 'radius="-1"', "above 0"),
    (".urdf", 'radius="0.1"', "", ":4: <sphere>", 'radius=""', "must be a number above 0"),
    (".urdf", 'mass value="1"', 'mass value="nan"', "<mass>", "not finite"),
    (".urdf", 'mass value="1"', 'mass value="heavy"', "<mass>", "value", "give numbers"),
    (".urdf", 'iyy="1" ', "", "<inertia>", "'iyy'", "give it"),
    (".urdf", '<sphere radius="0.1"/>', '<mesh filename="gone.stl"/>', "<mesh>", "gone.stl",
     "set ROS_PACKAGE_PATH"),
    (".xml", 'joint="hinge"', 'joint="knee"', '<motor name="drive">', "knee"),
    (".xml", 'mesh="wedge"/>', 'mesh="wheel"/>', "wheel"),
    (".xml", 'size="0.1"', 'size="0.1 x"', '<geom name="ball">', "size", "give numbers"),
    (".xml", 'size="0.1"', 'size="nan"', '<geom name="ball">', "not finite"),
    (".xml", 'size="0.1"', 'size="-1"', '<geom name="ball">', "give a size above 0"),
    (".xml", 'range="-1 1"', 'range="1 -1"', '<joint name="hinge">', "must be below the upper one"),
    (".xml", "0 0 1\"/></asset>", "0 0\"/></asset>", "wedge"),
    (".xml", "</worldbody>", '<body name="arm"/></worldbody>', '<body name="arm">', "rename one"),
    (".xml", "<worldbody>", '<worldbody><include file="{path}"/>', "<include>", "includes itself"),
    (".sdf", "<mass>1<", "<mass>heavy<", ":2: <mass>", '"heavy"', "give one"),
    (".sdf", "<mass>1<", "<mass>nan<", ":2: <mass>", "1 numbers are expected"),
    (".sdf", "<mass>1<", "<mass>-1<", ":2: <inertial>", "must be positive"),
    (".sdf", "<child>arm<", "<child>leg<", ":4: <child>", '"leg"', "correct the name"),
    (".sdf", "<parent>world</parent>", "", '<joint name="hinge">', "<parent>", "give it one"),
    (".sdf", "0 0 1<", "0 0 0<", '<joint name="hinge">', "give the direction"),
    (".sdf", "0 0 1<", "0 1<", ":5: <xyz>", "3 numbers are expected"),
    (".sdf", "</model>", '<link name="arm"/></model>', '<link name="arm">', "rename one"),
    (".sdf", "</model>", "<link/></model>", "<link>", "give it one"),
    (".sdf", "<radius>0.1", "<radius>-1", ":3: <sphere>", "must be positive"),
    (".sdf", 'version="1.9"', 'version="new"', ":1", '"new" is no version'),
    (".sdf", '<link name="arm">', '<link name="a"><pose relative_to="arm"/></link><link name="arm">'
     '<pose relative_to="a"/>', "relative to each other: a -> arm -> a"),
    (".sdf", "</model>", "<include><uri>{path}</uri></include></model>", "<include>", "includes itself"),
    (".sdf", "</model>", "<include><uri>model://gone</uri></include></model>", "<include>", "model://gone",
     "set GZ_SIM_RESOURCE_PATH"),
    (".usda", "physics:mass = 1", "physics:mass = nan", ":/arm: physics:mass", "correct it"),
    (".usda", "physics:mass = 1", "physics:mass = -1", ":/arm: physics:mass = -1", "must be positive"),
    (".usda", "physics:mass = 1", 'physics:mass = "x"', ":8", "export it again"),
    (".usda", "(0, 0, 1)", "(0, 0, inf)", ":/arm: ", "correct its transformations"),
    (".usda", "radius = 0.1", "radius = -1", ":/arm/ball: ", "must be positive"),
    (".usda", "radius = 0.1", "radius = nan", ":/arm/ball: radius", "correct it"),
    (".usda", '"X"', '"Q"', ":/hinge: physics:axis", "X, Y or Z"),
    (".usda", "lowerLimit = -1", "lowerLimit = nan", ":/hinge: lower", "must be a number"),
    (".usda", "metersPerUnit = 1", "metersPerUnit = 0", "metersPerUnit = 0", "must be > 0; correct"),
    (".usda", "#usda 1.0", "#usda 9.0", ":1", "version", "export it again"),
    (".usda", 'Sphere "ball"', 'Mesh "ball"', ":/arm/ball: faceVertexCounts", "export it again"),
]  # fmt: skip


# Breaks when a mistake passes, or its message does not name the file, the thing and the way out.
@pytest.mark.parametrize("case", WRONG, ids=lambda case: f"{case[0][1:]} {case[2][:40]}")
def test_wrong_values(tmp_path, case):
    suffix, good, bad, *parts = case
    if suffix == ".usda":
        pytest.importorskip("pxr")
    path = tmp_path / f"model{suffix}"
    text = GOOD[suffix]
    assert good in text
    path.write_text(text.replace(good, bad.replace("{path}", str(path)), 1))
    refused(path, *parts)


# Breaks when a file that was cut off gives a model of its first half, or a traceback.
@pytest.mark.parametrize("suffix", [*GOOD, ".json", ".usdc"])
def test_truncated_files(tmp_path, suffix):
    if suffix.startswith(".usd"):
        pytest.importorskip("pxr")
    path = tmp_path / f"model{suffix}"
    if suffix in GOOD:
        path.write_text(GOOD[suffix])
    else:
        builder = amontons.ModelBuilder()
        builder.add_body("ball", shape=amontons.shapes.Sphere(0.1), density=100)
        amontons.write_model(builder.build(), path)
    data = path.read_bytes().rstrip()
    quiet(amontons.load_model, path)
    for k in range(12):
        cut = tmp_path / f"cut{k}{suffix}"
        cut.write_bytes(data[: (len(data) * k) // 12])
        refused(cut, ":")


def model_json():
    builder = amontons.ModelBuilder()
    builder.add_body("ball", shape=amontons.shapes.Sphere(0.1), density=100)
    builder.add_revolute_joint("ball", name="hinge", point=(0, 0, 0), axis=(0, 0, 1))
    return builder.build()


def without_lists(file):
    file.clear()
    file["version"] = 99


WRONG_JSON = [
    (lambda m: m.update(version=99), "version: it is 99", "take a newer one"),
    (without_lists, "version: it is 99", "take a newer one"),
    (lambda m: m.update(version="1"), "version", "give an integer"),
    (lambda m: m.pop("bodies"), 'no list "bodies"', "write it by amontons.write_model"),
    (lambda m: m.update(bodies={}), 'no list "bodies"', "write it by amontons.write_model"),
    (lambda m: m["bodies"].append(3), "bodies[1]", "give an object"),
    (lambda m: m["bodies"][0].update(mass="heavy"), "bodies[0].mass", "give a number"),
    (lambda m: m["bodies"][0].update(mass=-1), 'body "ball"', "must be positive"),
    (lambda m: m["bodies"][0].update(colour=1), 'bodies[0]: "colour" is not known', "newer version"),
    (lambda m: m["bodies"].append(m["bodies"][0]), 'body "ball" occurs twice', "must be unique"),
    (lambda m: m["joints"][0].update(body_a=7), 'joint "hinge"', "body 7 does not exist"),
    (lambda m: m["joints"][0]["dofs"][0].update(kind="twist"), "joints[0].dofs[0].kind", "give one of hinge"),
    (lambda m: m["shapes"][0].update(kind="cube"), "shapes[0]", "not known"),
    (lambda m: m["shapes"][0].update(radius=-1), "shapes[0]: sphere: the radius must be positive"),
    (lambda m: m.update(keyframes=3), "keyframes: give a list"),
    (lambda m: m["shapes"][0].pop("radius"), 'shapes[0]: there is no "radius"'),
    (lambda m: m["geoms"][0].update(shape=5), "geoms[0].shape", 'no such shape in "shapes"'),
    (lambda m: m["bodies"][0]["pose"].update(rotation=[0, 0, 0, 0]), 'body "ball"', "normalise it"),
    (lambda m: m.update(sites=[{"name": "s", "body": 9}]), 'site "s"', "there is no body 9"),
]  # fmt: skip


# Breaks when a wrong field is read, or a file of a later version is told as one that lacks a list.
@pytest.mark.parametrize("number", range(len(WRONG_JSON)))
def test_wrong_json(tmp_path, number):
    change, *parts = WRONG_JSON[number]
    path = tmp_path / "model.json"
    amontons.write_model(model_json(), path)
    file = json.loads(path.read_text())
    change(file)
    path.write_text(json.dumps(file))
    refused(path, *parts)


# Breaks when what is no JSON of a model, or holds a NaN, is told otherwise than as a fault of the file.
@pytest.mark.parametrize("text", [b"", b"[]", b"{}", b"null", b"\xff\xfe", b"[" * 100000, b'{"shapes": NaN}'])
def test_no_json(tmp_path, text):
    path = tmp_path / "model.json"
    path.write_bytes(text)
    refused(path)


PLY = "ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty float x\nend_header\n"
MESHES = {
    "cut.stl": b"\0" * 80 + b"\x10\0\0\0" + b"\0" * 60,
    "text.stl": b"hello",
    "empty.stl": b"",
    "nan.obj": b"v 0 0 0\nv nan 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n",
    "far.obj": b"v 0 0 0\nv 1 0 0\nf 1 2 9\n",
    "words.obj": b"v a b c\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "cut.ply": PLY.encode() + b"\0" * 9,
    "cut.dae": b"<COLLADA><library_geometries",
    "empty.dae": b"<COLLADA/>",
}


# Breaks when a damaged mesh becomes a shape, or is told without its file and what to do.
@pytest.mark.parametrize("name", MESHES)
def test_meshes(tmp_path, name):
    pytest.importorskip("trimesh")
    path = tmp_path / name
    path.write_bytes(MESHES[name])
    for read in (amontons.shapes.read_mesh, amontons.shapes.Hull.read):
        with pytest.raises(FileError, match="export it again") as caught:
            read(path)
        assert str(caught.value).startswith(str(path))
    mesh = f"<mesh><uri>{name}</uri></mesh>"
    model = tmp_path / "model.sdf"
    model.write_text(SDF.replace("<sphere><radius>0.1</radius></sphere>", mesh))
    refused(model, ":3: <mesh>", name, "export it again")
    if path.suffix in (".stl", ".obj"):  # others are listed as no mesh
        model = tmp_path / "model.urdf"
        model.write_text(URDF.replace('<sphere radius="0.1"/>', f'<mesh filename="{name}"/>'))
        refused(model, ":4: <mesh>", "export it again")
    model = tmp_path / "model.xml"
    model.write_text(MJCF.replace('vertex="0 0 0 1 0 0 0 1 0 0 0 1"', f'file="{name}"'))
    refused(model, ':2: <mesh name="wedge">', "again" if path.suffix in (".stl", ".obj") else "convert it")


# Breaks when a model that a format cannot hold leaves a part of a file, or the file that was there is lost.
@pytest.mark.parametrize("name", ["model.urdf", "model.bvh", "none/model.json"])
def test_nothing_partial_is_written(tmp_path, name):
    path = tmp_path / name
    if path.parent == tmp_path:
        path.write_text("what was there")
    with pytest.raises(InputError, match=path.name if path.parent == tmp_path else "make it first"):
        amontons.write_model(every_part(), path)
    assert [p.name for p in tmp_path.iterdir()] == ([path.name] if path.parent == tmp_path else [])
    assert path.parent != tmp_path or path.read_text() == "what was there"


# Breaks when a file of a later SDF is refused, or read unsaid.
def test_later_sdf(tmp_path):
    path = tmp_path / "model.sdf"
    path.write_text(SDF.replace("1.9", "1.99"))
    with pytest.warns(
        UnsupportedWarning, match="a version after 1.12, whose new elements are not known here"
    ):
        model = amontons.load_model(path, strict=True)
    assert [entry.effect for entry in model.unread] == ["none"]
