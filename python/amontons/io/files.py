"""Paths that users name, checked; and files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path

from ..errors import FileError


def existing(path: str | PathLike[str], what: str) -> Path:
    """The path of a file that is there; `what` it should be is said of a directory: "a recording"."""
    path = Path(path)
    if path.is_dir():
        raise FileError(f"{path}: is a directory; give {what}")
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file")
    return path


def writable(path: str | PathLike[str]) -> Path:
    """The path of a file that may come to be: its folder is there, and it is none itself."""
    path = Path(path)
    if path.is_dir():
        raise FileError(f"{path}: is a directory; give the name of a file")
    if not path.parent.is_dir():
        raise FileError(f"{path}: the folder {path.parent} does not exist; make it first")
    return path


@contextmanager
def replacing(*paths: Path) -> Iterator[list[Path]]:
    """Temporary files beside `paths`, which replace them when the block ends without an exception."""
    temporary: list[Path] = []
    try:
        for path in paths:
            temporary.append(reserve(path))
        yield temporary
        settle(temporary, paths)
    finally:
        for new in temporary:
            new.unlink(missing_ok=True)


def reserve(path: Path) -> Path:
    """A new empty hidden file beside `path`, on the same file system; FileError where none can be."""
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise FileError(f"{path}: cannot be written here ({error.strerror})") from None
    os.close(handle)
    return Path(name)


def settle(temporary: Sequence[Path], paths: Sequence[Path]) -> None:
    """Give reserved files the names that they stand for."""
    umask = os.umask(0)
    os.umask(umask)
    for new, path in zip(temporary, paths, strict=True):
        new.chmod(0o666 & ~umask)  # mkstemp gives 0600
        os.replace(new, path)
