"""The table of a run: a row per family."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from .runner import Run

FAILURES = ("crash", "hang", "memory", "internal error", "accepted nonsense")
Row = dict[str, Any]


def rows(run: Run) -> list[Row]:
    """Counts by outcome, failures by kind, and the largest of every measure."""
    tallies = {name: tally for name, tally in run.tallies.items() if tally.cases}
    outcomes = sorted({o for tally in tallies.values() for o in tally.outcomes})
    kinds = [*FAILURES, *sorted({k for t in tallies.values() for k in t.failures} - set(FAILURES))]
    measures = sorted({m for tally in tallies.values() for m in tally.largest})
    found = []
    for name, tally in tallies.items():
        row: Row = {"family": name, "seed": run.seed, "cases": tally.cases}
        row |= {outcome: tally.outcomes.get(outcome, 0) for outcome in outcomes}
        row |= {"failures": sum(tally.failures.values())}
        row |= {kind: tally.failures.get(kind, 0) for kind in kinds}
        row |= {f"largest {m}": f"{tally.largest[m]:.4g}" if m in tally.largest else "" for m in measures}
        found.append(row)
    return found


def added(table: list[Row], before: dict[str, dict[str, str]]) -> list[Row]:
    """The table of this run and of those before it, by family: cases and failures summed, the largest of each
    measure."""
    names = list(dict.fromkeys([*next(iter(before.values()), {}), *(n for row in table for n in row)]))
    # Counts stand before measures, whichever run had them first.
    names.sort(key=lambda name: name.startswith("largest "))
    now = {row["family"]: row for row in table}
    found = []
    for family in dict.fromkeys([*before, *now]):
        pair = before.get(family, {}), now.get(family, {})
        found.append({name: _both(name, *(str(row.get(name, "")) for row in pair)) for name in names})
    return found


def _both(name: str, one: str, two: str) -> Any:
    if name == "family":
        return one or two
    if name == "seed":
        return " ".join(dict.fromkeys(f"{one} {two}".split()))
    if name.startswith("largest "):
        return max(one, two, key=lambda text: float(text or "-inf"))
    return int(one or 0) + int(two or 0)


def show(table: list[Row]) -> str:
    if not table:
        return "no cases were run"
    names = list(table[0])
    total = {n: sum(row[n] for row in table) if isinstance(table[0][n], int) else "" for n in names}
    total |= {"family": "all"}
    lines = [[str(row[n]) for n in names] for row in [*table, total]]
    widths = [max(len(n), *(len(line[k]) for line in lines)) for k, n in enumerate(names)]
    return "\n".join(
        "  ".join(w.rjust(n) for w, n in zip(line, widths, strict=True)) for line in [names, *lines]
    )


def read_csv(path: Path) -> dict[str, dict[str, str]]:
    """The rows of a table by family; none where there is none."""
    if not path.is_file():
        return {}
    with path.open(newline="") as file:
        return {row["family"]: row for row in csv.DictReader(file)}


def write_csv(path: Path, table: list[Row]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(table[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)
