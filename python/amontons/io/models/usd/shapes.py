"""Colliders of USD: gprims with CollisionAPI, their materials, and the mass that they give."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....checks import Array
from ....model import shapes
from ....model.parts import Material
from ....model.shapes import Shape
from ....model.transforms import IDENTITY, ORIGIN, Quaternion, Transform, axis_angle, rotation_matrix
from ..mesh_shapes import cone, scaled, told
from .stage import Scene, unscaled

TO_AXIS: dict[str, Quaternion] = {
    "X": axis_angle((0.0, 1.0, 0.0), math.pi / 2),
    "Y": axis_angle((1.0, 0.0, 0.0), -math.pi / 2),
    "Z": IDENTITY,
}
"""Turn z, the axis of our shapes and joints, to an axis of USD."""
ALIKE = 1e-4
"""Relative difference below which two scales are one; matrices in files are rounded"""
UNBOUND = Material(friction=0.5)
"""PhysX's surface of a collider without a material"""


@dataclass
class Colliders:
    """Reads shapes, each mesh once for its triangles."""

    scene: Scene
    materials: dict[str, tuple[Material, float]] = field(default_factory=dict)

    def read(self, prim: Any, frame: Transform, *, moves: bool) -> tuple[Shape, Transform] | None:
        """The shape of a gprim and its place in a body whose frame in the world is given; None is listed."""
        linear, at = self._seen_from(frame, prim)
        with self.scene.told(prim):
            found = self._shape(prim, linear, moves=moves)
        return None if found is None else (found[0], at @ found[1])

    def _seen_from(self, frame: Transform, prim: Any) -> tuple[Array, Transform]:
        """Linear map and origin of a prim in a frame of the world."""
        linear, origin = self.scene.matrix(prim)
        back = np.array(rotation_matrix(frame.rotation)).T
        return back @ linear, Transform(tuple((back @ (origin - np.array(frame.position))).tolist()))

    def surface(self, prim: Any, frame: Transform) -> tuple[shapes.Mesh, Transform]:
        """The triangles of a Mesh as they look, whatever collides in their place."""
        linear, at = self._seen_from(frame, prim)
        return scaled(self.triangles(prim), self.scene.metre * linear), at

    def _shape(self, prim: Any, linear: Array, *, moves: bool) -> tuple[Shape, Transform] | None:
        kind = str(prim.GetTypeName())
        if kind in ("Mesh",):
            return self._mesh(prim, linear, moves=moves)
        axis = TO_AXIS.get(str(self.scene.get(prim, "axis", "Z")), IDENTITY)
        along = linear @ np.array(rotation_matrix(axis))
        rotation, scale = unscaled(along)
        if not np.all(scale != 0):
            raise self.scene.error(prim, "its scale is zero")
        sheared = np.abs(_gram(along) - np.diag(scale**2)).max() > ALIKE * (scale**2).max()
        size = np.abs(scale) * self.scene.metre
        solid = self._primitive(prim, kind, size, moves=moves)
        if solid is None:
            return None
        if sheared:
            self.scene.refuse(prim, "a shape that is skewed by the scales above it; it is not skewed here")
        return solid, Transform(rotation=rotation)

    def _primitive(self, prim: Any, kind: str, size: Array, *, moves: bool) -> Shape | None:
        number = self.scene.number
        x, y, z = size.tolist()
        even = abs(x - y) <= ALIKE * x
        if kind not in ("Cube", "Plane", "Sphere") and not even:
            self.scene.refuse(prim, f"scales {x:.4g} and {y:.4g} m across its axis; their mean is taken")
        across = 0.5 * (x + y)
        match kind:
            case "Cube":
                half = 0.5 * number(prim, "size", 2.0)
                return shapes.Box((half * x, half * y, half * z))
            case "Sphere":
                radius = number(prim, "radius", 1.0)
                if even and abs(x - z) <= ALIKE * x:
                    return shapes.Sphere(radius * x)
                return shapes.Ellipsoid((radius * x, radius * y, radius * z))
            case "Capsule" | "Capsule_1" | "Cylinder" | "Cylinder_1":
                radius = across * self._radius(prim, kind)
                half = 0.5 * z * number(prim, "height", 2.0 if kind.startswith("Cylinder") else 1.0)
                made = shapes.Capsule if kind.startswith("Capsule") else shapes.Cylinder
                return made(radius, half)
            case "Cone":
                self.scene.refuse(prim, "a cone is a pyramid of 48 sides here", "none")
                return cone(across * number(prim, "radius", 1.0), z * number(prim, "height", 2.0))
            case "Plane" if not moves:
                return shapes.Plane()
        self.scene.refuse(prim, f"a collider of the kind {kind or 'without a type'}", "large")
        return None

    def _radius(self, prim: Any, kind: str) -> float:
        if not kind.endswith("_1"):
            return self.scene.number(prim, "radius", 0.5 if kind == "Capsule" else 1.0)
        top, bottom = (self.scene.number(prim, f"radius{end}", 0.5) for end in ("Top", "Bottom"))
        if top != bottom:
            self.scene.refuse(prim, f"radii {top:g} and {bottom:g}; the mean is taken")
        return 0.5 * (top + bottom)

    def _mesh(self, prim: Any, linear: Array, *, moves: bool) -> tuple[Shape, Transform] | None:
        mesh = scaled(self.triangles(prim), self.scene.metre * linear)
        approximation = str(self.scene.get(prim, "physics:approximation", "none"))
        if approximation == "boundingCube":
            return self._bounding_box(prim, linear)
        if approximation == "boundingSphere":
            centre = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
            radius = float(np.linalg.norm(mesh.vertices - centre, axis=1).max())
            return shapes.Sphere(radius), Transform(tuple(centre.tolist()))
        if not moves and approximation != "convexHull":
            return mesh, ORIGIN
        hull = shapes.Hull(mesh.vertices)
        if approximation != "convexHull" and (what := told(mesh, hull)):
            self.scene.issues.dent(hull, mesh, self.scene.at(prim), what)
        return hull, ORIGIN

    def _bounding_box(self, prim: Any, linear: Array) -> tuple[Shape, Transform]:
        """In the axes of the mesh."""
        points = self.triangles(prim).vertices
        low, high = points.min(axis=0), points.max(axis=0)
        rotation, scale = unscaled(linear)
        half = self.scene.metre * np.abs(scale) * (high - low) / 2
        centre = self.scene.metre * linear @ ((low + high) / 2)
        return shapes.Box(tuple(half.tolist())), Transform(tuple(centre.tolist()), rotation)

    def triangles(self, prim: Any) -> shapes.Mesh:
        """The surface of a Mesh in its own units, counter-clockwise from outside."""
        get = self.scene.get
        points = np.array(get(prim, "points", []), dtype=np.float64).reshape(-1, 3)
        counts = np.array(get(prim, "faceVertexCounts", []), dtype=np.int64)
        corners = np.array(get(prim, "faceVertexIndices", []), dtype=np.int64)
        if counts.sum() != len(corners) or not len(corners) or (counts < 0).any():
            raise self.scene.error(
                prim, "faceVertexCounts and faceVertexIndices do not fit together; export it again"
            )
        if corners.min() < 0 or corners.max() >= len(points):
            raise self.scene.error(
                prim, f"a face names point {corners.max()}; there are {len(points)}; export it again"
            )
        starts = np.concatenate(([0], np.cumsum(counts)[:-1]))
        cuts = np.maximum(counts - 2, 0)
        first = np.repeat(starts, cuts)
        step = np.arange(cuts.sum()) - np.repeat(np.cumsum(cuts) - cuts, cuts)
        found = np.stack((corners[first], corners[first + step + 1], corners[first + step + 2]), axis=1)
        if str(get(prim, "orientation", "rightHanded")) == "leftHanded":
            found = found[:, ::-1]
        return shapes.Mesh(points, found.astype(np.int32))

    def material(self, prim: Any, fallback: Any = None) -> tuple[Material, float]:
        """The surface of a collider and its density (kg/m^3), 0 if it has none."""
        from pxr import UsdPhysics, UsdShade

        bound, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
        found = bound.GetPrim() if bound else None
        if not found or not found.HasAPI(UsdPhysics.MaterialAPI):
            found = fallback
        if not found:
            return UNBOUND, 0.0
        key = str(found.GetPath())
        if key not in self.materials:
            self.materials[key] = self._material(found)
        return self.materials[key]

    def _material(self, prim: Any) -> tuple[Material, float]:
        scene = self.scene
        dynamic = scene.number(prim, "physics:dynamicFriction")
        static = scene.number(prim, "physics:staticFriction")
        if static < dynamic and prim.GetAttribute("physics:staticFriction").HasAuthoredValue():
            scene.refuse(prim, f"staticFriction {static:g} below the dynamicFriction {dynamic:g}")
        stiffness = scene.number(prim, "physxMaterial:compliantContactStiffness") * scene.kilogram
        damping = scene.number(prim, "physxMaterial:compliantContactDamping") * scene.kilogram
        density = scene.number(prim, "physics:density") * scene.kilogram / scene.metre**3
        with scene.told(prim):
            material = Material(
                friction=dynamic,
                friction_static=static if static > dynamic else None,
                restitution=scene.number(prim, "physics:restitution"),
                compliance=1 / stiffness if stiffness > 0 else 0.0,
                relaxation_time=damping / stiffness if stiffness > 0 else 0.0,
            )
        return material, density


def _gram(linear: Array) -> Array:
    return linear.T @ linear
