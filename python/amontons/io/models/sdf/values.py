"""Values of SDF elements: texts, numbers, poses; and files behind their addresses."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path

from ....checks import shortened
from ....errors import FileError
from ....limits import Limits
from ....model.orientations import from_euler
from ....model.transforms import ORIGIN, Transform
from ..elements import Element
from ..places import inside

PATHS = (
    "GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "SDF_PATH", "GAZEBO_MODEL_PATH",
    "GAZEBO_RESOURCE_PATH",
)  # fmt: skip
"""Variables with folders of models."""
INFINITE = 1e15
"""rad, m, N, N m: what is larger stands for no bound; SDF's default limits are 1e16"""


def text(element: Element, tag: str, default: str = "") -> str:
    child = element.child(tag)
    return child.text.strip() if child is not None else default


def floats(element: Element | None, count: int | None = None) -> list[float]:
    """The numbers between the tags of an element; FileError unless they are finite and so many."""
    if element is None:
        return []
    try:
        values = [float(word) for word in element.text.split()]
    except ValueError:
        raise element.fault(f'"{shortened(element.text)}" is no number; give one') from None
    if any(math.isnan(x) for x in values) or (count is not None and len(values) != count):
        raise element.fault(
            f"{shortened(element.text.strip()) or 'nothing'} stands where "
            f"{count or 'a list of'} numbers are expected"
        )
    return values


def value(element: Element | None, tag: str, default: float) -> float:
    child = element.child(tag) if element is not None else None
    return default if child is None else floats(child, 1)[0]


def bound(element: Element | None, tag: str, default: float) -> float:
    """A number that is infinite where it is very large."""
    found = value(element, tag, default)
    return math.copysign(math.inf, found) if abs(found) >= INFINITE else found


def flag(element: Element | None, tag: str, *, default: bool = False) -> bool:
    child = element.child(tag) if element is not None else None
    return default if child is None else child.text.strip().lower() in ("1", "true")


def vector(element: Element | None, tag: str, default: tuple[float, ...]) -> tuple[float, ...]:
    child = element.child(tag) if element is not None else None
    return default if child is None else tuple(floats(child, len(default)))


def version(element: Element) -> tuple[int, ...]:
    """The version of the file that an element stands in."""
    root = next((e for e in (element, *element.ancestors()) if e.tag == "sdf"), element)
    given = root.attributes.get("version", "1.6")
    try:
        return tuple(int(part) for part in given.split("."))
    except ValueError:
        raise FileError(f'{root.place}: version="{shortened(given)}" is no version of SDF') from None


def pose(element: Element) -> tuple[Transform, str]:
    """The <pose> of an element and the name of the frame it is in, "" for the usual one."""
    child = element.child("pose")
    if child is None:
        return ORIGIN, ""
    relative = child.attributes.get("relative_to", child.attributes.get("frame", ""))
    if not child.text.strip():
        return ORIGIN, relative
    if child.attributes.get("rotation_format") == "quat_xyzw":
        x, y, z, *(b, c, d, a) = floats(child, 7)
        rotation = (a, b, c, d)
    else:
        x, y, z, *angles = floats(child, 6)
        if child.attributes.get("degrees") in ("true", "1"):
            angles = [math.radians(angle) for angle in angles]
        rotation = from_euler("xyz", angles)
    with child.told():
        return Transform((x, y, z), rotation), relative


def find(element: Element, uri: str, limits: Limits) -> Path:
    """The file or folder of an address: model://, package://, file://, or a path beside the file."""
    looked = [place for place in _places(uri, element.file.parent) if inside(place, limits)]
    found = next((place for place in looked if place.exists()), None)
    if found is None:
        raise element.fault(
            f'"{shortened(uri)}" is not found'
            + (f" within {limits.folder}, to which Limits(folder=...) confines it" if limits.folder else "")
            + f"; set {PATHS[0]} to the folders that hold the models"
        )
    return found


def _places(uri: str, folder: Path) -> Iterator[Path]:
    scheme, colon, rest = uri.partition("://")
    parents = (folder.absolute(), *folder.absolute().parents)
    if not colon:
        yield folder / uri
    elif scheme == "file":
        yield folder / rest
    rest = (rest if colon else uri).strip("/")
    name, _, inner = rest.partition("/")
    if scheme in ("model", "package"):
        yield from (parent / inner for parent in parents if parent.name == name)
    for variable in PATHS:
        yield from (Path(p) / rest for p in os.environ.get(variable, "").split(os.pathsep) if p)
    if colon and scheme != "file":
        yield from (parent / rest for parent in parents)
        yield from (parent / "models" / rest for parent in parents)
