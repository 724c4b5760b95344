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
    Table("files.csv", ("law", "tolerance"), "time", "s", "iterations"),
    Table("steps.csv", ("scene", "law", "tolerance"), "fastest", "s", "iterations"),
    Table("simulation.csv", ("name",), "step", "s", "iterations"),
    Table("robots.csv", ("model",), "step_median", "s"),
    Table("robots_2ms.csv", ("model",), "step_median", "s"),
)

Sums = dict[str, tuple[float, float]]


@dataclass(frozen=True)
class Line:
    """An entry, or the total of a part, before and after."""

    part: str
    name: str
    before: float
    after: float
    """NaN if there is none any more"""
    unit: str
    work: float | None = None
    """ratio of the iterations"""

    @property
    def ratio(self) -> float:
        return self.after / self.before if self.before > 0 else math.nan


def entries(folder: Path, table: Table) -> Sums:
    """Time and work of every entry, each the sum over the rows of its name that have a time."""
    sums: Sums = defaultdict(lambda: (0.0, 0.0))
    with (folder / table.file).open() as lines:
        for row in csv.DictReader(lines):
            if not row[table.time]:
                continue
            name = " ".join(row[column] for column in table.names)
            time, work = sums[name]
            sums[name] = time + float(row[table.time]), work + float(row[table.work] if table.work else 0)
    return dict(sums)


def compare(before: Path, after: Path, table: Table) -> Iterator[Line]:
    """Every entry that has a time before."""
    old, new = entries(before, table), entries(after, table)
    for name, (time, work) in sorted(old.items()):
        time_after, work_after = new.get(name, (math.nan, math.nan))
        ratio = work_after / work if work > 0 else None
        yield Line(table.file.removesuffix(".csv"), name, time, time_after, table.unit, ratio)


def total(lines: list[Line]) -> Line:
    """The sum over the entries of a part that have a time before and after."""
    both = [line for line in lines if not math.isnan(line.after)]
    sums = sum(line.before for line in both), sum(line.after for line in both)
    return Line(lines[0].part, "total", *sums, lines[0].unit)


def show(line: Line, limit: float) -> str:
    what = "gone" if math.isnan(line.after) else f"{line.after:.4g} {line.unit}"
    ratio = "" if math.isnan(line.ratio) else f"{line.ratio:.2f}{' slower' if line.ratio > limit else ''}"
    work = "" if line.work is None or math.isnan(line.work) else f"{line.work:.2f}"
    return f"| {line.part} | {line.name} | {line.before:.4g} {line.unit} | {what} | {ratio} | {work} |"


def parts(before: Path, after: Path) -> Iterator[list[Line]]:
    """The entries of every table; FileNotFoundError where only one folder has it."""
    for table in TABLES:
        known = (before / table.file).exists() or (after / table.file).exists()
        if known and (lines := list(compare(before, after, table))):
            yield lines


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("--limit", type=float, default=1.1, help="largest ratio of an entry")
    parser.add_argument("--total", type=float, default=1.0, help="largest ratio over all parts")
    options = parser.parse_args(arguments)
    slower = gone = 0
    totals: list[Line] = []
    print("| benchmark | entry | before | after | ratio | iterations |\n|---|---|--:|--:|--:|--:|")
    for lines in parts(options.before, options.after):
        slower += sum(line.ratio > options.limit for line in lines)
        gone += sum(math.isnan(line.after) for line in lines)
        totals.append(total(lines))
        print("\n".join(show(line, options.limit) for line in (*lines, totals[-1])))
    ratios = [line.ratio for line in totals if not math.isnan(line.ratio)]
    if not ratios:
        parser.error("no table has an entry in both folders")
    over_all = math.exp(sum(map(math.log, ratios)) / len(ratios))
    verdict = " slower" if over_all > options.total else ""
    print(f"| all | total | | | {over_all:.3f}{verdict} | |")
    print(f"\n{slower} entries slower than {options.limit:g} times before, {gone} gone")
    return int(slower > 0 or gone > 0 or over_all > options.total)


if __name__ == "__main__":
    sys.exit(main())
