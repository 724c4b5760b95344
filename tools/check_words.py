"""Counts what makes comments and documents hard to read, and compares the counts with limits that only fall.

    python tools/check_words.py                      prints part x measure; fails above the limits
    python tools/check_words.py --list PART MEASURE  prints file:line of every hit
    python tools/check_words.py --lower              lowers the limits to the counts

Parts: comments of the C++ core and of the bindings; comments, docstrings and help of commands of the package;
documents; guides, which are the other pages at the root and the READMEs of folders; examples. Measures:
- long: sentences of more than 30 words; code and a formula count as one word each
- start: sentences that begin with "Of" or "What"; questions and headings may
- idiom: the phrases of IDIOM

A sentence ends at a full stop, a question mark, a blank line, the next item of a list or the border of a
table cell.
"""

import argparse
import csv
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from prose import sentences

ROOT = Path(__file__).resolve().parent.parent
LIMITS = Path("tools/word_limits.csv")
GUIDES = ("CODE_OF_CONDUCT.md", "RELEASING.md", "SECURITY.md", "paper/paper.md")
FOLDERS = ("benchmarks", "bindings", "licenses", "python", "src", "tests", "tools")
PARTS = {
    "core": ("include/**/*.hpp", "src/**/*.hpp", "src/**/*.cpp"),
    "bindings": ("bindings/**/*.hpp", "bindings/**/*.cpp"),
    "python": ("python/**/*.py",),
    "documents": ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "docs/**/*.md"),
    "guides": (*GUIDES, *(f"{folder}/**/README.md" for folder in FOLDERS)),
    "examples": ("examples/**/*.py",),
}
MOST_WORDS = 30
# Each phrase has a plain word: CONTRIBUTING.md, "Words". "ways" is the plural of way for travel.
IDIOM = re.compile(
    r"\b((is|are|was|were|be|unless) told|tells? of|(has|have) the last word|[Nn]one are"
    r"|(?<![Tt]here )are none|([Nn]obody|[Nn]othing|whoever) (is|are) asked|(is|are) asked (of|for)"
    r"|[Mm]end(s|ed|ing)?|in a hurry|hurried|such a one|all the same|(can|could|to) be had"
    r"|nobody (can|could) foresee|come in flocks|for nothing|anew|in the place of|looked at (again|after)"
    r"|[Ww]ays(?! (to|of|in which|that|round))|(its|their|the) way \(|(its|their|the) way of the"
    r"|bring(s|ing)? (it|them) down|largest way|as it comes|of now|[Ii]n earnest|taken? back"
    r"|who knows|said by)\b"
)
START = re.compile(r"(Of|What)\b(?!.*\?)")


class Hit(NamedTuple):
    place: str
    """file:line of the sentence or of its paragraph"""
    text: str


def hits(name: str, text: str) -> dict[str, list[Hit]]:
    """Every measure with what it finds in a file of that name."""
    found: dict[str, list[Hit]] = {"long": [], "start": [], "idiom": []}
    for line, sentence in sentences(name, text):
        hit = Hit(f"{name}:{line}", sentence)
        if sum(any(map(str.isalnum, word)) for word in sentence.split()) > MOST_WORDS:
            found["long"].append(hit)
        if START.match(sentence):
            found["start"].append(hit)
        found["idiom"] += [Hit(hit.place, f'"{m[0]}": {sentence}') for m in IDIOM.finditer(sentence)]
    return found


def measure(root: Path) -> dict[str, dict[str, list[Hit]]]:
    """Part -> measure -> hits, of the files below a root."""
    table: dict[str, dict[str, list[Hit]]] = {}
    for part, patterns in PARTS.items():
        table[part] = {"long": [], "start": [], "idiom": []}
        for path in sorted({p for pattern in patterns for p in root.glob(pattern)}):
            for kind, found in hits(str(path.relative_to(root)), path.read_text()).items():
                table[part][kind] += found
    return table


def read_limits(path: Path) -> dict[str, dict[str, int]]:
    with path.open() as file:
        return {row.pop("part"): {k: int(v) for k, v in row.items()} for row in csv.DictReader(file)}


def lower(path: Path, counts: dict[str, dict[str, int]]) -> None:
    """Writes the smaller one of limit and count; a limit never rises."""
    limits = read_limits(path) if path.exists() else counts
    rows = [
        [part, *(min(count, limits[part][kind]) for kind, count in row.items())]
        for part, row in counts.items()
    ]
    lines = [["part", *next(iter(counts.values()))], *rows]
    path.write_text("".join(",".join(map(str, line)) + "\n" for line in lines))


def faults(counts: dict[str, dict[str, int]], limits: dict[str, dict[str, int]]) -> Iterator[str]:
    for part, row in counts.items():
        for kind, count in row.items():
            if count > limits[part][kind]:
                yield (
                    f"{part}: {count} x {kind}, at most {limits[part][kind]}: rewrite the new ones "
                    f"(tools/check_words.py --list {part} {kind} shows all; CONTRIBUTING.md, Words, says how)"
                )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--list", nargs=2, metavar=("PART", "MEASURE"), help="print the hits")
    parser.add_argument("--lower", action="store_true", help="lower the limits to the counts")
    options = parser.parse_args()
    table = measure(ROOT)
    if options.list:
        part, kind = options.list
        if part not in table or kind not in table[part]:
            parser.error(f"--list: PART is one of {', '.join(table)}; MEASURE of {', '.join(table['core'])}")
        print("\n".join(f"{hit.place}: {hit.text}" for hit in table[part][kind]))
        return 0
    counts = {part: {kind: len(found) for kind, found in row.items()} for part, row in table.items()}
    if options.lower:
        lower(ROOT / LIMITS, counts)
    limits = read_limits(ROOT / LIMITS)
    for part, row in counts.items():
        cells = (f"{k} {n} (at most {limits[part][k]})" for k, n in row.items())
        print(f"{part:10}", *(f"{cell:24}" for cell in cells))
    found = list(faults(counts, limits))
    print("\n".join(found) if found else "words hold")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
