r"""Equations as MathML, which browsers show by themselves: no script, no fonts, no network.

A document writes `$`x^2`$`-like inline mathematics as $x^2$ and a numbered equation as a block

    ```math
    u = A x + b \tag{1}
    ```

which code hosting sites show, too. The block becomes <div class="equation" id="eq-1">; a comment of the code
cites it as "docs/algorithm.md (1)", a document as [(1)](algorithm.md#eq-1).
"""

import html as html_module
import re

from latex2mathml.converter import convert

BLOCK = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.DOTALL)
INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
TAG = re.compile(r"\\tag\{(\w+)\}")


def to_mathml(html: str) -> tuple[str, list[str]]:
    """The page with its equations as MathML, and what is wrong with them."""
    faults: list[str] = []

    def mathml(source: str, display: str) -> str:
        text = html_module.unescape(source).strip().replace("'", r"^{\top}")  # primes are set too high
        try:
            result = convert(text, display=display)
        except Exception as error:  # of many types, whatever the parser stumbles over
            faults.append(f"equation {text!r}: {error}")
            return ""
        unknown = re.search(r"<m[iot][^>]*>(\\\w+)", result)
        if unknown:
            faults.append(f"equation {text!r}: {unknown.group(1)} is not known")
        return result

    def block(match: re.Match[str]) -> str:
        source = match.group(1)
        number = TAG.search(source)
        formula = mathml(TAG.sub("", source), "block")
        if not number:
            return f'<div class="equation">{formula}</div>'
        n = number.group(1)
        link = f'<a class="number" href="#eq-{n}">({n})</a>'
        return f'<div class="equation" id="eq-{n}">{formula}{link}</div>'

    return INLINE.sub(lambda m: mathml(m.group(1), "inline"), BLOCK.sub(block, html)), faults
