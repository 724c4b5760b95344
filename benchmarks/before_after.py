"""Two folders of results side by side: what became slower or faster, entry by entry.

    python benchmarks/before_after.py BEFORE AFTER [--limit 1.05]

Both folders are results of `make bench` on one machine, one right after the other. Prints a Markdown table of
the kernel (ns per contact), the files (time of all, per law and tolerance), the steps (time to the
tolerance), the scenes (median step) and the broad phase, with the ratio after over before. The exit code is 1
if an entry is slower than the limit.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

# File, the columns that name an entry (entries of one name are summed), the column compared, its unit.
TABLES = (
    ("kernel.csv", ("contacts", "law", "threads"), "ns_per_contact", "ns"),
    ("files.csv", ("law", "tolerance"), "time", "s"),
    ("steps.csv", ("scene", "law", "tolerance"), "time", "s"),
    ("simulation.csv", ("name",), "step_median", "s"),
    ("broad_phase.csv", ("scene", "bodies"), "next_ns_per_body", "ns"),
)


def entries(folder: Path, file: str, names: tuple[str, ...], value: str) -> dict[str, float]:
    """The sum of the values of all rows with one name."""
    sums: dict[str, float] = defaultdict(float)
    with (folder / file).open() as lines:
        for row in csv.DictReader(lines):
            sums[" ".join(row[name] for name in names)] += float(row[value])
    return dict(sums)


def rows(before: Path, after: Path) -> Iterator[tuple[str, str, float, float, str]]:
    for file, names, value, unit in TABLES:
        old, new = entries(before, file, names, value), entries(after, file, names, value)
        for name in old.keys() & new.keys():
            yield file.removesuffix(".csv"), name, old[name], new[name], unit


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("--limit", type=float, default=1.05, help="largest ratio that counts as the same")
    options = parser.parse_args()
    slower = 0
    print("| benchmark | entry | before | after | ratio |\n|---|---|--:|--:|--:|")
    for table, name, old, new, unit in sorted(rows(options.before, options.after)):
        ratio = new / old
        slower += ratio > options.limit
        mark = " slower" if ratio > options.limit else ""
        print(f"| {table} | {name} | {old:.4g} {unit} | {new:.4g} {unit} | {ratio:.2f}{mark} |")
    print(f"\n{slower} entries slower than {options.limit:g}")
    return int(slower > 0)


if __name__ == "__main__":
    sys.exit(main())
