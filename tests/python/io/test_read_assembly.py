"""Blocks of drawings: the same wall in every format, units and axes, and what is refused."""

import json
import struct

import numpy as np
import pytest
from amontons import FileError, InputError, ModelWarning, examples
from amontons.studies import read_assembly, stability
from problems import DATA

CORNERS = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
PLACES = [(0, 0, 0), (1, 0, 0), (0.5, 0, 1)]
"""Two cubes side by side and one above, which share corners and edges"""


def cube(place):
    return np.array(CORNERS, dtype=float) + place


def as_obj(names=True, scale=1):
    lines = []
    for k, place in enumerate(PLACES):
        lines += [f"o cube {k}"] if names else []
        lines += [f"v {x} {y} {z}" for x, y, z in scale * cube(place)]
        lines += ["f " + " ".join(f"{8 * k + i + 1}//1" for i in quad) for quad in QUADS]
    return "\n".join(lines)


def corners():
    return [cube(p)[[a, b, c]] for p in PLACES for q in QUADS for a, b, c in (q[:3], (q[0], q[2], q[3]))]


def as_binary_stl():
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in corners())
    return b"solid but binary".ljust(80) + struct.pack("<I", len(corners())) + body


def as_text_stl():
    lines = []
    for k in range(3):
        lines.append(f"solid cube {k}")
        for t in corners()[12 * k : 12 * k + 12]:
            lines += [
                "facet normal 0 0 0",
                "outer loop",
                *(f"vertex {x} {y} {z}" for x, y, z in t),
                "endloop",
                "endfacet",
            ]
        lines.append("endsolid")
    return "\n".join(lines)


def as_compas(version):
    def mesh(place):
        vertex = {str(i): {"x": x, "y": y, "z": z} for i, (x, y, z) in enumerate(cube(place).tolist())}
        return {"vertex": vertex, "face": {str(i): list(q) for i, q in enumerate(QUADS)}}

    if version == 1:
        nodes = {
            str(k): {"block": {"dtype": "Block", "data": mesh(p)}, "is_support": k < 2}
            for k, p in enumerate(PLACES)
        }
        return {
            "dtype": "Assembly",
            "data": {
                "graph": {"data": {"node": nodes, "edge": {"0": {"1": {"interface": mesh(PLACES[0])}}}}}
            },
        }
    shift = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]]
    elements = [
        {
            "dtype": "Block",
            "data": {
                "name": f"cube {k}",
                "is_support": k < 2,
                "geometry": {"dtype": "Mesh", "data": mesh(p)},
            },
        }
        for k, p in enumerate(PLACES[:2])
    ]
    box = {"dtype": "Box", "data": {"xsize": 1, "ysize": 1, "zsize": 1, "frame": {"point": [1, 0.5, 0.5]}}}
    moved = {"dtype": "Transformation", "data": {"matrix": shift}}
    elements.append({"dtype": "Block", "data": {"name": "cube 2", "geometry": box, "transformation": moved}})
    return {"dtype": "BlockModel", "data": {"elements": elements, "graph": {"edge": {}}}}


def gltf():
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene()
    for k, p in enumerate(PLACES):
        points = cube(p)[:, [0, 2, 1]] * (1, 1, -1)  # y up
        faces = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]
        scene.add_geometry(
            trimesh.Trimesh(points, faces, process=False), node_name=f"cube {k}", geom_name=f"g{k}"
        )
    return scene.export(file_type="glb")


WRITTEN = {
    "named.obj": lambda: as_obj().encode(),
    "one.obj": lambda: as_obj(names=False).encode(),
    "binary.stl": as_binary_stl,
    "text.stl": lambda: as_text_stl().encode(),
    "one.json": lambda: json.dumps(as_compas(1)).encode(),
    "two.json": lambda: json.dumps(as_compas(2)).encode(),
    "scene.glb": gltf,
}


# Each format gives three cubes in their places, though they share edges. Breaks if blocks that touch are
# merged, if quads are split wrongly, or if axes of a format are lost.
@pytest.mark.parametrize("name", WRITTEN)
def test_three_cubes_in_every_format(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(WRITTEN[name]())
    blocks = read_assembly(path, supports="lowest").blocks
    assert len(blocks) == 3
    assert sorted(b.fixed for b in blocks) == [False, True, True]
    middles = sorted(tuple(np.round(b.mass.centre_of_mass, 6)) for b in blocks)
    assert middles == sorted(tuple(np.array(p) + 0.5) for p in PLACES)
    assert all(b.mass.mass == pytest.approx(2400, rel=1e-6) for b in blocks)
    verdict = stability(read_assembly(path, supports="lowest"))
    assert verdict.stands
    assert len(verdict.statics.joints) == 2
    if name not in ("one.obj", "binary.stl"):
        assert {b.name.removeprefix("cube ") for b in blocks} == {"0", "1", "2"}


# IFC, where its reader is installed: extrusions of a project in millimetres.
def test_ifc(tmp_path):
    pytest.importorskip("ifcopenshell")
    from ifcopenshell.api import run

    file = run("project.create_file")
    run("root.create_entity", file, ifc_class="IfcProject", name="p")
    run("unit.assign_unit", file, length={"is_metric": True, "raw": "MILLIMETERS"})
    context = run("context.add_context", file, context_type="Model")
    body = run(
        "context.add_context",
        file,
        context_type="Model",
        context_identifier="Body",
        target_view="MODEL_VIEW",
        parent=context,
    )
    for k, p in enumerate(PLACES):
        kind = "IfcFooting" if k < 2 else "IfcBuildingElementProxy"
        product = run("root.create_entity", file, ifc_class=kind, name=f"cube {k}")
        shape = run(
            "geometry.add_wall_representation", file, context=body, length=1.0, height=1.0, thickness=1.0
        )
        run("geometry.assign_representation", file, product=product, representation=shape)
        matrix = np.eye(4)
        matrix[:3, 3] = p
        run("geometry.edit_object_placement", file, product=product, matrix=matrix)
    path = tmp_path / "cubes.ifc"
    file.write(str(path))
    found = read_assembly(path)
    assert found.names == ("cube 0", "cube 1", "cube 2")
    assert found.supports == ("cube 0", "cube 1")
    assert np.round(found.blocks[2].mass.centre_of_mass, 6).tolist() == [1, 0.5, 1.5]
    assert stability(found).stands
    bare = run("project.create_file")
    run("root.create_entity", bare, ifc_class="IfcProject", name="p")
    run("root.create_entity", bare, ifc_class="IfcWall", name="w")
    bare.write(str(tmp_path / "bare.ifc"))
    with pytest.raises(FileError, match="none of its products has a body .IfcWall."):
        read_assembly(tmp_path / "bare.ifc")


# Units and axes are options; sizes like millimetres warn.
# Breaks if a unit is guessed or an axis flips a block.
def test_units_and_axes(tmp_path):
    path = tmp_path / "mm.obj"
    path.write_text(as_obj(scale=1000))
    with pytest.warns(ModelWarning, match='give unit="mm"'):
        assert read_assembly(path).blocks[0].size == pytest.approx(1000)
    small = read_assembly(path, unit="mm", up="y", supports=["cube 0"])
    assert small.blocks[2].vertices[:, 1].min() == pytest.approx(-2)
    assert small.supports == ("cube 0",)
    with pytest.raises(InputError, match="unit"):
        read_assembly(path, unit="furlong")
    with pytest.raises(InputError, match="there is no block 'cube 9'"):
        read_assembly(path, unit="mm", supports=["cube 9"])


# What a file leaves open is said. Breaks if a default stays silent.
def test_notes_say_what_was_assumed():
    arch = read_assembly(examples.path("arch.obj"))
    assert arch.supports == ("abutment left", "abutment right")
    text = " ".join(arch.notes)
    assert "metres" in text
    assert "2400" in text
    assert "0.6" in text
    assert "abutment left" in text
    assert not read_assembly(
        examples.path("arch.obj"), unit="m", up="z", density=2000, friction=0.7, supports="lowest"
    ).notes


# Damaged files end in one line that names the file and the block.
def test_files_that_are_refused(tmp_path):
    def refused(name, data, error, match):
        path = tmp_path / name
        path.write_bytes(data)
        with pytest.raises(error, match=match):
            read_assembly(path)

    refused("a.txt", b"", FileError, "is no .obj")
    refused("a.obj", b"v 0 0\nf 1 2 3", FileError, "line 1")
    refused("b.obj", b"v 0 0 0\nf 1 2 9", FileError, "vertex 2 of 1")
    refused("c.obj", b"# nothing", FileError, "has no blocks")
    refused("d.obj", as_obj().rsplit("\n", 1)[0].encode(), InputError, "'cube 2': its surface is not closed")
    refused("a.stl", as_binary_stl()[:-20], FileError, "cut off")
    refused("b.stl", b"solid x\nvertex 0 0 a\n", FileError, "no number")
    refused("a.json", b"{", FileError, "is no JSON")
    refused("b.json", b"{}", FileError, "has no mesh")
    refused(
        "c.json", b'{"vertex": {"0": {"x": 0}}, "face": {"0": [0, 0, 0]}}', FileError, "not one of COMPAS"
    )
    refused("a.glb", b"glTF", FileError, "cannot be read as glTF")
    with pytest.raises(FileNotFoundError):
        read_assembly(tmp_path / "none.obj")


# The assemblies of compas_cra, whose authors say which stand; skipped without the data.
@pytest.mark.parametrize(
    ("name", "supports", "friction", "verdict"),
    [
        ("shelf-stable", [0], 0.9, "stands"),
        ("shelf", [0], 0.9, "needs prestress"),
        ("H", [0, 1], 0.84, "needs prestress"),
        ("bridge", [0, 1], 0.9, "stands"),
    ],
)
def test_the_assemblies_of_compas_cra(name, supports, friction, verdict):
    path = DATA / "measured" / "masonry" / f"{name}.json"
    if not path.is_file():
        pytest.skip("the assemblies of compas_cra are not here")
    found = stability(read_assembly(path, supports=supports, friction=friction))
    assert found.verdict == verdict
