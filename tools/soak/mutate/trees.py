"""Damage to trees: JSON values, and the elements of an XML file."""

from __future__ import annotations

import copy
import json
from typing import Any
from xml.etree import ElementTree

from .raw import WORDS, Rng, pick

VALUES: list[Any] = [
    None, True, False, 0, 1, -1, 2**31, 2**63, -(2**63) - 1, 10**30, 1e308,
    -1e308, float("nan"), float("inf"), "",
    "x", "%s%n%x", [], {}, [None], [[]], [1, 2], [0.0, 0.0, 0.0], {"a": 1}, "0", 0.5, [1e300, 0, 0],
]  # fmt: skip


def places(value: Any, at: tuple = ()) -> list[tuple]:
    found = [at]
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in items:
        found += places(part, (*at, key))
    return found


def damage_json(rng: Rng, text: str) -> str:
    """One value becomes another one, is missing, repeated or renamed."""
    tree = json.loads(text)
    at = pick(rng, places(tree))
    if not at:
        return str(
            pick(rng, ["null", "[]", "{}", "1", '""', "[" * 5000, '{"a":' * 5000, text[: len(text) // 2]])
        )
    *way, last = at
    parent = tree
    for key in way:
        parent = parent[key]
    match int(rng.integers(8)):
        case 0:
            del parent[last]
        case 1 if isinstance(parent, list):
            parent.extend(copy.deepcopy(parent[last]) for _ in range(int(rng.integers(1, 5))))
        case 2 if isinstance(parent, dict):
            parent[str(pick(rng, ["x", "name", "kind", "", last + "_"]))] = parent.pop(last)
        case 3:
            other = tree
            for key in pick(rng, places(tree)):
                other = other[key]
            parent[last] = copy.deepcopy(other)
        case _:
            parent[last] = pick(rng, VALUES)
    return json.dumps(tree)


NUMBERS = [
    "nan", "inf", "-inf", "1e308", "1e200", "-1e200", "1e-320", "-1", "0", "1000000", "2147483647",
    "2147483648", "9223372036854775807", "99999999999999999999", "0.5", "1e999",
]  # fmt: skip


def damage_xml(rng: Rng, text: str) -> str:
    """One element or attribute changes."""
    root = ElementTree.fromstring(text)
    parents = {child: parent for parent in root.iter() for child in parent}
    element = pick(rng, list(root.iter()))
    kinds = [attribute, attribute, attribute, attribute, remove, double, move, rename, many, nest]
    pick(rng, kinds)(rng, root, element, parents.get(element))
    return ElementTree.tostring(root, encoding="unicode")


def attribute(rng: Rng, root: Any, element: Any, parent: Any) -> None:
    owners = [e for e in root.iter() if e.attrib]
    if not owners:
        return
    element = pick(rng, owners)
    name = str(pick(rng, list(element.attrib)))
    words = element.attrib[name].split()
    match int(rng.integers(7)):
        case 0:
            del element.attrib[name]
        case 1:
            donor = pick(rng, owners)
            name = str(pick(rng, list(donor.attrib)))
            element.attrib[name] = donor.attrib[name]
        case 2 if words:
            words[rng.integers(len(words))] = str(pick(rng, NUMBERS))
            element.attrib[name] = " ".join(words)
        case 3:
            element.attrib[name] = " ".join(words * int(pick(rng, [2, 10, 1000])))
        case 4:
            element.attrib[name] = " ".join(words[:-1])
        case 5:
            element.attrib[name] = str(pick(rng, NUMBERS))
        case 6:
            odd = pick(rng, WORDS).decode("utf-8", "replace")
            element.attrib[name] = "".join(c for c in odd if c.isprintable())


def remove(rng: Rng, root: Any, element: Any, parent: Any) -> None:
    if parent is not None:
        parent.remove(element)


def double(rng: Rng, root: Any, element: Any, parent: Any) -> None:
    if parent is not None:
        parent.append(copy.deepcopy(element))


def move(rng: Rng, root: Any, element: Any, parent: Any) -> None:
    below = set(element.iter())
    targets = [e for e in root.iter() if e not in below]
    if parent is not None and targets:
        parent.remove(element)
        pick(rng, targets).append(element)


def rename(rng: Rng, root: Any, element: Any, parent: Any) -> None:
    element.tag = str(
        pick(rng, [e.tag for e in root.iter()] + ["include", "replicate", "frame", "attach", "x"])
    )


def many(rng: Rng, root: Any, element: Any, parent: Any) -> None:
    """Copies with and without their names."""
    for _ in range(int(pick(rng, [3, 30, 300]))):
        twin = copy.deepcopy(element)
        for part in twin.iter():
            if rng.random() < 0.9:
                part.attrib.pop("name", None)
        if parent is not None:
            parent.append(twin)


def nest(rng: Rng, root: Any, element: Any, parent: Any) -> None:
    """Elements within elements, deeper than any parser likes."""
    depth = int(pick(rng, [10, 200, 600]))
    tag = element.tag
    for _ in range(depth):
        inner = ElementTree.SubElement(element, tag)
        element = inner
