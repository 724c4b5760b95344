"""Links and joints of a URDF, held against each other before MuJoCo sees them: its messages name neither."""

from __future__ import annotations

import math

from ...checks import shortened
from ...errors import FileError
from ...model.coordinates import known
from .elements import Element

TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical")
"""Kinds of joints that MuJoCo reads; the last one is no part of URDF's specification"""
TURN = ("revolute", "continuous", "prismatic", "planar")
"""Those that have an axis"""


def wrong(element: Element, what: str) -> FileError:
    return element.fault(f"{what}{macro(element)}")


def macro(element: Element) -> str:
    """The remedy where a macro stands in an element, as in files that are meant for xacro; else nothing."""
    if any("$" in value for value in element.attributes.values()):
        return "; a macro such as ${x} is for xacro, which must be run first"
    return ""


WORLD = "world"


def lacks_world(root: Element) -> bool:
    """Whether joints hold links on a link called world that the file leaves out, as Drake's readers allow."""
    ends = (joint.child("parent") for joint in root.all("joint"))
    named = any(end is not None and end.attributes.get("link") == WORLD for end in ends)
    return named and all(link.name != WORLD for link in root.all("link"))


def add_world(root: Element) -> None:
    root.children.append(Element("link", {"name": WORLD}, root.file, root.line, root))


def with_world(text: str) -> str:
    """The text of a file with that link."""
    before, end, after = text.rpartition("</robot>")
    return f'{before}<link name="{WORLD}"/>{end}{after}'


def require_tree(root: Element) -> None:
    """FileError unless links have names of their own and joints make trees of them.

    `<loop>` of URDF+ and the pairs of an extended URDF are no part of the trees.
    """
    links = _named(root, "link")
    joints = _named(root, "joint")
    carried: dict[str, Element] = {}
    above: dict[str, str] = {}
    for joint in joints.values():
        _require_kind(joint)
        parent, child = (_end(joint, tag, links) for tag in ("parent", "child"))
        if child in carried:
            raise wrong(
                joint,
                f'the link "{child}" hangs on the joint "{carried[child].name}" already; a link has one '
                "parent. Close the loop by a <loop> of URDF+",
            )
        carried[child], above[child] = joint, parent
    _require_roots(carried, above)
    for link in links.values():
        for collision in link.all("collision"):
            _require_shape(collision)


SIZES = {"box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length")}
"""Attributes of shapes that are lengths (m)."""


def _require_shape(collision: Element) -> None:
    geometry = collision.child("geometry")
    for shape in geometry.children if geometry is not None else []:
        for attribute in SIZES.get(shape.tag, ()):
            given = shape.attributes.get(attribute, "")
            count = 3 if attribute == "size" else 1
            values = shape.numbers(attribute) or []
            if len(values) != count or not all(x > 0 for x in values):
                numbers = "three numbers" if count == 3 else "a number"
                raise wrong(shape, f'{attribute}="{shortened(given)}" must be {numbers} above 0 (m)')


def _named(root: Element, tag: str) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in root.all(tag):
        if not element.name:
            raise wrong(element, "it has no name; give it one")
        if element.name in found:
            first = found[element.name]
            raise wrong(element, f"line {first.line} has a {tag} of this name; rename one")
        found[element.name] = element
    return found


def _require_kind(joint: Element) -> None:
    kind = joint.attributes.get("type")
    if kind not in TYPES:
        said = "it has no type" if kind is None else f'type="{shortened(kind)}" is no kind of joint'
        raise wrong(joint, f"{said}; give one of {', '.join(TYPES)}")
    axis = joint.child("axis")
    if axis is None or "xyz" not in axis.attributes or kind not in TURN:
        return
    values = axis.numbers("xyz") or []
    if len(values) != 3 or not all(map(math.isfinite, values)):
        raise wrong(axis, f'xyz="{shortened(axis.attributes["xyz"])}" must be three numbers')
    if not any(values):
        raise wrong(axis, "xyz is zero; give the direction of the axis")


def _end(joint: Element, tag: str, links: dict[str, Element]) -> str:
    """The link that a joint names as its parent or child."""
    element = joint.child(tag)
    if element is None or not element.attributes.get("link"):
        raise wrong(joint, f'it has no <{tag} link="..."/>; name a link')
    name = element.attributes["link"]
    if name not in links:
        listed = known([shortened(link) for link in links])
        raise wrong(joint, f'there is no link "{shortened(name)}", its {tag}; there are {listed}')
    return name


def _require_roots(carried: dict[str, Element], above: dict[str, str]) -> None:
    """FileError where links carry each other in a circle. Links that are known to hang on a root are done."""
    done: set[str] = set()
    for start in carried:
        way: dict[str, None] = {}
        link = start
        while link in carried and link not in done and link not in way:
            way[link] = None
            link = above[link]
        if link in way:
            names = list(way)
            circle = " -> ".join([*names[names.index(link) :], link])
            raise wrong(
                carried[link], f"links carry each other: {shortened(circle)}; one link must have no parent"
            )
        done.update(way)
