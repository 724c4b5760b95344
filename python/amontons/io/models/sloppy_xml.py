"""XML that is not well-formed, as far as MuJoCo's parser (TinyXML-2) takes it.

That parser wants tags that match and quoted attributes. It does not mind text or blanks before the
declaration, comments with "--" in them, "&" and "<" in attributes, entities that nobody has defined,
attributes without blanks between them, bytes that are not of the encoding, and what follows the root.
"""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path

from .elements import Element
from .size import Budget

TOKEN = re.compile(
    r"""(?P<skipped><!--.*?-->|<\?.*?\?>|<!\[CDATA\[.*?\]\]>|<![^>]*>)
    |</\s*(?P<end>[^\s>]+)\s*>
    |<(?P<start>[^\s/>!?=]+)(?P<attributes>(?:\s*[^\s=/>"\']+\s*=\s*(?:"[^"]*"|\'[^\']*\'))*)\s*(?P<empty>/?)>""",
    re.DOTALL | re.VERBOSE,
)
ATTRIBUTE = re.compile(r"""([^\s=/>"\']+)\s*=\s*(?:"([^"]*)"|\'([^\']*)\')""", re.DOTALL)


def parse(data: bytes, path: Path, budget: Budget, depth: int) -> Element | None:
    """The first root element; None if its tags do not match or something that starts like a tag is none."""
    text = data.decode("utf-8", errors="replace")
    stack: list[Element] = []
    line, at, place = 1, 0, 0
    while (place := text.find("<", place)) >= 0:
        token = TOKEN.match(text, place)
        if token is None or token[0].startswith("<!ENTITY") or "<!ENTITY" in (token["skipped"] or "")[:2000]:
            return None
        line += text.count("\n", at, place)
        at = place
        place = token.end()
        if token["start"]:
            parent = stack[-1] if stack else None
            element = Element(token["start"], _attributes(token["attributes"]), path, line, parent)
            budget.add(element, depth + len(stack))
            if parent is not None:
                parent.children.append(element)
            if not token["empty"]:
                stack.append(element)
            elif parent is None:
                return element
        elif token["end"]:
            if not stack or stack[-1].tag != token["end"]:
                return None
            element = stack.pop()
            if not stack:
                return element
    return None


def _attributes(text: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for name, double, single in ATTRIBUTE.findall(text):
        found.setdefault(name, unescape(double or single))
    return found
