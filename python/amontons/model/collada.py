"""Collada files (.dae), which MuJoCo does not read, as the points of which a collision mesh takes the hull.

Positions of the geometries that the scene shows, moved by its nodes, in metres: <unit meter> counts, and
<up_axis> does not, as in the viewers of ROS, for which URDF files are made.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ..checks import Array
from .transforms import axis_angle, rotation_matrix

MOST = 10_000
"""Nodes at most: those that name each other would have no end."""


def read(path: Path) -> Array | None:
    """The points (n, 3); None of a file that is malformed, or whose scene shows nothing."""
    try:
        tree = ElementTree.parse(path)
        found = [moved(matrix, points) for matrix, points in _Scene(tree.getroot()).shown()]
    except (ElementTree.ParseError, ValueError, KeyError, IndexError, RecursionError):
        return None
    points = np.concatenate(found) if found else np.zeros((0, 3))
    return points if len(points) >= 4 and np.isfinite(points).all() else None


def read_triangles(path: Path) -> Array | None:
    """The corners of all triangles (3 n, 3), polygons cut from their first corner; None as in `read`."""
    try:
        scene = _Scene(ElementTree.parse(path).getroot())
        found = [moved(matrix, points) for matrix, points in scene.shown(triangles=True)]
    except (ElementTree.ParseError, ValueError, KeyError, IndexError, RecursionError):
        return None
    corners = np.concatenate(found) if found else np.zeros((0, 3))
    return corners if len(corners) and np.isfinite(corners).all() else None


def moved(matrix: Array, points: Array) -> Array:
    return points @ matrix[:3, :3].T + matrix[:3, 3]


class _Scene:
    """The elements of a file by their id."""

    def __init__(self, root: ElementTree.Element) -> None:
        for element in root.iter():  # tags come with their namespace in front
            element.tag = str(element.tag).rpartition("}")[2]
        self.root = root
        self.visited = 0
        self.by_id = {f"#{element.get('id')}": element for element in root.iter()}

    def shown(self, *, triangles: bool = False) -> Iterator[tuple[Array, Array]]:
        """Points, of the vertices or the corners of triangles, with the matrix (4, 4) that moves them."""
        self.triangles = triangles
        unit = self.root.find("asset/unit")
        scale = float(unit.get("meter", "1")) if unit is not None else 1.0
        scene = self.root.find("scene/instance_visual_scene")
        if scene is not None:
            for node in self.by_id[scene.attrib["url"]].findall("node"):
                yield from self._of(node, np.diag([scale, scale, scale, 1.0]))

    def _of(self, node: ElementTree.Element, outer: Array) -> Iterator[tuple[Array, Array]]:
        self.visited += 1
        if self.visited > MOST:
            raise ValueError("nodes of a scene name each other")
        matrix = outer
        for child in node:
            matrix = matrix @ _transformation(child)
        for instance in node.findall("instance_geometry"):
            geometry = self.by_id[instance.attrib["url"]]
            for source in geometry.iterfind("mesh/vertices/input[@semantic='POSITION']"):
                points = self._points(self.by_id[source.attrib["source"]])
                if not self.triangles:
                    yield matrix, points
                    continue
                for faces in ("triangles", "polylist"):
                    for primitive in geometry.iterfind(f"mesh/{faces}"):
                        yield matrix, points[_corners(primitive)]
        for child in node.findall("node"):
            yield from self._of(child, matrix)
        for instance in node.findall("instance_node"):
            yield from self._of(self.by_id[instance.attrib["url"]], matrix)

    def _points(self, source: ElementTree.Element) -> Array:
        values = _numbers(source.find("float_array"))
        accessor = source.find("technique_common/accessor")
        stride = int(accessor.get("stride", "3")) if accessor is not None else 3
        return values.reshape(-1, stride)[:, :3]


def _corners(primitive: ElementTree.Element) -> np.ndarray:
    """The vertices of the triangles (3 n,) of <triangles> or <polylist>, whose <p> holds for every corner an
    index per input."""
    inputs = [(int(i.get("offset", "0")), i.get("semantic")) for i in primitive.findall("input")]
    stride = 1 + max(offset for offset, _ in inputs)
    offset = next(offset for offset, semantic in inputs if semantic == "VERTEX")
    indices = _numbers(primitive.find("p")).astype(np.int64).reshape(-1, stride)[:, offset]
    counts = _numbers(primitive.find("vcount")).astype(np.int64)
    if primitive.tag == "triangles" or (counts == 3).all():
        return indices
    fans, first = [], 0
    for count in counts:
        corners = indices[first : first + count]
        fans += [(corners[0], corners[k], corners[k + 1]) for k in range(1, count - 1)]
        first += count
    return np.array(fans, dtype=np.int64).ravel()


def _numbers(element: ElementTree.Element | None) -> Array:
    text = element.text if element is not None else None  # <float_array count="0"/> has none
    return np.array((text or "").split(), dtype=np.float64)


def _transformation(element: ElementTree.Element) -> Array:
    """The transform of one child of a node; the identity for elements that move nothing."""
    matrix = np.eye(4)
    if element.tag == "matrix":
        return _numbers(element).reshape(4, 4)
    if element.tag == "translate":
        matrix[:3, 3] = _numbers(element)
    elif element.tag == "scale":
        matrix[:3, :3] = np.diag(_numbers(element))
    elif element.tag == "rotate":
        *axis, angle = _numbers(element).tolist()
        matrix[:3, :3] = rotation_matrix(axis_angle(tuple(axis), np.radians(angle)))
    return matrix
