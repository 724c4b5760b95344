"""Shapes as prims of USD: primitives where USD has them, else meshes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....checks import Array
from ....model import shapes
from ....model.shapes import Shape
from ....model.transforms import Transform
from ....model.visuals import TriangleMesh


def place(xform: Any, frame: Transform, scale: Sequence[float] | None = None) -> None:
    """Translation, quaternion and scale in double precision."""
    from pxr import Gf, UsdGeom

    double = UsdGeom.XformOp.PrecisionDouble
    xform.AddTranslateOp(double).Set(Gf.Vec3d(*frame.position))
    xform.AddOrientOp(double).Set(Gf.Quatd(*frame.rotation))
    if scale is not None:
        xform.AddScaleOp(double).Set(Gf.Vec3d(*scale))


def attribute(prim: Any, name: str, kind: str, value: object) -> None:
    """Set an attribute of a schema that usd-core does not know, as PhysX's."""
    from pxr import Sdf

    prim.CreateAttribute(name, getattr(Sdf.ValueTypeNames, kind), True).Set(value)


def define(
    stage: Any, path: str, shape: Shape | TriangleMesh, frame: Transform, *, collides: bool = True
) -> Any:
    """The prim of a collider or visual, at a place in the prim above."""
    from pxr import UsdGeom

    scale: Sequence[float] | None = None
    if isinstance(shape, shapes.Box):
        made, scale = UsdGeom.Cube.Define(stage, path), shape.half
        made.CreateSizeAttr(2.0)
    elif isinstance(shape, shapes.Sphere):
        made = UsdGeom.Sphere.Define(stage, path)
        made.CreateRadiusAttr(shape.radius)
    elif isinstance(shape, shapes.Ellipsoid):
        made, scale = UsdGeom.Sphere.Define(stage, path), shape.radii
        made.CreateRadiusAttr(1.0)
    elif isinstance(shape, shapes.Capsule | shapes.Cylinder):
        kind = UsdGeom.Capsule if isinstance(shape, shapes.Capsule) else UsdGeom.Cylinder
        made = kind.Define(stage, path)
        made.CreateRadiusAttr(shape.radius)
        made.CreateHeightAttr(2 * shape.half_length)
        made.CreateAxisAttr(UsdGeom.Tokens.z)
    elif isinstance(shape, shapes.Plane):
        made = UsdGeom.Plane.Define(stage, path)
        made.CreateAxisAttr(UsdGeom.Tokens.z)
    else:
        made = _mesh(stage, path, shape, collides)
    place(made, frame, scale)
    return made.GetPrim()


def _mesh(stage: Any, path: str, shape: Shape | TriangleMesh, collides: bool) -> Any:
    from pxr import UsdGeom, UsdPhysics, Vt

    made = UsdGeom.Mesh.Define(stage, path)
    points, triangles = _grid(shape) if isinstance(shape, shapes.HeightField) else _triangles(shape)
    made.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
    made.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(triangles), 3, dtype=np.int32)))
    made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(triangles.astype(np.int32).ravel()))
    made.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    if collides:
        approximation = "convexHull" if isinstance(shape, shapes.Hull) else "none"
        UsdPhysics.MeshCollisionAPI.Apply(made.GetPrim()).CreateApproximationAttr(approximation)
    return made


def _triangles(shape: Any) -> tuple[Array, Array]:
    return np.array(shape.vertices), np.array(shape.triangles)


def _grid(field: shapes.HeightField) -> tuple[Array, Array]:
    """Two triangles for each cell, counter-clockwise seen from above."""
    rows, columns = field.heights.shape
    x = np.linspace(-0.5, 0.5, columns) * field.size_x
    y = np.linspace(-0.5, 0.5, rows) * field.size_y
    across, along = np.meshgrid(x, y)
    points = np.stack((across.ravel(), along.ravel(), field.heights.ravel()), axis=1)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    right, up = corner + 1, corner + columns
    triangles = np.concatenate(
        (np.stack((corner, right, up + 1), axis=1), np.stack((corner, up + 1, up), axis=1))
    )
    return points, triangles
