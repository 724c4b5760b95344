"""Meshes of files as shapes, and orientations from matrices, angles and directions."""

import math

import amontons
import numpy as np
import pytest
from amontons import FileError, InputError, shapes

OBJ = """v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"""


# Breaks when a file loses triangles, its scale, or its orientation: a tetrahedron of 1/6 of a cube.
@pytest.mark.parametrize("kind", ["obj", "stl", "ply"])
def test_read_mesh(tmp_path, kind):
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / "part.obj"
    path.write_text(OBJ)
    if kind != "obj":
        trimesh.load_mesh(path).export(tmp_path / f"part.{kind}")
        path = tmp_path / f"part.{kind}"
    mesh = shapes.read_mesh(path, scale=0.1)
    assert mesh.volume() == pytest.approx(1e-3 / 6)
    assert shapes.Hull.read(path, scale=0.1).volume() == pytest.approx(1e-3 / 6)


# Breaks when a file that is no mesh, or a STEP file, is refused without a remedy.
def test_refused(tmp_path):
    for name, message in (
        ("a.step", "export it as .stl"),
        ("a.xyz", ".stl, .obj"),
        ("a.ply", "cannot be read"),
    ):
        (tmp_path / name).write_bytes(b"nothing")
        with pytest.raises(FileError, match=message):
            shapes.read_mesh(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        shapes.read_mesh(tmp_path / "none.stl")


# Breaks when a quaternion disagrees with SciPy's, half turns about each axis too.
def test_orientations():
    from scipy.spatial.transform import Rotation

    turns = [*Rotation.random(20, rng=1), *(Rotation.from_rotvec(math.pi * axis) for axis in np.eye(3))]
    for turn in turns:
        found = Rotation.from_quat(np.roll(amontons.from_matrix(turn.as_matrix()), -1))
        assert (found * turn.inv()).magnitude() < 1e-12
        body = amontons.ModelBuilder()
        body.add_body("a", orientation=turn, shape=shapes.Sphere(1), mass=1)
    for axes in ("xyz", "XYZ", "zx", "ZYX"):
        angles = [0.3, -1.0, 2.0][: len(axes)]
        found = Rotation.from_quat(np.roll(amontons.from_euler(axes, angles), -1))
        assert (found * Rotation.from_euler(axes, angles).inv()).magnitude() < 1e-12
    turn = amontons.Transform(rotation=amontons.look_at((1, 1, 1), (1, 3, 1)))
    np.testing.assert_allclose([turn((1, 0, 0)), turn((0, 0, 1))], [(0, 1, 0), (0, 0, 1)], atol=1e-15)


# Breaks when the parts of a mesh fill its dent, or the deviation is not that of the parts: an L of three
# cubes of 0.1 m, into which two boxes fit. One hull would reach 0.05 m beyond it.
def test_decompose():
    pytest.importorskip("coacd", reason="needs coacd")
    outline = 0.1 * np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    points = np.vstack([np.column_stack((outline, np.full(6, z))) for z in (0.0, 0.1)])
    fan = [(0, k, k + 1) for k in range(1, 5)]
    sides = [t for k in range(6) for t in ((k, (k + 1) % 6, k + 6), ((k + 1) % 6, (k + 1) % 6 + 6, k + 6))]
    mesh = shapes.Mesh(
        points, [(a, c, b) for a, b, c in fan] + [(a + 6, b + 6, c + 6) for a, b, c in fan] + sides
    )
    parts = shapes.decompose(mesh, error=0.002)
    assert len(parts.hulls) == 2
    assert parts.deviation < 1e-4
    assert sum(hull.volume() for hull in parts.hulls) == pytest.approx(3e-3, rel=1e-3)
    assert shapes.decompose(shapes.Mesh(mesh.vertices, mesh.triangles), error=0.002) is parts
    with pytest.raises(InputError, match="> 0"):
        shapes.decompose(mesh, error=0)
    with pytest.raises(InputError, match="decompose: .*closed"):
        shapes.decompose(shapes.Mesh(mesh.vertices, mesh.triangles[:-1]), error=0.01)


# Breaks when what is no rotation becomes one.
def test_no_orientations():
    with pytest.raises(InputError, match="no rotation"):
        amontons.from_matrix(2 * np.eye(3))
    with pytest.raises(InputError, match="letters"):
        amontons.from_euler("xYz", (1, 2, 3))
    with pytest.raises(InputError, match="needs 3 angles"):
        amontons.from_euler("xyz", (1, 2))
    with pytest.raises(InputError, match="along the line"):
        amontons.look_at((0, 0, 0), (0, 0, 1))


# Breaks when a keyframe prints its arrays, is not accepted itself, or one of another model is.
def test_keyframes(tmp_path):
    pytest.importorskip("mujoco")
    for name, bodies in (("a", 1), ("b", 2)):
        body = '<body><freejoint/><geom size="1"/></body>' * bodies
        key = " ".join(["0 0 5 1 0 0 0"] * bodies)
        (tmp_path / f"{name}.xml").write_text(
            f'<mujoco><worldbody>{body}</worldbody><keyframe><key name="k" qpos="{key}"/></keyframe></mujoco>'
        )
    one, two = (amontons.load_model(tmp_path / f"{name}.xml") for name in "ab")
    assert repr(one.keyframes[0]) == "Keyframe('k', time=0, 1 bodies, 0 coordinates)"
    simulation = amontons.Simulation(one)
    simulation.apply_keyframe(one.keyframes[0])
    assert simulation.state.positions[0, 2] == 5
    with pytest.raises(InputError, match="2 bodies .* the model has 1"):
        simulation.apply_keyframe(two.keyframes[0])
