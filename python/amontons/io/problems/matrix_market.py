"""Matrix Market files (Boisvert, Pozo, Remington 1996), read by a reader of our own.

SciPy's trusts the file: it takes the memory that the size line asks for, and reads behind the end of a file
whose last number is cut off. The part of the format that a matrix A can be in is small: real or integer
numbers or a pattern, general or symmetric, as coordinates or as columns.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...errors import FileError
from ...limits import Limits, readable

PIECE = 1 << 22
"""Bytes that are split into words at a time."""


def read(path: Path, rows: int, limits: Limits) -> Any:
    """The matrix as a sparse (coordinates) or dense (columns) array of (rows, rows).

    Raises FileError naming what is wrong, before memory is taken for what the file only declares.
    """
    size = path.stat().st_size
    if size > limits.memory:
        raise _fail(path, f"has {readable(size)}, more than the limit of {readable(limits.memory)}")
    try:
        return _parsed(path, path.read_bytes(), rows, limits)
    except MemoryError:
        raise _fail(path, "does not fit into memory") from None


def _fail(path: Path, message: str) -> FileError:
    return FileError(f"{path}: {message}")


def _parsed(path: Path, data: bytes, rows: int, limits: Limits) -> Any:
    banner, _, rest = data.partition(b"\n")
    words = banner.decode("ascii", "replace").lower().split()
    if len(words) != 5 or words[:2] != ["%%matrixmarket", "matrix"]:
        raise _fail(path, "is no Matrix Market file: it does not begin with %%MatrixMarket matrix")
    layout, field, symmetry = words[2:]
    if layout not in ("coordinate", "array") or (layout == "array" and field == "pattern"):
        raise _fail(path, f"has the layout {layout[:40]!r} of {field[:40]!r}; known are coordinate and array")
    if field not in ("real", "double", "integer", "pattern"):
        raise _fail(path, f"holds {field[:40]!r} numbers; they must be real, integer or pattern")
    if symmetry not in ("general", "symmetric"):
        raise _fail(path, f"is {symmetry[:40]!r}; A must be general or symmetric")
    while rest.lstrip()[:1] == b"%" or (rest and not rest.split(b"\n", 1)[0].strip()):
        rest = rest.partition(b"\n")[2]
    line, _, body = rest.partition(b"\n")
    sizes = _sizes(path, line, 3 if layout == "coordinate" else 2)
    if sizes[0] != sizes[1] or sizes[0] != rows:
        raise _fail(path, f"is {sizes[0]} x {sizes[1]}; the archive beside it asks for {rows} x {rows}")
    if layout == "array":
        return _columns(path, body, rows, symmetry == "symmetric", limits)
    return _coordinates(path, body, rows, sizes[2], field == "pattern", symmetry == "symmetric")


def _sizes(path: Path, line: bytes, count: int) -> list[int]:
    words = line.split()
    if len(words) != count or not all(w.isdigit() and len(w) < 19 for w in words):
        shown = line[:60].decode("ascii", "replace").strip()
        raise _fail(path, f"has the size line {shown!r}; it must hold {count} integers that are not negative")
    return [int(word) for word in words]


def _numbers(path: Path, body: bytes, count: int) -> np.ndarray:
    """The numbers of the body, of which there must be as many as the size line says."""
    if b"_" in body:  # which float() takes within a number
        raise _fail(path, "holds a word that is no number")
    if 2 * count > len(body) + 1:  # a digit and a blank each
        raise _fail(path, f"is truncated: its {len(body)} bytes of entries cannot be {count} numbers")
    values, at = np.empty(count), 0
    for words in _pieces(body):
        if at + len(words) > count:
            raise _fail(path, f"has more numbers than the {count} that its size line says")
        try:
            values[at : at + len(words)] = np.fromiter(map(float, words), np.float64, len(words))
        except ValueError as error:
            raise _fail(path, f"is no Matrix Market file, or is truncated ({str(error)[:100]})") from None
        at += len(words)
    if at != count:
        raise _fail(path, f"is truncated: it has {at} of the {count} numbers that its size line says")
    if not np.isfinite(values).all():
        raise _fail(path, f"entry number {int(np.argmax(~np.isfinite(values))) + 1} is not finite")
    return values


def _pieces(body: bytes) -> Iterator[list[bytes]]:
    start = 0
    while start < len(body):
        end = body.find(b"\n", start + PIECE)
        end = len(body) if end < 0 else end
        yield body[start:end].split()
        start = end


def _columns(path: Path, body: bytes, n: int, symmetric: bool, limits: Limits) -> np.ndarray:
    """All entries column by column; of a symmetric matrix those from the diagonal down."""
    if 8 * n * n > limits.memory:
        raise _fail(path, f"is {n} x {n} with all entries, more than the limit of {readable(limits.memory)}")
    if not symmetric:
        return _numbers(path, body, n * n).reshape(n, n).T
    values = _numbers(path, body, n * (n + 1) // 2)
    columns, rows = np.triu_indices(n)
    matrix = np.zeros((n, n))
    matrix[rows, columns] = matrix[columns, rows] = values
    return matrix


def _coordinates(path: Path, body: bytes, n: int, nnz: int, pattern: bool, symmetric: bool) -> sp.csr_array:
    width = 2 if pattern else 3
    table = _numbers(path, body, nnz * width).reshape(nnz, width)
    indices = table[:, :2]
    wrong = np.flatnonzero(((indices < 1) | (indices > n) | (indices != np.floor(indices))).any(axis=1))
    if wrong.size:
        shown = ", ".join(f"{x:g}" for x in indices[wrong[0]])
        raise _fail(path, f"entry {wrong[0] + 1} is at ({shown}); rows and columns count from 1 to {n}")
    i, j = indices.astype(np.int64).T - 1
    x = np.ones(nnz) if pattern else table[:, 2]
    if symmetric:
        off = i != j
        i, j, x = np.concatenate([i, j[off]]), np.concatenate([j, i[off]]), np.concatenate([x, x[off]])
    return sp.csr_array((x, (i, j)), shape=(n, n))
