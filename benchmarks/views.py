"""Numbers, tables and results: what the views of the documents are made of (report.py)."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from common import ORIGINS, read_csv

Row = dict[str, str]
Rows = list[Row]
Spec = str | Callable[[Row], str]
"""A cell: a function of the row, or a column with a format behind a space: one of `format`, "ms" for seconds
in ms, "x1e3" for two digits of the value times 1e3, "~3" for three digits of a number and texts as they
are."""
Columns = dict[str, Spec]
"""Of a table: the header and the cells."""


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; columns after the first are aligned to the right."""
    lines = ["| " + " | ".join(header) + " |", "|---" + "|--:" * (len(header) - 1) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def in_ms(seconds: str | float) -> str:
    """Three digits, whole milliseconds from 100 on; nothing for a blank."""
    if seconds == "":
        return ""
    value = 1e3 * float(seconds)
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def power(text: str) -> str:
    """A number with a short power of ten: 1e-6 for 1e-06."""
    return re.sub(r"e([+-])0*(\d)", lambda found: f"e{found[1].strip('+')}{found[2]}", text)


def scientific(value: str | float) -> str:
    """Two digits; a power of ten below a hundredth and from a million on."""
    if value == "":
        return ""
    usual = float(value) == 0 or 1e-2 <= abs(float(value)) < 1e6
    return digits(value, 1) if usual else power(f"{float(value):.1e}")


def digits(value: str | float, scale: float = 1) -> str:
    """Two digits, whole numbers from 10 to a million."""
    number = scale * float(value)
    return f"{number:.0f}" if 10 <= number < 1e6 else power(f"{number:.2g}")


def short(value: str, places: int = 3) -> str:
    """A number with so many digits, whole from there to a million; a text as it is."""
    try:
        number = float(value)
    except ValueError:
        return value
    return f"{number:.0f}" if 10**places <= abs(number) < 1e6 else power(f"{number:.{places}g}")


def cell(row: Row, spec: Spec) -> str:
    if callable(spec):
        return spec(row)
    key, _, how = spec.partition(" ")
    value = row[key]
    if not how or value == "":
        return value
    if how in ("ms", ".1e"):
        return in_ms(value) if how == "ms" else scientific(value)
    if how[0] in "x~":
        return digits(value, float(how[1:])) if how[0] == "x" else short(value, int(how[1:]))
    return power(format(float(value), how))


def view(rows: Iterable[Row], columns: Columns) -> str:
    """A table with a line per row: the header of each column, and its cell."""
    return table(tuple(columns), [[cell(row, spec) for spec in columns.values()] for row in rows])


def grouped(rows: Iterable[dict[str, Any]], *keys: str) -> dict[tuple[str, ...], list[dict[str, Any]]]:
    """The rows by their values of these columns, in the order in which they come."""
    groups: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    return groups


def by_task(
    rows: Iterable[Mapping[str, Any]], task: str = "task", method: str = "method", time: str = "time"
) -> dict[str, dict[str, float]]:
    """Of each task the least time of each method that has one; other columns may take their places."""
    found: dict[str, dict[str, float]] = {}
    for row in rows:
        if row[time] != "":
            times = found.setdefault(row[task], {})
            times[row[method]] = min(float(row[time]), times.get(row[method], math.inf))
    return found


def over_best(rows: Sequence[Mapping[str, Any]], *apart: str) -> dict[str, list[float]]:
    """Of each method: its time over the least on each task that a method other than those apart solves;
    infinite where it fails."""
    tasks = [(times, [times[method] for method in times.keys() - apart]) for times in by_task(rows).values()]
    best = [(times, min(others)) for times, others in tasks if others]
    methods = dict.fromkeys(row["method"] for row in rows)
    return {method: [times.get(method, math.inf) / least for times, least in best] for method in methods}


def pivot(
    rows: Iterable[Row], down: str, across: str, cells: Callable[[Rows], Sequence[str]],
    header: str = "", heads: Callable[[str], Sequence[str]] = lambda name: (name,),
) -> str:  # fmt: skip
    """A line per value of one column, and cells for each value of another: those of the rows that have both,
    under the `heads` of that value; blank where there are none."""
    groups = grouped(rows, down, across)
    lines, columns = (list(dict.fromkeys(key[k] for key in groups)) for k in (0, 1))
    body = [
        (line, *(text for name in columns for text in (
            cells(groups[line, name]) if (line, name) in groups else [""] * len(heads(name))
        )))
        for line in lines
    ]  # fmt: skip
    return table((header, *(head for name in columns for head in heads(name))), body)


class Results:
    """The CSV files of a folder by name, with their origins."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.beside = folder, folder.parent / "beside"
        self.environment = {row["key"]: row["value"] for row in self["environment"]}
        self.origins = {row["table"]: row for at in (folder, self.beside) for row in read_csv(at / ORIGINS)}

    def __getitem__(self, name: str) -> Rows:
        return read_csv((self.beside if name in ("beside", "solvers") else self.folder) / f"{name}.csv")

    def origin(self, name: str) -> str:
        """The revision, the date and the processor of a table."""
        if (found := self.origins.get(f"{name}.csv")) is None:
            return ""
        parts = (f"`{found['table']}`: revision {found['revision']}", found["date"], found["processor"])
        return ", ".join(part for part in parts if part)
