"""XML elements with the file and line they stand in, which the parsers of the model libraries do not keep."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from ...errors import FileError


@dataclass
class Element:
    """One element; an <include> is replaced by the content of its file."""

    tag: str
    attributes: dict[str, str]
    file: Path
    line: int
    parent: Element | None = field(default=None, repr=False)
    children: list[Element] = field(default_factory=list, repr=False)

    @property
    def name(self) -> str:
        return self.attributes.get("name", "")

    def walk(self) -> Iterator[Element]:
        """This element and all below it, in the order of the document."""
        yield self
        for child in self.children:
            yield from child.walk()

    def child(self, tag: str) -> Element | None:
        return next((c for c in self.children if c.tag == tag), None)

    def ancestors(self) -> Iterator[Element]:
        node = self.parent
        while node is not None:
            yield node
            node = node.parent

    def __str__(self) -> str:
        return f'<{self.tag} name="{self.name}">' if self.name else f"<{self.tag}>"

    @property
    def place(self) -> str:
        return f"{self.file}:{self.line}"

    def numbers(self, attribute: str) -> list[float] | None:
        """The values of an attribute of numbers; None without it, or if it holds anything else."""
        try:
            return [float(word) for word in self.attributes[attribute].split()]
        except (KeyError, ValueError):
            return None


def read_xml(path: Path) -> Element:
    """The root element of a file, as written: with its <include> elements.

    Raises FileError naming file and line if it is not well-formed or not readable as text.
    """
    parser = expat.ParserCreate()
    roots: list[Element] = []
    stack: list[Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        parent = stack[-1] if stack else None
        element = Element(tag, attributes, path, parser.CurrentLineNumber, parent)
        (parent.children if parent else roots).append(element)
        stack.append(element)

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda tag: stack.pop()
    try:
        parser.Parse(path.read_bytes(), True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        last = f"; the element open there is {stack[-1]} of line {stack[-1].line}" if stack else ""
        raise FileError(f"{path}:{error.lineno}: malformed XML: {reason}{last}") from None
    return roots[0]


def expand_includes(root: Element, folder: Path) -> None:
    """Puts the content of included files in the place of <include file="..."/>, as MuJoCo does.

    Paths are relative to the folder of the main file. Raises FileError for files that are missing,
    malformed or include themselves.
    """

    def expand(node: Element, open_files: tuple[Path, ...]) -> None:
        children = []
        for child in node.children:
            if child.tag != "include":
                expand(child, open_files)
                children.append(child)
                continue
            file = folder / child.attributes.get("file", "")
            if not file.is_file():
                raise FileError(f"{child.place}: {child}: the file {file} does not exist")
            if file.resolve() in open_files:
                raise FileError(f"{child.place}: {child}: the file {file} includes itself")
            content = read_xml(file)
            expand(content, (*open_files, file.resolve()))
            for part in content.children:
                part.parent = node
            children += content.children
        node.children[:] = children

    expand(root, (root.file.resolve(),))


def not_finite(element: Element, attribute: str) -> bool:
    values = element.numbers(attribute)
    return values is not None and not all(map(math.isfinite, values))
