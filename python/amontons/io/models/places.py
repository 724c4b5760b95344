"""Files that a model names: regular ones, and within a folder where `Limits` says so.

MuJoCo joins folders and names in ways of its own (strippath, meshdir, texturedir, assetdir), so all places at
which it may look are judged, before it looks at any.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ...checks import shortened
from ...limits import Limits
from .elements import Element

FILES = ("file", "filename", *(f"file{side}" for side in ("right", "left", "up", "down", "front", "back")))
DIRS = ("meshdir", "texturedir", "assetdir")


def inside(path: Path, limits: Limits) -> bool:
    """Whether a path, with all links followed, lies in the folder that the limits allow."""
    if limits.folder is None:
        return True
    try:
        return path.resolve().is_relative_to(limits.folder)
    except (OSError, ValueError, RuntimeError):  # a loop of links, a name that is none
        return False


def require_inside(element: Element, path: Path, limits: Limits) -> None:
    """FileError where a file lies outside of the allowed folder."""
    if not inside(path, limits):
        raise element.fault(
            f"the file {shortened(str(path))} lies outside of {limits.folder}, "
            "to which limits=amontons.Limits(folder=...) confines models"
        )


def require_files(root: Element, folder: Path, limits: Limits) -> None:
    """FileError unless what the elements name are regular files, if any, and inside."""
    dirs = {"", *(e.attributes.get(name, "") for e in root.walk() if e.tag == "compiler" for name in DIRS)}
    for element in root.walk():
        if root.tag == "robot" and element.tag == "mesh":
            continue  # looked for elsewhere, by rules of URDF
        for attribute in FILES:
            for path in _places(folder, dirs, element.attributes.get(attribute, "")):
                require_inside(element, path, limits)
                if is_special(path):
                    raise element.fault(f"{path} is no regular file")


def is_special(path: Path) -> bool:
    """Whether there is a pipe, a device or a socket: MuJoCo would wait for it, or read without end."""
    try:
        return path.exists() and not path.is_file() and not path.is_dir()
    except (ValueError, OSError):
        return False


def _places(folder: Path, dirs: set[str], name: str) -> Iterator[Path]:
    if not name:
        return
    name = name.replace("\\", "/")  # as MuJoCo does
    for part in dirs:
        base = folder / part.replace("\\", "/")
        yield base / name
        yield base / Path(name).name
