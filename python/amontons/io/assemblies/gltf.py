"""glTF and GLB by trimesh: nodes as blocks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FileError, InputError
from .shells import Shell, split


def read_gltf(path: Path) -> list[Shell]:
    """The shells of each node with a mesh, in the axes of the file."""
    try:
        import trimesh
    except ImportError:
        raise InputError(f"{path}: glTF is read by trimesh: pip install trimesh") from None
    try:
        scene: Any = trimesh.load_scene(path, process=False)
        shells = []
        for node in scene.graph.nodes_geometry:
            matrix, geometry = scene.graph[node]
            mesh = scene.geometry[geometry]
            faces = getattr(mesh, "faces", None)
            if faces is None or not len(faces):
                continue  # lines and points
            points = np.asarray(mesh.vertices, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
            extras = getattr(mesh, "metadata", {}) or {}
            fixed = bool(extras.get("fixed", False) or extras.get("support", False))
            triangles = np.asarray(faces, dtype=np.int64)
            if np.linalg.det(matrix[:3, :3]) < 0:
                triangles = triangles[:, ::-1]
            shells += split(Shell(str(node), points, triangles, fixed=fixed))
        return shells
    except Exception as error:  # whatever its parsers raise of a damaged file
        reason = " ".join(str(error).split())[:200]
        raise FileError(f"{path}: cannot be read as glTF ({reason}); export it again") from None
