"""STL files written as text, which MuJoCo does not read."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..checks import Array

VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)")


def read(path: Path) -> Array | None:
    """The corners of the triangles (3 n, 3); None of a binary file and of other kinds of files.

    A binary file may begin with "solid" as well, but holds 84 bytes and 50 per triangle.
    """
    if path.suffix.lower() != ".stl":
        return None
    data = path.read_bytes()
    triangles = int.from_bytes(data[80:84], "little")
    if not data.lstrip().startswith(b"solid") or len(data) == 84 + 50 * triangles:
        return None
    try:
        corners = np.array(VERTEX.findall(data), dtype=np.float64)
    except ValueError:
        return None
    return corners if len(corners) >= 4 and len(corners) % 3 == 0 else None
