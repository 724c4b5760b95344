"""Functions for files and processes that Linux, macOS and Windows have under different names.

Windows has no links that `open` could refuse to follow, and no pipes in folders. It opens files as text
unless a flag forbids it. It neither replaces nor removes a file that somebody has open.
"""

from __future__ import annotations

import os
import stat
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:
    fcntl = None  # type: ignore[assignment]

WINDOWS = sys.platform == "win32"
BINARY = getattr(os, "O_BINARY", 0)
"""Flag of `os.open`: bytes as they are."""
CAREFUL = BINARY | sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC"))
"""Flags of `os.open` for a name that somebody else may have given to a link or a pipe."""
PATIENCE = 2.0
"""Seconds that a rename waits on Windows for who has the file open: scanners and indexers do for moments."""
FAR = 1 << 62
"""Bytes: where a lock on Windows lies, beyond all that is ever read, as locks there stop readers, too."""


def replace(source: Path, target: Path) -> None:
    """The file takes the place of another at once; OSError if it cannot."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            os.replace(source, target)
            return
        except PermissionError:
            if not WINDOWS or time.monotonic() > end:
                raise
        time.sleep(0.02)


def put_new(source: Path, target: Path) -> None:
    """The file gets a name that nobody has; FileExistsError if somebody has it. The old name may stay."""
    if WINDOWS:
        os.rename(source, target)  # refuses what is there; file systems of memory sticks have no links
    else:
        os.link(source, target)


def take_over(handle: int, of: os.stat_result) -> None:
    """Mode and, where the system lets us, owner of the file that is replaced."""
    if hasattr(os, "fchown"):
        with suppress(OSError):
            os.fchown(handle, of.st_uid, of.st_gid)
    if hasattr(os, "fchmod"):
        os.fchmod(handle, stat.S_IMODE(of.st_mode))


def lock(handle: int) -> bool:
    """Take the lock of an open file, which ends with the handle and the process; False if it is taken.

    OSError where the file system has no locks.
    """
    if WINDOWS:
        return _lock_windows(handle)
    if fcntl is None:
        return True
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def drop_lock(path: Path, handle: int) -> None:
    """Remove a lock file and let the lock go. On Windows the handle is closed first, as what is open stays
    there; who takes the lock in between keeps its file."""
    if WINDOWS:
        os.close(handle)
        with suppress(OSError):
            path.unlink()
    else:
        path.unlink(missing_ok=True)
        os.close(handle)


def _lock_windows(handle: int) -> bool:
    """LockFileEx, at once and exclusive, of one byte at FAR."""
    import ctypes
    import msvcrt
    from ctypes import wintypes

    class Overlapped(ctypes.Structure):
        _fields_ = [
            ("internal", ctypes.c_void_p), ("internal_high", ctypes.c_void_p),
            ("offset", wintypes.DWORD), ("offset_high", wintypes.DWORD), ("event", wintypes.HANDLE),
        ]  # fmt: skip

    exclusive_at_once = 0x2 | 0x1
    taken = 33  # ERROR_LOCK_VIOLATION
    kernel: Any = ctypes.WinDLL("kernel32", use_last_error=True)  # type: ignore[attr-defined]
    where = Overlapped(offset=FAR & 0xFFFFFFFF, offset_high=FAR >> 32)
    file = wintypes.HANDLE(msvcrt.get_osfhandle(handle))  # type: ignore[attr-defined]
    if kernel.LockFileEx(file, exclusive_at_once, 0, 1, 0, ctypes.byref(where)):
        return True
    error = ctypes.get_last_error()  # type: ignore[attr-defined]
    if error == taken:
        return False
    raise OSError(error, "the file cannot be locked")


def end_with(parent: int) -> None:
    """Wait until a process has ended. Where a child goes on under another parent its number tells; on
    Windows the number stays, and the process itself is waited for."""
    if WINDOWS:
        import ctypes

        kernel: Any = ctypes.WinDLL("kernel32")  # type: ignore[attr-defined]
        kernel.OpenProcess.restype = ctypes.c_void_p
        synchronise, for_ever = 0x00100000, 0xFFFFFFFF
        process = kernel.OpenProcess(synchronise, False, parent)
        if process:
            kernel.WaitForSingleObject(ctypes.c_void_p(process), for_ever)
        return
    while os.getppid() == parent:
        time.sleep(0.5)
