"""Measures functions, comments and duplicates of the sources, and prints what lies beyond the limits."""

import math
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import lizard
from duplicates import Pair, find, without_comments

ROOT = Path(__file__).resolve().parent.parent
CPP, CORE, PYTHON = ("include", "src", "bindings", "fmu"), ("include", "src"), ("python/amontons",)
P90, LONGEST, COMPLEXITY, COMMENTS = 35, 70, 20, 0.18
PARAMETERS = 6  # of functions of the core; others mirror the options of a call
# Pairs of files that may say the same, and why; the names are starts of paths.
BOILERPLATE: dict[tuple[str, str], str] = {
    ("python/amontons/cli/", "python/amontons/cli/"): "the options of a command are its signature",
    ("python/amontons/model/joint_b", "python/amontons/model/joint_b"): "signatures of one family",
    ("python/amontons/problem/problem", "python/amontons/problem/problem"): "solve() as function and method",
    ("python/amontons/problem/operators", "python/amontons/problem/operators"): "arrays of the bindings",
}


@dataclass(frozen=True)
class Function:
    place: str  # file:line
    name: str
    lines: int
    complexity: int
    parameters: int


@dataclass(frozen=True)
class Text:
    """Lines that hold code, comments alone, and code with a comment behind."""

    code: int
    comments: int
    trailing: int

    @property
    def share(self) -> float:
        """Of comment lines among those that are not blank; what stands behind code does not count."""
        return self.comments / max(1, self.code + self.comments)


def sources(root: Path, folders: Sequence[str]) -> list[Path]:
    found = (
        p for folder in folders for p in (root / folder).rglob("*") if p.suffix in (".cpp", ".hpp", ".py")
    )
    return sorted(found)


def functions(root: Path, paths: Sequence[Path]) -> list[Function]:
    """Every function with its lines from the signature to the last brace, comments and docstring included."""
    found = []
    for path in paths:
        name = path.relative_to(root)
        # lizard takes the && of a forwarding reference for an operator.
        text = re.sub(r"\bauto\s*&&", "auto&", path.read_text())
        for f in lizard.analyze_file.analyze_source_code(str(path), text).function_list:
            found.append(
                Function(
                    f"{name}:{f.start_line}", f.name, f.length, f.cyclomatic_complexity, f.parameter_count
                )
            )
    return found


def measure_text(paths: Sequence[Path]) -> Text:
    code = comments = trailing = 0
    for path in paths:
        text = path.read_text()
        for line, bare in zip(text.split("\n"), without_comments(text, path.suffix).split("\n"), strict=True):
            if bare.strip():
                code += 1
                trailing += bare.strip() != line.strip()
            elif line.strip():
                comments += 1
    return Text(code, comments, trailing)


def quantile(values: Sequence[int], q: float) -> int:
    """The smallest value that so large a part of them does not exceed; 0 of none."""
    return sorted(values)[max(0, math.ceil(q * len(values)) - 1)] if values else 0


def function_faults(kind: str, found: Sequence[Function]) -> Iterator[str]:
    p90 = quantile([f.lines for f in found], 0.9)
    if p90 > P90:
        yield f"{kind}: a tenth of the functions has more than {p90} lines; at most {P90}"
    for f in sorted(found, key=lambda f: -f.lines):
        if f.lines > LONGEST:
            yield f"{f.place}: {f.name} has {f.lines} lines; at most {LONGEST}: divide it"
    for f in sorted(found, key=lambda f: -f.complexity):
        if f.complexity > COMPLEXITY:
            yield f"{f.place}: {f.name} has complexity {f.complexity}; at most {COMPLEXITY}: divide it"
    for f in found:
        if f.parameters > PARAMETERS and f.place.startswith(CORE):
            yield f"{f.place}: {f.name} has {f.parameters} parameters; at most {PARAMETERS}: pass a value"


def text_faults(core: Text) -> Iterator[str]:
    if core.share < COMMENTS:
        missing = math.ceil((COMMENTS * core.code - (1 - COMMENTS) * core.comments) / (1 - COMMENTS))
        yield (
            f"include, src: {core.share:.1%} of the lines are comments; at least {COMMENTS:.0%}: "
            f"{missing} lines that derive or explain are missing"
        )


def duplicate_faults(pairs: Sequence[Pair], boilerplate: dict[tuple[str, str], str]) -> Iterator[str]:
    unused = set(boilerplate)
    for pair in pairs:
        excuses = [key for key in boilerplate if all(map(str.startswith, pair.files, key))]
        unused -= set(excuses)
        if not excuses:
            yield str(pair)
    for a, b in sorted(unused):
        yield f"tools/check_style.py: BOILERPLATE lists {a} and {b}, which no longer agree; remove it"


def measure(root: Path, boilerplate: dict[tuple[str, str], str] = BOILERPLATE) -> list[str]:
    """What lies beyond the limits."""
    cpp, python = sources(root, CPP), sources(root, PYTHON)
    kinds = {"C++": functions(root, cpp), "Python": functions(root, python)}
    faults = [fault for kind, found in kinds.items() for fault in function_faults(kind, found)]
    faults += text_faults(measure_text(sources(root, CORE)))
    return [*faults, *duplicate_faults(find(root, cpp + python), boilerplate)]


def main() -> int:
    faults = measure(ROOT)
    print("\n".join(faults or ["style holds"]))
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
