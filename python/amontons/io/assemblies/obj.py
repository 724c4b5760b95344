"""Wavefront OBJ: objects and groups as blocks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import FileError
from .shells import Shell, mesh, split


class _Lines:
    """Corners, and the faces of each object and of each group, as the lines of a file add them."""

    def __init__(self) -> None:
        self.points: list[tuple[float, float, float]] = []
        self.objects: dict[str, list[list[int]]] = {}
        self.groups: dict[str, list[list[int]]] = {}
        self._object, self._group = "", ""

    def add(self, words: list[str]) -> None:
        """The words of a line; ValueError if they are wrong."""
        if words[0] == "v":
            x, y, z = map(float, words[1:4])
            self.points.append((x, y, z))
        elif words[0] == "o":
            self._object = " ".join(words[1:])
        elif words[0] == "g":
            self._group = " ".join(words[1:])
        elif words[0] == "f":
            face = [_corner(word, len(self.points)) for word in words[1:]]
            self.objects.setdefault(self._object, []).append(face)
            self.groups.setdefault(self._group, []).append(face)

    def named(self) -> dict[str, list[list[int]]]:
        """Faces by object; by group if there are no objects."""
        named = self.objects if len(self.objects) > 1 or "" not in self.objects else self.groups
        return {"": named["default"]} if list(named) == ["default"] else named


def read_obj(path: Path) -> list[Shell]:
    """The shells of each object, or of each group where there are no objects; faces may be polygons."""
    lines = _Lines()
    text = path.read_text(encoding="utf-8", errors="replace").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        if not words:
            continue
        try:
            lines.add(words)
        except ValueError as error:
            shown = line.strip()[:80]
            raise FileError(
                f"{path}, line {number}: {shown!r} is no OBJ ({error}); export it again"
            ) from None
    vertices = np.array(lines.points, dtype=np.float64).reshape(-1, 3)
    if not np.isfinite(vertices).all():
        raise FileError(f"{path}: holds a corner that is not finite; export it again")
    shells = []
    for name, faces in lines.named().items():
        used = sorted({k for face in faces for k in face})
        place = {k: i for i, k in enumerate(used)}
        made = mesh(vertices[used], [[place[k] for k in face] for face in faces])
        if len(made[1]):
            shells += split(Shell(name, *made))
    return shells


def _corner(word: str, known: int) -> int:
    """The index of a corner of a face; negative ones count from the last vertex."""
    index = int(word.split("/")[0])
    place = index - 1 if index > 0 else known + index
    if index == 0 or not 0 <= place < known:
        raise ValueError(f"vertex {index} of {known}")
    return place
