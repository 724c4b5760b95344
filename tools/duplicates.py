"""Places of the sources that say the same: runs of lines that agree but for names, numbers and strings.

Comments, blank lines, imports and lines of punctuation alone are passed over, so that a run is one of
statements. It counts if it has 6 lines of the same words, or 8 lines of the same shape of which most differ
from each other: lists (parameters, bindings) look alike and are none.
"""

import io
import keyword
import re
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

SAME_WORDS, SAME_SHAPE = 6, 8
CPP_KEYWORDS = set(
    re.findall(
        r"\w+",
        """auto bool break case class const constexpr continue default do double else enum explicit false
        float for if inline int namespace noexcept operator private public return short signed sizeof static
        static_assert struct switch template this throw true typename union unsigned using virtual void
        while""",
    )
)
KEYWORDS = CPP_KEYWORDS | set(keyword.kwlist)
CPP_COMMENT = re.compile(r'("(?:\\.|[^"\\\n])*")|//[^\n]*|/\*.*?\*/', re.DOTALL)
TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])*\'|[A-Za-z_]\w*|\d[\w.]*|\S')
PASSED_OVER = re.compile(r"(#\s*include|#\s*pragma|import |from \S+ import|namespace\b|using namespace)")


@dataclass(frozen=True)
class Line:
    number: int
    words: str
    shape: str


@dataclass(frozen=True)
class Pair:
    """Lines first[0] to first[1] of one file are those second[0] to second[1] of another, or of the same."""

    files: tuple[str, str]
    first: tuple[int, int]
    second: tuple[int, int]
    lines: int

    def __str__(self) -> str:
        a, b = self.files
        (i, j), (k, m) = self.first, self.second
        return f"{a}:{i}-{j} and {b}:{k}-{m}: {self.lines} lines of one shape; write them once"


def blank(match: re.Match[str]) -> str:
    """A comment as the line ends in it; a string as it is."""
    return match.group(1) or "\n" * match.group().count("\n")


def without_comments(text: str, suffix: str) -> str:
    """The text with as many lines and no comments; of Python docstrings go too."""
    if suffix != ".py":
        return CPP_COMMENT.sub(blank, text)
    lines = text.split("\n")
    start = True  # of a statement
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT or (token.type == tokenize.STRING and start):
            (a, i), (b, j) = token.start, token.end
            for row in range(a, b + 1):
                line = lines[row - 1]
                left, right = (i if row == a else 0), (j if row == b else len(line))
                lines[row - 1] = line[:left] + " " * (right - left) + line[right:]
        if token.type not in (tokenize.COMMENT, tokenize.NL):
            start = token.type in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENCODING)
    return "\n".join(lines)


def shape(token: str) -> str:
    if token in KEYWORDS:
        return token
    kinds = ((r"[A-Za-z_]", "x"), (r"\d", "0"), (r"[\"']", "s"))
    return next((kind for start, kind in kinds if re.match(start, token)), token)


def statements(text: str, suffix: str) -> list[Line]:
    found = []
    for number, line in enumerate(without_comments(text, suffix).split("\n"), 1):
        tokens = TOKEN.findall(line)
        thin = not any(re.match(r"\w", t) and t not in KEYWORDS for t in tokens)
        if not thin and not PASSED_OVER.match(line.strip()):
            found.append(Line(number, " ".join(tokens), " ".join(map(shape, tokens))))
    return found


def matches(files: dict[str, list[Line]], size: int, field: str) -> Iterator[tuple[str, int, str, int]]:
    """(file, index, file, index) of windows of that many lines which agree in the field."""
    places = defaultdict(list)
    for name, lines in files.items():
        keys = [getattr(line, field) for line in lines]
        for i in range(len(keys) - size + 1):
            places[tuple(keys[i : i + size])].append((name, i))
    for window, found in places.items():
        if len(set(window)) < 0.75 * size:
            continue
        for (a, i), (b, k) in pairwise(found):
            if a != b or k - i >= size:
                yield a, i, b, k


def duplicates(files: dict[str, list[Line]]) -> list[Pair]:
    """Runs that agree, each as long as it goes; a place that stands n times makes n - 1 pairs."""
    diagonals = defaultdict(set)
    for size, field in ((SAME_WORDS, "words"), (SAME_SHAPE, "shape")):
        for a, i, b, k in matches(files, size, field):
            diagonals[a, b, k - i].update(range(i, i + size))
    pairs = []
    for (a, b, offset), indices in diagonals.items():
        ordered = sorted(indices)
        ends = [j for j, (x, y) in enumerate(pairwise(ordered), 1) if y > x + 1]
        for lo, hi in pairwise([0, *ends, len(ordered)]):
            i, j = ordered[lo], ordered[hi - 1]
            spans = (
                (files[a][i].number, files[a][j].number),
                (files[b][i + offset].number, files[b][j + offset].number),
            )
            pairs.append(Pair((a, b), *spans, j - i + 1))
    return sorted(pairs, key=lambda pair: (-pair.lines, pair.files, pair.first))


def find(root: Path, paths: list[Path]) -> list[Pair]:
    files = {str(p.relative_to(root)): statements(p.read_text(), p.suffix) for p in paths}
    return duplicates(files)
