"""What a model file lacks or has too much of does not refuse it; a file of another kind says what to do."""

import pytest
from amontons import FileError, ModelWarning, Simulation
from amontons.io.models import load_model
from problems import silent

mujoco = pytest.importorskip("mujoco")

KINDS = {
    "robot.step": "export it as a mesh",
    "robot.stp": "export it as a mesh",
}


# Breaks when a file of a known other kind does not say what to do with it.
@pytest.mark.parametrize("name", KINDS)
def test_other_kinds_say_what_to_do(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"anything")
    with pytest.raises(FileError, match=rf"{name}: .*{KINDS[name]}.*known suffixes are .xml, .mjcf, .urdf"):
        load_model(path)


# Breaks when bytes of zero after the root refuse a file that MuJoCo reads, or such bytes within it are read.
@pytest.mark.parametrize("tail", [b"\0", b"\n\0\0\n"])
def test_zero_bytes_at_the_end(tmp_path, tail):
    path = tmp_path / "padded.xml"
    text = b'<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>'
    path.write_bytes(text + tail)
    assert mujoco.MjModel.from_xml_path(str(path)).nbody == 2
    assert len(load_model(path).bodies) == 1
    path.write_bytes(text.replace(b"<body>", b"<body>\0"))
    with pytest.raises(FileError, match="bytes of zero"):
        load_model(path)


# Breaks when a texture that is missing, which nothing here looks at, refuses a model or is warned about.
def test_missing_textures(tmp_path):
    sides = " ".join(f'file{side}="{side}.png"' for side in ("right", "left", "up", "down", "front", "back"))
    path = tmp_path / "model.xml"
    path.write_text(
        f"""<mujoco><asset><texture name="flat" type="2d" file="none.png"/>
        <texture name="cube" type="cube" {sides}/><texture type="skybox" file="sky.png"/>
        <material name="a" texture="flat"/><material name="b" texture="cube"/></asset>
        <worldbody><geom type="plane" size="1 1 1" material="a"/>
        <body><freejoint/><geom size="1" material="b"/></body></worldbody></mujoco>"""
    )
    with pytest.raises(ValueError, match="none.png"):
        mujoco.MjModel.from_xml_path(str(path))
    model = silent(load_model, path)
    assert len(model.geoms) == 2
    assert model.unread == ()


# Breaks when the keyframe of a model without bodies cannot be applied.
def test_keyframe_without_bodies(tmp_path):
    path = tmp_path / "scenery.xml"
    path.write_text(
        '<mujoco><worldbody><geom size="1"/></worldbody>'
        '<keyframe><key name="k" time="2"/></keyframe></mujoco>'
    )
    with pytest.warns(ModelWarning, match="no bodies"):
        sim = Simulation(load_model(path))
    sim.apply_keyframe("k")
    sim.reset("k")
    assert sim.time == 2


# Breaks when loading does not say which links have the mass of their shapes, or says it of links with
# <inertial>, without mass, or of a base that does not move. A box of 0.1 x 0.2 x 0.3 m has 6 kg, others 1 kg.
def test_mass_of_shapes_is_said(tmp_path):
    path = tmp_path / "robot.urdf"
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    box = '<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'
    path.write_text(
        f"""<robot name="r"><link name="base"><inertial><mass value="1"/>{inertia}</inertial>{box}</link>
        <link name="leg">{box}</link><link name="frame"/>
        <link name="foot"><inertial><mass value="1"/>{inertia}</inertial></link>
        <joint name="a" type="continuous"><parent link="base"/><child link="leg"/></joint>
        <joint name="b" type="fixed"><parent link="leg"/><child link="frame"/></joint>
        <joint name="c" type="continuous"><parent link="leg"/><child link="foot"/></joint></robot>"""
    )
    said = r'without <inertial> have the mass of their shapes at 1000 kg/m\^3, 6 kg of 8 kg: "leg" 6 kg$'
    with pytest.warns(ModelWarning, match=said):
        model = load_model(path)
    assert model.total_mass == pytest.approx(8)
    path.write_text(
        f'<robot name="r"><link name="world"/><link name="wall">{box}</link><joint name="a" '
        'type="fixed"><parent link="world"/><child link="wall"/></joint></robot>'
    )
    assert silent(load_model, path).bodies[0].motion == "static"
