"""How much a file may ask for, in one place: limits that honest files stay below, and that can be raised."""

from __future__ import annotations

import os
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from .checks import integer
from .errors import InputError

COMPRESSION = 1100
"""Deflate, the compression of HDF5 and of archives, makes at most 1032 bytes of one; what a file declares
beyond it holds nothing, however large its numbers are."""
BULK, DENSE = 1 << 26, 100
"""Beyond these bytes numbers are expected not to be zeros only, and to be packed so many to one at most."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of a file; a file above them is refused. Every reader takes `limits=amontons.Limits(...)`.

    Raises InputError for what is no positive integer, and for a folder that there is not.

    >>> small = Limits(memory=10**6, elements=1000)
    >>> model = load_model(examples.path("arm.xml"), limits=small)
    """

    memory: int = 2 * 2**30
    """bytes of the numbers of a problem, a saved simulation or a recording; of the heights of a model, too"""
    elements: int = 20_000
    """of a model file, with what it includes and copies (`replicate`, `composite`, a grid of `flexcomp`);
    MuJoCo's time grows with the square of it"""
    depth: int = 400
    """of elements within elements; MuJoCo's parser takes 500 in a file"""
    chain: int = 1_000
    """of links of a URDF, one on the other; MuJoCo's time grows with the cube of it"""
    attributes: int = 1_000
    """of an element of a model file; the time of MuJoCo's parser grows with the square of it"""
    folder: str | PathLike[str] | None = None
    """outside of which a model has no meshes, textures, includes and attached models, with links resolved;
    None: they may be anywhere"""

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            if name != "folder":
                integer(f"limits: {name}", getattr(self, name), 1, 2**62)
        if self.folder is not None:
            object.__setattr__(self, "folder", _folder(self.folder))


def _folder(given: object) -> Path:
    try:
        path = Path(os.path.realpath(given))  # type: ignore[call-overload]
        if path.is_dir():
            return path
    except (TypeError, ValueError, OSError):
        pass
    raise InputError(f"limits: folder = {given!r:.200}; it must be a folder that there is")


DEFAULT = Limits()


def plausible(stored: int) -> int:
    """Bytes that so many packed ones may declare to be."""
    return min(COMPRESSION * stored, BULK + DENSE * stored)


def readable(size: float) -> str:
    """A number of bytes for people."""
    for unit in ("bytes", "kB", "MB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:.3g} GB"
