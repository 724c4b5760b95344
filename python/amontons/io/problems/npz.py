"""NumPy archives, read without trust: the directory of the zip file and the header of every array are checked
before memory is taken, and nothing in them is evaluated."""

from __future__ import annotations

import math
import re
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ...errors import FileError
from ...limits import Limits, plausible, readable

MEMBERS = 1000
"""Arrays of an archive at most."""
SLACK = 1 << 12
MAGIC = b"\x93NUMPY"
HEADER = re.compile(
    rb"\{ *'descr': *'(?P<kind>[<>=|]?[biufSU]\d{1,9})', *'fortran_order': *(?P<fortran>True|False), *"
    rb"'shape': *\((?P<shape>(?: *\d{1,18}L? *,)*(?: *\d{1,18}L?)?) *\) *,? *\} *\n?"
)
"""The header of an array as NumPy writes it (numpy.lib.format), of numbers, truths or texts."""


class Archive:
    """The arrays of an archive by name; each is read on first use."""

    def __init__(self, path: Path, limits: Limits) -> None:
        self.path, self._limits = path, limits
        self._left = min(limits.memory, plausible(path.stat().st_size) + SLACK)
        self._members: dict[str, zipfile.ZipInfo] = {}
        with self._damage(), zipfile.ZipFile(path) as file:
            for info in file.infolist():
                name = info.filename.removesuffix(".npy")
                if name in self._members or len(self._members) >= MEMBERS:
                    twice = f"the array {name[:100]!r} twice"
                    what = twice if name in self._members else f"more than {MEMBERS} arrays"
                    raise self._fail(f"is damaged: it holds {what}")
                self._members[name] = info

    def _fail(self, message: str) -> FileError:
        return FileError(f"{self.path}: {message}")

    @contextmanager
    def _damage(self) -> Iterator[None]:
        """zipfile does not say what it raises on damage, and zlib.error is no OSError."""
        try:
            yield
        except FileError:
            raise
        except Exception as error:
            reason = " ".join(str(error).split())[:300]
            raise self._fail(f"is no NumPy archive of a problem, or is truncated ({reason})") from None

    def _unpacked(self, name: str) -> bytes:
        """The bytes of a member, no more than it says that it has."""
        info = self._members[name]
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) or info.flag_bits & 1:
            raise self._fail(f"the array {name!r} is packed in a way that NumPy does not use")
        if info.file_size > self._left or info.file_size > plausible(info.compress_size) + SLACK:
            raise self._fail(
                f"the array {name!r} declares {readable(info.file_size)} and stores "
                f"{readable(info.compress_size)} of it: the file is damaged, or beyond the limit of "
                f"{readable(self._limits.memory)}, which limits=amontons.Limits(memory=...) raises"
            )
        with self._damage(), zipfile.ZipFile(self.path) as file, file.open(info) as member:
            data = member.read(info.file_size + 1)
        if len(data) != info.file_size:
            raise self._fail(f"the array {name!r} is not as long as it declares; the file is damaged")
        return data

    def __contains__(self, name: str) -> bool:
        return name in self._members

    def __getitem__(self, name: str) -> np.ndarray:
        """FileError if the array is missing, of objects, or not as its header says."""
        if name not in self._members:
            found = ", ".join(sorted(self._members)) or "nothing"
            found = found if len(found) < 300 else f"{len(self._members)} other arrays"
            raise self._fail(f"the array {name!r} is missing; it holds {found}")
        return self._parsed(name, self._unpacked(name))

    def _parsed(self, name: str, data: bytes) -> np.ndarray:
        wide = 2 if data[6:7] == b"\x01" else 4  # bytes of the length of the header
        start = 8 + wide + int.from_bytes(data[8 : 8 + wide], "little")
        header = HEADER.fullmatch(data[8 + wide : start].rstrip(b" \n"))
        if data[:6] != MAGIC or data[6:8] not in (b"\x01\0", b"\x02\0", b"\x03\0") or header is None:
            raise self._fail(
                f"is no NumPy archive of a problem, or is damaged: the array {name!r} has no header of an "
                "array of numbers or text"
            )
        shape = tuple(int(n.strip(b" L")) for n in header["shape"].split(b",") if n.strip())
        try:
            dtype = np.dtype(header["kind"].decode())
        except TypeError:
            dtype = np.dtype("V")  # such as f3
        declared = math.prod(shape) * dtype.itemsize
        if dtype.kind not in "biufSU" or len(shape) > 8 or declared != len(data) - start:
            raise self._fail(
                f"the array {name!r} declares the shape {shape} of {header['kind'].decode()}, which is not "
                f"what its {len(data) - start} bytes hold"
            )
        values = np.frombuffer(data, dtype, count=math.prod(shape), offset=start)
        return values.reshape(shape, order="F" if header["fortran"] == b"True" else "C")

    def real(self, name: str) -> np.ndarray:
        """An array of finite or infinite numbers, but not of NaN."""
        values = self[name]
        if values.dtype.kind not in "iuf":
            raise self._fail(f"the array {name!r} must hold real numbers, not {values.dtype}")
        if values.dtype.kind == "f" and np.isnan(values).any():
            where = ", ".join(map(str, np.argwhere(np.isnan(values))[0]))
            raise self._fail(f"{name}[{where}] is not finite: it is no number")
        return values

    def integers(self, name: str, size: int | None = None) -> np.ndarray:
        """A vector of integers of 64 bits."""
        values = self[name]
        if values.ndim != 1 or (values.dtype.kind not in "iu" and values.size):
            raise self._fail(
                f"the array {name!r} must be a vector of integers, not {values.shape} of {values.dtype}"
            )
        if size is not None and len(values) != size:
            raise self._fail(f"the array {name!r} has {len(values)} entries; it must have {size}")
        if values.dtype.kind == "u" and values.size and values.max() > np.iinfo(np.int64).max:
            raise self._fail(f"the array {name!r} holds {values.max()}, beyond 64-bit integers")
        return values.astype(np.int64)

    def text(self, name: str) -> str:
        """A text; "" where there is none."""
        if name not in self._members:
            return ""
        values = self[name]
        if values.size > 1 or values.dtype.kind not in "US":
            raise self._fail(f"the array {name!r} must be one text, not {values.shape} of {values.dtype}")
        return self._words(name, np.atleast_1d(values))[0] if values.size else ""

    def words(self, name: str) -> list[str]:
        """A vector of texts, such as names of cones."""
        return self._words(name, self[name])

    def _words(self, name: str, values: np.ndarray) -> list[str]:
        if values.ndim != 1 or (values.dtype.kind not in "US" and values.size):
            raise self._fail(f"the array {name!r} must hold texts, not {values.shape} of {values.dtype}")
        try:
            listed = values.tolist()  # code points are checked here
        except (ValueError, OverflowError, SystemError):
            raise self._fail(f"the array {name!r} holds what is no text") from None
        return [w.decode("utf-8", "replace") if isinstance(w, bytes) else w for w in listed]
