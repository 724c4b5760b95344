"""Meshes of model files, and the shapes that collide in their place."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...checks import Array
from ...errors import InputError
from ...model import shapes
from ...model.mesh_files import is_closed, read_triangles
from ...model.shapes import Shape
from ..files import told_at

TELL = 0.05
"""The share of its own volume that a hull adds to a closed mesh, from which on it is listed"""


def read_mesh(path: Path, part: str = "") -> shapes.Mesh:
    """The triangles of a file, or of one of its parts, taken for metres; FileError if it holds none."""
    with told_at(path):
        return shapes.Mesh(*read_triangles(path, part))


def scaled(mesh: shapes.Mesh, matrix: Array) -> shapes.Mesh:
    """The mesh after a linear map (3, 3); a mirror image turns its triangles round."""
    if np.array_equal(matrix, np.eye(3)):
        return mesh
    turned = np.linalg.det(matrix) < 0
    return shapes.Mesh(mesh.vertices @ matrix.T, mesh.triangles[:, ::-1] if turned else mesh.triangles)


def _inside_out(mesh: shapes.Mesh) -> bool:
    """Whether the triangles of a closed mesh face inwards, or enclose nothing."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) <= 0


def told(mesh: shapes.Mesh, hull: Shape) -> str:
    """The text of the entry for a hull in place of a mesh; "" if they are alike."""
    if not is_closed(mesh.vertices, mesh.triangles) or _inside_out(mesh):
        return "the mesh is not closed, or faces inwards; its convex hull collides"
    try:
        added = max(hull.volume() - mesh.volume(), 0.0)
    except InputError:  # of almost no volume
        return "the mesh encloses almost nothing; its convex hull collides"
    if added <= TELL * mesh.volume():
        return ""
    return f"its convex hull collides, which adds {1e6 * added:.4g} cm^3 to {1e6 * mesh.volume():.4g} cm^3"


def cone(radius: float, length: float, sides: int = 48) -> shapes.Hull:
    """A cone about z with its tip up, its centre half way; a pyramid whose corners lie on its rim."""
    angles = 2 * np.pi * np.arange(sides) / sides
    rim = np.column_stack((radius * np.cos(angles), radius * np.sin(angles), np.full(sides, -0.5 * length)))
    return shapes.Hull(np.vstack((rim, (0.0, 0.0, 0.5 * length))))


def prism(outline: Sequence[Sequence[float]], height: float) -> shapes.Hull:
    """The hull of an outline in x and y, raised along z from 0 to `height` (m)."""
    flat = np.asarray(outline, dtype=np.float64)
    low, high = (np.column_stack((flat, np.full(len(flat), z))) for z in (0.0, height))
    return shapes.Hull(np.vstack((low, high)))
