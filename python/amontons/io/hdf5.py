"""HDF5 access that turns every failure into one sentence with the name of the file and the dataset.

Nothing is read before the description of it was: the type, the shape, and that what it declares can be in a
file of its size. Links, values in other files and filters that HDF5 would load as programs are refused.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np
import scipy.sparse as sp

from ..errors import FileError, InputError
from ..limits import COMPRESSION, DEFAULT, Limits, plausible, readable
from .files import told_at
from .object_header import is_virtual

T = TypeVar("T")
Table = np.ndarray[Any, Any]

FILTERS = {
    h5py.h5z.FILTER_DEFLATE: "gzip",
    h5py.h5z.FILTER_SHUFFLE: "shuffle",
    h5py.h5z.FILTER_FLETCHER32: "fletcher32",
    h5py.h5z.FILTER_SZIP: "szip",
    h5py.h5z.FILTER_LZF: "lzf",
}
"""Permitted filters: none of them can expand a few bytes to a large array."""
SLACK = 1 << 20
"""Bytes of a chunk that are always in proportion: a small dataset may have one larger than what it holds."""
ELSEWHERE = "the values of {} lie in other files; store them in this one"
TEXT = 1 << 28
"""Bytes of a text at most."""


def open_hdf5(path: Path, what: str, opened: Callable[[Path], h5py.File] = h5py.File) -> h5py.File:
    """The file, opened for reading; FileError if it is none, with `what` is wanted: "a recording"."""
    try:
        return opened(path)
    except Exception:  # whatever the library says of a damaged file
        raise FileError(f"{path}: is no HDF5 file, or truncated or damaged; give {what}") from None


class Reader:
    """A group of an HDF5 file with checked access."""

    def __init__(self, path: Path, group: h5py.Group, limits: Limits = DEFAULT) -> None:
        self.path, self.group, self.limits = path, group, limits
        self.most = min(limits.memory, plausible(path.stat().st_size))
        """bytes of numbers that the file can hold, and is allowed to"""

    def name(self, key: str) -> str:
        return f"{self._own_name}/{key}"

    @property
    def _own_name(self) -> str:
        with self.damage("the file"):
            return str(self.group.name or "").rstrip("/")

    def fail(self, message: str) -> FileError:
        return FileError(f"{self.path}: {message}")

    @contextmanager
    def damage(self, what: str) -> Iterator[None]:
        """Whatever the HDF5 library raises in the block, and that is not documented, means a damaged file."""
        try:
            yield
        except InputError:
            raise
        except Exception as error:
            reason = " ".join(str(error).split())[:300]
            raise self.fail(f"{what} cannot be read; the file is damaged ({reason})") from None

    def meaning(self, what: str) -> AbstractContextManager[None]:
        """Lets what is wrong with the content of the file (InputError) name file and place."""
        return told_at(f"{self.path}: {what}")

    def names(self) -> list[str]:
        with self.damage(f"the group {self._own_name or '/'}"):
            return list(self.group)

    def has(self, key: str) -> bool:
        with self.damage(self.name(key)):
            return self.group.get(key, getlink=True) is not None

    def _item(self, key: str) -> Any:
        """The object of a key; None if there is none."""
        with self.damage(self.name(key)):
            link = self.group.get(key, getlink=True)
            if link is None:
                return None
            if not isinstance(link, h5py.HardLink):
                raise self.fail(f"{self.name(key)} is a link to another place; store what it leads to there")
            if is_virtual(self.path, self.group, key):
                raise self.fail(ELSEWHERE.format(self.name(key)))
            return self.group.get(key)

    def sub(self, key: str) -> Reader:
        group = self._item(key)
        if not isinstance(group, h5py.Group):
            raise self.fail(f"the group {self.name(key)} is missing")
        return Reader(self.path, group, self.limits)

    def dataset(self, key: str, *, in_parts: bool = False) -> h5py.Dataset:
        """A dataset of which type, shape and storage are sound; its values have not been read.

        in_parts: it will not be read as a whole, so that only its chunks must fit into memory.
        """
        item = self._item(key)
        if not isinstance(item, h5py.Dataset):
            raise self.fail(f"the dataset {self.name(key)} is missing")
        with self.damage(f"the dataset {self.name(key)}"):
            self._require_stored(key, item, in_parts)
        return item

    def _require_stored(self, key: str, dataset: h5py.Dataset, in_parts: bool) -> None:
        """FileError unless what the dataset declares lies in this file."""
        if dataset.shape is None:
            raise self.fail(f"{self.name(key)} declares no values")
        properties = dataset.id.get_create_plist()
        if properties.get_layout() == h5py.h5d.VIRTUAL or properties.get_external_count():
            raise self.fail(ELSEWHERE.format(self.name(key)))
        for k in range(properties.get_nfilters()):
            if properties.get_filter(k)[0] not in FILTERS:
                known = ", ".join(FILTERS.values())
                raise self.fail(f"{self.name(key)} is packed by a filter that is not read; known are {known}")
        declared = math.prod(map(int, dataset.shape)) * dataset.id.get_type().get_size()
        item = dataset.dtype.itemsize  # raises where NumPy has no such type
        chunk = math.prod(map(int, dataset.chunks)) * item if dataset.chunks else 0
        taken = chunk if in_parts else max(declared, chunk)
        if taken > self.limits.memory:
            raise self.fail(
                f"{self.name(key)} asks for {readable(taken)}, more than the limit of "
                f"{readable(self.limits.memory)}; raise it with limits=amontons.Limits(memory=...)"
            )
        # Values that were never written are zeros: real files have such solutions. So the size of the file
        # counts, not that of what is stored of the dataset.
        size = self.path.stat().st_size
        if declared > (COMPRESSION * size if in_parts else plausible(size)) or chunk > max(SLACK, self.most):
            raise self.fail(
                f"{self.name(key)} declares {readable(max(declared, chunk))}, which a file of "
                f"{readable(size)} cannot hold; the file is damaged"
            )

    def array(self, key: str, kinds: str = "iuf") -> Table:
        """The values of a dataset whose type is of one of NumPy's kinds."""
        dataset = self.dataset(key)
        with self.damage(f"the dataset {self.name(key)}"):
            if dataset.dtype.kind not in kinds:
                wanted = "integers" if kinds == "iu" else "real numbers" if "f" in kinds else "a table"
                raise self.fail(f"{self.name(key)} must hold {wanted}, not {dataset.dtype}")
            return np.asarray(dataset[()])

    def table(self, key: str, columns: np.dtype[Any]) -> Table:
        """The rows of a dataset of records as those of `columns`; see `require_columns`."""
        self.require_columns(self.dataset(key), key, columns)
        return self.array(key, "V").astype(columns)

    def require_columns(
        self, dataset: h5py.Dataset, key: str, columns: np.dtype[Any], optional: Sequence[str] = ()
    ) -> None:
        """FileError unless the dataset is a list of records with these fields, of these kinds and shapes."""
        with self.damage(f"the dataset {self.name(key)}"):
            found, names = dataset.dtype, columns.names or ()
            if found.names is None or len(dataset.shape) != 1:
                raise self.fail(f"{self.name(key)} must be a list of records, not {dataset.shape} of {found}")
            for name in names:
                if name not in found.names:
                    if name in optional:
                        continue
                    raise self.fail(f"{self.name(key)} has no column {name!r}")
                kind, wanted = found[name].base.kind, columns[name].base.kind
                alike = (
                    kind == wanted or (kind in "iuf" and wanted in "iuf") or (kind == "S" and wanted == "U")
                )
                if not alike or found[name].shape != columns[name].shape:
                    raise self.fail(f"{self.name(key)}: the column {name!r} must not be {found[name]}")

    def integer(self, key: str) -> int:
        dataset = self.dataset(key)
        if dataset.size != 1 or dataset.dtype.kind not in "iu":
            raise self.fail(f"{self.name(key)} must be one integer")
        return int(self.array(key).ravel()[0])

    def integers(self, key: str) -> Table:
        dataset = self.dataset(key)
        values = self.array(key, "iu" if dataset.size else "iuf").ravel()
        if values.dtype.kind == "u" and values.size and values.max() > np.iinfo(np.int64).max:
            raise self.fail(f"{self.name(key)} holds {values.max()}, beyond 64-bit integers")
        return values.astype(np.int64)

    def vector(self, key: str, size: int) -> Table:
        dataset = self.dataset(key)
        if dataset.size != size:
            raise self.fail(f"{self.name(key)} has {dataset.size} entries; the matrices ask for {size}")
        return self.finite(key, self.array(key).ravel())

    def finite(self, key: str, values: Table) -> Table:
        """The values as float64, all of which are finite."""
        with np.errstate(over="ignore"):  # of numbers of 128 bits
            values = np.ascontiguousarray(values, dtype=np.float64)
        bad = np.argwhere(~np.isfinite(values))
        if bad.size:
            raise self.fail(f"{self.name(key)}[{', '.join(map(str, bad[0]))}] is not finite")
        return values

    def text(self, key: str) -> str:
        """A string, fixed or variable length, or "" where there is none."""
        if not self.has(key):
            return ""
        dataset = self.dataset(key)
        with self.damage(f"the dataset {self.name(key)}"):
            if h5py.check_string_dtype(dataset.dtype) is None or dataset.size > 1:
                raise self.fail(f"{self.name(key)} must be one text")
            if dataset.dtype.itemsize > TEXT:
                raise self.fail(f"{self.name(key)} is longer than {readable(TEXT)}")
            value = dataset[()]
            if isinstance(value, np.ndarray):
                value = value.ravel()[0] if value.size else b""
            if isinstance(value, bytes):
                value = value.decode("utf-8", "replace")
            return str(value).rstrip("\0").strip()

    def parsed(self, key: str, parse: Callable[[str], T]) -> T:
        """Returns the result of `parse`; InputError and every error of a parser mean a damaged file."""
        text = self.text(key)
        try:
            return parse(text)
        except (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError) as error:
            reason = " ".join(str(error).split())[:300]
            raise self.fail(f"{self.name(key)} cannot be read; the file is damaged ({reason})") from None

    def require_version(self, newest: int) -> None:
        """FileError if a newer amontons wrote the file, or none."""
        if (version := self.integer("version")) < 1:
            raise self.fail(f"has version {version} of the format; the first is 1: the file is damaged")
        if version > newest:
            raise self.fail(
                f"has version {version} of the format; this amontons reads up to {newest}: update it"
            )


@contextmanager
def hdf5_image(
    libver: tuple[str, str] = ("earliest", "v110"),
) -> Iterator[tuple[h5py.File, Callable[[], bytes]]]:
    """A file in memory, and a function that gives its bytes when the block is over.

    HDF5 writes no file itself: where a disk is full it neither closes the file nor lets the process end. The
    driver "core" would do, but the image that HDF5 1.14.2 (h5py 3.10 and 3.11) gives of its files in the
    format 1.10 has a wrong checksum.
    """
    memory = io.BytesIO()
    with h5py.File(memory, "w", libver=libver) as file:
        yield file, memory.getvalue


def write_integer(group: h5py.Group, key: str, value: int) -> None:
    group.create_dataset(key, data=np.array([value], dtype=np.int32))


def write_text(group: h5py.Group, key: str, text: str) -> None:
    """A scalar of fixed length that ends with NUL, as the C library of FCLIB reads it."""
    data = text.encode("utf-8", "backslashreplace") + b"\0"
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
