"""XML elements with the file and line they stand in, which the parsers of the model libraries do not keep."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path

from ...checks import shortened
from ...errors import FileError
from ..files import told_at


@dataclass
class Element:
    """One element; an <include> is replaced by the content of its file."""

    tag: str
    attributes: dict[str, str]
    file: Path
    line: int
    parent: Element | None = field(default=None, repr=False)
    children: list[Element] = field(default_factory=list, repr=False)
    text: str = field(default="", repr=False)
    """between its tags, where SDF has its values; MJCF and URDF have none"""
    _by_name: dict[str, dict[str, Element]] = field(default_factory=dict, repr=False, compare=False)

    @property
    def name(self) -> str:
        return self.attributes.get("name", "")

    def walk(self) -> Iterator[Element]:
        """This element and all below it, in the order of the document."""
        left = [self]
        while left:
            element = left.pop()
            yield element
            left += reversed(element.children)

    def all(self, tag: str) -> list[Element]:
        return [c for c in self.children if c.tag == tag]

    def child(self, tag: str) -> Element | None:
        return next((c for c in self.children if c.tag == tag), None)

    def named(self, tag: str, name: str) -> Element | None:
        """The first child of a tag and a name. Children no longer change once this was asked."""
        if tag not in self._by_name:
            found = self._by_name[tag] = {}
            for child in self.children:
                if child.tag == tag:
                    found.setdefault(child.name, child)
        return self._by_name[tag].get(name)

    def ancestors(self) -> Iterator[Element]:
        node = self.parent
        while node is not None:
            yield node
            node = node.parent

    def __str__(self) -> str:
        tag = shortened(self.tag)
        return f'<{tag} name="{shortened(self.name)}">' if self.name else f"<{tag}>"

    @property
    def place(self) -> str:
        return f"{self.file}:{self.line}"

    def fault(self, what: object) -> FileError:
        """That something is wrong with this element."""
        return FileError(f"{self.place}: {self}: {what}")

    def told(self) -> AbstractContextManager[None]:
        """Lets what is wrong with this element (InputError) name it and its place."""
        return told_at(f"{self.place}: {self}")

    def numbers(self, attribute: str) -> list[float] | None:
        """The values of an attribute of numbers; None without it, or if it holds anything else."""
        try:
            return [float(word) for word in self.attributes[attribute].split()]
        except (KeyError, ValueError):
            return None


def not_finite(element: Element, attribute: str) -> bool:
    values = element.numbers(attribute)
    return values is not None and not all(map(math.isfinite, values))
