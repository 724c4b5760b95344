"""Triangles of mesh files: STL, OBJ and PLY by trimesh, DAE and STL as text here."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..errors import FileError

SUFFIXES = (".stl", ".obj", ".ply", ".dae")
Surface = tuple[Array, NDArray[np.int32]]
"""Points (n, 3), in the unit of the file, and triangles (t, 3) of their indices"""


def read_triangles(path: Path, part: str = "") -> Surface:
    """The triangles of a file; FileError if it holds none or is of another kind.

    part: the name of the one geometry that is taken; "" takes all.
    """
    kind = path.suffix.lower()
    if kind not in SUFFIXES:
        remedy = (
            "export it as .stl or .obj from the program that made it"
            if kind in (".step", ".stp")
            else "convert it"
        )
        raise FileError(f"{path}: is no {', '.join(SUFFIXES)} file; {remedy}")
    from . import collada, stl_text

    corners = collada.read_triangles(path) if kind == ".dae" else stl_text.read(path)
    if corners is not None and not part:
        points, index = np.unique(corners, axis=0, return_inverse=True)
        return _mesh(path, points, index.reshape(-1, 3))
    if kind == ".dae" and not part:
        raise FileError(f"{path}: is no Collada file, or its scene shows no triangles; export it again")
    return _by_trimesh(path, part)


def _by_trimesh(path: Path, part: str) -> Surface:
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
        reason = " ".join(str(error).split())[:200]
        raise FileError(f"{path}: cannot be read as a mesh ({reason}); export it again") from None


def _mesh(path: Path, points: Any, triangles: Any) -> Surface:
    points, triangles = np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int32)
    if not len(triangles) or not np.isfinite(points).all():
        raise FileError(f"{path}: holds no triangles of finite points; export it again")
    return points, triangles


def is_closed(points: Array, triangles: NDArray[np.int32]) -> bool:
    """Whether each edge belongs to one triangle in either direction; points of the same place are one."""
    _, index = np.unique(points, axis=0, return_inverse=True)
    corners = index.reshape(-1)[triangles]
    edges = np.concatenate([corners[:, [k, (k + 1) % 3]] for k in range(3)])
    edges = edges[edges[:, 0] != edges[:, 1]]
    there, back = (np.unique(e, axis=0) for e in (edges, edges[:, ::-1]))
    return len(there) == len(edges) and np.array_equal(there, back)
