"""URDF files: links stay links, the base floats, meshes are found, mistakes are named with their line."""

import math
import shutil
import struct
import warnings

import amontons
import numpy as np
import pytest
from amontons import FileError, InputError, Material, ModelWarning, UnsupportedWarning, shapes
from amontons.io.models import load_model
from amontons.model.mass import MassProperties
from amontons.model.transforms import axis_angle, multiply, rotate, rotation_matrix

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.filterwarnings("ignore:.*the base link")


@pytest.fixture(scope="module")
def rover(root):
    return root / "tests" / "python" / "io" / "models" / "rover.urdf"


INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def write(tmp_path, *lines, name="model.urdf"):
    path = tmp_path / name
    path.write_text("\n".join(['<robot name="r">', *lines, "</robot>"]))
    return path


def link(name, inertial=INERTIAL, more=""):
    return f'<link name="{name}">{inertial}{more}</link>'


def joint(name, kind, parent, child, more=""):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{more}</joint>'
    )


# Breaks when the name of a fixed link is lost, the base is welded to the world, or a mass or centre is moved.
def test_links_stay_links(rover):
    model = load_model(rover)
    assert model.body_names == ("chassis", "wheel_left", "wheel_right", "lift")
    assert model.joint_names == ("left", "right", "lift_joint")
    assert [(link.name, link.joint, link.carrier) for link in model.links] == [
        ("mast", "mast_joint", -1),
        ("camera_frame", "camera_joint", 0),
    ]
    assert all(body.motion == "dynamic" for body in model.bodies)
    assert [body.mass for body in model.bodies] == [12.5, 1, 1, 0.7]
    assert [link.mass for link in model.links] == [0.5, 0]
    mast = model.links[0]
    alone = MassProperties(mast.mass, mast.centre_of_mass, mast.inertia).moved(mast.frame)
    whole = model.bodies[0]
    chassis = MassProperties(whole.mass, whole.centre_of_mass, whole.inertia) + alone.scaled(-1)
    assert chassis.centre_of_mass == pytest.approx((0.02, 0, 0.01))
    turn = np.array(rotation_matrix(axis_angle((0, 0, 1), 0.3)))
    inertia = np.array([[0.4, 0.01, 0.02], [0.01, 0.6, 0], [0.02, 0, 0.8]])
    np.testing.assert_allclose(chassis.inertia, turn @ inertia @ turn.T, rtol=1e-12)


# Breaks when the origin of a joint or of a collision is not applied, or in another order.
def test_frames_follow_the_origins(rover):
    model = load_model(rover)
    poses = dict(zip(model.body_names, (b.pose for b in model.bodies), strict=True))
    poses |= {link.name: model.bodies[link.body].pose @ link.frame for link in model.links}
    tilt = axis_angle((1, 0, 0), 0.1)
    mast = np.array([-0.2, 0, 0.2])
    np.testing.assert_allclose(poses["wheel_left"].position, (0, 0.3, -0.05), atol=1e-15)
    np.testing.assert_allclose(poses["wheel_right"].rotation, axis_angle((0, 0, 1), 0.1), atol=1e-15)
    np.testing.assert_allclose(poses["mast"].rotation, tilt, atol=1e-15)
    np.testing.assert_allclose(poses["lift"].position, mast + rotate(tilt, (0, 0, 0.15)), atol=1e-15)
    left = model.joints[model.joint_index("left")]
    assert (left.dofs[0].axis, left.dofs[0].damping, left.dofs[0].friction) == ((0, 1, 0), 0.2, 0.1)
    assert (left.dofs[0].lower, left.dofs[0].upper) == (-math.inf, math.inf)
    lift = model.joints[model.joint_index("lift_joint")]
    assert (lift.dofs[0].kind, lift.dofs[0].lower, lift.dofs[0].upper) == ("slide", -0.1, 0.2)
    assert lift.dofs[0].motor.max_effort == 30
    assert model.links[lift.link_b].name == "camera_frame"
    wheel = next(g for g in model.geoms if model.bodies[g.body].name == "wheel_left")
    assert wheel.shape == shapes.Cylinder(0.1, 0.02)
    np.testing.assert_allclose(rotate(wheel.frame.rotation, (0, 0, 1)), (0, -1, 0), atol=1e-15)
    (coupling,) = model.couplings
    assert coupling.coefficients == (0.5, 2.0)
    assert model.joints[coupling.joint_a].name == "right"


# Breaks when the loaded base does not fall freely: v = g t, exactly in each step.
def test_base_falls(rover):
    sim = amontons.Simulation(load_model(rover), dt=1e-3)
    sim.run(0.1)
    linear, _ = sim.forces.momentum()
    assert linear == pytest.approx((0, 0, -9.81 * 0.1 * sim.model.total_mass), abs=1e-9)


# Breaks when the rule of the base changes: free with a mass, its own or one that is fixed to it, fixed if
# called world or without any.
def test_floating_base(tmp_path):
    arm = [link("arm"), joint("j", "continuous", "base", "arm")]
    free = load_model(write(tmp_path, link("base"), *arm))
    assert free.joint_names == ("j",)
    assert free.bodies[0].motion == "dynamic"
    held = load_model(write(tmp_path, link("base"), *arm), floating_base=False)
    assert held.bodies[0].motion == "static"
    massless = write(tmp_path, link("base", ""), link("trunk"), joint("f", "fixed", "base", "trunk"))
    assert [b.motion for b in load_model(massless, floating_base=False).bodies] == ["static", "static"]
    with pytest.warns(ModelWarning, match='"base" has no <inertial> and moves freely.*floating_base=False'):
        floating = load_model(massless)
    assert [(b.name, b.motion, b.mass) for b in floating.bodies] == [("base", "dynamic", 2.0)]
    nothing = write(tmp_path, link("base", ""), link("arm"), joint("j", "continuous", "base", "arm"))
    assert [b.motion for b in load_model(nothing).bodies] == ["static", "dynamic"]
    anchored = INERTIAL.replace('value="2"', 'value="0"')  # as Bullet fixes a base
    held = write(tmp_path, link("base", anchored), link("trunk"), joint("f", "fixed", "base", "trunk"))
    assert [b.motion for b in load_model(held).bodies] == ["static", "static"]
    world = [link("world", ""), link("base"), joint("f", "fixed", "world", "base", '<origin xyz="0 0 1"/>')]
    model = load_model(write(tmp_path, *world, link("arm"), joint("j", "continuous", "base", "arm")))
    assert [b.motion for b in model.bodies] == ["static", "dynamic"]
    assert model.bodies[0].pose.position == (0, 0, 1)
    drone = write(tmp_path, link("world", ""), link("drone"), joint("f", "floating", "world", "drone"))
    assert load_model(drone).bodies[0].motion == "dynamic"


# Breaks when loading does not say what became of the base, or says it where the user or the file has decided.
def test_base_is_said(tmp_path):
    path = write(tmp_path, link("base"))
    with pytest.warns(ModelWarning, match='"base" moves freely; floating_base=False fixes it') as caught:
        load_model(path)
    assert [w.category for w in caught] == [ModelWarning]
    with warnings.catch_warnings(action="error"):
        load_model(path, floating_base=True)
        load_model(write(tmp_path, link("world", "")))
    with pytest.warns(ModelWarning, match='"base" is fixed; floating_base=True frees it'):
        load_model(write(tmp_path, link("base", "")))


# Breaks when a joint type of URDF gets other freedoms: planar moves in the plane across its axis.
def test_planar_joint(tmp_path):
    model = load_model(
        write(
            tmp_path, link("world", ""), link("p"), joint("j", "planar", "world", "p", '<axis xyz="0 0 1"/>')
        )
    )
    dofs = model.joints[0].dofs
    assert [d.kind for d in dofs].count("slide") == 2
    for dof in dofs:
        along = abs(np.dot(dof.axis, (0, 0, 1)))
        assert along == pytest.approx(1.0 if dof.kind == "hinge" else 0.0, abs=1e-12)


# Breaks when a robot in an .xml file is taken for MJCF.
def test_robot_in_xml(tmp_path):
    assert load_model(write(tmp_path, link("base"), name="robot.xml")).body_names == ("base",)


MESH = '<collision><geometry><mesh filename="{}" scale="0.1 0.1 0.2"/></geometry></collision>'


# Breaks when a mesh is not found where URDF files keep it.
@pytest.mark.parametrize(
    "filename",
    [
        "package://robot_description/meshes/visual/wedge.obj",
        "model://robot_description/meshes/visual/wedge.obj",
        "package://elsewhere/wedge.obj",
        "package://installed/wedge.obj",
        "../meshes/visual/wedge.obj",
        "file://{folder}/robot_description/meshes/visual/wedge.obj",
        "{folder}/robot_description/meshes/visual/wedge.obj",
        "wedge.obj",
    ],
)
def test_meshes_are_found(tmp_path, root, filename, monkeypatch):
    package = tmp_path / "robot_description"
    installed = tmp_path / "ament" / "share" / "installed"
    for folder in (
        package / "meshes" / "visual",
        tmp_path / "ros" / "elsewhere",
        installed,
        package / "urdf",
    ):
        folder.mkdir(parents=True)
        if filename == "wedge.obj" or folder.name != "urdf":
            shutil.copy(root / "tests/python/io/models/meshes/wedge.obj", folder)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ros"))
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "ament"))
    path = write(
        package / "urdf", link("base", more=MESH.format(filename.format(folder=tmp_path))), name="r.urdf"
    )
    (geom,) = load_model(path).geoms
    corners = np.array([geom.frame(v) for v in geom.shape.vertices])
    assert corners.max(axis=0) == pytest.approx((0.1, 0.1, 0.1), abs=1e-6)  # meshes are float32
    assert corners.min(axis=0) == pytest.approx((-0.1, -0.1, -0.1), abs=1e-6)


# Breaks when an STL file in text is refused, as MuJoCo does, or scaled otherwise than a binary one, or when a
# binary one that begins like text is taken for it.
@pytest.mark.parametrize("text", [True, False])
def test_stl(tmp_path, text):
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    triangles = [[corners[i] for i in face] for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))]
    if text:
        lines = [
            "facet normal 0 0 0\nouter loop\n"
            + "".join(f"vertex {x} {y} {z:e}\n" for x, y, z in triangle)
            + "endloop\nendfacet\n"
            for triangle in triangles
        ]
        (tmp_path / "a.STL").write_text(f"solid a\n{''.join(lines)}endsolid a\n")
    else:
        parts = [struct.pack("<12fH", 0, 0, 0, *np.ravel(triangle), 0) for triangle in triangles]
        (tmp_path / "a.STL").write_bytes(b"solid".ljust(80) + struct.pack("<I", 4) + b"".join(parts))
    (geom,) = load_model(write(tmp_path, link("base", more=MESH.format("a.STL")))).geoms
    found = np.array([geom.frame(v) for v in geom.shape.vertices])
    assert sorted(map(tuple, np.round(found, 6) + 0.0)) == [(0, 0, 0), (0, 0, 0.2), (0, 0.1, 0), (0.1, 0, 0)]


# Breaks when <compiler meshdir> of the MuJoCo extension is not obeyed.
def test_meshdir(tmp_path, root):
    (tmp_path / "stl").mkdir()
    shutil.copy(root / "tests/python/io/models/meshes/wedge.obj", tmp_path / "stl")
    head = '<mujoco><compiler meshdir="stl" discardvisual="false"/></mujoco>'
    path = write(tmp_path, head, link("base", more=MESH.format("package://gone/wedge.obj")))
    assert len(load_model(path).geoms) == 1


WRONG = [
    (
        [link("base", more=MESH.format("package://p/none.stl"))],
        r':2: <mesh>: the file ".*none.stl" does not exist',
    ),
    ([link("base", '<inertial><mass value="-2"/></inertial>')], r':2: <mass>: value="-2" is negative'),
    (
        [link("base"), joint("j", "revolute", "base", "none")],
        r':3: <joint name="j">: there is no link "none"',
    ),
    ([link("base"), link("a"), joint("j", "bogus", "base", "a")], r':4: <joint name="j">: .*type'),
    ([link("base"), link("a", ""), joint("j", "continuous", "base", "a")], r':3: <link name="a">: .*mass'),
    ([link("base"), joint("j", "fixed", "base", "base")], "base -> base; one link must have"),
    (["<link>"], r":3: malformed XML: mismatched tag; the element open there is <link>"),
]


# Breaks when a wrong file is read, or its error does not name file, line and element.
@pytest.mark.parametrize(("lines", "message"), WRONG)
def test_wrong_files(tmp_path, lines, message):
    with pytest.raises(FileError, match=message):
        load_model(write(tmp_path, *lines))


# Breaks when a mesh of a kind that cannot be read gives an obscure error, or is left out unsaid.
@pytest.mark.parametrize("name", ["a.dae", "a.fbx"])
def test_mesh_of_no_kind(tmp_path, name):
    (tmp_path / name).write_text("")
    path = write(tmp_path, link("base", more=MESH.format(name)))
    with pytest.raises(InputError, match=rf":2: <mesh>: {name} is no \.stl, \.obj, \.msh file; convert it"):
        load_model(path, strict=True)
    with pytest.warns(UnsupportedWarning, match="convert it"):
        model = load_model(path)
    assert (model.geom_names, model.unread[0].effect) == ((), "large")


COLLADA = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema">
<asset><unit name="centimetre" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="f" count="12">0 0 0 10 0 0 0 20 0 0 0 30</float_array>
<technique_common><accessor source="#f" count="4" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices></mesh></geometry></library_geometries>
<library_nodes><node id="n"><scale>2 1 1</scale><instance_geometry url="#g"/>{}</node></library_nodes>
<library_visual_scenes><visual_scene id="s">
<node><translate>100 0 0</translate><rotate>0 0 1 90</rotate><instance_node url="#n"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


# Breaks when nodes, units or the scale of a Collada file move its points otherwise (worked out by hand), or
# when nodes that name themselves have no end.
def test_collada(tmp_path):
    (tmp_path / "a.dae").write_text(COLLADA.format(""))
    path = write(tmp_path, link("base", more=MESH.format("a.dae")))
    (geom,) = load_model(path, strict=True).geoms
    # 20, 20 and 30 cm along x, y and z from 1 m on, turned about z, then times (0.1, 0.1, 0.2).
    points = np.array([geom.frame(v) for v in geom.shape.vertices])
    expected = np.array([(1, 0, 0), (1, 0.2, 0), (0.8, 0, 0), (1, 0, 0.3)]) * (0.1, 0.1, 0.2)
    order = [sorted(map(tuple, np.round(part, 6) + 0.0)) for part in (points, expected)]
    np.testing.assert_allclose(*order, atol=1e-6)
    (tmp_path / "a.dae").write_text(COLLADA.format('<instance_node url="#n"/>'))
    with pytest.raises(InputError, match="convert it"):
        load_model(path, strict=True)


# Breaks when inertias of no solid are taken, or stop at the first. Their mean keeps the trace.
def test_impossible_inertias(tmp_path):
    thin = INERTIAL.replace('izz="1"', 'izz="2.5"')
    frame = '<inertial><mass value="0"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'
    path = write(
        tmp_path, link("base"), link("a", thin), link("b", INERTIAL.replace('ixx="1"', 'ixx="0"')),
        link("frame", frame), joint("j", "continuous", "base", "a"), joint("k", "continuous", "base", "b"),
        joint("f", "fixed", "a", "frame"),
    )  # fmt: skip
    with pytest.raises(
        InputError, match='2 things.*\n.*:3: <link name="a">.*1, 1, 2.5.*\n.*:4: <link name="b">'
    ):
        load_model(path, strict=True)
    with pytest.warns(UnsupportedWarning, match="Their mean is taken"):
        model = load_model(path)
    assert model.bodies[1].inertia[0][0] == pytest.approx(1.5)
    assert model.body_names == ("base", "a", "b")


BOX = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
CONTACT = """<contact><lateral_friction value="0.3"/><rolling_friction value="0.01"/>
<spinning_friction value="0.02"/><restitution value="0.4"/><stiffness value="2000"/><damping value="10"/>
<contact_cfm value="0"/><inertia_scaling value="3"/></contact>"""


# Breaks when Bullet's contact parameters are not the material of the link's geoms, or of other links' too.
def test_contact_of_a_link(tmp_path):
    path = write(
        tmp_path, link("base", more=CONTACT + BOX), link("a", more=BOX), joint("j", "continuous", "base", "a")
    )
    model = load_model(path, strict=True)
    assert model.geoms[0].material == Material(0.3, 0.4, 1 / 2000, 10 / 2000, 0, None, 0.02, 0.01)
    assert model.geoms[1].material == Material(1.0)


# Breaks when a joint without a range moves, or moves unsaid.
@pytest.mark.parametrize(
    ("kind", "limit", "at"),
    [
        ("revolute", "", 0),
        ("prismatic", "<limit effort='1'/>", 0),
        ("revolute", "<limit lower='0.2' upper='0.2'/>", 0.2),
    ],
)
def test_joint_without_range(tmp_path, kind, limit, at):
    path = write(tmp_path, link("base"), link("a"), joint("j", kind, "base", "a", limit))
    with pytest.warns(ModelWarning, match='without a range of motion stay.*: "j"; give lower < upper'):
        model = load_model(path, strict=True)
    assert model.unread == ()
    assert (model.joints[0].dofs[0].lower, model.joints[0].dofs[0].upper) == (at, at)


# Breaks when limits that are infinite, as some exporters write them, are refused or bound something.
def test_infinite_limits(tmp_path):
    limit = '<limit lower="-inf" upper="inf" effort="inf" velocity="inf"/>'
    path = write(tmp_path, link("base"), link("a"), joint("j", "revolute", "base", "a", limit))
    dof = load_model(path, strict=True).joints[0].dofs[0]
    assert (dof.lower, dof.upper, dof.motor.max_effort) == (-math.inf, math.inf, math.inf)
    with pytest.raises(FileError, match=':4: <limit>: lower="nan" is not finite'):
        load_model(
            write(
                tmp_path, link("base"), link("a"), joint("j", "revolute", "base", "a", "<limit lower='nan'/>")
            )
        )


# Breaks when a link with mass and no moments of inertia is refused: MuJoCo reads it where its base is fixed.
def test_no_moments_of_inertia(tmp_path):
    point = INERTIAL.replace('="1"', '="0"')
    path = write(tmp_path, link("base", point), link("a"), joint("j", "continuous", "base", "a"))
    with pytest.warns(UnsupportedWarning, match="2 kg and no moments of inertia; those of a ball"):
        model = load_model(path)
    radius = (2 / (4 / 3 * math.pi * 1000)) ** (1 / 3)
    assert model.bodies[0].inertia[1][1] == pytest.approx(0.4 * 2 * radius**2)
    held = load_model(path, floating_base=False, strict=True)
    assert held.bodies[0].motion == "static"


# Breaks when the error about a macro in a number does not say what to do.
def test_macro_in_a_number(tmp_path):
    with pytest.raises(FileError, match="run first"):
        load_model(write(tmp_path, link("base", INERTIAL.replace('"2"', '"${m}"'))))


UNSUPPORTED = [
    ('<xacro:macro name="m"/>', r":3: <xacro:macro name=\"m\">: a macro; run xacro first"),
    ("<wing/>", ":3: <wing>: this element is not known"),
    (
        link("a") + joint("j", "continuous", "base", "a", '<dynamics dampin="2"/>'),
        ':3: <dynamics>: dampin="2": this attribute is not known',
    ),
    (
        link("a") + joint("j", "revolute", "base", "a", '<limit lower="1" upper="-1"/>'),
        ':3: <joint name="j">: lower 1 is above upper -1; it moves without limits',
    ),
    (
        link("a") + joint("j", "continuous", "base", "a", '<mimic joint="none"/>'),
        "MuJoCo warns: .*mimic",
    ),
]


# Breaks when something of a URDF is dropped silently: MuJoCo itself does not check names.
@pytest.mark.parametrize(("line", "message"), UNSUPPORTED)
def test_unsupported(tmp_path, line, message):
    with pytest.raises(InputError, match=message):
        load_model(write(tmp_path, link("base"), line), strict=True)


# Breaks when the pose of a chain of fixed links is composed in another order.
def test_fixed_links_compose(tmp_path):
    origin = '<origin xyz="1 0 0" rpy="0 0 0.5"/>'
    path = write(
        tmp_path, link("base"), link("a", ""), link("b"),
        joint("f", "fixed", "base", "a", origin), joint("g", "fixed", "a", "b", origin),
    )  # fmt: skip
    model = load_model(path)
    turn = axis_angle((0, 0, 1), 0.5)
    frame = model.links[-1].frame
    assert frame.position == pytest.approx((1 + math.cos(0.5), math.sin(0.5), 0))
    assert frame.rotation == pytest.approx(multiply(turn, turn))


# Breaks when a link called world that the file leaves out refuses the robot, or lets it fall. Drake takes it;
# lines in messages stay those of the file.
def test_world_without_a_link(tmp_path):
    path = write(tmp_path, link("base"), joint("hold", "fixed", "world", "base"))
    model = load_model(path)
    assert [body.motion for body in model.bodies] == ["static"]
    path = write(tmp_path, link("base"), joint("hold", "fixed", "world", "base"), "<joint/>")
    with pytest.raises(FileError, match=r"model\.urdf:4: <joint>: it has no name"):
        load_model(path)


# Breaks when moments of no solid, of a link called world, refuse the file: they have no meaning.
def test_mass_of_the_world(tmp_path):
    inertia = '<inertia ixx="0.01" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/>'
    world = f'<link name="world"><inertial><mass value="0.01"/>{inertia}</inertial></link>'
    model = load_model(write(tmp_path, world, link("base"), joint("j", "continuous", "world", "base")))
    assert [body.motion for body in model.bodies] == ["dynamic"]


def crossed(tmp_path, between):
    """Two hinges and a slide in a row, with turned and moved axes, to a bob; a gear to a wheel."""
    place = '<origin xyz="0.1 0.2 -0.1" rpy="0.3 -0.4 0.5"/><axis xyz="0 0.6 0.8"/>'
    far = '<origin xyz="0.05 0 0.3" rpy="0 0.7 0"/><axis xyz="1 0 0"/>'
    out = '<origin xyz="0 0.1 0" rpy="1 0 0"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/>'
    return write(
        tmp_path,
        '<link name="world"/>',
        *(f'<link name="{name}">{between}</link>' for name in ("one", "two")),
        link("bob"),
        link("wheel"),
        joint("a", "continuous", "world", "one", place),
        joint("b", "continuous", "one", "two", far),
        joint("c", "prismatic", "two", "bob", out),
        joint("d", "continuous", "bob", "wheel", '<axis xyz="0 0 1"/><mimic joint="b" multiplier="2"/>'),
    )


# Breaks when massless links, of which joints with several parts are made, refuse the robot, or its axes move.
# With 1e-7 kg in their place masses and forces are the same but for that.
def test_links_without_mass_between_joints(tmp_path):
    light = (
        '<inertial><mass value="1e-7"/><inertia ixx="1e-7" iyy="1e-7" izz="1e-7" ixy="0" ixz="0" iyz="0"/>'
    )
    with pytest.warns(
        ModelWarning, match='are no bodies, and the joints one with several parts: "one", "two"'
    ):
        model = load_model(crossed(tmp_path, ""))
    assert model.body_names == ("bob", "wheel")
    assert model.joint_names == ("a+b+c", "d")
    assert list(model.coordinates) == ["a", "b", "c", "d"]
    heavy = load_model(crossed(tmp_path, light + "</inertial>"))
    found = []
    for each in (model, heavy):
        simulation = amontons.Simulation(each)
        simulation.set_q({"a": 0.3, "b": -0.4, "c": 0.1})
        simulation.set_qd({"a": 1.0, "b": 0.5, "c": -0.2})
        bob = simulation.kinematics.link("bob")
        found.append(
            (simulation.forces.mass_matrix(), simulation.forces.bias_forces(), bob["position"], simulation.q)
        )
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, atol=2e-6)


# Breaks when a link without mass that holds two links, or none, is taken for a part of a joint.
@pytest.mark.parametrize("ends", [(), ("x", "y")])
def test_other_links_without_mass(tmp_path, ends):
    path = write(
        tmp_path,
        link("base"),
        '<link name="empty"/>',
        joint("a", "continuous", "base", "empty"),
        *(link(name) + joint(name, "continuous", "empty", name) for name in ends),
    )
    with pytest.raises(FileError, match='<link name="empty">: .*give it an <inertial>'):
        load_model(path)
