"""Collisions and visuals of SDF: shapes, surfaces, colours."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ....errors import FileError
from ....limits import Limits
from ....model import shapes
from ....model.parts import Material
from ....model.shapes import Shape
from ....model.transforms import ORIGIN, Transform, Vector3, rotation_to_z
from ..elements import Element
from ..issues import Issues
from ..mesh_shapes import cone, prism, read_mesh, scaled, told
from .values import bound, find, flag, floats, text, value, vector

HARD = 1e5
"""N/m; ODE's contacts that are at least as stiff are rigid here"""
PATCH = 3 * math.pi / 16
"""Torque of a patch of contact of radius a that turns: 3 pi / 16 a mu N (Gazebo, Torsional friction)."""
EVERY = 0xFFFF


@dataclass
class Shapes:
    """Reads shapes; meshes are read once each."""

    issues: Issues
    limits: Limits
    known: dict[tuple[str, str], shapes.Mesh] = field(default_factory=dict)

    def read(self, holder: Element, *, moves: bool) -> list[tuple[Shape, Transform]]:
        """The shapes of a <collision> or <visual>, each in the frame of the element; none is listed."""
        geometry = holder.child("geometry")
        for element in geometry.children if geometry is not None else []:
            with element.told():
                return self._shape(element, moves=moves)
        self.issues.add(holder, "it has no <geometry>", "large")
        return []

    def _shape(self, e: Element, *, moves: bool) -> list[tuple[Shape, Transform]]:
        radius, half = value(e, "radius", 1.0), 0.5 * value(e, "length", 1.0)
        match e.tag:
            case "empty":
                return []
            case "box":
                x, y, z = vector(e, "size", (1.0, 1.0, 1.0))
                return [(shapes.Box((0.5 * x, 0.5 * y, 0.5 * z)), ORIGIN)]
            case "sphere":
                return [(shapes.Sphere(radius), ORIGIN)]
            case "cylinder":
                return [(shapes.Cylinder(radius, half), ORIGIN)]
            case "capsule":
                return [(shapes.Capsule(radius, half), ORIGIN)]
            case "ellipsoid":
                return [(shapes.Ellipsoid(vector(e, "radii", (1.0, 1.0, 1.0))), ORIGIN)]
            case "cone":
                self.issues.add(e, "a cone is a pyramid of 48 sides here", "none")
                return [(cone(radius, 2 * half), ORIGIN)]
            case "plane" if not moves:
                normal = np.array(vector(e, "normal", (0.0, 0.0, 1.0)))
                unit = tuple((normal / np.linalg.norm(normal)).tolist())
                return [(shapes.Plane(), Transform((0.0, 0.0, 0.0), rotation_to_z(unit)))]
            case "polyline":
                return self._polylines(e)
            case "mesh":
                return self._mesh(e, moves=moves)
        what = "a plane on a link that moves" if e.tag == "plane" else "this kind of geometry"
        self.issues.add(e, f"{what}; use a mesh or a primitive", "large")
        return []

    def _polylines(self, e: Element) -> list[tuple[Shape, Transform]]:
        points = [floats(point, 2) for point in e.all("point")]
        solid = prism(points, value(e, "height", 1.0))
        x, y = np.array(points).T
        area = 0.5 * abs(float(x @ np.roll(y, 1) - y @ np.roll(x, 1)))
        added = solid.volume() - area * value(e, "height", 1.0)
        if added > 1e-6 * solid.volume():
            self.issues.add(e, f"its convex hull collides, which adds {1e6 * added:.4g} cm^3")
        return [(solid, ORIGIN)]

    def _mesh(self, e: Element, *, moves: bool) -> list[tuple[Shape, Transform]]:
        uri = text(e, "uri")
        part = text(e.child("submesh") or e, "name") if e.child("submesh") is not None else ""
        path = find(e, uri, self.limits)
        key = str(path), part
        if key not in self.known:
            try:
                self.known[key] = read_mesh(path, part)
            except FileError as error:
                raise e.fault(error) from None
        mesh = self.known[key]
        if part and flag(e.child("submesh"), "center"):
            low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
            mesh = shapes.Mesh(mesh.vertices - (low + high) / 2, mesh.triangles)
        mesh = scaled(mesh, np.diag(vector(e, "scale", (1.0, 1.0, 1.0))))
        if not moves and not e.attributes.get("optimization", "").startswith("convex"):
            return [(mesh, ORIGIN)]
        hull = shapes.Hull(mesh.vertices)
        if what := told(mesh, hull):
            self.issues.dent(hull, mesh, e, what)
        return [(hull, ORIGIN)]


@dataclass(frozen=True)
class Surface:
    """The contacts of a <collision>; direction: in the frame of the collision."""

    material: Material
    direction: Vector3 | None
    bits: int


def surface(collision: Element, issues: Issues) -> Surface:
    """SDF's defaults: a friction of 1, no rebound, contacts with all."""
    e = collision.child("surface")
    friction = e.child("friction") if e is not None else None
    ode, bullet = ((friction.child(tag) if friction else None) for tag in ("ode", "bullet"))
    along = bound(ode, "mu", bound(bullet, "friction", 1.0))
    across = bound(ode, "mu2", bound(bullet, "friction2", along))
    given = vector(ode or bullet, "fdir1", (0.0, 0.0, 0.0))
    direction = tuple(given) if any(given) and across != along else None
    if across != along and direction is None:
        issues.add(ode or bullet, "two coefficients without fdir1; the first holds in all directions")
    most = 1e6  # "infinite" friction; a contact cannot slide long before
    material = Material(
        friction=min(along, most), friction_across=None if direction is None else min(across, most)
    )
    if ode is not None and any(value(ode, tag, 0.0) for tag in ("slip1", "slip2")):
        issues.add(ode, "slip, a friction that grows with speed")
    contact = e.child("contact") if e is not None else None
    bits = EVERY
    if contact is not None:
        bits = (
            int(text(contact, "collide_bitmask", str(EVERY)), 0)
            if contact.child("collide_bitmask")
            else EVERY
        )
        if flag(contact, "collide_without_contact"):
            bits = 0
        material = _soft(contact.child("ode"), material)
    bounce = e.child("bounce") if e is not None else None
    torsion = friction.child("torsional") if friction is not None else None
    return Surface(
        replace(
            material,
            restitution=min(max(value(bounce, "restitution_coefficient", 0.0), 0.0), 1.0),
            torsional_friction=_torsion(torsion, issues),
        ),
        direction,  # type: ignore[arg-type]
        bits & EVERY,
    )


def _soft(ode: Element | None, material: Material) -> Material:
    stiffness, damping = value(ode, "kp", math.inf), max(value(ode, "kd", 0.0), 0.0)
    if not 0 < stiffness < HARD:
        return material
    return replace(material, compliance=1 / stiffness, relaxation_time=damping / stiffness)


def _torsion(torsional: Element | None, issues: Issues) -> float:
    """m, moment over normal force."""
    if torsional is None:
        return 0.0
    coefficient = value(torsional, "coefficient", 1.0)
    if not flag(torsional, "use_patch_radius", default=True):
        issues.add(torsional, "surface_radius: a patch that grows with depth; contacts have no depth here")
        return 0.0
    return PATCH * max(coefficient, 0.0) * max(value(torsional, "patch_radius", 0.0), 0.0)


def colour(visual: Element) -> tuple[float, ...] | None:
    material = visual.child("material")
    diffuse = material.child("diffuse") if material is not None else None
    values = floats(diffuse) if diffuse is not None else []
    if len(values) == 3:
        values.append(1.0)
    return tuple(min(max(x, 0.0), 1.0) for x in values) if len(values) == 4 else None
