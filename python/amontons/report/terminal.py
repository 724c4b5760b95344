"""Tables of solves and comparisons."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from ..problem.problem import Problem
from ..problem.solution import Solution
from .comparison import Run

WIDE = 110
"""Columns of a terminal from which on the tables show all their columns."""


def _milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.3g}" if seconds < 1 else f"{1e3 * seconds:.0f}"


def _colour(solution: Solution) -> Text:
    return Text(solution.status, "green" if solution.converged else "red")


def laws(problems: Iterable[Problem], law: str | None) -> str:
    """The law by which problems were solved: the one that was asked for, or those of the problems."""
    return law or " or ".join(sorted({problem.law for problem in problems}))


def _table(law: str, first: str, columns: dict[str, str]) -> Table:
    """A table whose first column folds and whose others do not; columns: name -> alignment."""
    table = Table(title=f"law {law}", title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
    table.add_column(first, overflow="fold", min_width=16)
    for name, justify in columns.items():
        table.add_column(name, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    return table


LEFT, RIGHT = "left", "right"


def _outcome(s: Solution) -> dict[str, str | Text]:
    return {
        "method": s.method,
        "status": _colour(s),
        "residual": f"{s.residual:.1e}",
        "objective": f"{s.objective:.8g}",
        "products": str(s.products),
        "time (ms)": _milliseconds(s.time),
    }


ALIGNMENT = dict.fromkeys(("residual", "objective", "products", "time (ms)"), RIGHT)


def solved(entries: Sequence[tuple[Path, Problem, Solution]], law: str, *, wide: bool) -> Table:
    """One row per solved file; wide: with the columns that a narrow terminal has no room for."""
    columns = {"method": LEFT, "status": LEFT} | ALIGNMENT
    if wide:
        columns = {"rows": RIGHT, "contacts": RIGHT} | columns | {"iterations": RIGHT}
    table = _table(law, "file", columns)
    for path, problem, s in entries:
        sizes = {"rows": problem.rows, "contacts": problem.contacts, "iterations": s.iterations}
        values = _outcome(s) | {key: str(value) for key, value in sizes.items()}
        table.add_row(path.name, *(values[column] for column in columns))
    return table


def compared(runs: Sequence[Run], law: str) -> Table:
    """One row per run, grouped by problem."""
    columns = {"method": LEFT, "status": LEFT} | ALIGNMENT
    table = _table(law, "problem", columns)
    previous = None
    for run in runs:
        if previous not in (None, run.problem):
            table.add_section()
        first = run.problem if run.problem != previous else ""
        previous = run.problem
        values: dict[str, str | Text] = {"method": run.method, "status": Text("not applicable", "dim")}
        if run.solution is not None:
            values |= _outcome(run.solution) | {"method": run.method}
        table.add_row(first, *(values.get(column, "") for column in columns))
    return table


def refusals(runs: Sequence[Run]) -> Iterator[str]:
    """Why methods do not apply, once per method and reason."""
    problems: dict[tuple[str, str], list[str]] = {}
    for run in runs:
        if run.solution is None:
            problems.setdefault((run.method, run.reason), []).append(run.problem)
    for (method, reason), names in problems.items():
        yield f"{method} does not apply to {', '.join(names)}: {reason}"


def as_dict(path: Path, problem: Problem, s: Solution) -> dict[str, Any]:
    """The outcome of one file for JSON."""
    fields = (
        "status",
        "converged",
        "residual",
        "objective",
        "iterations",
        "products",
        "factorizations",
        "time",
    )
    summary = {"file": str(path), "rows": problem.rows, "contacts": problem.contacts, "method": s.method}
    summary |= {field: getattr(s, field) for field in fields}
    return summary | {"reason": s.reason, "notes": list(problem.notes)}
