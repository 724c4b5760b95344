"""Good files, small, of every format and with every feature, for damage."""

from __future__ import annotations

import io
import struct
import tempfile
import zlib
from functools import cache
from pathlib import Path

import amontons
import numpy as np
from amontons.io.recordings.unfinished import HEAD, lookup3

Files = dict[str, bytes]
ROOT = Path(__file__).resolve().parents[2]
MODELS = ROOT / "tests" / "python" / "io" / "models"


def _file(name: str) -> bytes:
    return (Path(__file__).parent / "files" / name).read_bytes()


def _matrix(n: int) -> np.ndarray:
    rows = np.random.default_rng(n).normal(size=(n, n))
    return rows @ rows.T + n * np.eye(n)


def _factored() -> amontons.vi.Factored:
    rng = np.random.default_rng(1)
    a, b = np.repeat([0, 1, 0], 3), np.repeat([-1, -1, 1], 3)
    return amontons.vi.Factored(
        [1.0, 0.5], np.ones((2, 3)), a, b, rng.normal(size=(9, 6)), rng.normal(size=(9, 6))
    )


def _written(problem: amontons.vi.Problem, name: str, **options: object) -> Files:
    with tempfile.TemporaryDirectory() as folder:
        problem.write(Path(folder) / name, **options)
        return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}


@cache
def fclib() -> dict[str, Files]:
    friction = [amontons.vi.Friction([0.3, 0.5]), amontons.vi.Bilateral(2)]
    local = amontons.vi.Problem(_matrix(8), np.ones(8), friction, name="local", guesses=[np.ones(8)])
    rolling = amontons.vi.Problem(_matrix(10), np.ones(10), amontons.vi.RollingFriction(0.3, 0.1, n=2))
    bodies = amontons.vi.Problem(_factored(), np.ones(9), "friction", mu=0.3, f=np.ones(12))
    return {
        **{
            s: _written(local, "problem.hdf5", storage=s, solution=np.ones(8))
            for s in ("csc", "csr", "triplet")
        },
        "rolling": _written(rolling, "problem.hdf5"),
        "global": _written(bodies, "problem.hdf5"),
        "global triplet": _written(bodies, "problem.hdf5", storage="triplet"),
    }


def _all_cones() -> list[amontons.problem.cones.Cone]:
    return [
        amontons.vi.Bilateral(2),
        amontons.vi.NonNegative(1),
        amontons.vi.Interval([-1.0, 0.0], [1.0, np.inf]),
        amontons.vi.Friction([0.3, 0.5]),
        amontons.vi.RollingFriction(0.3, 0.1, n=1),
        amontons.vi.EllipticFriction([[0.2, 0.4]], [0.1], n=1),
    ]


@cache
def archives() -> dict[str, Files]:
    import scipy.sparse as sp

    A, cones = _matrix(20), _all_cones()
    rows = sum(cone.rows for cone in cones)
    A = A[:rows, :rows]
    buffer = io.BytesIO()
    np.savez(buffer, W=_matrix(6), q=np.ones(6), mu=np.array([0.1, 0.2]))
    bodies = amontons.vi.Problem(_factored(), np.ones(9), "friction", mu=0.3)
    return {
        "sparse": _written(amontons.vi.Problem(sp.csr_array(A), np.ones(rows), cones), "problem.npz"),
        "dense": _written(
            amontons.vi.Problem(A, np.ones(rows), cones, guesses=[np.ones(rows)]), "problem.npz"
        ),
        "bodies": _written(bodies, "problem.npz"),
        "local": {"problem.npz": buffer.getvalue()},
    }


@cache
def matrices() -> dict[str, Files]:
    text = _written(amontons.vi.Problem(_matrix(6), np.ones(6), "friction", mu=0.3), "problem.mtx")
    dense = "\n".join(f"{x!r}" for x in _matrix(6).T.ravel().tolist())
    general = "\n".join(f"{i + 1} {j + 1} {float(x)!r}" for (i, j), x in np.ndenumerate(_matrix(6)))
    head = "%%MatrixMarket matrix"
    return {
        "symmetric": text,
        "array": {**text, "problem.mtx": f"{head} array real general\n6 6\n{dense}\n".encode()},
        "general": {
            **text,
            "problem.mtx": f"{head} coordinate real general\n% x\n6 6 36\n{general}\n".encode(),
        },
        "whole": {**text, "problem.mtx": f"{head} coordinate integer general\n6 6 1\n1 1 3\n".encode()},
    }


def _simulation() -> amontons.Simulation:
    builder = amontons.ModelBuilder()
    builder.add_geom(None, amontons.shapes.Plane())
    base = builder.add_body(
        "base", shape=amontons.shapes.Box((0.1, 0.1, 0.1)), density=1000, position=(0, 0, 0.1)
    )
    corners = np.array([[x, y, z] for x in (0, 0.1) for y in (0, 0.1) for z in (0, 0.1)])
    arm = builder.add_body("arm", shape=amontons.shapes.Hull(corners), density=500, position=(0.3, 0, 0.5))
    builder.add_revolute_joint(base, arm, point=(0.2, 0, 0.3), axis=(0, 1, 0), limits=(-1, 1), name="elbow")
    builder.add_body("ball", shape=amontons.shapes.Sphere(0.1), density=1000, position=(1, 0, 0.1))
    return amontons.Simulation(builder.build())


@cache
def states() -> dict[str, Files]:
    simulation = _simulation()
    for _ in range(3):
        simulation.step()
    with tempfile.TemporaryDirectory() as folder:
        simulation.save(Path(folder) / "state.h5")
        return {"simulation": {"state.h5": (Path(folder) / "state.h5").read_bytes()}}


@cache
def recordings() -> dict[str, Files]:
    simulation = _simulation()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.h5"
        with amontons.record(path, simulation) as recorder:
            for _ in range(5):
                recorder.add(simulation.step())
        return {"run": {"run.h5": path.read_bytes()}}


@cache
def unfinished() -> dict[str, Files]:
    """Recordings with the mark of a writer, as a process leaves them that is killed within a write."""
    head = bytearray(recordings()["run"]["run.h5"])
    head[11] = 5  # open for writing, with readers (SWMR)
    head[HEAD : HEAD + 4] = struct.pack("<I", lookup3(bytes(head[:HEAD])))
    return {"run": {"run.h5": bytes(head)}}


@cache
def tables() -> dict[str, Files]:
    """The rows of a study."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rows.parquet"
        grid = {"mu": [0.3, 0.5], "stones": [3], "duration": [0.01]}
        amontons.sweep("arch", grid, out=path, executor=0, progress=False)
        return {"study": {"rows.parquet": path.read_bytes()}}


@cache
def mjcf() -> dict[str, Files]:
    """Those of the tests, and one with an included file."""
    gears = {"gears.xml": (MODELS / "gears.xml").read_bytes(), **_meshes()}
    found = {p.stem: {"model.xml": p.read_bytes(), **gears} for p in sorted(MODELS.glob("*.xml"))}
    found["included"] = {"model.xml": _file("including.xml"), "part.xml": _file("part.xml")}
    found["features"] = {"model.xml": _file("features.xml")}
    return found


def _meshes() -> Files:
    return {f"meshes/{p.name}": p.read_bytes() for p in sorted((MODELS / "meshes").iterdir())}


@cache
def urdf() -> dict[str, Files]:
    return {p.stem: {"model.urdf": p.read_bytes(), **_meshes()} for p in sorted(MODELS.glob("*.urdf"))}


ROBOT = """<robot name="r"><link name="base"/><link name="l"><inertial><mass value="1"/>
<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="asset.{suffix}" scale="1 1 1"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="base"/><child link="l"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
MESH = """<mujoco><asset><mesh name="m" file="asset.{suffix}"/></asset><worldbody><body><freejoint/>
<geom type="mesh" mesh="m"/></body></worldbody></mujoco>"""
FIELD = """<mujoco><asset><hfield name="h" file="asset.{suffix}" size="1 1 1 .1"/></asset><worldbody>
<geom type="hfield" hfield="h"/></worldbody></mujoco>"""

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def asset(suffix: str) -> dict[str, Files]:
    """A small model with a mesh or a height field in a file."""
    kind = suffix.removeprefix("txt.")
    name, text = ("model.urdf", ROBOT) if suffix in ("dae", "txt.stl") else ("model.xml", MESH)
    text = FIELD if suffix in ("png", "bin") else text
    return {"only": {name: text.format(suffix=kind).encode(), f"asset.{kind}": _asset(suffix)}}


@cache
def _asset(suffix: str) -> bytes:
    triangles = CORNERS[np.array(FACES)]
    match suffix:
        case "stl":
            body = b"".join(struct.pack("<12fH", 0, 0, 1, *t.ravel(), 0) for t in triangles)
            return b"x".ljust(80) + struct.pack("<I", len(triangles)) + body
        case "txt.stl":
            corner = "\n".join("vertex {} {} {}".format(*v) for v in triangles.reshape(-1, 3).tolist())
            return (
                f"solid x\nfacet normal 0 0 1\nouter loop\n{corner}\nendloop\nendfacet\nendsolid\n".encode()
            )
        case "obj":
            lines = [f"v {x} {y} {z}" for x, y, z in CORNERS.tolist()]
            lines += ["f " + " ".join(str(i + 1) for i in face) for face in FACES]
            return "\n".join(["o x", *lines, ""]).encode()
        case "msh":  # MuJoCo's own: counts of vertices, normals, texture coordinates, faces
            return struct.pack("<4i", 4, 0, 0, 4) + CORNERS.tobytes() + np.array(FACES, dtype="<i4").tobytes()
        case "bin":
            return struct.pack("<2i", 4, 5) + np.linspace(0, 1, 20, dtype="<f4").tobytes()
        case "png":
            return _png(np.arange(48, dtype=np.uint8).reshape(6, 8) * 5)
    return _file("mesh.dae")


def _png(pixels: np.ndarray) -> bytes:
    """Grey, 8 bits."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width = pixels.shape
    head = struct.pack(">2I5B", width, height, 8, 0, 0, 0, 0)
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )
