"""The sentences of comments, docstrings, help of commands and documents.

Each comes with the line where its paragraph begins.
"""

import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

ABBREVIATION = r"(?<!\be\.g\.)(?<!\bi\.e\.)(?<!\bcf\.)(?<!\bal\.)(?<!\bno\.)(?<!\bvs\.)"
END = re.compile(rf"(?<=[.!?])(?:[)\"*]*){ABBREVIATION}\s+(?=\S)")
ITEM = re.compile(r"\s*([-*+]|\d+\.|[ivx]+\))\s+")
EXAMPLE = re.compile(r"^ *>>> .*(?:\n *\S.*)*", re.MULTILINE)
COMMENT = re.compile(r'"(?:\\.|[^"\\\n])*"|(//+)([^\n]*)')

Lines = list[tuple[int, str]]
"""(line number, text) of one comment, docstring or paragraph"""


def units(lines: Lines) -> Iterator[tuple[int, str]]:
    """Paragraphs and list items: a blank line, an item and a displayed formula begin a new one."""
    start, parts = 0, list[str]()
    for number, line in [*lines, (0, "")]:
        text = line.strip()
        if (not text or ITEM.match(line) or line.startswith("    ")) and parts:
            yield start, " ".join(parts)
            parts = []
        if text:
            start = start if parts else number
            parts.append(ITEM.sub("", line, count=1).strip() if ITEM.match(line) else text)


def comments_cpp(text: str) -> Iterator[Lines]:
    """Comments; one that follows at the same column on its own line continues the one before."""
    block, last, column = Lines(), -1, -1
    for number, line in enumerate(text.split("\n"), 1):
        match = next((m for m in COMMENT.finditer(line) if m[1]), None)
        if match is None:
            continue
        alone = not line[: match.start()].strip()
        if block and not (alone and number == last + 1 and match.start() == column):
            yield block
            block = []
        block, last, column = [*block, (number, match[2].removeprefix(" "))], number, match.start()
    yield block


def comments_python(text: str) -> Iterator[Lines]:
    """Docstrings, each line with the indentation of the string removed, `help="..."`, and comments as in C++.

    Examples of docstrings, from a line `>>>` to the next blank one, are code.
    """
    start, hashes = True, [""] * (text.count("\n") + 2)
    before_help, shown_help = ("", ""), Lines()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        (row, column), kind = token.start, token.type
        if kind == tokenize.COMMENT:
            before = token.line[:column]
            hashes[row] = ("x" if before.strip() else " ").ljust(column) + "//" + token.string[1:]
        elif kind == tokenize.STRING and start:
            body = token.string.strip("rRuU").strip("\"'")
            lines = EXAMPLE.sub(only_lines, body).split("\n")
            yield [(row + i, line.removeprefix(" " * column)) for i, line in enumerate(lines)]
        elif kind == tokenize.STRING and (shown_help or before_help == ("help", "=")):
            shown_help.append((row, token.string.strip("rRuU").strip("\"'")))
        elif shown_help and kind not in (tokenize.NL, tokenize.COMMENT):
            yield shown_help
            shown_help = []
        if kind not in (tokenize.COMMENT, tokenize.NL):
            start = kind in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENCODING)
            before_help = (before_help[1], token.string)
    yield from comments_cpp("\n".join(hashes[1:]))


def only_lines(match: re.Match[str]) -> str:
    return "\n" * match[0].count("\n")


def paragraphs(text: str) -> Iterator[Lines]:
    """Paragraphs of Markdown, without code, HTML, formulas and headings; every cell of a table is one."""
    text = re.sub(r"^(```+|~~~+).*?^\1\s*$", only_lines, text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"<!--.*?-->|</?[a-z][^>]*>", only_lines, text, flags=re.DOTALL)
    text = re.sub(r"`[^`]+`|\$[^$\n]+\$", lambda m: "code" + only_lines(m), text)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"[\1]", text)
    block = Lines()
    for number, line in enumerate(text.split("\n"), 1):
        if line.lstrip().startswith("|"):
            yield from ([(number, cell.strip())] for cell in line.strip().strip("|").split("|"))
        block.append((number, "" if line.lstrip().startswith(("|", "#", ":::")) else line.strip(" *")))
    yield block


READERS = {".md": paragraphs, ".py": comments_python, ".hpp": comments_cpp, ".cpp": comments_cpp}


def sentences(name: str, text: str) -> Iterator[tuple[int, str]]:
    """(line of the paragraph, sentence) of the comments or the paragraphs of a file of that name."""
    for block in READERS[Path(name).suffix](text):
        for line, unit in units(block):
            yield from ((line, sentence) for sentence in END.split(unit))
