"""What MJCF and URDF files look like; against MuJoCo's own frames, and the points of the mesh files."""

import amontons
import numpy as np
import pytest
from amontons import shapes
from amontons.report.batches import visuals_of
from problems import quiet

mujoco = pytest.importorskip("mujoco")

POINTS = np.array([(0.3, 0, 0), (1.3, 0, 0), (0.3, 2, 0), (0.3, 0, 3.0)])
FACES = ((1, 3, 2), (1, 2, 4), (1, 4, 3), (2, 3, 4))


def write_mesh(folder, name="wedge.obj"):
    lines = [f"v {x} {y} {z}" for x, y, z in POINTS] + ["f {} {} {}".format(*face) for face in FACES]
    (folder / name).write_text("\n".join(lines))


def load(path, text, **options):
    path.write_text(text)
    return quiet(amontons.load_model, path, **options)


def drawn(model):
    """By body, the points of all that is drawn on it in its frame, rounded and sorted."""
    found = {}
    for batch in visuals_of(model):
        for k, body in enumerate(batch.bodies.tolist()):
            frame = amontons.Transform(tuple(batch.positions[k]), tuple(batch.rotations[k]))
            points = [frame(p) for p in batch.surface.vertices.astype(float) * batch.scales[k]]
            found.setdefault(body, []).extend(np.round(points, 5).tolist())
    return {body: sorted(points) for body, points in found.items()}


MJCF = """<mujoco><asset><mesh name="wedge" file="wedge.obj" scale="0.1 0.2 0.1"/>
<material name="red" rgba="1 0 0 0.5"/></asset>
<worldbody><geom type="plane" size="1 1 1"/><body name="b" pos="0 0 1"><freejoint/>
<geom type="mesh" mesh="wedge" contype="0" conaffinity="0" pos="0.1 0 0" euler="0 90 0" {mesh}/>
<geom name="hull" type="box" size="0.1 0.2 0.3" group="3"/></body>
<body name="c" pos="3 0 1"><freejoint/><geom name="ball" type="sphere" size="0.2" {ball}/></body>
</worldbody></mujoco>"""


# Breaks when a mesh that is only seen is lost or drawn elsewhere than in MuJoCo (which moves it into its
# inertial frame), the hidden collision geom is drawn too, or a colour is not that of geom or material.
def test_mjcf(tmp_path):
    write_mesh(tmp_path)
    model = load(tmp_path / "m.xml", MJCF.format(mesh='material="red"', ball='rgba="0 1 0 1"'))
    mesh, ball = model.visuals
    assert (mesh.colour, ball.colour) == ((1, 0, 0, 0.5), (0, 1, 0, 1))
    assert ball.shape is model.geoms[model.geom_index("ball")].shape
    theirs = mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
    data = mujoco.MjData(theirs)
    mujoco.mj_forward(theirs, data)
    turn = data.geom_xmat[1].reshape(3, 3)
    there = theirs.mesh_vert @ turn.T + data.geom_xpos[1] - (0, 0, 1)  # in the frame of the body
    (wedge, _) = drawn(model)[0], drawn(model)[1]
    np.testing.assert_allclose(wedge, sorted(np.round(there, 5).tolist()), atol=2e-5)
    assert len(wedge) == 4


# Breaks when a model whose geoms say all that there is to see gets the same shapes a second time.
def test_plain_mjcf_has_no_visuals(tmp_path):
    text = '<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>'
    assert load(tmp_path / "m.xml", text).visuals == ()


URDF = """<robot name="r"><material name="blue"><color rgba="0 0 1 1"/></material>
<link name="base"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/>
<geometry><mesh filename="{file}" scale="1 1 -2"/></geometry><material name="blue"/></visual>
<visual><geometry><cylinder radius="0.5" length="2"/></geometry>
<material name="own"><color rgba="1 1 0 1"/></material></visual>
<collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>"""


# Breaks when a visual of a link is lost, put elsewhere or scaled otherwise, or a colour by name or of its own
# is not found. A quarter turn about z takes (x, y, z) to (-y, x, z).
def test_urdf(tmp_path):
    write_mesh(tmp_path)
    model = load(tmp_path / "r.urdf", URDF.format(file="package://r/wedge.obj"), floating_base=True)
    mesh, cylinder = model.visuals
    assert (mesh.colour, cylinder.colour) == ((0, 0, 1, 1), (1, 1, 0, 1))
    assert (cylinder.shape.radius, cylinder.shape.half_length) == (0.5, 1.0)
    points = np.array([mesh.frame(p) for p in mesh.shape.vertices.astype(float)])
    expected = np.column_stack((-POINTS[:, 1], POINTS[:, 0], 1 - 2 * POINTS[:, 2]))
    np.testing.assert_allclose(
        sorted(points.round(5).tolist()), sorted(expected.round(5).tolist()), atol=2e-5
    )
    # A mirror image turns its triangles round, so that they face outwards again.
    a, b, c = (mesh.shape.vertices[mesh.shape.triangles[:, k]].astype(float) for k in range(3))
    assert (a * np.cross(b, c)).sum() > 0


# Breaks when a mesh that is only to be seen and is missing or no mesh stops the model from being read.
@pytest.mark.parametrize("content", [None, "no mesh"])
def test_a_missing_visual_is_left_out(tmp_path, content):
    if content is not None:
        (tmp_path / "gone.obj").write_text(content)
    model = load(tmp_path / "r.urdf", URDF.format(file="gone.obj"))
    assert [type(v.shape) for v in model.visuals] == [shapes.Cylinder]


# Breaks when a visual that is wrong stops the model from being read, or is drawn somewhere.
@pytest.mark.parametrize(
    "wrong",
    [
        '<origin rpy="0 0 nan"/><geometry><sphere radius="1"/></geometry>',
        '<origin xyz="1e999 0 0"/><geometry><sphere radius="1"/></geometry>',
        '<origin xyz="a b c"/><geometry><sphere radius="1"/></geometry>',
        '<geometry><sphere radius="-1"/></geometry>',
        '<geometry><box size="1 2"/></geometry>',
        '<geometry><mesh filename=""/></geometry>',
        '<geometry><mesh filename="wedge.obj" scale="1 nan 1"/></geometry>',
        "<geometry/>",
        "",
    ],
)
def test_a_wrong_visual_is_left_out(tmp_path, wrong):
    write_mesh(tmp_path)
    text = URDF.format(file="wedge.obj").replace("<collision>", f"<visual>{wrong}</visual><collision>")
    assert len(load(tmp_path / "r.urdf", text).visuals) == 2


DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"><asset><unit meter="0.5"/></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array count="12">
0 0 0 1 0 0 1 1 0 0 1 0</float_array><technique_common><accessor stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><input semantic="NORMAL" offset="1"/>
<vcount>4</vcount><p>0 9 1 9 2 9 3 9</p></polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


# Breaks when a polygon of Collada is not cut into triangles, its unit is lost, or other inputs are taken for
# vertices.
def test_collada(tmp_path):
    (tmp_path / "square.dae").write_text(DAE)
    text = URDF.replace('scale="1 1 -2"', "").format(file="square.dae")
    mesh = load(tmp_path / "r.urdf", text).visuals[0].shape
    corners = mesh.vertices[mesh.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert area.tolist() == pytest.approx([0.125, 0.125])


# Breaks when a source without numbers, as exporters write for what is not used, ends the reader.
def test_collada_with_an_empty_source(tmp_path):
    empty = DAE.replace(
        "</library_geometries>",
        """<geometry id="e"><mesh><source id="n"><float_array count="0"/></source>
<vertices id="w"><input semantic="POSITION" source="#n"/></vertices></mesh></geometry>
</library_geometries>""",
    )
    empty = empty.replace("</node>", '<instance_geometry url="#e"/></node>')
    (tmp_path / "square.dae").write_text(empty)
    text = URDF.replace('scale="1 1 -2"', "").format(file="square.dae")
    assert len(load(tmp_path / "r.urdf", text).visuals[0].shape.triangles) == 2
