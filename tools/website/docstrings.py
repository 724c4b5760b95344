"""The docstrings of this package for the site: lines `name: what it is` become a list, examples code.

An extension of griffe, which reads the sources; nothing is imported.
"""

import re
from typing import Any

import griffe

# "dt: time step (s)", "position, orientation: of the frame", at the start of a line or behind a full stop.
NAMES = r"[a-z_*]\w*(?:, [a-z_]\w*)*"
ENTRY = re.compile(rf"({NAMES})((?: \([^)]*\))?): (?=\S)")
EXAMPLE = re.compile(r"^>>> .*(?:\n.*\S.*)*", re.MULTILINE)
NEXT = re.compile(rf"(?<=\.) (?={NAMES}: )")


def items(entry: str) -> list[str]:
    """The items of a list that a run of entries makes."""
    made = []
    for part in NEXT.split(entry):
        match = ENTRY.match(part)
        assert match
        names = ", ".join(f"`{name}`" for name in match.group(1).split(", "))
        made.append(f"- {names}{match.group(2)}: {part[match.end() :]}")
    return made


def as_markdown(text: str) -> str:
    """The docstring with its entries, over all their lines, as items of a list, and its examples as code."""
    parts, end = [], 0
    for example in EXAMPLE.finditer(text):
        parts += [_listed(text[end : example.start()]), f"```pycon\n{example[0]}\n```"]
        end = example.end()
    return "\n\n".join(part for part in [*parts, _listed(text[end:])] if part)


def _listed(text: str) -> str:
    lines: list[str] = []
    entry = ""
    for line in [*text.splitlines(), ""]:
        if ENTRY.match(line) or (entry and not line.strip()):
            if entry:
                lines += items(entry)
            elif lines and lines[-1]:
                lines.append("")
            entry = line
            if not line.strip():
                lines.append("")
        elif entry:
            entry += " " + line.strip()
        else:
            lines.append(line)
    return "\n".join(lines).strip("\n")


class Docstrings(griffe.Extension):
    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        if obj.docstring and not obj.is_module:
            obj.docstring.value = as_markdown(obj.docstring.value)
