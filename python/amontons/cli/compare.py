"""amontons compare: every method on the same problems."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..problem import options
from ..problem.problem import Problem
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
    make_folder,
    one_line_errors,
    out,
    print_json,
    progress,
    read,
    say,
)


def compare(
    files: Files,
    output: Annotated[
        Path, typer.Option("--out", "--output", help="Folder for the figures and CSV files.")
    ] = Path("comparison"),
    methods: Annotated[str, typer.Option(help="Methods to run, separated by commas; default: all.")] = "all",
    law: Law = None,
    tolerance: Tolerance = 1e-6,
    deadline: Annotated[float, typer.Option(help="Wall-clock limit for each method and file (s).")] = 2.0,
    threads: Threads = None,
    device: DeviceName = "cpu",
    as_json: AsJson = False,
) -> None:
    """Run every method on the same problems: a table, convergence figures (PNG) and CSV files.

    The exit code is 0 if some method solved each problem, 1 if not, 2 if some input could not be used.
    """
    from ..report.comparison import Run, as_dict, interrupted, write_csv
    from ..report.comparison import compare as run_methods
    from ..report.figures import convergence_figures

    chosen = _chosen(methods, law)
    runs: list[Run] = []
    problems: list[Problem] = []
    bad = 0
    with progress(len(files) * len(chosen)) as advance:
        for path in files:
            problem = read(path)
            if problem is None:
                bad += 1
                continue
            problems.append(problem)
            with one_line_errors(path):
                mine = run_methods(
                    path.stem,
                    problem,
                    chosen,
                    law=law,
                    tolerance=tolerance,
                    deadline=deadline,
                    threads=threads,
                    device=device,
                    before=lambda problem, method: advance(f"{problem}: {method}"),
                )
            runs += mine
            if interrupted(mine):
                break
    told = terminal.laws(problems, law)
    if runs and not as_json:
        out.print(terminal.compared(runs, told))
        for line in terminal.refusals(runs):
            say(line, "dim")
    made: list[Path] = []
    if runs:
        with one_line_errors(output):
            make_folder(output)
            made += convergence_figures(runs, output, tolerance=tolerance, law=told)
            made += write_csv(runs, output)
    if as_json:
        print_json({"law": told, "runs": [as_dict(run) for run in runs], "files": made})
    else:
        for path in made:
            say(path)
    if bad:
        raise typer.Exit(BAD_INPUT)
    converged = {run.problem for run in runs if run.solution is not None and run.solution.converged}
    if len(converged) < len({run.problem for run in runs}):
        raise typer.Exit(NOT_CONVERGED)


def _chosen(methods: str, law: str | None) -> list[str]:
    """The methods to run; a name that is none, and a law that is none, end the command."""
    with one_line_errors():
        if law is not None:
            options.chosen("law", law, options.LAWS, options.LAW_TERMS)
        names = options.methods() if methods == "all" else [name.strip() for name in methods.split(",")]
        return [options.require_method(name) for name in names]
