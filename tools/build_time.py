"""Says where the processor time of a build goes: compiles each source again, alone, and adds up GCC's phases.

    python tools/build_time.py BUILD [--match TEXT] [--rows N] [--csv FILE]

BUILD is a folder with compile_commands.json. Times are user times (s): of the compiler, of reading headers
and sources (parse), of the templates and functions that are instantiated at the end of a source (deferred),
and of optimisation and code (code). The objects go nowhere, and no cache of a compiler is used.
"""

from __future__ import annotations

import argparse
import csv
import json
import re
import resource
import shlex
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

PHASES = {"phase parsing": "parse", "phase lang. deferred": "deferred", "phase opt and generate": "code"}
COLUMNS = ["user", "parse", "deferred", "code"]


def command_of(entry: dict[str, str]) -> list[str]:
    """The command of an entry without a cache before the compiler and without an object behind -o."""
    words = shlex.split(entry["command"])
    if Path(words[0]).name in ("ccache", "sccache"):
        words = words[1:]
    words[words.index("-o") + 1] = "/dev/null"
    return [*words, "-ftime-report"]


def phases(report: str) -> dict[str, float]:
    """User seconds of each phase in what -ftime-report prints."""
    found = {}
    for name, column in PHASES.items():
        line = re.search(rf"^ {re.escape(name)} *: *([\d.]+)", report, re.MULTILINE)
        found[column] = float(line[1]) if line else 0.0
    return found


def measure(entry: dict[str, str]) -> dict[str, float]:
    """User seconds of one source, and its phases."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    command, folder = command_of(entry), entry["directory"]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if run.returncode:
        sys.exit(f"amontons: {entry['file']} does not compile:\n{run.stderr[-2000:]}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    return {"user": after - before, **phases(run.stderr)}


def group_of(entry: dict[str, str]) -> str:
    """The target and the first two folders of a source, as sources are summed up."""
    target = re.search(r"CMakeFiles/([^/]+)\.dir", entry["command"])
    parts = Path(entry["file"]).parts
    roots = [k for k, part in enumerate(parts) if part in ("src", "bindings", "tests")]
    start = max(roots, default=len(parts) - 1)
    length = 2 if parts[start] == "src" else 1
    return f"{target[1] if target else '?'}: {'/'.join(parts[start : start + length])}"


def show(title: str, rows: list[tuple[str, dict[str, float]]]) -> None:
    print(f"\n{'':8}".join(["", *[f"{c:>8}" for c in COLUMNS]]).replace("\n", "") + f"  {title}")
    for name, times in rows:
        print("".join(f"{times[c]:8.1f}" for c in COLUMNS) + f"  {name}")


def total(rows: list[dict[str, float]]) -> dict[str, float]:
    return {c: sum(r[c] for r in rows) for c in COLUMNS}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("build", type=Path)
    parser.add_argument("--match", default="", help="regular expression in the command")
    parser.add_argument("--rows", type=int, default=25)
    parser.add_argument("--csv", type=Path)
    given = parser.parse_args()
    entries = json.loads((given.build / "compile_commands.json").read_text())
    wanted = [e for e in entries if re.search(given.match, e["command"])]
    groups: dict[str, list[dict[str, float]]] = defaultdict(list)
    rows = []
    for entry in wanted:
        times = measure(entry)
        rows.append((f"{group_of(entry)} {Path(entry['file']).name}", times))
        groups[group_of(entry)].append(times)
    rows.sort(key=lambda row: -row[1]["user"])
    show("target and folder", sorted(((g, total(t)) for g, t in groups.items()), key=lambda r: -r[1]["user"]))
    show(f"source (the first {given.rows})", rows[: given.rows])
    show("all", [(f"{len(rows)} sources", total([t for _, t in rows]))])
    if given.csv:
        with given.csv.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["source", *COLUMNS])
            writer.writerows([[name, *(f"{t[c]:.2f}" for c in COLUMNS)] for name, t in rows])


if __name__ == "__main__":
    main()
