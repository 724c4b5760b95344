"""Counts what ARCHITECTURE.md says about the size of amontons, each row by one rule.

    python tools/sizes.py [ROOT]

ROOT: another checkout with its environment (make install), for the column of an earlier revision; the rules
stay those of this file.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from check_policy import BASES, ROOT, look
from cpp_facts import body, calls, code, declared

ROOMS = ("multibody/step", "solvers/choice", "solvers/direct", "solvers/central_path")
CORE = ("multibody", "solvers", "problem")
TEXT = (".py", ".pyi", ".cpp", ".hpp", ".md")
ASKS = re.compile(
    r"(?:\.|->)(?:ends_within|over|over_attempt|exhausted|late|left|work_left|since_solved|elapsed)\("
)
"""Questions to the clock or the budget."""


def lines(paths: list[Path]) -> int:
    return sum(path.read_text(errors="replace").count("\n") for path in paths)


def sources(root: Path, room: str, suffixes: tuple[str, ...] = (".hpp", ".cpp")) -> list[Path]:
    return [p for base in BASES for p in sorted((root / base / room).rglob("*")) if p.suffix in suffixes]


def of_package(root: Path) -> list[int]:
    """The number of public names, and of members of `Simulation`, of the package as it is installed there."""
    ask = "import amontons as a; print(len(a.__all__), sum(n[0] != '_' for n in dir(a.Simulation)))"
    told = subprocess.run([root / ".venv/bin/python", "-c", ask], capture_output=True, text=True, check=True)
    return list(map(int, told.stdout.split()))


def rows(root: Path) -> dict[str, str]:
    step = sources(root, "multibody/step")
    advance = body(root / "src/multibody/step/step.cpp", r"Simulation::Outcome Simulation::advance\(")
    stages = set(calls(advance))
    stages &= declared([path for path in step if path.suffix == ".hpp"])
    tests = " ".join(map(code, (root / "tests" / "cpp").glob("*.cpp")))
    tested = {name for name in stages if re.search(rf"\b{name}\(", tests)}
    names, members = of_package(root)
    told = subprocess.run(["git", "-C", root, "ls-files"], capture_output=True, text=True, check=True)
    listed = [root / name for name in told.stdout.splitlines() if name.endswith(TEXT)]
    numbers = [c for room in ROOMS for c in look(root, room).constants]
    step_code = [code(path) for path in step if path.suffix == ".cpp"]
    counts = {
        "lines of " + ", ".join(ROOMS): lines([p for room in ROOMS for p in sources(root, room)]),
        "lines of " + ", ".join(CORE): lines([p for layer in CORE for p in sources(root, layer)]),
        "repairs that a number of `policy.hpp` switches off": sum(c.off is not None for c in numbers),
        "tuned numbers of these rooms (`check_policy.py`)": sum(look(root, room).count for room in ROOMS),
        "questions of `src/multibody/step` to the clock or the budget": sum(
            len(ASKS.findall(text)) for text in step_code
        ),
        "stages that `Simulation::advance` calls": len(stages),
        "of these called alone by a C++ test": len(tested),
        "names in `amontons.__all__`": names,
        "members of `Simulation`": members,
        "lines of " + ", ".join("*" + kind for kind in TEXT): lines([p for p in listed if p.is_file()]),
    }
    return {what: f"{number:,}" for what, number in counts.items()}


if __name__ == "__main__":
    for what, number in rows(Path(sys.argv[1]) if sys.argv[1:] else ROOT).items():
        print(f"{what}: {number}")
