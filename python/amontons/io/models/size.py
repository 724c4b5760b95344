"""How large a model file is, with all that it includes and copies; refused before anything is built of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ...errors import FileError
from ...limits import Limits, readable
from .elements import Element

HEIGHT = 64
"""Bytes that a height of a height field takes at most: MuJoCo's and ours, while both are there."""
PIXEL = 8
NUMBERS = {
    ("numeric", "size"): 8, ("user", "dim"): 8, ("hfield", "nrow"): 8, ("hfield", "ncol"): 8,
    ("texture", "width"): PIXEL, ("texture", "height"): PIXEL, ("camera", "resolution"): PIXEL,
    ("size", "nuserdata"): 8, ("size", "nkey"): 1 << 12, ("size", "nconmax"): 1 << 10,
    ("size", "njmax"): 1 << 10, ("size", "nstack"): 8, ("mesh", "params"): 1 << 10,
}  # fmt: skip
"""Attributes by which an element asks for memory, and bytes of each that it asks for at least."""
COPIES = ("replicate", "composite", "flexcomp")
"""Elements whose count (one number, or one along each axis) says how often their content is copied."""


@dataclass
class Budget:
    """Counts the elements of a file and of what it includes, while they are read."""

    limits: Limits
    elements: int = 0

    def add(self, element: Element, depth: int) -> None:
        """Called for each element as it begins; FileError beyond the limits."""
        self.elements += 1
        if self.elements > self.limits.elements:
            raise too_large(element.place, f"more than {self.limits.elements} elements", "elements")
        if len(element.attributes) > self.limits.attributes:
            what = f"{element} has {len(element.attributes)} attributes, more than {self.limits.attributes}"
            raise too_large(element.place, what, "attributes")
        if depth > self.limits.depth:
            what = f"{element}: elements within elements, more than {self.limits.depth} of them"
            raise too_large(element.place, what, "depth")


def too_large(place: str, what: str, limit: str) -> FileError:
    return FileError(
        f"{place}: {what}; if that is meant, raise the limit: limits=amontons.Limits({limit}=...)"
    )


def require_size(root: Element, limits: Limits, attached: Callable[[Element], int]) -> None:
    """FileError if the elements with all copies, their chains, or what they ask for go beyond the limits.

    attached: the elements of the file that a <model> names.
    """
    weights: dict[int, float] = {}
    models: dict[str, int] = {}
    for element in _children_first(root):
        weight = 1.0 + sum(weights.pop(id(child)) for child in element.children)
        if element.tag in COPIES:
            weight *= _count(element)
        if element.tag == "model" and element.parent is not None and element.parent.tag == "asset":
            models[element.name] = attached(element)
            weight += models[element.name]
        if element.tag == "attach":
            weight += models.get(element.attributes.get("model", ""), 0)
        if weight > limits.elements:
            raise too_large(
                element.place,
                f"{element} makes {weight:.4g} elements, more than {limits.elements}",
                "elements",
            )
        weights[id(element)] = weight
        _require_memory(element, limits)
    if root.tag == "robot":
        _require_chain(root, limits)


def _children_first(root: Element) -> Iterator[Element]:
    # Assets before what attaches them, as files have it; the order of MJCF's sections is free.
    found = list(root.walk())
    found.sort(key=lambda e: e.tag == "model" or any(a.tag == "asset" for a in e.ancestors()))
    return reversed(found)


def _count(element: Element) -> float:
    counts = element.numbers("count") or [1.0]
    return math.prod(max(1.0, n) for n in counts)  # NaN counts as one, and is refused as what it is


def _require_memory(element: Element, limits: Limits) -> None:
    numbers = {
        name: [abs(x) for x in element.numbers(name) or [] if math.isfinite(x)] or [0.0]
        for tag, name in NUMBERS
        if tag == element.tag and name in element.attributes
    }
    wanted = sum(NUMBERS[element.tag, name] * math.prod(values) for name, values in numbers.items())
    if element.tag == "hfield":
        wanted = HEIGHT * math.prod(values[0] for values in numbers.values())
    if element.tag == "texture":
        wanted = PIXEL * math.prod(values[0] for values in numbers.values())
    if wanted > limits.memory:
        asked = ", ".join(f'{name}="{element.attributes[name]}"' for name in numbers)
        what = f"{element} asks for {readable(wanted)} ({asked}), more than {readable(limits.memory)}"
        raise too_large(element.place, what, "memory")


def _require_chain(root: Element, limits: Limits) -> None:
    """FileError for a URDF whose links hang on each other in too long a row; a loop is MuJoCo's to refuse."""
    parent: dict[str, tuple[str, Element]] = {}
    for joint in root.children:
        ends = [joint.child(end) for end in ("parent", "child")]
        if joint.tag == "joint" and all(ends):
            above, below = (end.attributes.get("link", "") for end in ends if end)
            parent[below] = above, joint
    depth: dict[str, int] = {}
    for start in parent:
        way, link = [], start
        while link in parent and link not in depth and len(way) <= len(parent):
            way.append(link)
            link = parent[link][0]
        level = depth.get(link, 0)
        for name in reversed(way):
            level += 1
            depth[name] = level
            if level > limits.chain:
                joint = parent[name][1]
                what = f"{joint}: links hang on each other, more than {limits.chain} in a row"
                raise too_large(joint.place, f"{what}, whose time grows with its cube", "chain")
