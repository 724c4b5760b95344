"""HDF5 files whose writer was killed, or is within a write: read without waiting for it.

The superblock of such a file says that it is open for writing, so that HDF5 reads it only as one of the many
readers of a single writer (SWMR). It then takes a wrong checksum for a write that is about to be finished,
and tries again after 1, 2, 4, 8, ... ns, a hundred times: for ever, where the file is damaged. So HDF5 is
shown a superblock that says that the file is closed and ends where it ends. A file in which a write has just
begun may then seem damaged; who reads it looks again (`open_recording`).

After the HDF5 File Format Specification 3.0, II.A (superblock, version 3) and III.G (Jenkins' hash).
"""

from __future__ import annotations

import io
import os
import struct
from pathlib import Path

import h5py

HEAD = 44
"""Bytes of a superblock of version 3 with addresses of 8 bytes; its checksum follows."""
START = b"\x89HDF\r\n\x1a\n\x03\x08\x08"
MASK = 0xFFFFFFFF


def is_open_for_writing(path: Path) -> bool:
    """Whether the superblock says so."""
    with path.open("rb") as file:
        head = file.read(HEAD)
    return len(head) == HEAD and head.startswith(START) and head[11] != 0


def open_unfinished(path: Path) -> h5py.File:
    """The file as it is now; OSError where its superblock is damaged."""
    shown = _Closed(path)
    try:
        return h5py.File(shown, "r")
    except BaseException:
        shown.close()
        raise


class _Closed(io.RawIOBase):
    """The bytes of a file behind a superblock without the mark of a writer."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb", buffering=0)
        self._size = os.fstat(self._file.fileno()).st_size
        head = self._file.read(HEAD + 4)
        if len(head) < HEAD + 4 or struct.unpack("<I", head[HEAD:])[0] != lookup3(head[:HEAD]):
            self._file.close()
            raise OSError("the superblock is damaged")
        base = struct.unpack_from("<Q", head, 12)[0]
        end = struct.pack("<Q", max(self._size - base, 0))
        head = head[:11] + b"\0" + head[12:28] + end + head[36:HEAD]
        self._head = head + struct.pack("<I", lookup3(head))
        self._place = 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._place = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._place, os.SEEK_END: self._size}[whence]
        return self._place

    def tell(self) -> int:
        return self._place

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        into, place = memoryview(buffer).cast("B"), self._place
        wanted = len(into)
        if place + wanted > self._size:
            raise OSError(f"the file ends before byte {place + wanted}")
        self._file.seek(place)
        while into:
            count = self._file.readinto(into)
            if not count:
                raise OSError(f"the file ends before byte {place + wanted}")
            into = into[count:]
        if place < len(self._head):
            own = self._head[place : place + wanted]
            memoryview(buffer).cast("B")[: len(own)] = own
        self._place = place + wanted
        return wanted

    def close(self) -> None:
        self._file.close()
        super().close()


def lookup3(data: bytes) -> int:
    """Jenkins' hash of bytes, the checksum of HDF5's metadata (B. Jenkins, lookup3.c, hashlittle, 2006)."""
    a = b = c = (0xDEADBEEF + len(data)) & MASK
    last = max(0, (len(data) - 1) // 12 * 12)
    for at in range(0, last, 12):
        x, y, z = struct.unpack_from("<3I", data, at)
        a, b, c = _mixed((a + x) & MASK, (b + y) & MASK, (c + z) & MASK)
    if not data:
        return c
    x, y, z = struct.unpack("<3I", data[last:].ljust(12, b"\0"))
    a, b, c = (a + x) & MASK, (b + y) & MASK, (c + z) & MASK
    for turn in (14, 11, 25, 16, 4, 14, 24):
        c = ((c ^ b) - _turned(b, turn)) & MASK
        a, b, c = b, c, a
    return b


def _mixed(a: int, b: int, c: int) -> tuple[int, int, int]:
    for turn in (4, 6, 8, 16, 19, 4):
        a = ((a - c) & MASK) ^ _turned(c, turn)
        c = (c + b) & MASK
        a, b, c = b, c, a
    return a, b, c


def _turned(x: int, by: int) -> int:
    return (x << by | x >> 32 - by) & MASK
