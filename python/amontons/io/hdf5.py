"""HDF5 access that turns every failure into one sentence with the name of the file and the dataset."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np
import scipy.sparse as sp

from ..errors import FileError

T = TypeVar("T")

TRIPLET_LABELS = "nz is the number of triplets, -1 for compressed columns, -2 for compressed rows"


class Reader:
    """A group of an HDF5 file with checked access."""

    def __init__(self, path: Path, group: h5py.Group) -> None:
        self.path, self.group = path, group

    def name(self, key: str) -> str:
        return f"{self.group.name.rstrip('/')}/{key}"

    def fail(self, message: str) -> FileError:
        return FileError(f"{self.path}: {message}")

    def has(self, key: str) -> bool:
        return key in self.group

    def sub(self, key: str) -> Reader:
        if not isinstance(self.group.get(key), h5py.Group):
            raise self.fail(f"the group {self.name(key)} is missing")
        return Reader(self.path, self.group[key])

    def array(self, key: str) -> np.ndarray[Any, Any]:
        dataset = self.group.get(key)
        if not isinstance(dataset, h5py.Dataset):
            raise self.fail(f"the dataset {self.name(key)} is missing")
        try:
            return np.asarray(dataset[()])
        except (OSError, RuntimeError) as error:
            raise self.fail(
                f"the dataset {self.name(key)} cannot be read; the file is damaged ({error})"
            ) from None

    def integer(self, key: str) -> int:
        values = self.array(key).ravel()
        if values.size != 1 or values.dtype.kind not in "iu":
            raise self.fail(f"{self.name(key)} must be one integer")
        return int(values[0])

    def integers(self, key: str) -> np.ndarray[Any, Any]:
        values = self.array(key).ravel()
        if values.size and values.dtype.kind not in "iu":
            raise self.fail(f"{self.name(key)} must hold integers, not {values.dtype}")
        return values.astype(np.int64)

    def vector(self, key: str, size: int) -> np.ndarray[Any, Any]:
        values = self.array(key).ravel()
        if values.size and values.dtype.kind not in "iuf":
            raise self.fail(f"{self.name(key)} must hold real numbers, not {values.dtype}")
        if len(values) != size:
            raise self.fail(f"{self.name(key)} has {len(values)} entries; the matrices ask for {size}")
        values = values.astype(np.float64)
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise self.fail(f"{self.name(key)}[{bad[0]}] is not finite")
        return values

    def text(self, key: str) -> str:
        """A string, fixed or variable length, or "" where there is none."""
        dataset = self.group.get(key)
        if not isinstance(dataset, h5py.Dataset):
            return ""
        value = dataset[()]
        if isinstance(value, np.ndarray):
            value = value.ravel()[0] if value.size else b""
        if isinstance(value, bytes):
            value = value.decode("utf-8", "replace")
        return str(value).rstrip("\0").strip()

    def parsed(self, key: str, parse: Callable[[str], T]) -> T:
        """What `parse` makes of a text."""
        try:
            return parse(self.text(key))
        except (ValueError, TypeError, KeyError, IndexError, AttributeError) as error:
            raise self.fail(f"{self.name(key)} cannot be read; the file is damaged ({error})") from None

    def require_version(self, newest: int) -> None:
        """FileError if a newer amontons wrote the file."""
        if (version := self.integer("version")) > newest:
            raise self.fail(
                f"has version {version} of the format; this amontons reads up to {newest}: update it"
            )

    def matrix(self, key: str) -> sp.csr_array:
        """A matrix of the FCLIB layout: m, n, nz and p, i, x, whose meaning depends on nz."""
        g = self.sub(key)
        m, n, nz = g.integer("m"), g.integer("n"), g.integer("nz")
        if m < 0 or n < 0:
            raise self.fail(f"{self.name(key)} has a negative size, {m} x {n}")
        if nz < -2:
            raise self.fail(f"{self.name(key)}/nz = {nz} is no known storage; {TRIPLET_LABELS}")
        p, i, x = g.integers("p"), g.integers("i"), g.array("x").ravel()
        if x.size and x.dtype.kind not in "iuf":
            raise self.fail(f"{self.name(key)}/x must hold real numbers, not {x.dtype}")
        matrix = g._triplets(m, n, nz, p, i, x) if nz >= 0 else g._compressed(m, n, nz, p, i, x)
        bad = np.flatnonzero(~np.isfinite(matrix.data))
        if bad.size:
            raise self.fail(f"{self.name(key)}/x: an entry is not finite")
        return matrix

    def _triplets(self, m: int, n: int, nz: int, p: Any, i: Any, x: Any) -> sp.csr_array:
        # Real files have i = row and p = column (the comment in fclib.h says the reverse), and arrays that
        # may be longer than the nz entries in use.
        for key, array in (("i", i), ("p", p), ("x", x)):
            if len(array) < nz:
                raise self.fail(f"{self.name(key)} has {len(array)} entries but nz = {nz}; {TRIPLET_LABELS}")
        rows, columns, values = i[:nz], p[:nz], x[:nz]
        self._require_indices("i", rows, m)
        self._require_indices("p", columns, n)
        return sp.csr_array((values.astype(np.float64), (rows, columns)), shape=(m, n))

    def _compressed(self, m: int, n: int, nz: int, p: Any, i: Any, x: Any) -> sp.csr_array:
        major, minor = (n, m) if nz == -1 else (m, n)
        if len(p) != major + 1 or p[0] != 0 or np.any(np.diff(p) < 0):
            raise self.fail(
                f"{self.name('p')} must hold {major + 1} ascending pointers from 0 on (nz = {nz}); "
                f"{TRIPLET_LABELS}"
            )
        nnz = int(p[-1])
        for key, array in (("i", i), ("x", x)):
            if len(array) < nnz:
                raise self.fail(
                    f"{self.name(key)} has {len(array)} entries but {self.name('p')} ends at {nnz}"
                )
        self._require_indices("i", i[:nnz], minor)
        parts = (x[:nnz].astype(np.float64), i[:nnz], p)
        matrix = sp.csc_array(parts, shape=(m, n)) if nz == -1 else sp.csr_array(parts, shape=(m, n))
        matrix = sp.csr_array(matrix)
        matrix.sum_duplicates()
        return matrix

    def _require_indices(self, key: str, indices: Any, size: int) -> None:
        bad = np.flatnonzero((indices < 0) | (indices >= size))
        if bad.size:
            raise self.fail(f"{self.name(key)}[{bad[0]}] = {indices[bad[0]]} is outside 0..{size - 1}")


@contextmanager
def hdf5_image(
    libver: tuple[str, str] = ("earliest", "v110"),
) -> Iterator[tuple[h5py.File, Callable[[], bytes]]]:
    """A file in memory, and a function that gives its bytes when the block is over.

    HDF5 writes no file itself: where a disk is full it neither closes the file nor lets the process end.
    """
    data: list[bytes] = []
    name = f"amontons-{next(_images)}"  # which HDF5 takes for the identity of the file
    with h5py.File(name, "w", driver="core", backing_store=False, libver=libver) as file:
        yield file, lambda: data[0]
        file.flush()
        data.append(file.id.get_file_image())


_images = itertools.count()


def write_integer(group: h5py.Group, key: str, value: int) -> None:
    group.create_dataset(key, data=np.array([value], dtype=np.int32))


def write_text(group: h5py.Group, key: str, text: str) -> None:
    """A scalar of fixed length that ends with NUL, as the C library of FCLIB reads it."""
    data = text.encode("utf-8") + b"\0"
    kind = h5py.h5t.C_S1.copy()
    kind.set_size(len(data))
    kind.set_strpad(h5py.h5t.STR_NULLTERM)
    space = h5py.h5s.create(h5py.h5s.SCALAR)
    dataset = h5py.h5d.create(group.id, key.encode(), kind, space)
    dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, np.array(data, dtype=f"S{len(data)}"), mtype=kind)


def write_matrix(group: h5py.Group, key: str, matrix: sp.sparray, storage: str) -> None:
    g = group.create_group(key)
    if storage == "triplet":
        stored = sp.coo_array(matrix)
        nz, p, i = stored.nnz, stored.coords[1], stored.coords[0]
    else:
        stored = sp.csc_array(matrix) if storage == "csc" else sp.csr_array(matrix)
        nz, p, i = (-1 if storage == "csc" else -2), stored.indptr, stored.indices
    for name, value in (("nzmax", stored.nnz), ("m", matrix.shape[0]), ("n", matrix.shape[1]), ("nz", nz)):
        write_integer(g, name, value)
    g.create_dataset("p", data=p.astype(np.int32))
    g.create_dataset("i", data=i.astype(np.int32))
    g.create_dataset("x", data=stored.data.astype(np.float64))
