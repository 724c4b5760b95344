"""What is not read of an MJCF file is listed, what is wrong is named, with its line and element."""

import pickle
import sys
import warnings

import pytest
from amontons import FileError, InputError, Simulation
from amontons.errors import UnsupportedWarning
from amontons.io.models import load_model

mujoco = pytest.importorskip("mujoco")


def load(tmp_path, body, *, tail="", strict=True):
    path = tmp_path / "model.xml"
    path.write_text(f"<mujoco>\n\n<worldbody>\n{body}\n</worldbody>\n{tail}\n</mujoco>\n")
    return load_model(path, strict=strict)


MODEL = """<mujoco><worldbody>
<body pos="0 0 1"><freejoint/><geom name="ball" size="0.1" friction="0.3"/></body>
</worldbody></mujoco>"""
UNSUPPORTED = [
    ("geom", '<geom name="x" size="1" adhesion="1"/>', "adhesion"),
    ("joint", '<body><joint name="x" springyield="1"/><geom size="1"/></body>', "yields"),
    ("joint", '<body><joint name="x" stiffness="1 2"/><geom size="1"/></body>', "nonlinear spring"),
    ("joint", '<body><joint name="x" damping="1 0 2"/><geom size="1"/></body>', "nonlinear damper"),
    (
        "joint",
        '<body><joint name="x" type="ball"/><joint type="slide"/><geom size="1"/></body>',
        "put it last",
    ),
    ("joint", '<body><joint name="x" ref="200"/><geom size="1"/></body>', "more than half a turn"),
    (
        "flexcomp",
        '<flexcomp name="x" type="grid" count="2 2 1" spacing="1 1 1" mass="1" dim="2"/>',
        "deformable",
    ),
]
UNSUPPORTED_AFTER = [
    (
        "fixed",
        '<tendon><fixed name="x" stiffness="1 2"><joint joint="j" coef="1"/></fixed></tendon>',
        "a nonlinear spring",
    ),
    ("adhesion", '<actuator><adhesion name="x" body="b" ctrlrange="0 1"/></actuator>', "this kind of"),
    ("muscle", '<actuator><muscle name="x" joint="j" lengthrange="0 1"/></actuator>', "this kind of"),
    ("general", '<actuator><general name="x" joint="j" gaintype="user"/></actuator>', "of this kind"),
    ("general", '<actuator><general name="x" joint="j" biastype="user"/></actuator>', "of this kind"),
    ("general", '<actuator><general name="x" joint="j" dyntype="user"/></actuator>', "of this kind"),
    ("motor", '<actuator><motor name="x" joint="free" damping="1"/></actuator>', "neither a hinge"),
    ("motor", '<actuator><motor name="x" joint="free" gear="1 0 0 1 0 0"/></actuator>', "different axes"),
    ("pair", '<contact><pair name="x" geom1="g" geom2="f" friction="1 0.5"/></contact>', "anisotropic"),
    ("pair", '<contact><pair name="x" geom1="g" geom2="f" friction="1 1 0 1 2"/></contact>', "anisotropic"),
]  # fmt: skip
SCENE = """<body name="b"><joint name="j"/><geom name="g" size="1"/><geom name="g2" size="1"/>
<site name="s"/></body>
<body name="c"><freejoint name="free"/><geom name="f" size="1"/></body>"""


# Breaks when something unsupported is taken silently, or listed without its element and line.
@pytest.mark.parametrize(("tag", "text", "reason"), UNSUPPORTED)
def test_unsupported_in_bodies(tmp_path, tag, text, reason):
    with pytest.raises(InputError) as error:
        load(tmp_path, text)
    assert f'model.xml:4: <{tag} name="x">: ' in str(error.value)
    assert reason in str(error.value)
    assert "1 thing is not supported" in str(error.value)
    assert "strict=False" in str(error.value)


# Breaks when something unsupported outside the bodies is taken silently, or without its element and line.
@pytest.mark.parametrize(("tag", "text", "reason"), UNSUPPORTED_AFTER)
def test_unsupported_elsewhere(tmp_path, tag, text, reason):
    with pytest.raises(InputError) as error:
        load(tmp_path, SCENE, tail=text)
    line = 8 + text.split('name="x"')[0].count("\n")
    name = ' name="x"' if 'name="x"' in text else ""
    assert f"model.xml:{line}: <{tag}{name}>: " in str(error.value)
    assert reason in str(error.value)
    assert "1 thing is not supported" in str(error.value)


# Breaks when the list is not complete, or when what is left out takes something else with it.
def test_all_is_listed_once_and_the_rest_loads(tmp_path):
    (tmp_path / "part.xml").write_text('<mujoco>\n<body>\n<geom size="1" adhesion="3"/></body></mujoco>')
    path = tmp_path / "model.xml"
    path.write_text(
        '<mujoco>\n<default><geom adhesion="0.1"/></default>\n<worldbody>\n'
        '<replicate count="3" offset="3 0 0">\n<body><freejoint/><geom size="1" adhesion="1"/></body>'
        '</replicate>\n<include file="part.xml"/>\n</worldbody></mujoco>'
    )
    with pytest.raises(InputError) as error:
        load_model(path, strict=True)
    lines = str(error.value).splitlines()
    assert "3 things are not supported" in lines[0]
    assert [line.strip().split(": ")[0] for line in lines[1:4]] == [
        f"{path}:2",
        f"{path}:5",
        f"{tmp_path / 'part.xml'}:3",
    ]
    with pytest.warns(UnsupportedWarning, match="3 things are not read") as caught:
        model = load_model(path)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert len(model.bodies) == 4
    assert [entry.place for entry in model.unread] == [line.strip().split(": ")[0] for line in lines[1:4]]
    assert pickle.loads(pickle.dumps(model)).unread == model.unread


# Breaks when the list is not in the order of what matters, lines that say the same are not put together, or
# strict refuses what does not change the motion.
def test_worst_first(tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(
        '<robot name="r">\n<drake:joint_filter/>\n<wing a="1"/>\n<wing a="2"/>\n<xacro:macro/>\n'
        '<link name="world"/></robot>'
    )
    with pytest.warns(UnsupportedWarning) as caught:
        model = load_model(path)
    assert [entry.effect for entry in model.unread] == ["large", "small", "small", "none"]
    lines = str(caught[0].message).splitlines()
    assert [line.strip().removeprefix(f"{path}:") for line in lines] == [
        " 4 things are not read (model.unread has the list).",
        "Changes the motion; strict=True refuses it:",
        "line 5: <xacro:macro>: a macro; run xacro first",
        "line 3: <wing>: this element is not known (and 1 more like it)",
        "Does not change the motion:",
        "line 2: <drake:joint_filter>: an element for drake, which MuJoCo does not read either",
    ]
    path.write_text('<robot name="r"><drake:joint_filter/><link name="world"/></robot>')
    with pytest.warns(UnsupportedWarning, match="Does not change the motion"):
        assert not load_model(path, strict=True).unread[0].changes_motion


# Breaks when a long list floods the terminal: 5 lines of each part, of about 140 characters, the
# rest counted, and the file named once however long its name is.
def test_long_list_is_cut(tmp_path):
    folder = tmp_path / ("f" * 100)
    folder.mkdir()
    name = "g" * 200
    body = "".join(f'<geom name="{name}{i}" size="1" adhesion="{i}"/>' for i in range(1, 21))
    with pytest.warns(UnsupportedWarning, match=r"(?s)20 things.*and 15 more\Z") as caught:
        model = load(folder, body, strict=False)
    message = str(caught[0].message)
    assert len(message.splitlines()) == 2 + 5 + 1
    assert max(map(len, message.splitlines()[1:])) <= 145
    assert message.count(str(folder)) == 1
    assert len(model.unread) == 20


WRONG = [
    ('<body>\n<geom size="-1"/></body>', r"model\.xml:5: <geom>: size 0 must be positive"),
    ('<body name="x">\n<inertial mass="-1" pos="0 0 0"/></body>', r':5: <inertial>: mass="-1" is negative'),
    ('<body>\n<joint/>\n</body>', r"model\.xml:4: <body>: mass and inertia of moving.*give it an"),
    ('<body><joint name="x" range="2 1"/><geom size="1"/></body>', r'"x">: range="2 1": the lower limit'),
    ('<body pos="nan 0 0"><geom size="1"/></body>', r':4: <body>: pos="nan 0 0" is not finite'),
    ('<body><geom size="1" friction="-1"/></body>', r':4: <geom>: friction="-1" is negative'),
    ('<body/>\n<pair friction="1 1 -1"/>', r':5: <pair>: friction="1 1 -1" is negative'),
    ('<body><geom siz="1"/></body>', r":4: <geom>: .*siz"),
    ('<body><geom size="1"/>', r"xml:5: malformed XML: mismatched tag; the element open there is <body>"),
    ('<include file="none.xml"/>', r":4: <include>: the file .*none\.xml does not exist"),
    ('<geom type="mesh" mesh="none"/>', r":4: <geom>: .*none"),
    ('<body name="x"/><body name="x"/>', r":4: <body name=\"x\">: repeated name 'x'"),
    ('<body><joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 3"/></body>', "no solid has these"),
]  # fmt: skip


# Breaks when a wrong file is read, or its error does not name file, line and element.
@pytest.mark.parametrize(("text", "message"), WRONG)
def test_wrong_files(tmp_path, text, message):
    with pytest.raises(FileError, match=message):
        load(tmp_path, text)


SLOPPY = {
    "a comment": MODEL.replace("<worldbody>", "<!-- a -- b ---><worldbody>"),
    "latin1": MODEL.replace("<worldbody>", "<!-- caf\xe9 --><worldbody>").encode("latin1"),
    "an encoding": '<?xml version="1.0" encoding="none"?>' + MODEL,
    "blanks": "\n \n<?xml version='1.0'?>\n" + MODEL,
    "text": "A model: " + MODEL,
    "two roots": MODEL + "<scene/>",
    "no blanks": MODEL.replace(' size', 'size'),
    "entities": MODEL.replace("ball", "a & <b"),
}  # fmt: skip


# Breaks when XML that MuJoCo takes is refused, or is taken unsaid, or its elements are misread.
@pytest.mark.parametrize("what", SLOPPY)
def test_sloppy_xml(tmp_path, what):
    path = tmp_path / "model.xml"
    text = SLOPPY[what]
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.warns(UnsupportedWarning, match=r"(?s)Does not change.*line \d+ is malformed XML.*as MuJoCo"):
        model = load_model(path, strict=True)
    assert len(model.unread) == 1
    assert model.geoms[0].material.friction == 0.3
    assert model.geom_names == (("a & <b" if what == "entities" else "ball"),)


# Breaks when a hull without volume is refused or becomes something that a ball falls through.
@pytest.mark.parametrize("height", [1e-9, 1e-7, 1e-5])
def test_flat_hull(tmp_path, height):
    corners = f"0 0 0  1 0 0  0 1 {height}  1 1 0"
    path = tmp_path / "model.xml"
    path.write_text(
        f'<mujoco><asset><mesh name="m" vertex="{corners}" inertia="shell"/></asset><worldbody>'
        '<geom type="mesh" mesh="m"/><body pos="0.5 0.5 0.2"><freejoint/><geom size="0.1"/></body>'
        "</worldbody></mujoco>"
    )
    with warnings.catch_warnings(action="ignore", category=UnsupportedWarning):
        model = load_model(path, strict=True)
    assert all(entry.effect == "none" for entry in model.unread)
    sim = Simulation(model)
    sim.run(1.0)
    assert sim.state.positions[0, 2] == pytest.approx(0.1, abs=2e-4)


# Breaks when a <pair> does not hold where masks and exclusions keep bodies apart: a child lies on its parent.
def test_pairs_touch_anyway(tmp_path):
    slide = '<joint type="slide" axis="0 0 1"'
    body = f"""<body name="a" pos="0 0 1">{slide} name="j"/><geom name="low" size="0.1"/>
    <body name="b" pos="0 0 0.3">{slide}/><geom name="high" size="0.1" {{}}/></body></body>"""
    hold = '<equality><joint joint1="j"/></equality>'
    pair = f'<contact><pair geom1="low" geom2="high"/></contact>{hold}'
    for options in ("", 'contype="0" conaffinity="0"'):
        sim = Simulation(load(tmp_path, body.format(options), tail=pair))
        sim.run(1.0)
        assert sim.state.positions[1, 2] == pytest.approx(1.2, abs=1e-4)
    sim = Simulation(load(tmp_path, body.format(""), tail=hold))
    sim.run(1.0)
    assert sim.state.positions[1, 2] < 0


# Breaks when a reference to something that does not exist does not name the line.
@pytest.mark.parametrize(
    ("tail", "message"),
    [
        ('<contact><exclude body1="b" body2="none"/></contact>', ":8: <exclude>: .*none"),
        ('<actuator><motor name="x" joint="none"/></actuator>', ':8: <motor name="x">: .*none'),
        ('<asset><mesh name="m" file="none.stl"/></asset>', ':8: <mesh name="m">: .*none.stl'),
        (
            '<asset><model name="m" file="none.xml"/></asset>',
            ':8: <model name="m">: .*none.xml does not exist',
        ),
        ('<keyframe><key name="x" qpos="1 2 3 4 5 6 7 8 9"/></keyframe>', ':8: <key name="x">: .*qpos'),
    ],
)
def test_missing_parts(tmp_path, tail, message):
    with pytest.raises(FileError, match=message):
        load(tmp_path, SCENE, tail=tail)


# Breaks when a file that is no model is not told apart, or a flat mesh gives an obscure error.
def test_other_files(tmp_path, monkeypatch):
    with pytest.raises(FileNotFoundError, match="no such file"):
        load_model(tmp_path / "none.xml")
    with pytest.raises(FileError, match="is a directory"):
        load_model(tmp_path)
    (tmp_path / "a.txt").write_text("")
    with pytest.raises(FileError, match="known suffixes are .xml, .mjcf, .urdf"):
        load_model(tmp_path / "a.txt")
    other = tmp_path / "a.xml"
    other.write_text("<svg/>")
    with pytest.raises(FileError, match=r"a\.xml:1: the root is <svg>; it must be <mujoco>"):
        load_model(other)
    other.write_text("")
    with pytest.raises(FileError, match=r"a\.xml:1: malformed XML: no element found"):
        load_model(other)
    other.write_text('<mujoco><worldbody><include file="a.xml"/></worldbody></mujoco>')
    with pytest.raises(FileError, match="includes itself"):
        load_model(other)
    other.write_text("<mujoco/>")
    with pytest.raises(InputError, match="floating_base is for URDF"):
        load_model(other, floating_base=True)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InputError, match=r"pip install amontons\[models\]"):
        load_model(other)


# Breaks when what MuJoCo has no name for, as of some damaged files, is not told as a fault of the file.
def test_what_mujoco_cannot_name(tmp_path, monkeypatch):
    def fail(_path):
        raise RuntimeError("Caught an unknown exception!")

    path = tmp_path / "m.xml"
    path.write_text("<mujoco><worldbody/></mujoco>")
    monkeypatch.setattr(mujoco.MjSpec, "from_file", staticmethod(fail))
    with pytest.raises(FileError, match="unknown exception"):
        load_model(path)
