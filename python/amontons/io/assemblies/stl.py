"""STL, text and binary: solids as blocks."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import FileError
from .shells import Shell, split

SOLID = re.compile(rb"^\s*solid\b([^\n\r]*)", re.MULTILINE)
VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)")
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(path: Path) -> list[Shell]:
    """The shells of each solid of a file as text, or of a binary file, which has no names."""
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) >= 84 + 50 * count and not _is_text(data, count):
        corners = np.frombuffer(data, dtype=RECORD, count=count, offset=84)["corners"].astype(np.float64)
        return _shells(path, "", corners.reshape(-1, 3))
    heads = list(SOLID.finditer(data))
    if not heads or b"vertex" not in data:
        raise FileError(f"{path}: is no STL file, or is cut off; export it again")
    shells = []
    for head, end in zip(heads, [*(h.start() for h in heads[1:]), len(data)], strict=True):
        try:
            corners = np.array(VERTEX.findall(data[head.end() : end]), dtype=np.float64)
        except ValueError:
            raise FileError(f"{path}: a corner is no number; export it again") from None
        name = head.group(1).decode("utf-8", errors="replace").strip()
        if len(corners):
            shells += _shells(path, name, corners)
    return shells


def _is_text(data: bytes, count: int) -> bool:
    return data.lstrip().startswith(b"solid") and len(data) != 84 + 50 * count and b"vertex" in data[:4000]


def _shells(path: Path, name: str, corners: np.ndarray) -> list[Shell]:
    if len(corners) % 3 or not np.isfinite(corners).all():
        raise FileError(
            f"{path}: solid {name!r} has {len(corners)} corners, or some that are not finite; export it again"
        )
    return split(Shell(name, corners, np.arange(len(corners)).reshape(-1, 3)))
