"""Plants the faults of tests/faults.toml one by one, and says which of them their tests find.

    .venv/bin/python tools/plant_faults.py [WORD ...]

WORD: a part of what a fault does, or of its file; all faults without one. Prints a line per fault; exit
status 1 if a test passes with its fault, or fails without it. A fault in C++ compiles a source and links its
test in build/python. The sources come back in any case.
"""

from __future__ import annotations

import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "python"
PATIENCE = 600
"""s; a test that takes longer has found its fault."""
Fault = dict[str, str]


def faults(words: list[str]) -> list[Fault]:
    """The faults of the table that a word names; all without a word."""
    listed: list[Fault] = tomllib.loads((ROOT / "tests" / "faults.toml").read_text())["fault"]
    return [f for f in listed if not words or any(w in f["what"] or w in f["file"] for w in words)]


@contextmanager
def planted(fault: Fault) -> Iterator[None]:
    path = ROOT / fault["file"]
    text = path.read_text()
    if text.count(fault["was"]) != 1:
        sys.exit(f"{fault['file']}: it must hold {fault['was']!r} once; renew tests/faults.toml")
    try:
        path.write_text(text.replace(fault["was"], fault["now"]))
        yield
    finally:
        path.write_text(text)


def passes(fault: Fault) -> bool:
    """Whether the test of a fault passes with the sources as they are, which must compile."""
    if "cpp" in fault:
        run("cmake", "--build", BUILD, "--target", fault["cpp"]).check_returncode()
        command = [BUILD / "tests" / "cpp" / fault["cpp"]]
    else:
        # -B: bytecode stays valid for a source of equal size that is written in the same second.
        command = [sys.executable, "-B", "-m", "pytest", "-x", "-q", "-n", "0", *fault["python"].split()]
    try:
        return run(*command, timeout=PATIENCE).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def run(*command: object, timeout: float | None = None) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run([str(c) for c in command], cwd=ROOT, capture_output=True, timeout=timeout)


def main(words: list[str]) -> int:
    wrong = 0
    for fault in faults(words):
        test = fault.get("cpp") or fault["python"]
        sound = passes(fault)
        with planted(fault):
            found = not passes(fault)
        wrong += not (sound and found)
        outcome = "found" if sound and found else "NOT FOUND" if sound else "the test fails without it"
        print(f"{outcome}: {fault['what']} ({fault['file']}, {test})", flush=True)
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
