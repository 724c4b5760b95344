"""What documents type into a shell, and what they show of it.

    python tools/shell_blocks.py --write    renews the outputs that documents show, from what is printed

A line of a block of `sh` is a command; in a block without a language one begins with `$ `, and below it
stands what it prints. tests/repository/test_documentation_shell.py runs all of them but those in ELSEWHERE.
Outputs agree if they differ in numbers, and in the width of columns, only.
"""

from __future__ import annotations

import argparse
import glob
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```[^\S\n]*$", re.MULTILINE | re.DOTALL)
# What no test of the documents runs: how the command begins, and who runs it.
ELSEWHERE = {
    "make ": "what builds: .ci/run",
    "source ": "the environment that make made: every command here runs in it",
    "pip ": "what installs: tools/make_wheel.py tries an installed package",
    "cmake ": "the C++ library: .ci/run builds and uses it, test_cpp_example the example",
    "build/": "the C++ example: test_cpp_example",
    "python examples/": "examples: test_example_runs",
    "amontons view ": "a server: test_viewer_browser opens its pages",
}
# Only the first words are compared: versions, and what is installed. What has passed is compared with its
# numbers, but for those of the machine.
LOOSE = ("amontons doctor",)
PASSED, MACHINE = "passed", re.compile(r"\d+ steps/s|1 and \d+ threads")
# Scenes that take long -> what makes them small; for how long a scene is run at most (s), and a small one.
SMALL = {"wall": ["--set", "columns=4", "--set", "rows=3"]}
LONGEST, SHORT = 0.1, 1.0
# Pictures that make a command cheap.
CHEAP = {"--report": ["--snapshots", "1"], "--gif": ["--fps", "2"], "--mp4": ["--fps", "2"]}


@dataclass(frozen=True)
class Command:
    """A command of a document, with the lines that are shown of what it prints; None where nothing is."""

    line: int
    text: str
    shown: tuple[str, ...] | None

    @property
    def elsewhere(self) -> bool:
        return self.text.startswith(tuple(ELSEWHERE))


def commands(document: Path) -> list[Command]:
    """All commands of a document, in order."""
    text = document.read_text()
    found: list[Command] = []
    for block in FENCE.finditer(text):
        first = text.count("\n", 0, block.start(2)) + 1
        lines = list(enumerate(block[2].splitlines(), first))
        if block[1] == "sh":
            found += [Command(number, line, None) for number, line in lines if line.strip()]
        elif not block[1]:
            found += _typed(lines)
    return found


def _typed(lines: list[tuple[int, str]]) -> Iterator[Command]:
    starts = [k for k, (_, line) in enumerate(lines) if line.startswith("$ ")]
    for k, end in zip(starts, [*starts[1:], len(lines)], strict=False):
        number, line = lines[k]
        yield Command(number, line[2:], tuple(text for _, text in lines[k + 1 : end]))


def words(command: Command) -> list[str]:
    """The words of a command; one whose output is not shown is made short."""
    listed = _expanded(command, Path())
    if command.shown is not None or listed[:1] != ["amontons"]:
        return listed
    simulated = listed[1] in ("run", "export") and "--set" not in listed
    small = next((SMALL[w] for w in listed if w in SMALL and simulated), [])
    if listed[1] == "run":
        longest = SHORT if small else LONGEST
        if "--duration" in listed:
            at = listed.index("--duration") + 1
            listed[at] = f"{min(float(listed[at]), longest):g}"
        else:
            listed += ["--duration", f"{longest:g}"]
    for option, cheap in CHEAP.items():  # of an option that is given twice the last holds
        listed += cheap if option in listed and listed[1] != "stability" else []
    return listed + small


def _expanded(command: Command, folder: Path) -> list[str]:
    """The words as a shell splits them, with the files that patterns match."""
    found: list[str] = []
    for word in shlex.split(command.text, comments=True):
        found += sorted(glob.glob(word, root_dir=folder)) if "*" in word else [word]
    return found


def agrees(shown: str, printed: str) -> bool:
    """Whether two lines say the same but for numbers and the width of columns."""
    return _form(shown) == _form(printed)


def _form(line: str) -> str:
    line = re.sub(r"(?<![\w.])[-+]?\d[\d.]*(e[-+]?\d+)?", "#", line)
    return re.sub(r"─+", "─", re.sub(r"\s+", " ", line)).strip()


def faults(command: Command, printed: list[str]) -> Iterator[str]:
    """What a document shows that the command did not print, and the other way round."""
    shown = [line for line in command.shown or () if line.strip()]
    printed = [line for line in printed if line.strip()]
    if command.text.startswith(LOOSE):
        shown, printed = ([_passed(line) for line in lines] for lines in (shown, printed))
        for a in shown:
            if a.startswith(PASSED) and a not in printed:
                yield f"line {command.line}, {command.text!r}: shows {a!r}, which is not printed"
    for k in range(max(len(shown), len(printed))):
        a, b = (lines[k] if k < len(lines) else "nothing" for lines in (shown, printed))
        if not agrees(a, b):
            yield f"line {command.line}, {command.text!r}: shows {a.strip()!r}, but {b.strip()!r} is printed"


def _passed(line: str) -> str:
    return MACHINE.sub("#", line).strip() if line.startswith(PASSED) else line.split()[0]


def outline(folder: Path, root: Path = ROOT) -> None:
    """What commands of documents find: the examples, and files that users would have."""
    for name in ("examples", "docs", "benchmarks"):
        (folder / name).symlink_to(root / name)
    shutil.copy(root / "examples" / "models" / "quadruped.xml", folder / "robot.xml")


def _printed(command: Command, folder: Path) -> list[str]:
    listed = [sys.executable, "-m", *_expanded(command, folder)]
    run = subprocess.run(listed, cwd=folder, capture_output=True, text=True, check=False)
    lines = [line.rstrip() for line in (run.stdout + run.stderr).splitlines()]
    while lines and not lines[-1]:
        lines.pop()
    return lines


def write(document: Path) -> None:
    """Put what is printed today in the place of what a document shows."""
    lines = document.read_text().splitlines()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        outline(folder)
        listed = [command for command in commands(document) if command.shown is not None]
        printed = [_printed(command, folder) for command in listed]
    for command, new in reversed(list(zip(listed, printed, strict=True))):
        assert command.shown is not None
        lines[command.line : command.line + len(command.shown)] = new
    document.write_text("\n".join(lines) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--write", action="store_true", required=True)
    parser.parse_args()
    for document in sorted((ROOT / "docs").rglob("*.md")):
        if any(command.shown is not None for command in commands(document)):
            write(document)
            print(document.relative_to(ROOT))


if __name__ == "__main__":
    main()
