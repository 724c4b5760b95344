"""Checks that the tuned numbers of some rooms of the C++ core stand in the room's policy.hpp, with reasons.

    python tools/check_policy.py            prints every violation
    python tools/check_policy.py --count    prints how many tuned numbers each room has, and where

A tuned number is
- a literal with a point or an exponent, unless it is 0, 0.5, 1 or 2;
- a whole number with which a variable or a field begins (`= 40`, `constexpr ... {40}`), unless it is -1 to 3
  or 6;
- any other whole number of at least 10.
Sizes in [] and <>, literals in strings and lines of the preprocessor are none. A line of code that holds a
number for another reason says so: `// not tuned: nanoseconds per second`.

policy.hpp has the fields of struct Policy, with their values, and perhaps constants. Each is a declaration of
its own, and its comment, above it or behind it, has the form "quantity (unit): reason". "Off: value." behind
the reason tells the value that does without what the number controls; benchmarks/sensitivity.py tries it. A
declaration counts as many numbers as it has tuned literals, at least one. name_policy() gives each field the
name that set_policy() takes.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from duplicates import without_comments

ROOT = Path(__file__).resolve().parent.parent
SHARED = "base"
"""Its policy.hpp has the numbers that rooms share. Elsewhere there its numbers are those of functions, as the
coefficients of a sine."""
ROOMS = (
    SHARED,
    "multibody/step",
    "multibody/joints",
    "multibody/contacts",
    "multibody/trees",
    "solvers/second_order",
    "solvers/direct",
    "solvers/central_path",
    "solvers/choice",
)
LIMIT = 45
"""of all rooms together; it only falls, but for a room that comes with the numbers that it has. Six rooms had
88 when joints and contacts came with 19, of 42 that stood in their code."""
BASES = ("include/amontons", "src")
POLICY = "policy.hpp"

TRIVIAL_REAL = {0.0, 0.5, 1.0, 2.0}
TRIVIAL_WHOLE = {0, 1, 2, 3, 6}
FEW = 10
"""Smaller whole numbers are none where they do not begin a variable: 4 * a * c."""

NUMBER = re.compile(
    r"(?<![\w.])(0[xX][\da-fA-F']+|(?:\d[\d']*\.?[\d']*|\.\d+)(?:[eE][+-]?\d+)?)[uUlLfFzZ]*(?![\w.])"
)
STRING = re.compile(r'"(?:\\.|[^"\\\n])*"')
SIZES = re.compile(r"\[[^][]*\]|<(?=\S)[\w\s:,&*]*(?<=\S)>")  # comparisons have spaces around them
CONSTANT = re.compile(r"\bconstexpr\b[^;(]*?\b(\w+)\s*(?:\[[^]]*\]\s*)?(?:=|\{)[^;]*;")
FIELD = re.compile(r"^[ \t]+(?:double|int|std::size_t)\s+(\w+)\s*(?:=|\{)[^;]*;", re.MULTILINE)
NAMED = re.compile(r'\{"(\w+)", &policy\.\1\}')
OFF = re.compile(r"\bOff: ([\d.e+-]+)\.$")
BEGINS = re.compile(r"(?<![=<>!+*/-])=\s*-?$")
EXEMPT = re.compile(r"//.*\bnot tuned: \S")
FORM = re.compile(r"[^():]+ \([^()]+\): \S")


@dataclass(frozen=True)
class Number:
    place: str
    """file:line"""
    literal: str


@dataclass(frozen=True)
class Constant:
    """A declaration in a policy.hpp."""

    place: str
    name: str
    numbers: int
    comment: str
    declares: int
    """variables"""
    field: bool
    """of struct Policy"""

    @property
    def off(self) -> float | None:
        """The value that does without what the number controls."""
        found = OFF.search(self.comment)
        return float(found[1]) if found else None


def bare(text: str) -> str:
    """The code with as many lines, without comments, strings, sizes and the preprocessor."""
    code = STRING.sub(lambda m: " " * len(m[0]), without_comments(text, ".hpp"))
    code = SIZES.sub(lambda m: " " * len(m[0]), code)
    return re.sub(r"^[ \t]*#.*", "", code, flags=re.MULTILINE)


def literals(code: str, constants: list[tuple[int, int]]) -> Iterator[tuple[int, str]]:
    """(position, literal) of the tuned numbers of bare code; `constants` are the spans of its constants."""
    for match in NUMBER.finditer(code):
        literal = match[1].replace("'", "")
        if not literal.lower().startswith("0x") and re.search("[.eE]", literal):
            tuned = float(literal) not in TRIVIAL_REAL
        else:
            value = int(literal, 0) if literal.lower().startswith("0x") else int(literal)
            begins = BEGINS.search(code, 0, match.start()) or any(
                a <= match.start() < b for a, b in constants
            )
            tuned = value not in TRIVIAL_WHOLE if begins else value >= FEW
        if tuned:
            yield match.start(), match[0]


def tuned(path: str, text: str) -> Iterator[Number]:
    """The tuned numbers of a file, but for the lines that say why theirs are none."""
    code, lines = bare(text), text.split("\n")
    constants = [match.span() for match in CONSTANT.finditer(code)]
    for position, literal in literals(code, constants):
        line = code.count("\n", 0, position)
        if not EXEMPT.search(lines[line]):
            yield Number(f"{path}:{line + 1}", literal)


def comment_of(lines: list[str], first: int, last: int) -> str:
    """The comment behind the lines of a declaration, or else those above it."""
    behind = lines[last].partition("//")[2].strip()
    above = []
    while first > 0 and lines[first - 1].strip().startswith("//"):
        first -= 1
        above.insert(0, lines[first].strip().removeprefix("//").strip())
    return behind or " ".join(above)


def declared(declaration: str) -> int:
    """The number of variables of a declaration: commas outside brackets divide them."""
    depth, count = 0, 1
    for character in declaration:
        depth += (character in "({[") - (character in ")}]")
        count += character == "," and depth == 0
    return count


def constants_of(path: str, text: str) -> Iterator[Constant]:
    """The declarations of a policy.hpp."""
    code, lines = bare(text), text.split("\n")
    found = [(match, False) for match in CONSTANT.finditer(code)]
    found += [(match, True) for match in FIELD.finditer(code)]
    for match, field in sorted(found, key=lambda pair: pair[0].start()):
        first, last = (code.count("\n", 0, at) for at in match.span())
        numbers = sum(1 for _ in literals(match[0], [(0, len(match[0]))]))
        comment = comment_of(lines, first, last)
        yield Constant(f"{path}:{first + 1}", match[1], max(1, numbers), comment, declared(match[0]), field)


@dataclass(frozen=True)
class Room:
    name: str
    exists: bool
    constants: list[Constant]
    strays: list[Number]
    named: set[str]
    """fields that name_policy() names"""

    @property
    def count(self) -> int:
        return sum(constant.numbers for constant in self.constants) + len(self.strays)


def look(root: Path, name: str) -> Room:
    folders = [root / base / name for base in BASES]
    constants: list[Constant] = []
    strays: list[Number] = []
    named: set[str] = set()
    files = POLICY if name == SHARED else "*.[hc]pp"
    for file in sorted(file for folder in folders for file in folder.rglob(files)):
        path, text = str(file.relative_to(root)), file.read_text()
        if file.name == POLICY:
            constants += constants_of(path, text)
        else:
            strays += tuned(path, text)
        named |= set(NAMED.findall(text))
    return Room(name, any(folder.is_dir() for folder in folders), constants, strays, named)


def faults(rooms: list[Room], limit: int) -> Iterator[str]:
    for room in rooms:
        if not room.exists:
            yield f"tools/check_policy.py: ROOMS lists {room.name}, which does not exist; correct the list"
        for number in room.strays:
            yield (
                f"{number.place}: {number.literal} is a tuned number; give it a name and a reason in "
                f"src/{room.name}/{POLICY}, or say what else it is: // not tuned: ..."
            )
        for constant in room.constants:
            if constant.declares > 1:
                yield f"{constant.place}: declares several constants; give each a line and a reason"
            elif not FORM.match(constant.comment):
                yield f'{constant.place}: the comment of {constant.name} must be "quantity (unit): reason"'
            if constant.field and constant.name not in room.named:
                yield f"{constant.place}: {constant.name} is not named in src/{room.name}/{POLICY}"
    total = sum(room.count for room in rooms)
    if total > limit:
        yield f"{total} tuned numbers in {', '.join(room.name for room in rooms)}; at most {limit}"


def count(rooms: list[Room]) -> str:
    """How many tuned numbers there are, and where."""
    lines = []
    for room in rooms:
        named = sum(constant.numbers for constant in room.constants)
        lines.append(f"{room.name}: {room.count} tuned numbers, {named} of them in {POLICY}")
        places: dict[str, list[str]] = {}
        for number in room.strays:
            places.setdefault(number.place, []).append(number.literal)
        lines += [f"  {place}: {', '.join(found)}" for place, found in places.items()]
    return "\n".join([*lines, f"{sum(room.count for room in rooms)} in all; at most {LIMIT}"])


def violations(root: Path, rooms: tuple[str, ...] = ROOMS, limit: int = LIMIT) -> list[str]:
    return list(faults([look(root, name) for name in rooms], limit))


if __name__ == "__main__":
    if sys.argv[1:] == ["--count"]:
        print(count([look(ROOT, name) for name in ROOMS]))
        sys.exit(0)
    found = violations(ROOT)
    print("\n".join(found) if found else "tuned numbers have reasons")
    sys.exit(bool(found))
