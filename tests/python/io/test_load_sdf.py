# ruff: noqa: E501  (lines of files as their authors write them)
"""SDF: frames, joints, loops, includes, surfaces, and what is listed. Files as Gazebo's users write them."""

import math
import re

import amontons
import numpy as np
import pytest
from amontons import FileError, Limits, UnsupportedWarning, load_model, shapes
from problems import silent

INERTIA = "<inertia><ixx>{0}</ixx><iyy>{0}</iyy><izz>{0}</izz></inertia>"


def inertial(mass=1.0, moment=0.1, pose="0 0 0 0 0 0"):
    return f"<inertial><pose>{pose}</pose><mass>{mass}</mass>{INERTIA.format(moment)}</inertial>"


def written(folder, content, version="1.9", name="model.sdf"):
    path = folder / name
    path.write_text(f'<?xml version="1.0"?>\n<sdf version="{version}">\n{content}\n</sdf>')
    return path


def place(model, name):
    return np.array(model.bodies[model.body_index(name)].pose.position)


# Breaks when a pose in a named frame, degrees, a quaternion, or a nested model with a placement frame lands
# elsewhere. The model stands at (0, 0, 1), turned by 90 degrees about z: its x axis is y of the world.
def test_frames(tmp_path):
    path = written(
        tmp_path,
        f"""<model name="m"><pose degrees="true">0 0 1 0 0 90</pose>
        <frame name="f" attached_to="a"><pose>1 0 0 0 0 0</pose></frame>
        <link name="a"><pose>1 0 0 0 0 0</pose>{inertial()}</link>
        <link name="b"><pose relative_to="f" rotation_format="quat_xyzw">0 2 0 0 0 0 1</pose>{inertial()}</link>
        <link name="c"><pose relative_to="j"/>{inertial()}</link>
        <joint name="j" type="fixed"><pose relative_to="b">0 0 3 0 0 0</pose><parent>a</parent><child>c</child></joint>
        <model name="n" placement_frame="d"><pose relative_to="c">0 0 1 0 0 0</pose>
          <link name="d"><pose>5 5 5 0 0 0</pose>{inertial()}</link></model>
        </model>""",
    )
    model = silent(load_model, path)
    assert model.body_names == ("a", "b", "c", "n::d")
    expected = {"a": (0, 1, 1), "b": (-2, 2, 1), "c": (-2, 2, 4), "n::d": (-2, 2, 5)}
    for name, position in expected.items():
        np.testing.assert_allclose(place(model, name), position, atol=1e-12)


# Breaks when the axis of a joint is taken in the wrong frame: that of the joint, which is turned by 90 degrees
# about z with its child; that of the model up to 1.4 or by the switch; or a named one.
@pytest.mark.parametrize(
    ("version", "axis", "expected"),
    [
        ("1.6", "<xyz>1 0 0</xyz>", (0, 1, 0)),
        ("1.4", "<xyz>1 0 0</xyz>", (1, 0, 0)),
        ("1.6", "<xyz>1 0 0</xyz><use_parent_model_frame>1</use_parent_model_frame>", (1, 0, 0)),
        ("1.9", '<xyz expressed_in="__model__">1 0 0</xyz>', (1, 0, 0)),
    ],
)
def test_axis_frames(tmp_path, version, axis, expected):
    path = written(
        tmp_path,
        f"""<model name="m"><link name="a">{inertial()}</link>
        <link name="b"><pose>0 0 0 0 0 {math.pi / 2}</pose>{inertial()}</link>
        <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis>{axis}</axis></joint></model>""",
        version,
    )
    model = silent(load_model, path)
    joint = model.joints[0]
    turned = model.bodies[0].pose @ joint.frame_b
    np.testing.assert_allclose(np.array(turned(joint.dofs[0].axis)) - turned.position, expected, atol=1e-12)


BAR = """<link name="{0}"><pose relative_to="{1}"/><inertial><pose>{2}</pose><mass>1</mass>
  <inertia><ixx>.08</ixx><iyy>.08</iyy><izz>.08</izz></inertia></inertial></link>"""
HINGE = """<joint name="{0}" type="revolute"><pose relative_to="{1}">{2}</pose><parent>{1}</parent>
  <child>{3}</child><axis><xyz>0 1 0</xyz></axis></joint>"""


# Breaks when a joint that closes a loop is lost, or opens: a parallelogram of bars of 1 m, whose coupler only
# translates. Its cranks then turn as a pendulum; the joint of the loop keeps the coupler level.
def test_loop(tmp_path):
    path = written(
        tmp_path,
        f"""<world name="w"><gravity>0 0 -9.81</gravity><model name="fourbar">
        <link name="base">{inertial()}</link>
        <joint name="fix" type="fixed"><parent>world</parent><child>base</child></joint>
        {BAR.format("crank", "j1", "0.5 0 0 0 0 0")}{BAR.format("coupler", "j2", "1 0 0 0 0 0")}
        {BAR.format("rocker", "j3", "0.5 0 0 0 0 0")}
        {HINGE.format("j1", "base", "0 0 0 0 0 0", "crank")}{HINGE.format("j2", "crank", "1 0 0 0 0 0", "coupler")}
        {HINGE.format("j3", "base", "2 0 0 0 0 0", "rocker")}
        {HINGE.format("j4", "rocker", "1 0 0 0 0 0", "coupler")}</model></world>""",
    )
    model = silent(load_model, path)
    assert model.joint_names == ("fix", "j1", "j2", "j3", "j4")
    simulation = amontons.Simulation(model, dt=1e-3)
    simulation.run(0.3)
    crank, coupler = simulation.kinematics.coordinate("j1"), simulation.kinematics.coordinate("j2")
    assert crank > 0.3  # it falls: the angle about +y grows
    assert coupler == pytest.approx(-crank, abs=1e-8)
    # Energy: I = 2 (0.08 + 0.25) + 1 about the pivots, weight 2 (1 kg at 0.5 m) + 1 kg at 1 m. First order in dt.
    rate = simulation.state.angular_velocities[model.body_index("crank")][1]
    assert 0.5 * 1.66 * rate**2 == pytest.approx(9.81 * 2 * math.sin(crank), rel=0.02)


# Breaks when limits, damping, friction, a spring, effort or a mimic are lost, or 1e16 becomes a bound.
def test_axis_values(tmp_path):
    path = written(
        tmp_path,
        f"""<model name="m"><link name="a">{inertial()}</link><link name="b">{inertial()}</link>
        <link name="c">{inertial()}</link>
        <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz>
          <limit><lower>-1</lower><upper>1e16</upper><effort>5</effort><velocity>2</velocity></limit>
          <dynamics><damping>0.1</damping><friction>0.2</friction><spring_stiffness>3</spring_stiffness>
          <spring_reference>0.4</spring_reference></dynamics></axis></joint>
        <joint name="k" type="prismatic"><parent>a</parent><child>c</child><axis><xyz>0 0 1</xyz>
          <limit><lower>-1</lower><upper>2</upper><effort>-1</effort></limit>
          <mimic joint="j" axis="axis"><multiplier>2</multiplier><offset>1</offset><reference>0.25</reference></mimic>
        </axis></joint></model>""",
        "1.11",
    )
    model = silent(load_model, path)
    dof, slide = model.joints[0].dofs[0], model.joints[1].dofs[0]
    assert (dof.lower, dof.upper, dof.motor.max_effort) == (-1, math.inf, 5)
    assert (dof.damping, dof.friction, dof.stiffness, dof.rest) == (0.1, 0.2, 3, 0.4)
    assert (slide.lower, slide.upper, slide.motor.max_effort) == (-1, 2, math.inf)
    (coupling,) = model.couplings
    assert coupling.coefficients == (0.5, 2)


# Breaks when a screw moves the wrong way or by another lead: 0.01 m a turn, right-handed, in both notations.
@pytest.mark.parametrize("pitch", ["screw_thread_pitch>0.01", f"thread_pitch>{-2 * math.pi / 0.01}"])
def test_screw(tmp_path, pitch):
    path = written(
        tmp_path,
        f"""<model name="m"><link name="a">{inertial()}</link><joint name="w" type="fixed"><parent>world</parent>
        <child>a</child></joint><link name="b">{inertial()}</link><joint name="j" type="screw"><parent>a</parent>
        <child>b</child><axis><xyz>0 0 1</xyz></axis><{pitch}</{pitch.split(">")[0]}></joint></model>""",
        "1.10",
    )
    (coupling,) = silent(load_model, path).couplings
    np.testing.assert_allclose(coupling.coefficients, (0, 0.01 / (2 * math.pi)))


# Breaks when a model by model://, with the newest file of its model.config, by name, place and static, or one
# that is merged, is not found; or when a file that includes itself does not end.
def test_includes(tmp_path, monkeypatch):
    folder = tmp_path / "models" / "crate"
    folder.mkdir(parents=True)
    (folder / "model.config").write_text(
        '<model><sdf version="1.4">old.sdf</sdf><sdf version="1.10">new.sdf</sdf></model>'
    )
    part = f"""<model name="crate"><link name="l"><pose>0 0 1 0 0 0</pose>{inertial(3)}<collision name="c">
      <geometry><box><size>1 2 3</size></box></geometry></collision></link></model>"""
    written(folder, part, name="new.sdf")
    path = written(
        tmp_path,
        f"""<world name="w"><include><uri>model://crate</uri><name>one</name><pose>1 0 0 0 0 0</pose></include>
        <include><uri>model://crate</uri><name>two</name><static>true</static></include>
        <model name="m"><link name="own">{inertial()}</link>
        <include merge="true"><uri>model://crate</uri><pose relative_to="own">0 5 0 0 0 0</pose></include>
        <joint name="j" type="fixed"><parent>own</parent><child>l</child></joint></model></world>""",
    )
    monkeypatch.setenv("GZ_SIM_RESOURCE_PATH", str(tmp_path / "models"))
    model = silent(load_model, path)
    assert model.body_names == ("one::l", "two::l", "m::own", "m::l")
    assert [body.motion for body in model.bodies] == ["dynamic", "static", "dynamic", "dynamic"]
    np.testing.assert_allclose([place(model, n) for n in ("one::l", "m::l")], [(1, 0, 1), (0, 5, 1)])
    other = tmp_path / "other"
    other.mkdir()
    with pytest.raises(FileError, match="confines"):
        load_model(path, limits=Limits(folder=other))
    lost = written(
        tmp_path, '<world name="w">\n<include><uri>model://none</uri></include></world>', name="b.sdf"
    )
    with pytest.raises(FileError, match=r"b.sdf:4: <include>.*GZ_SIM_RESOURCE_PATH"):
        load_model(lost)
    written(folder, '<model name="x"><include><uri>model://crate</uri></include></model>', name="new.sdf")
    with pytest.raises(FileError, match="includes itself"):
        load_model(path)


# Breaks when a surface has another friction, rebound, torsion or bits, or the friction of two is not the lesser.
def test_surfaces(tmp_path):
    path = written(
        tmp_path,
        f"""<model name="m"><link name="a">{inertial()}<collision name="c"><pose>0 0 0 0 0 {math.pi / 2}</pose>
        <geometry><sphere><radius>1</radius></sphere></geometry><surface><friction><ode><mu>0.8</mu><mu2>0.2</mu2>
        <fdir1>1 0 0</fdir1></ode><torsional><coefficient>0.5</coefficient><patch_radius>0.1</patch_radius>
        </torsional></friction><bounce><restitution_coefficient>0.3</restitution_coefficient></bounce>
        <contact><collide_bitmask>0x2</collide_bitmask><ode><kp>1000</kp><kd>10</kd></ode></contact></surface>
        </collision><collision name="d"><geometry><capsule><radius>1</radius><length>2</length></capsule></geometry>
        </collision></link></model>""",
    )
    model = silent(load_model, path)
    material, geom = model.geoms[0].material, model.geoms[0]
    assert (material.friction, material.friction_across, material.restitution) == (0.8, 0.2, 0.3)
    assert material.torsional_friction == pytest.approx(3 * math.pi / 16 * 0.1 * 0.5)
    assert (material.compliance, material.relaxation_time) == (1e-3, 1e-2)
    np.testing.assert_allclose(geom.friction_direction, (0, 1, 0), atol=1e-12)
    assert (geom.category, geom.mask) == (2, 2)
    assert (model.geoms[1].material.friction, model.friction_rule) == (1.0, "minimum")
    assert model.geoms[1].shape == shapes.Capsule(1.0, 1.0)


# Breaks when the mass of an inertial with a pose, of shapes (auto) or the default of 1 kg is another one, or
# the last is not told.
def test_mass(tmp_path):
    box = "<collision name='c'><geometry><box><size>1 2 3</size></box></geometry></collision>"
    path = written(
        tmp_path,
        f"""<model name="m"><link name="a"><inertial><pose>1 0 0 0 0 {math.pi / 2}</pose><mass>2</mass><inertia>
        <ixx>1</ixx><iyy>2</iyy><izz>2.5</izz></inertia></inertial></link>
        <link name="b"><inertial auto="true"><density>100</density></inertial>{box}</link>
        <link name="c">{box}</link></model>""",
        "1.11",
    )
    with pytest.warns(amontons.ModelWarning, match=r'mass of 1 kg .*: "c"$'):
        model = load_model(path)
    a, b, c = model.bodies
    assert (a.mass, a.centre_of_mass, b.mass, c.mass) == (2, (1, 0, 0), pytest.approx(600), 1)
    np.testing.assert_allclose(np.diag(a.inertia), (2, 1, 2.5))


# Breaks when an element that is not read is lost without a word, or a plugin counts as a part of the motion.
def test_listed(tmp_path):
    path = written(
        tmp_path,
        f"""<model name="m"><plugin name="p" filename="f"/><link name="a">{inertial()}
        <velocity_decay/></link>
        <link name="b">{inertial()}</link><joint name="j" type="magic"><parent>a</parent><child>b</child></joint>
        </model>""",
    )
    with pytest.warns(UnsupportedWarning, match="magic"):
        model = load_model(path)
    assert {(e.element, e.effect) for e in model.unread} == {
        ('<joint name="j">', "large"),
        ("<velocity_decay>", "small"),
        ('<plugin name="p">', "none"),
    }
    with pytest.raises(amontons.InputError, match="magic"):
        load_model(path, strict=True)


# Breaks when a file that cannot be right is read, or its error has no line.
@pytest.mark.parametrize(
    ("content", "line", "message"),
    [
        ('<model name="m">\n<link name="a"><pose>1 2</pose></link></model>', 4, "6 numbers"),
        ('<model name="m">\n<link name="a"><pose>1 2 x 0 0 0</pose></link></model>', 4, "no number"),
        ('<model name="m"><link name="a"/>\n<link name="a"/></model>', 4, "the name of another"),
        (
            '<model name="m"><link name="a"><pose relative_to="f"/></link>\n'
            '<frame name="f"><pose relative_to="a"/></frame></model>',
            4,
            "relative to each other",
        ),
        (
            '<model name="m"><link name="a"/>\n<joint name="j" type="fixed"><parent>a</parent><child>b</child>'
            "</joint></model>",
            4,
            'no frame "b"|no link or frame "b"',
        ),
        (
            '<model name="m">\n<link name="a"><inertial><mass>-1</mass></inertial></link></model>',
            4,
            "mass is -1",
        ),
        ('<model name="m"><link name="a">\n</model>', 4, "malformed"),
        (
            '<model name="m"><link name="a">\n<inertial><mass>nan</mass></inertial></link></model>',
            4,
            "no number|numbers",
        ),
    ],
)
def test_damaged(tmp_path, content, line, message):
    path = written(tmp_path, content)
    with pytest.raises(FileError, match=rf"model\.sdf:({line}|{line - 1}): ") as caught:
        load_model(path)
    assert re.search(message, str(caught.value)), caught.value


# Breaks when links of a model touch each other although self_collide is off, or do not where it is on.
@pytest.mark.parametrize("on", [False, True])
def test_self_collide(tmp_path, on):
    ball = "<collision name='c'><geometry><sphere><radius>1</radius></sphere></geometry></collision>"
    path = written(
        tmp_path,
        f"""<model name="m"><self_collide>{str(on).lower()}</self_collide><link name="a">{inertial()}{ball}</link>
        <link name="b">{inertial()}{ball}</link></model>""",
    )
    assert len(silent(load_model, path).excluded_bodies) == (0 if on else 1)


# Breaks when a mesh on a static link loses its dents, or a hull on a link that moves does not say what it adds:
# an L of two boxes, 1 x 1 x 1 m and 1 x 1 x 2 m, whose hull has half a cubic metre more.
def test_meshes(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    outline = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], dtype=float)
    faces = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    low, high = (np.column_stack((outline, np.full(6, z))) for z in (0.0, 1.0))
    sides = [t for k in range(6) for t in ((k, (k + 1) % 6, k + 6), ((k + 1) % 6, (k + 1) % 6 + 6, k + 6))]
    triangles = [(a, c, b) for a, b, c in faces] + [(a + 6, b + 6, c + 6) for a, b, c in faces] + sides
    mesh = trimesh.Trimesh(np.vstack((low, high)), triangles, process=False)
    mesh.export(tmp_path / "ell.stl")
    link = f"""<model name="{{0}}"><static>{{1}}</static><link name="l">{inertial()}<collision name="c"><geometry>
      <mesh><uri>ell.stl</uri><scale>0.1 0.1 0.1</scale></mesh></geometry></collision></link></model>"""
    path = written(tmp_path, f'<world name="w">{link.format("a", 1)}{link.format("b", 0)}</world>')
    with pytest.warns(UnsupportedWarning, match=r"adds 500 cm\^3 to 3000 cm\^3"):
        model = load_model(path)
    still, moving = (geom.shape for geom in model.geoms)
    assert isinstance(still, shapes.Mesh)
    assert isinstance(moving, shapes.Hull)
    assert still.volume() == pytest.approx(3e-3)
