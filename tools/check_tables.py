"""Checks that the tables which documents quote were measured on the present code, by one processor.

    python tools/check_tables.py            prints every table that is not, exit code 1
    python tools/check_tables.py FOLDER     of another folder of results

A table is older if `src/solvers` or `src/multibody`, or their public headers, have other code in the revision
that tables.csv names; comments and spaces may differ. The check belongs to `make release_checks`: between
releases tables may be older, and the documents say so by the revision that they print.
"""

from __future__ import annotations

import csv
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from duplicates import without_comments

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "benchmarks" / "results" / "processor"
MEASURED = [f"{base}/{room}" for base in ("src", "include/amontons") for room in ("solvers", "multibody")]


def git(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True)


@cache
def is_older(revision: str) -> bool:
    """Whether the measured code has changed since a revision, or the revision is unknown."""

    def words(of: str, name: str) -> list[str]:
        return without_comments(git("show", f"{of}:{name}").stdout, ".cpp").split()

    changed = git("diff", "--name-only", revision, "HEAD", "--", *MEASURED)
    names = changed.stdout.split()
    return changed.returncode != 0 or any(words(revision, name) != words("HEAD", name) for name in names)


def older(folder: Path) -> Iterator[str]:
    """The tables of the folder whose revision has other code."""
    with (folder / "tables.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            if is_older(row["revision"].removesuffix("+")):
                yield f"{row['table']}: measured on {row['revision']} ({row['date']}); run {row['command']}"


def of_others(folder: Path) -> Iterator[str]:
    """The tables whose processor is not that of environment.csv, which the documents name."""
    with (folder / "tables.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    named = next((row["processor"] for row in rows if row["table"] == "environment.csv"), "")
    for row in rows:
        if row["processor"] != named:
            yield f"{row['table']}: of {row['processor'] or 'an unknown processor'}; run {row['command']}"


def main(words: list[str]) -> int:
    folder = Path(words[0]) if words else RESULTS
    found = list(older(folder))
    for line in found:
        print(f"{folder.name}/{line}")
    if found:
        print(f"{len(found)} tables are older than the last change of solvers or multibody")
    strange = list(of_others(folder))
    for line in strange:
        print(f"{folder.name}/{line}")
    return bool(found or strange)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
