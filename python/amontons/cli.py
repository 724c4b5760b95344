"""The command `amontons`: solve, compare and info on problem files."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from . import __version__, options
from .errors import InputError
from .io import read_problem
from .problem import Problem
from .report import tables
from .solution import Solution

CONVERGED, NOT_CONVERGED, BAD_INPUT = 0, 1, 2
"""Exit codes: all converged, some did not, some input could not be used (which includes usage errors)."""

app = typer.Typer(
    help="Frictional contact problems, solved by P-SPG-FB and its companions.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
out = Console(width=None if sys.stdout.isatty() else 140)  # a pipe or a log has no width: nothing is folded
err = Console(stderr=True)

Files = Annotated[list[Path], typer.Argument(help="Problem files: FCLIB .hdf5, .mtx with .npz, or .npz.")]
Law = Annotated[str, typer.Option(help="associated (convex relaxation) or coulomb (true Coulomb friction).")]
Tolerance = Annotated[float, typer.Option(help="Natural residual to reach, relative to that of x = 0.")]
Threads = Annotated[int, typer.Option(help="Threads; results do not depend on them.")]


def main() -> None:
    """Entry point of the command."""
    try:
        app()
    except BrokenPipeError:  # the reader of our output has seen enough
        sys.stderr.close()
        sys.exit(NOT_CONVERGED)


def _version(wanted: bool) -> None:
    if wanted:
        out.print(f"amontons {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


@app.command()
def solve(
    files: Files,
    method: Annotated[str, typer.Option(help="auto, or one of the methods that 'compare' runs.")] = "auto",
    law: Law = "associated",
    tolerance: Tolerance = 1e-6,
    deadline: Annotated[float | None, typer.Option(help="Wall clock per file (s).")] = None,
    max_iterations: Annotated[int | None, typer.Option(help="Iterations per file.")] = None,
    threads: Threads = 1,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON in place of the table.")] = False,
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
    with _one_line_errors():
        options.core_options(options.require_method(method), history=False, method_options={}, **limits)
    solved: list[tuple[Path, Problem, Solution]] = []
    bad = 0
    with _progress(len(files)) as advance:
        for path in files:
            advance(path.name)
            problem = _read(path)
            if problem is None:
                bad += 1
                continue
            try:
                solution = problem.solve(method=method, **limits)
            except InputError as error:  # the method does not apply to this problem
                _complain(f"{path}: {error}")
                bad += 1
                continue
            solved.append((path, problem, solution))
            if solution.status == "interrupted":
                break
    if as_json:
        print(json.dumps([tables.as_dict(*entry) for entry in solved], indent=1))
    elif solved:
        out.print(tables.solved(solved, law, wide=out.width >= tables.WIDE))
    if bad:
        raise typer.Exit(BAD_INPUT)
    if not all(solution.converged for _, _, solution in solved):
        raise typer.Exit(NOT_CONVERGED)


@app.command()
def compare(
    files: Files,
    output: Annotated[
        Path, typer.Option("--out", "--output", help="Folder of the figures and CSV files.")
    ] = Path("comparison"),
    methods: Annotated[str, typer.Option(help="Comma-separated methods; all by default.")] = "all",
    law: Law = "associated",
    tolerance: Tolerance = 1e-6,
    deadline: Annotated[float, typer.Option(help="Wall clock per method and file (s).")] = 2.0,
    threads: Threads = 1,
) -> None:
    """Run every method on the same problems: a table, convergence figures (PNG) and CSV files.

    The exit code is 0 if some method solved each problem, 1 if not, 2 if some input could not be used.
    """
    from .report.comparison import Run, comparable_methods, interrupted, write_csv
    from .report.comparison import compare as run_methods
    from .report.figures import convergence_figures

    with _one_line_errors():
        chosen = comparable_methods() if methods == "all" else [name.strip() for name in methods.split(",")]
        for name in chosen:
            options.require_method(name)
        options.chosen("law", law, options.LAWS)
    runs: list[Run] = []
    bad = 0
    with _progress(len(files) * len(chosen)) as advance:
        for path in files:
            problem = _read(path)
            if problem is None:
                bad += 1
                continue
            name = path.stem
            with _one_line_errors(path):
                mine = run_methods(
                    name,
                    problem,
                    chosen,
                    law=law,
                    tolerance=tolerance,
                    deadline=deadline,
                    threads=threads,
                    before=lambda problem, method: advance(f"{problem}: {method}"),
                )
            runs += mine
            if interrupted(mine):
                break
    if runs:
        out.print(tables.compared(runs, law))
        for line in tables.refusals(runs):
            out.print(line, style="dim", soft_wrap=True, highlight=False, markup=False)
        with _one_line_errors(output):
            _make_folder(output)
        for path in (
            *convergence_figures(runs, output, tolerance=tolerance, law=law),
            *write_csv(runs, output),
        ):
            out.print(str(path), soft_wrap=True, highlight=False)
    if bad:
        raise typer.Exit(BAD_INPUT)
    converged = {run.problem for run in runs if run.solution is not None and run.solution.converged}
    if len(converged) < len({run.problem for run in runs}):
        raise typer.Exit(NOT_CONVERGED)


@app.command()
def info(file: Annotated[Path, typer.Argument(help="A problem file.")]) -> None:
    """Show sizes, cones, friction coefficients, symmetry, rank and conditioning of a problem."""
    from .report.facts import facts

    problem = _read(file)
    if problem is None:
        raise typer.Exit(BAD_INPUT)
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for key, value in facts(problem):
        table.add_row(key, value)
    out.print(table, highlight=False)


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot be made: {error.strerror}") from None


def _read(path: Path) -> Problem | None:
    """The problem, or None after one line on stderr; warnings of the reader become notes."""
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            problem = read_problem(path)
    except (InputError, OSError) as error:
        message = str(error)
        _complain(message if message.startswith(str(path)) else f"{path}: {message}")
        return None
    for warning in caught:
        err.print(f"note: {warning.message}", style="yellow", soft_wrap=True, highlight=False, markup=False)
    return problem


def _complain(message: str) -> None:
    err.print(
        "error: " + " ".join(message.split()), style="red", soft_wrap=True, highlight=False, markup=False
    )


@contextmanager
def _one_line_errors(where: Path | None = None) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        _complain(f"{where}: {error}" if where else str(error))
        raise typer.Exit(BAD_INPUT) from None


@contextmanager
def _progress(total: int) -> Iterator[Callable[[str], None]]:
    """A bar on stderr; the function that it gives names the step that begins."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as progress:
        task = progress.add_task("", total=total)
        started = False

        def advance(description: str) -> None:
            nonlocal started
            progress.update(task, description=description, advance=1 if started else 0)
            started = True

        yield advance


if __name__ == "__main__":
    main()
