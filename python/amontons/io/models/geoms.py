"""Geoms: shapes and materials."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...checks import Array
from ...errors import FileError, InputError
from ...model import shapes
from ...model.parts import Geom, Material
from ...model.shapes import Shape
from ...model.transforms import rotate
from .bodies import Bodies, unique_names
from .compiled import Compiled, transform
from .mesh_shapes import told
from .urdf import contact_values

BITS = 0xFFFFFFFF
THIN = 1e-4
"""The least thickness of a hull over its size"""
FROM_CONDIM = np.array([3, 4, 6])
"""The condim from which on sliding, torsional and rolling friction count."""


@dataclass
class Geoms:
    """Ours, and which of MuJoCo's they are."""

    geoms: list[Geom]
    index: dict[int, int]
    """Our index by MuJoCo geom; those that were left out are missing."""

    def sources(self) -> list[int]:
        """The geom of MuJoCo that each of ours is."""
        return list(self.index)


def read_geoms(compiled: Compiled, bodies: Bodies) -> Geoms:
    m = compiled.model
    names = unique_names(compiled, "geom", m.ngeom)
    known: dict[int, Shape] = {}  # meshes and height fields are shared by the geoms that use them
    geoms = Geoms([], {})
    for g in range(m.ngeom):
        shape = _shape(compiled, g, known, bodies.is_static(m.geom_bodyid[g]))
        if shape is None:
            continue
        body = int(m.geom_bodyid[g])
        of_link = contact_values(compiled.name("body", body), compiled.root)
        frame = bodies.frame[body] @ transform(m.geom_pos[g], m.geom_quat[g])
        surface, spin = (
            rotate(frame.rotation, tuple(part.tolist())) for part in m.geom_surfacevel[g].reshape(2, 3)
        )
        contact = compiled.enabled("contact")
        geoms.index[g] = len(geoms.geoms)
        geoms.geoms.append(
            Geom(
                names[g],
                bodies.at(body),
                frame,
                shape=shape,
                material=replace(_material(m, g), **of_link),
                surface_velocity=surface,
                surface_spin=spin,
                link=bodies.link[body],
                category=int(m.geom_contype[g]) & BITS if contact else 0,
                mask=int(m.geom_conaffinity[g]) & BITS if contact else 0,
            )
        )
    return geoms


def _material(model: Any, geom: int) -> Material:
    """The moments that its condim asks for; that condim 1 slides freely is up to the pair."""
    dim = model.geom_condim[geom]
    _, torsion, rolling = coefficients(dim, model.geom_friction[geom]).tolist()
    return Material(
        friction=float(model.geom_friction[geom, 0]),
        torsional_friction=torsion,
        rolling_friction=rolling,
        rest_offset=max(float(model.geom_margin[geom]), 0.0),
    )


def coefficients(dim: Any, friction: Any) -> Array:
    """The coefficients (..., 3), sliding, torsional and rolling, that count with condim `dim` (...)."""
    return np.where(np.asarray(dim)[..., None] >= FROM_CONDIM, friction, 0.0)


def touches_nothing(model: Any, geom: int) -> bool:
    """Whether the geom is there to be seen only."""
    paired = geom in model.pair_geom1 or geom in model.pair_geom2
    return not (model.geom_contype[geom] or model.geom_conaffinity[geom] or paired)


def primitive(compiled: Compiled, kind: Any, size: list[float]) -> Shape | None:
    """The shape of a geom or site that a few lengths describe; None for other kinds."""
    kinds = compiled.mujoco.mjtGeom
    match kind:
        case kinds.mjGEOM_SPHERE:
            return shapes.Sphere(size[0])
        case kinds.mjGEOM_CAPSULE:
            return shapes.Capsule(size[0], size[1])
        case kinds.mjGEOM_ELLIPSOID:
            return shapes.Ellipsoid(tuple(size))  # type: ignore[arg-type]
        case kinds.mjGEOM_CYLINDER:
            return shapes.Cylinder(size[0], size[1])
        case kinds.mjGEOM_BOX:
            return shapes.Box(tuple(size))  # type: ignore[arg-type]
    return None


def _shape(compiled: Compiled, g: int, known: dict[int, Shape], static: bool) -> Shape | None:
    """The shape of a geom; None for what is only seen, or not supported and listed."""
    m, kind = compiled.model, compiled.mujoco.mjtGeom
    if solid := primitive(compiled, m.geom_type[g], m.geom_size[g].tolist()):
        return solid
    match m.geom_type[g]:
        case kind.mjGEOM_PLANE:
            return shapes.Plane()
        case kind.mjGEOM_HFIELD if static:
            data = int(m.geom_dataid[g])
            return known.setdefault(-1 - data, _height_field(m, data))
        case kind.mjGEOM_HFIELD:
            compiled.refuse(
                "geom", g, "a height field on a body that moves; use meshes or primitives", "large"
            )
        case kind.mjGEOM_MESH if not touches_nothing(m, g):
            data = int(m.geom_dataid[g])
            if data not in known:
                known[data] = _hull(compiled, g, data)
            return known[data]
        case kind.mjGEOM_SDF:
            compiled.refuse("geom", g, "a signed distance field; use a mesh", "large")
    return None


def _height_field(model: Any, field: int) -> Shape:
    """MuJoCo stores heights from 0 to 1, rows along y and columns along x, both ascending."""
    rows, columns, start = model.hfield_nrow[field], model.hfield_ncol[field], model.hfield_adr[field]
    half_x, half_y, elevation, _ = model.hfield_size[field]
    data = model.hfield_data[start : start + rows * columns].astype(np.float64)
    return shapes.HeightField(elevation * data.reshape(rows, columns), 2 * float(half_x), 2 * float(half_y))


def _hull(compiled: Compiled, geom: int, mesh: int) -> Shape:
    """The convex hull of a mesh: that of MuJoCo, which <mesh maxhullvert> may have simplified.

    mesh_graph holds the number of corners and of faces, then per corner where its edges are and its vertex.
    """
    m = compiled.model
    start = m.mesh_vertadr[mesh]
    vertices = m.mesh_vert[start : start + m.mesh_vertnum[mesh]].astype(np.float64)
    if (graph := m.mesh_graphadr[mesh]) >= 0:
        corners = m.mesh_graph[graph]
        vertices = vertices[m.mesh_graph[graph + 2 + corners : graph + 2 + 2 * corners]]
    try:
        hull = shapes.Hull(vertices)
        _judge(compiled, geom, mesh, hull)
        return hull
    except ValueError:  # flat: no body has a hull without volume, but the ground of some scenes has
        compiled.refuse("geom", geom, "its hull has no volume; it is a thin plate here", "none")
    try:
        return shapes.Hull(thick(vertices))
    except InputError as error:
        element = compiled.element("geom", geom)
        place = f"{element.place}: {element}" if element else str(compiled.path)
        name = compiled.name("mesh", mesh)
        raise FileError(f'{place}: the convex hull of the mesh "{name}": {error}') from None


def _judge(compiled: Compiled, geom: int, mesh: int, hull: Shape) -> None:
    """Keeps the mesh where its hull fills dents. MJCF means the hull, URDF the mesh."""
    m = compiled.model
    first, face = m.mesh_vertadr[mesh], m.mesh_faceadr[mesh]
    triangles = m.mesh_face[face : face + m.mesh_facenum[mesh]]
    if not len(triangles):
        return
    whole = shapes.Mesh(m.mesh_vert[first : first + m.mesh_vertnum[mesh]].astype(np.float64), triangles)
    if not (what := told(whole, hull)):
        return
    element = compiled.element("geom", geom)
    body = compiled.name("body", int(m.geom_bodyid[geom]))
    name = "" if element else f'a mesh of "{body}": '
    effect = "small" if compiled.root.tag == "robot" else "none"
    compiled.issues.dent(hull, whole, element, name + what, effect)


def thick(vertices: Array) -> Array:
    """The points (n, 3) moved to both sides along the directions in which they have almost no extent."""
    try:
        _, _, axes = np.linalg.svd(vertices - vertices.mean(axis=0), full_matrices=True)
    except np.linalg.LinAlgError:  # of what is not finite, which the hull refuses
        return vertices
    extent = np.ptp(vertices @ axes.T, axis=0)
    for axis in axes[extent < THIN * extent.max()]:
        shift = 0.5 * THIN * extent.max() * axis
        vertices = np.concatenate([vertices - shift, vertices + shift])
    return vertices


def with_friction(geom: Geom, friction: float) -> Geom:
    return replace(geom, material=replace(geom.material, friction=friction))
