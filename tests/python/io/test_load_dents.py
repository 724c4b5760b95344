"""Meshes that are not convex: a warning names their hulls, and parts take their place if wanted."""

import warnings

import amontons
import numpy as np
import pytest
from amontons import InputError, cli, shapes
from problems import silent
from typer.testing import CliRunner

OUTLINE = ((0, 0), (0.2, 0), (0.2, 0.1), (0.1, 0.1), (0.1, 0.2), (0, 0.2))
"""An L of three squares of 10 cm; its hull adds half a square, 500 cm^3 to 3000 cm^3 at 10 cm of height."""
CAPS = ((3, 4, 5), (3, 5, 0), (3, 0, 1), (3, 1, 2))


def write_mesh(folder, open_=False):
    points = [(x, y, z) for z in (0, 0.1) for x, y in OUTLINE]
    faces = [(c, b, a) for a, b, c in CAPS] + [(a + 6, b + 6, c + 6) for a, b, c in CAPS]
    for k in range(6):
        n = (k + 1) % 6
        faces += [(k, n, n + 6), (k, n + 6, k + 6)]
    lines = [f"v {x} {y} {z}" for x, y, z in points]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces[: -2 if open_ else None]]
    (folder / "angle.obj").write_text("\n".join(lines) + "\n")


URDF = """<robot name="r"><link name="angle"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="angle.obj"/></geometry></collision></link></robot>"""
MJCF = """<mujoco><asset><mesh name="m" file="angle.obj"/></asset><worldbody>
<body name="angle"><freejoint/><geom name="skin" type="mesh" mesh="m"/></body>
<body name="ball" pos="2 0 0"><freejoint/><geom name="ball" size="0.02"/></body></worldbody>
<contact><pair geom1="skin" geom2="ball" friction="0.3"/></contact></mujoco>"""
SDF = """<sdf version="1.9"><model name="r"><link name="angle"><inertial><mass>1</mass></inertial>
<collision name="skin"><geometry><mesh>
<uri>angle.obj</uri></mesh></geometry></collision></link></model></sdf>"""
FILES = {"a.urdf": URDF, "a.xml": MJCF, "a.sdf": SDF}


def load(folder, name, **options):
    if name != "a.sdf":
        pytest.importorskip("mujoco")
    else:
        pytest.importorskip("trimesh")
    (folder / name).write_text(FILES[name])
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        model = amontons.load_model(folder / name, **options)
    return model, "\n".join(str(w.message) for w in caught)


# Breaks when a hull takes the place of a mesh unsaid, or with another volume than it adds.
@pytest.mark.parametrize(("name", "effect"), [("a.urdf", "small"), ("a.xml", "none"), ("a.sdf", "small")])
def test_hulls_are_told(tmp_path, name, effect):
    write_mesh(tmp_path)
    model, said = load(tmp_path, name)
    assert "its convex hull collides, which adds 500 cm^3 to 3000 cm^3" in said
    assert [entry.effect for entry in model.unread if "hull" in entry.what] == [effect]
    assert isinstance(model.geoms[0].shape, shapes.Hull)


# Breaks when parts are not those of the mesh, lie elsewhere, or pairs of the geom are lost with it.
@pytest.mark.parametrize("name", FILES)
def test_parts_in_place_of_hulls(tmp_path, name):
    pytest.importorskip("coacd")
    write_mesh(tmp_path)
    model, said = load(tmp_path, name, decompose=0.002)
    parts = [geom for geom in model.geoms if isinstance(geom.shape, shapes.Hull)]
    assert len(parts) >= 2
    assert sum(part.shape.volume() for part in parts) == pytest.approx(3e-3, rel=0.02)
    assert "collide as convex parts, which reach outside of them by at most" in said
    assert not [entry for entry in model.unread if "hull" in entry.what]
    # A ray into the dent meets its bottom, where the hull would meet it half way.
    simulation = amontons.Simulation(model)
    middle = np.array((0.15, 0.15, 0.05)) + simulation.state.positions[0]
    if name == "a.xml":  # MuJoCo moves a mesh into its centre, and the geom with it: the place is the same
        assert {(p.geom_a, p.geom_b) for p in model.pair_materials} == {
            (k, len(parts)) for k in range(len(parts))
        }
        assert all(p.material.friction == 0.3 and p.always for p in model.pair_materials)
    hit = simulation.kinematics.ray(middle, (-1, 0, 0))
    assert hit is not None
    assert hit.distance == pytest.approx(0.05, abs=4e-3)


# Breaks when a mesh that cannot be divided gives no remedy, or True divides nothing.
def test_default_error_and_open_meshes(tmp_path):
    pytest.importorskip("coacd")
    write_mesh(tmp_path)
    assert len(load(tmp_path, "a.urdf", decompose=True)[0].geoms) >= 2
    folder = tmp_path / "open"  # MuJoCo keeps meshes by their path
    folder.mkdir()
    write_mesh(folder, open_=True)
    model, said = load(folder, "a.urdf", decompose=True)
    assert "the mesh is not closed, or faces inwards; its convex hull collides; decompose: " in said
    assert len(model.geoms) == 1
    with pytest.raises(InputError, match="decompose is -1"):
        load(tmp_path, "a.urdf", decompose=-1)


# Breaks when what does not move loses its dents, or has parts where the mesh itself can collide.
def test_scenery_keeps_its_mesh(tmp_path):
    pytest.importorskip("mujoco")
    write_mesh(tmp_path)
    (tmp_path / "a.xml").write_text(MJCF.replace('<freejoint/><geom name="skin"', '<geom name="skin"'))
    model = silent(amontons.load_model, tmp_path / "a.xml", decompose=True)
    assert isinstance(model.geoms[0].shape, shapes.Mesh)
    assert model.geoms[0].shape.volume() == pytest.approx(3e-3)


# Breaks when the command decomposes other meshes than load_model, or takes nonsense for a length.
def test_command_decomposes(tmp_path):
    pytest.importorskip("coacd")
    pytest.importorskip("mujoco")
    write_mesh(tmp_path)
    (tmp_path / "a.xml").write_text(MJCF)
    saved = tmp_path / "state.h5"
    command = ["run", str(tmp_path / "a.xml"), "--duration", "0.01", "--save", str(saved), "--decompose"]
    with warnings.catch_warnings(action="ignore"):
        for given, option in (("auto", True), ("0.002", 0.002)):
            result = CliRunner().invoke(cli.app, [*command, given])
            assert result.exit_code == 0, result.stderr
            assert (
                amontons.Simulation.load(saved).model.geoms
                == load(tmp_path, "a.xml", decompose=option)[0].geoms
            )
            saved.unlink()
    refused = CliRunner().invoke(cli.app, [*command, "fine"])
    assert refused.exit_code == 2
    assert "--decompose fine: give auto, or the error in m" in refused.stderr
