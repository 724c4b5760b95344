"""Facts that diagrams take from C++ sources: calls, constants, enumerators, contenders of `auto`."""

import re
from collections.abc import Iterable
from pathlib import Path

from duplicates import without_comments


class Changed(Exception):
    """The sources have something that a diagram does not describe, or lack what it describes."""


def code(path: Path) -> str:
    return without_comments(path.read_text(), ".cpp")


def body(path: Path, signature: str) -> str:
    """The body of the first function whose definition begins with a signature (a regular expression)."""
    text = code(path)
    match = re.search(signature + r"[^;{]*\{", text)
    if match is None:
        raise Changed(f"{path}: there is no definition {signature}")
    depth, end = 1, match.end()
    while depth:
        depth += {"{": 1, "}": -1}.get(text[end], 0)
        end += 1
    return text[match.end() : end]


def calls(function: str) -> list[str]:
    """The functions and members that a body calls by name, in the order of their first calls."""
    return list(dict.fromkeys(re.findall(r"(?<![\w.:>])(\w+)\(", function)))


def declared(paths: Iterable[Path]) -> set[str]:
    """The functions that headers declare, or sources define, at the left margin."""
    pattern = re.compile(r"^(?=\w)(?!return|if|for|while)[\w:<>,&* ]*?[ &*](?:\w+::)?(\w+)\(", re.MULTILINE)
    return {name for path in paths for name in pattern.findall(code(path))}


def members(path: Path, name: str) -> set[str]:
    """The member functions of a class that a source defines."""
    return set(re.findall(rf"\b{name}::(\w+)\(", code(path)))


def described(found: Iterable[str], captions: Iterable[str], known: set[str], passed: set[str]) -> list[str]:
    """The known calls, in their order; Changed if one of them has no caption, or a caption no call."""
    order = [name for name in found if name in known and name not in passed]
    captions = list(captions)
    for name in order:
        if name not in captions:
            raise Changed(f"{name}() is called, but has no caption; add it in tools/diagrams.py")
    for name in captions:
        if name not in order:
            raise Changed(f"{name}() has a caption in tools/diagrams.py, but is not called any more")
    return order


def constant(path: Path, name: str) -> str:
    """The value of a constant, as it is written."""
    match = re.search(rf"\b{name}\s*(?:=\s*|\{{)([\d.e'+-]+)", code(path))
    if match is None:
        raise Changed(f"{path}: there is no constant {name}")
    return match[1].replace("'", "")


def enumerators(path: Path, name: str) -> list[str]:
    match = re.search(rf"enum class {name}\b[^{{]*\{{([^}}]*)\}}", code(path))
    if match is None:
        raise Changed(f"{path}: there is no enum class {name}")
    return re.findall(r"\w+", re.sub(r"=[^,]*", "", match[1]))


def contenders(path: Path) -> dict[str, list[tuple[str, str]]]:
    """Function -> (method, why it runs) of the contenders of auto that it lists."""
    text, groups = code(path), dict[str, list[tuple[str, str]]]()
    functions = [
        (m.start(), m[1]) for m in re.finditer(r"^\w[\w<>&: ]* (\w+)\([^;]*?\{$", text, re.MULTILINE)
    ]
    for match in re.finditer(r"\.start = start_(\w+),\s*\.why =(.*?\")\s*[,}]", text, re.DOTALL):
        function = [name for at, name in functions if at < match.start()][-1]
        why = re.findall(r'"([^"]*)"', match[2])[-1]
        groups.setdefault(function, []).append((match[1], why))
    return groups
