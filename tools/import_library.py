"""Import libraries of Python's DLLs, made from its headers: what a linker for Windows must know of them.

A module for Windows says of each name from which DLL it comes, so that its linker asks for a list. The
headers of a Python declare the same names on every system: functions by PyAPI_FUNC, data by PyAPI_DATA. A
name that the DLL does not export can be in the list, as only what the module uses is taken over; what the
stable ABI lacks is not declared under Py_LIMITED_API.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

FUNCTION = re.compile(r"PyAPI_FUNC\([^)]*\)\s*(\w+)\s*\(")
DATA = re.compile(r"PyAPI_DATA\([^)]*\)\s*\(?\*?\s*(\w+)")


def declared(headers: Path) -> tuple[list[str], list[str]]:
    """The functions and the data that headers declare, in order."""
    text = "\n".join(header.read_text(errors="replace") for header in sorted(headers.rglob("*.h")))
    data = set(DATA.findall(text))
    return sorted(set(FUNCTION.findall(text)) - data), sorted(data)


def definition(dll: str, functions: list[str], data: list[str]) -> str:
    """A module definition file, as the linkers of Windows read it."""
    lines = [f"LIBRARY {dll}.dll", "EXPORTS", *functions, *(f"{name} DATA" for name in data)]
    return "\n".join(lines) + "\n"


def forwarding(dll: str, to: str, functions: list[str], data: list[str]) -> str:
    """A module definition file of a DLL that forwards all its names to another."""
    lines = [
        *(f"{name} = {to}.{name}" for name in functions),
        *(f"{name} = {to}.{name} DATA" for name in data),
    ]
    return "\n".join([f"LIBRARY {dll}.dll", "EXPORTS", *lines, ""])


def write_import_library(dll: str, headers: Path, folder: Path, dlltool: Path) -> Path:
    """lib{dll}.a in a folder; nothing is done if it is there and says the same."""
    text = definition(dll, *declared(headers))
    library, source = folder / f"lib{dll}.a", folder / f"{dll}.def"
    if not (library.exists() and source.exists() and source.read_text() == text):
        source.write_text(text)
        subprocess.run(
            [dlltool, "-m", "i386:x86-64", "-d", source, "-l", library, "-D", f"{dll}.dll"], check=True
        )
    return library
