"""Assemblies of COMPAS as JSON: versions 1 and 2, compas_assembly, compas_cra, compas_dem, compas_model.

Their layouts differ, their meshes do not: a dictionary with "vertex" and "face", or lists "vertices" and
"faces". So the file is searched for meshes; each takes its name and marks from the dictionaries around it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...checks import Array
from ...errors import FileError
from .shells import Shell, mesh

SUPPORTS = ("is_support", "is_fixed", "fixed", "support", "is_boundary")
SKIPPED = {
    "edge",
    "adjacency",
    "interface",
    "interfaces",
    "interactions",
    "contacts",
    "edgedata",
    "facedata",
    "tree",
    "halfedge",
}
"""Keys below which no blocks are: contact surfaces are meshes too"""
DEEP = 60
"""Levels of dictionaries that are searched"""


@dataclass(frozen=True)
class Around:
    """Name and marks from the dictionaries around a mesh."""

    name: str = ""
    fixed: bool = False
    density: float | None = None
    friction: float | None = None
    placed: Any = None
    """(4, 4) of the element"""


def read_compas(path: Path) -> list[Shell]:
    """The blocks of an assembly, in the order of the file, those with numbers as names by number."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise FileError(
            f"{path}: is no JSON ({str(error)[:120]}); write it again by compas.json_dump"
        ) from None
    try:
        shells = list(_search(data, Around(), 0))
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise FileError(
            f"{path}: a mesh in it is not one of COMPAS ({type(error).__name__}: {str(error)[:120]}); "
            "write it again by compas.json_dump"
        ) from None
    if not shells:
        raise FileError(
            f"{path}: has no mesh of COMPAS, that is vertices and faces; give an assembly of blocks"
        )
    if all(shell.name.isdecimal() for shell in shells):
        shells.sort(key=lambda shell: int(shell.name))
    return shells


def _search(value: Any, around: Around, depth: int) -> Iterator[Shell]:
    if depth > DEEP:
        return
    if isinstance(value, list):
        for item in value:
            if isinstance(item, dict | list):
                yield from _search(item, around, depth + 1)
        return
    if not isinstance(value, dict):
        return
    around = _marked(value, around)
    found = _mesh_of(value)
    if found is not None:
        points, triangles = found
        if around.placed is not None:
            matrix = np.asarray(around.placed, dtype=np.float64)
            points = points @ matrix[:3, :3].T + matrix[:3, 3]
        yield Shell(around.name, points, triangles, around.fixed, around.density, around.friction)
        return
    for key, item in value.items():
        if key in SKIPPED or not isinstance(item, dict | list):
            continue
        if key == "node" and isinstance(item, dict):
            for name, node in item.items():
                yield from _search(node, replace(around, name=str(name).strip("'\"")), depth + 1)
        else:
            yield from _search(item, around, depth + 1)


def _marked(value: dict[str, Any], around: Around) -> Around:
    """The marks with those of this dictionary, its "attributes" and its "attr"."""
    for marks in (value, value.get("attributes"), value.get("attr")):
        if not isinstance(marks, dict):
            continue
        if isinstance(marks.get("name"), str) and not around.name:
            around = replace(around, name=marks["name"])
        if any(marks.get(key) is True or marks.get(key) == 1 for key in SUPPORTS):
            around = replace(around, fixed=True)
        density, friction = _number(marks, "density"), _number(marks, "friction", "mu")
        around = replace(
            around,
            density=around.density if density is None else density,
            friction=around.friction if friction is None else friction,
        )
        placed = marks.get("transformation")
        matrix = placed.get("data", placed).get("matrix") if isinstance(placed, dict) else None
        if matrix is not None:
            around = replace(around, placed=matrix)
    return around


def _number(marks: dict[str, Any], *keys: str) -> float | None:
    """The number under the first key that has one."""
    for key in keys:
        if isinstance(marks.get(key), int | float) and not isinstance(marks.get(key), bool):
            return float(marks[key])
    return None


def _mesh_of(value: dict[str, Any]) -> tuple[Array, Any] | None:
    """(vertices, triangles) of a dictionary that is a mesh, a polyhedron or a box; None of others."""
    vertex, face = value.get("vertex"), value.get("face")
    if isinstance(vertex, dict) and isinstance(face, dict) and vertex and face:
        place = {str(key): k for k, key in enumerate(vertex)}
        points = np.array([[v["x"], v["y"], v["z"]] for v in vertex.values()], dtype=np.float64)
        faces = [
            [place[str(v)] for v in (f if isinstance(f, list) else f["vertices"])] for f in face.values()
        ]
        return mesh(points, faces)
    vertices, polygons = value.get("vertices"), value.get("faces")
    if isinstance(vertices, list) and isinstance(polygons, list) and vertices and polygons:
        if isinstance(vertices[0], dict):
            vertices = [[v["x"], v["y"], v["z"]] for v in vertices]
        return mesh(np.array(vertices, dtype=np.float64).reshape(-1, 3), polygons)
    if {"xsize", "ysize", "zsize"} <= value.keys():
        return _box(value)
    return None


def _box(value: dict[str, Any]) -> tuple[Array, Any]:
    half = np.array([value[f"{axis}size"] for axis in "xyz"], dtype=np.float64) / 2
    frame = value.get("frame") or {}
    frame = frame.get("data", frame)
    x = np.array(frame.get("xaxis", (1, 0, 0)), dtype=np.float64)
    y = np.array(frame.get("yaxis", (0, 1, 0)), dtype=np.float64)
    axes = np.array([x, y, np.cross(x, y)])
    signs = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    points = signs * half @ axes + np.array(frame.get("point", (0, 0, 0)), dtype=np.float64)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return mesh(points, quads)
