"""An HDF5 file that grows by rows, and can be read after any end of the process that writes it.

Between two writes the file is closed: whole, and readable by every program. Within a write, some
milliseconds, it is open for a single writer and many readers (SWMR): HDF5 then writes what is pointed to
before what points to it, so that a process killed in between leaves a file that still opens
(`h5py.File(path, swmr=True)`), with rows of some datasets that those written after them lack. Room for the
rows is taken from the disk before HDF5 is called, since a full disk within a write is more than it survives.
"""

from __future__ import annotations

import os
import stat
import struct
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ...errors import FileError
from .. import system
from ..files import writable, write_whole

try:
    import fcntl
except ImportError:  # no locks on this system
    fcntl = None  # type: ignore[assignment]

LONGEST_WAIT = 10.0
"""Seconds for a reader in this process to close the file."""
LIBVER = ("v110", "v110")
"""SWMR needs the format of HDF5 1.10 (2016) or newer."""

Array = np.ndarray[Any, Any]

# HDF5 must not be caught within a write by a fork: the child would have the file open, too.
_writing = threading.RLock()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=_writing.acquire, after_in_parent=_writing.release, after_in_child=_writing.release
    )


class GrowingFile:
    """Made of the bytes of an HDF5 file with extensible datasets; `append` adds rows to them."""

    def __init__(self, path: Path, image: bytes, *, overwrite: bool) -> None:
        self.path = writable(path, new=not overwrite)
        self._handle = _create(self.path, image, overwrite)

    def append(self, rows: Mapping[str, Array], **scalars: int) -> None:
        """Add rows to datasets, in this order, then set scalars.

        Raises FileError, with nothing changed, where that fails.
        """
        with _writing:
            self._require_ours()
            try:
                self._write(rows, scalars)
            except OSError as error:
                raise FileError(
                    f"{self.path}: cannot be written any further ({error.strerror or error}); what was "
                    "recorded before is in it"
                ) from None

    def close(self) -> None:
        """Let others overwrite the file."""
        if self._handle >= 0:
            os.close(self._handle)
        self._handle = -1

    def _require_ours(self) -> None:
        try:
            found = os.stat(self.path)
        except OSError:
            found = None
        if found is None or not os.path.samestat(found, os.fstat(self._handle)):
            raise FileError(
                f"{self.path}: was removed or replaced while it was recorded; record to another name"
            )

    def _write(self, rows: Mapping[str, Array], scalars: Mapping[str, int]) -> None:
        size = os.fstat(self._handle).st_size
        if rows and hasattr(os, "posix_fallocate"):
            try:
                os.posix_fallocate(self._handle, size, sum(map(_room, rows.values())))
            except OSError:
                os.ftruncate(self._handle, size)  # what was taken is given back
                raise
        file = _opened(self.path)
        try:
            if rows:
                file.swmr_mode = True
            for name, values in rows.items():
                dataset = file[name]
                first = len(dataset)
                dataset.resize(first + len(values), axis=0)
                dataset[first:] = values
                dataset.flush()
            for name, value in scalars.items():
                file[name][...] = value
            file.flush()
        except BaseException:
            _abandon(file)
            raise
        file.close()


CHUNK = 65536
"""Bytes of a chunk: what is full is never written again, what is not is, each time that rows come in."""


def extensible(
    group: h5py.Group,
    name: str,
    dtype: np.dtype[Any],
    shape: tuple[int, ...] = (),
    *,
    compressed: bool = False,
) -> h5py.Dataset:
    """A dataset of no rows that grows along its first axis.

    compressed: for what fills chunks quickly. A compressed chunk that is written again may need more room,
    and leaves its old place empty; others stay where they are.
    """
    row = max(1, dtype.itemsize * int(np.prod(shape)))
    packing = dict(compression="gzip", compression_opts=1, shuffle=True) if compressed else {}
    return group.create_dataset(
        name,
        shape=(0, *shape),
        maxshape=(None, *(n or None for n in shape)),  # a model without joints: HDF5 has no chunks of nothing
        dtype=dtype,
        chunks=(max(1, CHUNK // row), *(max(1, n) for n in shape)),
        **packing,
    )


def _room(values: Array) -> int:
    """Bytes that rows take at most: their own, a chunk begun before and one begun now, what finds them."""
    return values.nbytes + values.nbytes // 64 + 2 * CHUNK + 2 * values[:1].nbytes + 4096


def _create(path: Path, image: bytes, overwrite: bool) -> int:
    """The file with these bytes, and a descriptor that holds its lock."""
    if overwrite and path.exists():
        handle = _opened_regular(path)
        try:
            _lock(handle, path)
            if system.WINDOWS:  # which replaces no file that is open
                os.close(handle)
                handle = -1
            write_whole({path: image})  # keeps the mode
        finally:
            if handle >= 0:
                os.close(handle)
    else:
        write_whole({path: image}, new=True)
    handle = _opened_regular(path)
    try:
        _lock(handle, path)
    except FileError:
        os.close(handle)
        raise
    return handle


def _opened_regular(path: Path) -> int:
    """A descriptor of a file that was found to be regular, whatever has its name by now."""
    handle = os.open(os.path.realpath(path), os.O_RDWR | system.CAREFUL)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise FileError(f"{path}: was replaced by what is no regular file")
    return handle


def _lock(handle: int, path: Path) -> None:
    """A lock of the open file, which ends with the process; readers and HDF5 do not ask for it.

    macOS has none of that kind: its locks end when HDF5 closes the file, or keep readers away.
    """
    if system.WINDOWS:
        if not system.lock(handle):
            raise FileError(
                f"{path}: is being recorded by another program or by this one; close that recorder first"
            )
        return
    if fcntl is None or not hasattr(fcntl, "F_OFD_SETLK"):
        return
    whole = struct.pack("hhqqi", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
    try:
        fcntl.fcntl(handle, fcntl.F_OFD_SETLK, whole)
    except BlockingIOError:
        raise FileError(
            f"{path}: is being recorded by another program or by this one; close that recorder first"
        ) from None
    except OSError:  # a file system without locks
        pass


def _opened(path: Path) -> h5py.File:
    """The file, to be written; waits while somebody in this process reads it by other means than ours.

    HDF5 opens a file of one process either for reading or for writing, and goes by the driver and the file.
    `read_recording` takes another driver. Locks of HDF5 would keep readers of other processes away.
    """
    end = time.monotonic() + LONGEST_WAIT
    while True:
        try:
            return h5py.File(path, "r+", libver=LIBVER, locking=False)
        except OSError as error:
            if "already open" not in str(error) or time.monotonic() > end:
                raise
        time.sleep(0.02)


def _abandon(file: h5py.File) -> None:
    """Close a file that cannot be written: HDF5 would try to until the process ends, and beyond.

    It is given a file in memory for what it still wants to write; that on the disk stays as it is.
    """
    try:
        handle = file.id.get_vfd_handle()
        memory = os.memfd_create("amontons")
        os.dup2(memory, handle)
        os.close(memory)
    except (AttributeError, OSError):  # no such thing on this system
        pass
    with suppress(OSError, RuntimeError):
        file.close()
