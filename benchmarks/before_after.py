"""Two folders of results side by side: what became slower or faster, entry by entry.

    python benchmarks/before_after.py BEFORE AFTER [--limit 1.05]

Both folders are results of `make bench` on one machine, one right after the other. Prints a Markdown table of
the kernel (ns per contact), the files (time of all, per law and tolerance), the steps (time to the
tolerance), the scenes (median step) and the broad phase, with the ratio after over before, and the ratio of
the iterations: where rounding alone sends a solve along another way, those tell. The exit code is 1 if an
entry is slower than the limit for the iterations that it took.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Table:
    """A file, the columns that name an entry (rows of one name are summed), and the columns compared."""

    file: str
    names: tuple[str, ...]
    time: str
    unit: str
    work: str | None = None


TABLES = (
    Table("kernel.csv", ("contacts", "law", "threads"), "ns_per_contact", "ns"),
    Table("files.csv", ("law", "tolerance"), "time", "s"),
    Table("steps.csv", ("scene", "law", "tolerance"), "fastest", "s", "iterations"),
    Table("simulation.csv", ("name",), "step", "s", "iterations"),
    Table("broad_phase.csv", ("scene", "bodies"), "next_ns_per_body", "ns"),
)


def entries(folder: Path, table: Table) -> dict[str, tuple[float, float]]:
    """Time and work of every entry, each the sum over the rows of its name; work 1 where none is counted."""
    sums: dict[str, tuple[float, float]] = defaultdict(lambda: (0.0, 0.0))
    with (folder / table.file).open() as lines:
        for row in csv.DictReader(lines):
            name = " ".join(row[column] for column in table.names)
            time, work = sums[name]
            sums[name] = time + float(row[table.time]), work + float(row[table.work] if table.work else 1)
    return dict(sums)


def rows(before: Path, after: Path) -> Iterator[tuple[str, str, float, float, float, str]]:
    for table in TABLES:
        old, new = entries(before, table), entries(after, table)
        for name in old.keys() & new.keys():
            (time, work), (time_after, work_after) = old[name], new[name]
            part = table.file.removesuffix(".csv")
            yield part, name, time, time_after, work_after / work, table.unit


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("--limit", type=float, default=1.05, help="largest ratio that counts as the same")
    options = parser.parse_args()
    slower = 0
    print("| benchmark | entry | before | after | ratio | iterations |\n|---|---|--:|--:|--:|--:|")
    for part, name, old, new, work, unit in sorted(rows(options.before, options.after)):
        ratio = new / old
        fault = ratio > options.limit * max(1.0, work)
        slower += fault
        mark = " slower" if fault else ""
        print(f"| {part} | {name} | {old:.4g} {unit} | {new:.4g} {unit} | {ratio:.2f}{mark} | {work:.2f} |")
    print(f"\n{slower} entries slower than {options.limit:g} times before")
    return int(slower > 0)


if __name__ == "__main__":
    sys.exit(main())
