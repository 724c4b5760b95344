"""Paths that users name, checked; and files that appear whole or not at all.

The content of a file is made in memory and then written by one loop of `write`. A library must not meet a
full disk while it writes: HDF5 does not survive that. Only regular files are replaced, and they keep owner
and mode; a link that a user names is followed to the file that it names. Names that we choose (`own`) are
known to everyone who fills a folder: at these no link is followed.
"""

from __future__ import annotations

import logging
import os
import stat
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path
from secrets import token_hex

from ..checks import shown
from ..errors import FileError, InputError
from ..escapes import visible
from . import system

LONGEST_PATH = 4096
"""Characters: what systems take."""

logger = logging.getLogger(__name__)


@contextmanager
def told_at(place: object) -> Iterator[None]:
    """Lets what is wrong with the content of a file (InputError) name the file, or the place in it."""
    try:
        yield
    except FileError:
        raise
    except InputError as error:
        raise FileError(f"{place}: {error}") from None
    except MemoryError:
        raise FileError(f"{place}: does not fit into memory") from None


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
        raise FileNotFoundError(visible(f"{path}: no such file"))
    if not path.is_file():  # a pipe would wait for its writer, a device has no end
        raise FileError(f"{path}: is no regular file; give {what}")
    if not os.access(path, os.R_OK):
        raise FileError(f"{path}: may not be read; change its mode")
    logger.info("reading %s", path)
    return path


def writable(path: str | PathLike[str], *, new: bool = False, own: bool = False) -> Path:
    """The path of a file that may come to be, or be replaced; FileError says why not.

    new: refuse one that is there already. own: the name is our choice, so that a link there is refused.
    """
    path = named(path)
    try:
        _require_replaceable(path)
        if own and path.is_symlink():
            raise FileError(
                f"{path}: is a link to {os.readlink(path)}; links are followed only at names that you give "
                "yourself: remove it"
            )
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


def write_whole(
    contents: Mapping[Path, bytes | memoryview], *, new: bool = False, own: Collection[Path] = ()
) -> None:
    """Write files that appear, or replace what was there, only when all of them are on the disk.

    new: nothing is replaced, not even what another program makes meanwhile. own: those whose names are our
    choice, see `writable`. Raises FileError, after which everything is as it was.
    """
    made: list[tuple[Path, Path]] = []
    try:
        for path, data in contents.items():
            writable(path, new=new, own=path in own)
            folder = Path(os.path.realpath(path.parent))
            target = folder / path.name if path in own else Path(os.path.realpath(path))  # through links
            try:
                made.append((_written_beside(target, data), target))
            except OSError as error:
                raise FileError(f"{path}: cannot be written ({_reason(error)})") from None
        while made:
            temporary, target = made[0]
            try:
                (system.put_new if new else system.replace)(temporary, target)
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
            system.take_over(handle, os.stat(target))
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
    return os.open(name, os.O_CREAT | os.O_EXCL | os.O_WRONLY | system.BINARY, 0o666), True


def _write(handle: int, data: bytes | memoryview) -> None:
    rest = memoryview(data).cast("B")
    while rest:
        rest = rest[os.write(handle, rest) :]


@contextmanager
def locked(path: Path, busy: str) -> Iterator[None]:
    """Holds the lock of a file that is going to be written, an empty hidden file beside it.

    busy: what the FileError says where another process holds it. The lock follows no link, waits for no pipe
    and changes no file: what is there and is no lock is refused.
    """
    lock = path.with_name(f".{path.name}.lock")
    while True:
        handle = _lock_file(path, lock)
        try:
            free = system.lock(handle)
        except OSError:  # a file system without locks
            free = False
        if not free:
            os.close(handle)
            raise FileError(f"{path}: {busy}")
        with suppress(OSError):
            if os.path.samestat(os.fstat(handle), lock.lstat()):
                break
        os.close(handle)  # its owner has just removed it
    try:
        yield
    finally:
        system.drop_lock(lock, handle)


def _lock_file(path: Path, lock: Path) -> int:
    try:
        handle = os.open(lock, os.O_RDWR | os.O_CREAT | system.CAREFUL, 0o600)
    except OSError as error:
        if lock.is_symlink():
            raise FileError(f"{path}: its lock {lock} is a link, which is not followed; remove it") from None
        raise FileError(f"{path}: its lock {lock} cannot be opened ({_reason(error)})") from None
    found = os.fstat(handle)
    if not stat.S_ISREG(found.st_mode) or found.st_size or found.st_nlink > 1:
        os.close(handle)
        raise FileError(f"{path}: {lock} is there and is no lock of a study; remove it")
    return handle


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
