"""Paths that users name, checked; and files that appear whole or not at all.

What is to be in a file is made in memory and then written by one loop of `write`, never by a library that
meets a full disk half way: HDF5 does not survive one. Only regular files are replaced, and they keep owner
and mode; a link is followed to the file that it names.
"""

from __future__ import annotations

import logging
import os
import stat
from collections.abc import Mapping
from contextlib import suppress
from os import PathLike
from pathlib import Path
from secrets import token_hex

from ..checks import shown
from ..errors import FileError

LONGEST_PATH = 4096
"""Characters: what systems take."""

logger = logging.getLogger(__name__)


def named(path: object) -> Path:
    """The path that a user gave; FileError if it is none."""
    try:
        made = Path(path)  # type: ignore[arg-type]
        if len(str(made)) > LONGEST_PATH:
            raise FileError(f"{shown(str(made))}: is too long for the name of a file")
        return made
    except TypeError:
        raise FileError(f"{shown(path)}: is no name of a file; give a string or a pathlib.Path") from None


def existing(path: str | PathLike[str], what: str) -> Path:
    """The path of a file that is there; `what` it should be is said of a directory: "a recording"."""
    path = named(path)
    try:
        if path.is_dir():
            raise FileError(f"{path}: is a directory; give {what}")
        there = path.exists()
    except OSError as error:  # a name too long
        raise FileError(f"{shown(path)}: cannot be a file ({_reason(error)})") from None
    if not there:
        raise FileNotFoundError(f"{path}: no such file")
    if not path.is_file():  # a pipe would wait for its writer, a device has no end
        raise FileError(f"{path}: is no regular file; give {what}")
    if not os.access(path, os.R_OK):
        raise FileError(f"{path}: may not be read; change its mode")
    logger.info("reading %s", path)
    return path


def writable(path: str | PathLike[str], *, new: bool = False) -> Path:
    """The path of a file that may come to be, or be replaced; FileError says why not.

    new: refuse one that is there already.
    """
    path = named(path)
    try:
        _require_replaceable(path)
        if new and path.exists():
            raise FileError(f"{path}: exists; give another name, remove it, or allow to overwrite it")
        if not os.access(path.parent, os.W_OK | os.X_OK):
            raise FileError(f"{path}: the folder {path.parent} is read-only for you")
    except (OSError, ValueError) as error:  # a name too long, a NUL within
        if isinstance(error, FileError):
            raise
        raise FileError(f"{path}: cannot be a file ({_reason(error)})") from None
    return path


def _require_replaceable(path: Path) -> None:
    if "\0" in str(path):
        raise FileError(f"{str(path)!r}: a name cannot have a NUL in it")
    if path.is_dir():
        raise FileError(f"{path}: is a directory; give the name of a file")
    if not path.parent.is_dir():
        raise FileError(f"{path}: the folder {path.parent} does not exist; make it first")
    if path.is_symlink() and not path.exists():
        raise FileError(f"{path}: is a link to {os.readlink(path)}, which does not exist; remove the link")
    if path.exists() and not path.is_file():
        raise FileError(f"{path}: is no regular file, and is not replaced by one; give another name")
    if path.exists() and not os.access(path, os.W_OK):
        raise FileError(f"{path}: is read-only; give another name, or allow to write it")


def write_whole(contents: Mapping[Path, bytes | memoryview], *, new: bool = False) -> None:
    """Write files that appear, or replace what was there, only when all of them are on the disk.

    new: nothing is replaced, not even what another program makes meanwhile. Raises FileError, after which
    everything is as it was.
    """
    made: list[tuple[Path, Path]] = []
    try:
        for path, data in contents.items():
            writable(path, new=new)
            target = Path(os.path.realpath(path))  # through links
            try:
                made.append((_written_beside(target, data), target))
            except OSError as error:
                raise FileError(f"{path}: cannot be written ({_reason(error)})") from None
        while made:
            temporary, target = made[0]
            try:
                (os.link if new else os.replace)(temporary, target)
            except OSError as error:
                raise FileError(f"{target}: cannot be written ({_reason(error)})") from None
            temporary.unlink(missing_ok=True)
            made.pop(0)
            logger.info("wrote %s", target)
    finally:
        for temporary, _ in made:
            temporary.unlink(missing_ok=True)


def _written_beside(target: Path, data: bytes | memoryview) -> Path:
    """A file with a hidden name, owner and mode those of the target, if there is one."""
    name = target.with_name(f".{token_hex(8)}")
    handle, named = _new_file(target.parent, name)
    try:
        _write(handle, data)
        if target.exists():
            _take_over(handle, os.stat(target))
        if not named:
            # A folder, which a whole path ignores, makes Python call linkat, which follows links if told so.
            os.link(f"/proc/self/fd/{handle}", name, src_dir_fd=handle, follow_symlinks=True)
    except BaseException:
        name.unlink(missing_ok=True)
        raise
    finally:
        os.close(handle)
    return name


def _new_file(folder: Path, name: Path) -> tuple[int, bool]:
    """A file to write, and whether it has the name yet: without one, a process that is killed leaves none."""
    if hasattr(os, "O_TMPFILE") and Path("/proc/self/fd").is_dir():
        try:
            return os.open(folder, os.O_TMPFILE | os.O_WRONLY, 0o666), False
        except OSError:  # a file system without nameless files, or one that fails for all names
            pass
    return os.open(name, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666), True


def _write(handle: int, data: bytes | memoryview) -> None:
    rest = memoryview(data).cast("B")
    while rest:
        rest = rest[os.write(handle, rest) :]


def _take_over(handle: int, of: os.stat_result) -> None:
    """Mode and, where the system lets us, owner of the file that is replaced."""
    with suppress(OSError):
        os.fchown(handle, of.st_uid, of.st_gid)
    os.fchmod(handle, stat.S_IMODE(of.st_mode))


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
