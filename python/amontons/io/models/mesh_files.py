"""Triangles of mesh files, and the shapes that collide in their place."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...checks import Array
from ...errors import FileError, InputError
from ...model import shapes
from ...model.shapes import Shape
from . import collada, stl_text

SUFFIXES = (".stl", ".obj", ".ply", ".dae")
TELL = 0.05
"""The share of its own volume that a hull adds to a closed mesh, from which on it is told"""


def read_triangles(path: Path, part: str = "") -> shapes.Mesh:
    """The triangles of a file (m, as written); FileError if it holds none or is of another kind.

    part: the name of the one geometry that is taken; "" takes all.
    """
    kind = path.suffix.lower()
    if kind not in SUFFIXES:
        remedy = (
            "; export it as .stl or .obj from the program that made it" if kind in (".step", ".stp") else ""
        )
        raise FileError(f"{path}: is no {', '.join(SUFFIXES)} file{remedy}")
    if kind == ".dae":
        corners = collada.read_triangles(path)
    else:
        corners = stl_text.read(path)
    if corners is not None and not part:
        points, index = np.unique(corners, axis=0, return_inverse=True)
        return _mesh(path, points, index.reshape(-1, 3))
    return _by_trimesh(path, part)


def _by_trimesh(path: Path, part: str) -> shapes.Mesh:
    try:
        import trimesh
    except ImportError:
        raise FileError(f"{path}: meshes are read by trimesh: pip install trimesh") from None
    try:
        scene: Any = trimesh.load_scene(path)
        if part:
            found = {name: mesh for name, mesh in scene.geometry.items() if name == part}
            if not found:
                known = ", ".join(scene.geometry) or "none"
                raise FileError(f'{path}: has no part "{part}"; it has {known}')
            mesh = next(iter(found.values()))
        else:
            mesh = scene.to_mesh()
        return _mesh(path, np.asarray(mesh.vertices), np.asarray(mesh.faces))
    except FileError:
        raise
    except Exception as error:  # whatever its parsers raise of a damaged file
        raise FileError(f"{path}: cannot be read as a mesh ({' '.join(str(error).split())[:200]})") from None


def _mesh(path: Path, points: Any, triangles: Any) -> shapes.Mesh:
    try:
        return shapes.Mesh(np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int32))
    except (InputError, ValueError) as error:
        raise FileError(f"{path}: holds no triangles that can be read: {error}") from None


def scaled(mesh: shapes.Mesh, matrix: Array) -> shapes.Mesh:
    """The mesh after a linear map (3, 3); a mirror image turns its triangles round."""
    if np.array_equal(matrix, np.eye(3)):
        return mesh
    turned = np.linalg.det(matrix) < 0
    return shapes.Mesh(mesh.vertices @ matrix.T, mesh.triangles[:, ::-1] if turned else mesh.triangles)


def added_volume(mesh: shapes.Mesh, hull: Shape) -> float | None:
    """m^3 that a hull has beyond a closed mesh; None of a mesh that is open or faces inwards."""
    try:
        return max(hull.volume() - mesh.volume(), 0.0)
    except InputError:
        return None


def told(mesh: shapes.Mesh, hull: Shape) -> str:
    """What an entry of the list says of a hull in place of a mesh; "" if they are alike."""
    added = added_volume(mesh, hull)
    if added is None:
        return "the mesh is not closed; its convex hull collides"
    if added <= TELL * mesh.volume():
        return ""
    return f"its convex hull collides, which adds {1e6 * added:.4g} cm^3 to {1e6 * mesh.volume():.4g} cm^3"


def cone(radius: float, length: float, sides: int = 48) -> shapes.Hull:
    """A cone about z with its tip up, its centre half way; a pyramid whose corners lie on its rim."""
    angles = 2 * np.pi * np.arange(sides) / sides
    rim = np.column_stack(
        (radius * np.cos(angles), radius * np.sin(angles), np.full(sides, -0.5 * length))
    )
    return shapes.Hull(np.vstack((rim, (0.0, 0.0, 0.5 * length))))


def prism(outline: Sequence[Sequence[float]], height: float) -> shapes.Hull:
    """The hull of an outline in x and y, raised along z from 0 to `height` (m)."""
    flat = np.asarray(outline, dtype=np.float64)
    low, high = (np.column_stack((flat, np.full(len(flat), z))) for z in (0.0, height))
    return shapes.Hull(np.vstack((low, high)))
