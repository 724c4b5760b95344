"""Every method on the same problems."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..io.files import write_whole
from ..problem.options import methods
from ..problem.problem import Problem
from ..problem.solution import HISTORY, Solution
from .complete_files import csv_bytes

UNLIMITED = 2_000_000_000  # iterations: only the deadline and the tolerance end a run
REPEATED = 0.05
"""Runs shorter than this (s) are repeated, and the faster one counts: the first pays for cold caches."""
CSV_ROWS = 2000
"""Records per method in a CSV; longer histories are thinned to geometrically spaced iterations."""

FIELDS = ("status", "residual", "objective", "iterations", "products", "factorizations", "time")


@dataclass(frozen=True)
class Run:
    """One method on one problem: its solution, or why the method does not apply."""

    problem: str
    method: str
    solution: Solution | None
    reason: str = ""


def single_methods() -> list[str]:
    """All methods but "auto", which runs one or several of the others."""
    return [name for name in methods() if name != "auto"]


def compare(
    name: str,
    problem: Problem,
    chosen: Sequence[str],
    *,
    law: str | None = None,
    tolerance: float = 1e-6,
    deadline: float | None = 10.0,
    threads: int | None = None,
    device: str = "cpu",
    before: Callable[[str, str], None] = lambda name, method: None,
) -> list[Run]:
    """Solve the problem by each method with its history recorded.

    A method that refuses the problem (CG with contacts, for example) gives a Run with the reason.
    law: None for that of the problem. deadline: per method (s).
    before: called with the names of the problem and of the method before each run.
    Ctrl-C ends the comparison with the current method.
    """
    runs = []
    for method in chosen:
        before(name, method)
        solve = partial(
            problem.solve,
            law=law,
            method=method,
            tolerance=tolerance,
            max_iterations=UNLIMITED,
            deadline=deadline,
            history=True,
            threads=threads,
            device=device,
        )
        try:
            solution = solve()
        except InputError as error:
            runs.append(Run(name, method, None, str(error)))
            continue
        if solution.time < REPEATED and solution.status != "interrupted":
            solution = min(solution, solve(), key=lambda s: s.time)
        runs.append(Run(name, method, solution))
        if solution.status == "interrupted":
            break
    return runs


def as_dict(run: Run) -> dict[str, Any]:
    """A run for JSON."""
    if run.solution is None:
        return {
            "problem": run.problem,
            "method": run.method,
            "status": "not applicable",
            "reason": run.reason,
        }
    told = {"problem": run.problem, "method": run.method, "device": run.solution.device}
    return told | {name: getattr(run.solution, name) for name in (*FIELDS, "reason")}


def interrupted(runs: Iterable[Run]) -> bool:
    """True if a run was ended by Ctrl-C."""
    return any(run.solution is not None and run.solution.status == "interrupted" for run in runs)


def write_csv(runs: Sequence[Run], folder: Path) -> list[Path]:
    """summary.csv with one line per run, and curves.csv with the histories; returns their paths."""
    summary, curves = folder / "summary.csv", folder / "curves.csv"
    rows, records = [], []
    for run in runs:
        values = [getattr(run.solution, field) if run.solution else "" for field in FIELDS]
        if run.solution is None:
            values[0] = "not applicable"
        rows.append([run.problem, run.method, *values, run.reason or (run.solution or run).reason])
        if run.solution is not None and run.solution.history is not None:
            records += [[run.problem, run.method, *r.tolist()] for r in thinned(run.solution.history)]
    write_whole(
        {
            summary: csv_bytes(["problem", "method", *FIELDS, "reason"], rows),
            curves: csv_bytes(["problem", "method", *(HISTORY.names or ())], records),
        },
        own={summary, curves},
    )
    return [summary, curves]


def thinned(history: np.ndarray, rows: int = CSV_ROWS) -> np.ndarray:
    """At most `rows` records at geometrically spaced iterations, with the first and the last."""
    if len(history) <= rows:
        return history
    chosen = np.unique(np.geomspace(1, len(history), rows).astype(int) - 1)
    return history[chosen]
