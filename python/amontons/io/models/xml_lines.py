"""Model files as elements with their lines: reads them, and puts in what they include."""

from __future__ import annotations

from pathlib import Path
from xml.parsers import expat

from ...errors import FileError
from . import sloppy_xml
from .elements import Element

Faults = list[tuple[Element, str]]
"""Root elements of files that are not well-formed, and why."""


def read_xml(path: Path, faults: Faults) -> Element:
    """The root element of a file, as written: with its <include> elements.

    Adds to the faults if it is not well-formed in a way that MuJoCo does not mind. Raises FileError naming
    file and line if it is otherwise malformed, or not readable as text.
    """
    data = path.read_bytes()
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
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError) as error:
        code = getattr(error, "code", None)  # without one it is an encoding that Python does not know
        reason = expat.ErrorString(code) if code else str(error)
        line = getattr(error, "lineno", 1)
        root = sloppy_xml.parse(data, path)
        if root is not None:
            faults.append((root, f"line {line} is malformed XML, {reason}; it is read as MuJoCo reads it"))
            return root
        last = f"; the element open there is {stack[-1]} of line {stack[-1].line}" if stack else ""
        raise FileError(f"{path}:{line}: malformed XML: {reason}{last}") from None
    return roots[0]


def expand_includes(root: Element, folder: Path, faults: Faults) -> None:
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
            content = read_xml(file, faults)
            expand(content, (*open_files, file.resolve()))
            for part in content.children:
                part.parent = node
            children += content.children
        node.children[:] = children

    expand(root, (root.file.resolve(),))
