"""amontons solve: problem files, one table."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError
from ..problem import options
from ..problem.iterate import source_of_device
from ..problem.problem import Problem
from ..problem.solution import Solution
from ..report import terminal
from .common import (
    BAD_INPUT,
    NOT_CONVERGED,
    AsJson,
    DeviceName,
    Files,
    Law,
    Threads,
    Tolerance,
    complain,
    one_line_errors,
    out,
    print_json,
    progress,
    read,
)
from .completion import method_names


def solve(
    files: Files,
    method: Annotated[
        str,
        typer.Option(
            help="Method: auto, or a method that `amontons compare` lists.", autocompletion=method_names
        ),
    ] = "auto",
    law: Law = None,
    tolerance: Tolerance = 1e-6,
    deadline: Annotated[float | None, typer.Option(help="Wall-clock limit for each file (s).")] = None,
    max_iterations: Annotated[int | None, typer.Option(help="Limit of iterations for each file.")] = None,
    threads: Threads = None,
    device: DeviceName = "cpu",
    as_json: AsJson = False,
) -> None:
    """Solve problem files and tabulate the outcome.

    The exit code is 0 if all converged, 1 if some did not, 2 if some file or option could not be used.
    """
    limits: dict[str, Any] = {
        "law": law,
        "tolerance": tolerance,
        "deadline": deadline,
        "max_iterations": max_iterations,
        "threads": threads,
    }
    with one_line_errors():
        options.core_options(options.require_method(method), history=False, method_options={}, **limits)
        source_of_device(device, 0)
    solved: list[tuple[Path, Problem, Solution]] = []
    bad = 0
    with progress(len(files)) as advance:
        for path in files:
            advance(path.name)
            problem = read(path)
            if problem is None:
                bad += 1
                continue
            try:
                solution = problem.solve(method=method, device=device, **limits)
            except InputError as error:  # the method does not apply to this problem
                complain(f"{path}: {error}")
                bad += 1
                continue
            solved.append((path, problem, solution))
            if solution.status == "interrupted":
                break
    if as_json:
        print_json([terminal.as_dict(*entry) for entry in solved])
    elif solved:
        out.print(
            terminal.solved(
                solved,
                terminal.laws([problem for _, problem, _ in solved], law),
                wide=out.width >= terminal.WIDE,
            )
        )
    if bad:
        raise typer.Exit(BAD_INPUT)
    if not all(solution.converged for _, _, solution in solved):
        raise typer.Exit(NOT_CONVERGED)
