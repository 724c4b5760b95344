"""Visuals of model files: visible geoms of MJCF, <visual> of URDF, and their colours.

The simulation knows nothing of it, so that nothing here is an error: what cannot be read is left out, and
pictures then show the collision shapes of its body.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...model import collada, shapes, stl_text
from ...model.shapes import Shape
from ...model.transforms import Transform
from ...model.visuals import TriangleMesh, Visual
from .bodies import Bodies
from .compiled import Compiled, transform
from .elements import Element
from .geoms import Geoms
from .places import inside
from .urdf import candidates, origin_of
from .waiting import interruptible
from .xml_lines import is_file

HIDDEN = 3
"""The first group of geoms that MuJoCo's own viewer does not show from the start."""
UNCOLOURED = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's colour of a geom without one."""


def read_visuals(compiled: Compiled, bodies: Bodies, geoms: Geoms) -> list[Visual]:
    """Empty where the geoms say all that there is to see."""
    if compiled.root.tag == "robot":
        return _of_urdf(compiled, bodies)
    return _of_mjcf(compiled, bodies, geoms)


def _of_mjcf(compiled: Compiled, bodies: Bodies, geoms: Geoms) -> list[Visual]:
    m, kind = compiled.model, compiled.mujoco.mjtGeom
    known: dict[int, TriangleMesh] = {}
    found: list[Visual] = []
    shown = [g for g in range(m.ngeom) if m.geom_group[g] < HIDDEN and m.geom_type[g] != kind.mjGEOM_PLANE]
    for g in shown:
        shape: Shape | TriangleMesh
        if m.geom_type[g] == kind.mjGEOM_MESH:
            data = int(m.geom_dataid[g])
            if data not in known:
                known[data] = _mesh(m, data)
            shape = known[data]
        elif g in geoms.index:
            shape = geoms.geoms[geoms.index[g]].shape
        else:
            continue
        body = int(m.geom_bodyid[g])
        frame = bodies.frame[body] @ transform(m.geom_pos[g], m.geom_quat[g])
        of = {"shape": shape, "colour": _colour(m, g), "link": bodies.link[body]}
        found.append(Visual(compiled.name("geom", g), bodies.at(body), frame, **of))
    alike = len(shown) == m.ngeom and not known and all(visual.colour is None for visual in found)
    return [] if alike else found


def _colour(model: Any, geom: int) -> tuple[float, ...] | None:
    """Colour of the geom, else of its material, else none; textures are not read."""
    rgba = model.geom_rgba[geom]
    if tuple(rgba.tolist()) == UNCOLOURED:
        material = int(model.geom_matid[geom])
        if material < 0:
            return None
        rgba = model.mat_rgba[material]
    return tuple(np.round(np.clip(rgba.astype(float), 0, 1), 6).tolist())  # kept in single precision


def _mesh(model: Any, mesh: int) -> TriangleMesh:
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    face, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return TriangleMesh(model.mesh_vert[first : first + count], model.mesh_face[face : face + faces])


def _of_urdf(compiled: Compiled, bodies: Bodies) -> list[Visual]:
    m, root = compiled.model, compiled.root
    index = {compiled.name("body", i): i for i in range(1, m.nbody)}
    colours = {e.name: _rgba(e) for e in root.children if e.tag == "material"}
    known: dict[Path, TriangleMesh | None] = {}
    found: list[Visual] = []
    for link in root.children:
        body = index.get(link.name, 0)  # a root called world is the world
        if link.tag != "link":
            continue
        for visual in link.children:
            try:
                shape = _urdf_shape(compiled, visual, known) if visual.tag == "visual" else None
                if shape is None:
                    continue
                material = visual.child("material")
                colour = (_rgba(material) or colours.get(material.name)) if material else None
                frame = bodies.frame[body] @ origin_of(visual)
                of = {"shape": shape, "colour": colour, "link": bodies.link[body]}
                found.append(Visual(visual.name, bodies.at(body), frame, **of))
            except (InputError, OSError, ValueError, OverflowError):
                continue
    return found


def _rgba(material: Element) -> tuple[float, ...] | None:
    colour = material.child("color")
    values = (colour and colour.numbers("rgba")) or []
    if len(values) != 4 or not np.isfinite(values).all():
        return None
    return tuple(np.clip(values, 0, 1).tolist())


def _urdf_shape(
    compiled: Compiled, visual: Element, known: dict[Path, TriangleMesh | None]
) -> Shape | TriangleMesh | None:
    geometry = visual.child("geometry")
    for element in geometry.children if geometry else []:
        size = {name: element.numbers(name) or [math.nan] for name in ("radius", "length", "size", "scale")}
        match element.tag:
            case "sphere":
                return shapes.Sphere(size["radius"][0])
            case "box":
                return shapes.Box(tuple(0.5 * x for x in size["size"]))
            case "cylinder":
                return shapes.Cylinder(size["radius"][0], 0.5 * size["length"][0])
            case "capsule":
                return shapes.Capsule(size["radius"][0], 0.5 * size["length"][0])
            case "mesh":
                scale = size["scale"] if len(size["scale"]) == 3 else [1.0, 1.0, 1.0]
                return _scaled(_file(compiled, element.attributes.get("filename", ""), known), scale)
    return None


def _scaled(mesh: TriangleMesh | None, scale: list[float]) -> TriangleMesh | None:
    if mesh is None or scale == [1.0, 1.0, 1.0]:
        return mesh
    triangles = mesh.triangles if np.prod(scale) > 0 else mesh.triangles[:, ::-1]  # a mirror image
    return TriangleMesh(mesh.vertices * np.array(scale), triangles)


def _file(compiled: Compiled, name: str, known: dict[Path, TriangleMesh | None]) -> TriangleMesh | None:
    """The triangles of a mesh file, read once; None if it is missing or of a kind that is not read."""
    places = candidates(name, "", compiled.path.parent)
    path = next((p for p in places if inside(p, compiled.limits) and is_file(p)), None)
    if path is None:
        return None
    if path not in known:
        known[path] = _read(compiled.mujoco, path)
    return known[path]


def _read(mujoco: Any, path: Path) -> TriangleMesh | None:
    if path.suffix.lower() == ".dae":
        triangles = collada.read_triangles(path)
        return None if triangles is None else _soup(triangles)
    if (corners := stl_text.read(path)) is not None:
        return _soup(corners)
    spec = mujoco.MjSpec()
    mesh = spec.add_mesh(name="mesh", file=str(path.resolve()))
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL  # its mass is of no interest, nor is a volume
    try:
        model = interruptible(spec.compile)
    except (ValueError, RuntimeError):
        return None
    moved = transform(model.mesh_pos[0], model.mesh_quat[0])  # MuJoCo puts meshes into their inertial frame
    turn = np.array([Transform((0.0, 0.0, 0.0), moved.rotation)(axis) for axis in np.eye(3)]).T
    return TriangleMesh(model.mesh_vert @ turn.T + np.array(moved.position), model.mesh_face)


def _soup(corners: Any) -> TriangleMesh:
    return TriangleMesh(corners, np.arange(len(corners)).reshape(-1, 3))
