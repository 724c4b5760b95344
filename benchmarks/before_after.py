"""Two folders of results side by side: what became slower or faster, entry by entry, in parts and in all.

    python benchmarks/before_after.py BEFORE AFTER [--limit 1.1]

Both folders are results of `make bench` on one machine, one right after the other. Prints a Markdown table of
the kernel (ns per contact), the files (time of all, per law and tolerance), the steps (time to the
tolerance), the scenes (mean step), the robots (median step of each model, at both time
steps), with the ratio after over before, and that of the iterations where they are counted. A part has a line
with its total time. The total over all parts is the geometric mean of their ratios, because their units
differ.

The exit code is 1 if an entry is slower than the limit, if one has no time any more, or if the total is above
--total. A table that neither folder has is left out.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from statistics import geometric_mean


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
    Table("files.csv", ("law", "tolerance"), "time", "s", "iterations"),
    Table("steps.csv", ("task", "law", "tolerance"), "fastest", "s", "iterations"),
    Table("simulation.csv", ("task",), "time", "s", "iterations"),
    Table("robots.csv", ("model",), "step_median", "s"),
    Table("robots_2ms.csv", ("model",), "step_median", "s"),
)

Sums = dict[str, tuple[float, float]]


def entries(folder: Path, table: Table) -> Sums:
    """Time and work of every entry, each the sum over the rows of its name that have a time."""
    sums: Sums = {}
    with (folder / table.file).open() as lines:
        for row in csv.DictReader(lines):
            if row[table.time]:
                name = " ".join(row[column] for column in table.names)
                time, work = sums.get(name, (0.0, 0.0))
                more = float(row[table.work]) if table.work else 0.0
                sums[name] = time + float(row[table.time]), work + more
    return sums


def show(table: Table, name: str, before: float, after: float, limit: float, work: float = math.nan) -> float:
    """Prints an entry, or a total, with the ratio of the iterations, and returns that of the times."""
    ratio = after / max(before, 1e-300)
    what = "gone" if math.isnan(after) else f"{after:.4g} {table.unit}"
    times = "" if math.isnan(ratio) else f"{ratio:.2f}{' slower' * (ratio > limit)}"
    done = "" if math.isnan(work) else f"{work:.2f}"
    part = table.file.removesuffix(".csv")
    print(f"| {part} | {name} | {before:.4g} {table.unit} | {what} | {times} | {done} |")
    return ratio


def compare(old: Sums, new: Sums, table: Table, limit: float) -> tuple[list[float], float]:
    """Prints every entry that has a time before, and their total. Returns the ratios, NaN where an entry is
    gone, and that of the sums over those that have a time in both."""
    ratios = []
    for name, (time, work) in sorted(old.items()):
        after, work_after = new.get(name, (math.nan, math.nan))
        ratios.append(show(table, name, time, after, limit, work_after / work if work > 0 else math.nan))
    sums = (sum(some[name][0] for name in old if name in new) for some in (old, new))
    return ratios, show(table, "total", *sums, limit)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("--limit", type=float, default=1.1, help="largest ratio of an entry")
    parser.add_argument("--total", type=float, default=1.0, help="largest ratio over all parts")
    options = parser.parse_args(arguments)
    every: list[float] = []
    ratios: list[float] = []
    print("| benchmark | entry | before | after | ratio | iterations |\n|---|---|--:|--:|--:|--:|")
    for table in TABLES:
        folders = (options.before, options.after)
        if any((folder / table.file).exists() for folder in folders):
            found, ratio = compare(*(entries(folder, table) for folder in folders), table, options.limit)
            every += found
            ratios += [ratio] * (not math.isnan(ratio))
    if not ratios:
        parser.error("no table has an entry in both folders")
    slower, gone = sum(ratio > options.limit for ratio in every), sum(map(math.isnan, every))
    over_all = geometric_mean(ratios)
    verdict = " slower" if over_all > options.total else ""
    print(f"| all | total | | | {over_all:.3f}{verdict} | |")
    print(f"\n{slower} entries slower than {options.limit:g} times before, {gone} gone")
    return int(slower > 0 or gone > 0 or over_all > options.total)


if __name__ == "__main__":
    sys.exit(main())
