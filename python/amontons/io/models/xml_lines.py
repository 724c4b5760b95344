"""Model files as elements with their lines: reads them, and puts in what they include."""

from __future__ import annotations

from pathlib import Path
from xml.parsers import expat

from ...errors import FileError
from . import sloppy_xml
from .elements import Element
from .places import is_special, require_inside
from .size import Budget

Faults = list[tuple[Element, str]]
"""Root elements of files that are not well-formed, and why."""
MOST_OPEN = 50


def is_file(path: Path) -> bool:
    """Whether a path that a file names is one; a name with bytes of zero, or too long a one, is none."""
    try:
        return path.is_file()
    except (ValueError, OSError):
        return False


def read_xml(path: Path, faults: Faults, budget: Budget, depth: int = 0) -> Element:
    """The root element of a file, as written: with its <include> elements.

    Adds to the faults if it is not well-formed in a way that MuJoCo does not mind. Raises FileError naming
    file and line if it is otherwise malformed, not readable as text, or beyond the limits.

    depth: of the <include> in whose place it comes.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror})") from None
    data = data.rstrip(b"\0 \t\r\n")  # some programs end files with a zero; MuJoCo's parser stops there
    if b"\0" in data:
        raise FileError(f"{path}: is no text: it holds bytes of zero, where MuJoCo's parser would stop")
    parser = expat.ParserCreate()
    roots: list[Element] = []
    stack: list[Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        parent = stack[-1] if stack else None
        element = Element(tag, attributes, path, parser.CurrentLineNumber, parent)
        budget.add(element, depth + len(stack))
        (parent.children if parent else roots).append(element)
        stack.append(element)

    def entity(name: str, *_: object) -> None:
        # MuJoCo's parser leaves out what an entity stands for, without a word.
        raise FileError(
            f"{path}:{parser.CurrentLineNumber}: the entity &{name}; is defined here, which MuJoCo does not "
            "read; write what it stands for in its places, or <include> it"
        )

    def text(part: str) -> None:
        stack[-1].text += part

    parser.StartElementHandler = start
    parser.CharacterDataHandler = text
    parser.buffer_text = True
    parser.EndElementHandler = lambda tag: stack.pop()
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        if isinstance(error, FileError):
            raise
        code = getattr(error, "code", None)  # without one it is an encoding that Python does not know
        reason = expat.ErrorString(code) if code else str(error)
        line = getattr(error, "lineno", 1)
        root = sloppy_xml.parse(data, path, budget, depth)
        if root is not None:
            faults.append((root, f"line {line} is malformed XML, {reason}; it is read as MuJoCo reads it"))
            return root
        last = f"; the element open there is {stack[-1]} of line {stack[-1].line}" if stack else ""
        raise FileError(f"{path}:{line}: malformed XML: {reason}{last}") from None
    return roots[0]


def expand_includes(root: Element, folder: Path, faults: Faults, budget: Budget) -> None:
    """Replaces <include file="..."/> by the content of the file, as MuJoCo does.

    Paths are relative to the folder of the main file. Raises FileError for files that are missing,
    malformed or include themselves.
    """

    def expand(node: Element, open_files: tuple[Path, ...], depth: int) -> None:
        children = []
        for child in node.children:
            if child.tag != "include":
                expand(child, open_files, depth + 1)
                children.append(child)
                continue
            file = folder / child.attributes.get("file", "")
            require_inside(child, file, budget.limits)
            if is_special(file):
                raise child.fault(f"{file} is no regular file")
            if not is_file(file):
                raise child.fault(f"the file {file} does not exist")
            if len(open_files) > MOST_OPEN:
                raise child.fault(f"more than {MOST_OPEN} files include each other in a row")
            if file.resolve() in open_files:
                raise child.fault(f"the file {file} includes itself")
            content = read_xml(file, faults, budget, depth)
            expand(content, (*open_files, file.resolve()), depth)
            for part in content.children:
                part.parent = node
            children += content.children
        node.children[:] = children

    expand(root, (root.file.resolve(),), 0)
