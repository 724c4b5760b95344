"""Shared parts of the commands: exit codes, options, output, errors in one line, progress."""

from __future__ import annotations

import json
import logging
import math
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console, ConsoleRenderable
from rich.highlighter import NullHighlighter
from rich.logging import RichHandler
from rich.progress import BarColumn, MofNCompleteColumn, Progress, Task, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from ..errors import InputError, SimulationError
from ..escapes import visible
from ..io import read_problem
from ..problem.problem import Problem
from ..ranges import MOST_COUNT
from . import completion

CONVERGED, NOT_CONVERGED, BAD_INPUT = 0, 1, 2
"""Exit codes: all converged, some did not, some input could not be used (which includes usage errors)."""


class Plain(Console):
    """A console for which texts are texts: no markup, and escapes in place of what a terminal obeys."""

    def render_str(self, text: str, **options: Any) -> Text:
        return super().render_str(visible(text, "\n"), **(options | {"markup": False, "emoji": False}))


class Words(TextColumn):
    """A column of progress whose words may be names."""

    def render(self, task: Task) -> Text:
        return Text(visible(self.text_format.format(task=task)), style="none")


class _Log(RichHandler):
    def render_message(self, record: logging.LogRecord, message: str) -> ConsoleRenderable:
        return super().render_message(record, visible(message, "\n"))


# A pipe or a log has no width: nothing is folded. There is no stdout at all where it was closed.
out = Plain(width=None if sys.stdout is not None and sys.stdout.isatty() else 140)
err = Plain(stderr=True)

Files = Annotated[
    list[Path],
    typer.Argument(
        help="Problem files: FCLIB .hdf5, .mtx with .npz, or .npz.", autocompletion=completion.problems
    ),
]
Law = Annotated[
    str | None,
    typer.Option(
        help="Law of friction: coulomb (exact) or associated (convex relaxation); default: that of the file.",
        autocompletion=completion.law_names,
    ),
]
Tolerance = Annotated[float, typer.Option(help="Natural residual to reach (1 at zero impulses).")]
Threads = Annotated[
    int | None,
    typer.Option(
        help="Number of threads; default: one per core for large problems. Results do not depend on it."
    ),
]
_device = typer.Option(
    "--device",
    help="Device that runs p-spg-fb and apgd: cpu, gpu, opencl, cuda:1, ...; `amontons doctor` lists them.",
)
DeviceName = Annotated[str, _device]
DeviceOfSteps = Annotated[str | None, _device]

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]


def most_steps(option: str, value: float, steps: int) -> int:
    """The number of steps that an option asks for; InputError where nobody lives to see the last."""
    if steps > MOST_COUNT:
        raise InputError(f"{option} = {value:.6g}: asks for {steps:.4g} steps, more than {MOST_COUNT}")
    return steps


def make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot be made: {error.strerror}") from None


def read(path: Path) -> Problem | None:
    """The problem, or None after one line on stderr; warnings of the reader become notes."""
    try:
        with notes():
            return read_problem(path)
    except (InputError, OSError) as error:
        complain(_with_name(path, str(error)))
        return None


def _with_name(where: object, message: str) -> str:
    return message if message.startswith((str(where), visible(str(where)))) else f"{where}: {message}"


@contextmanager
def notes() -> Iterator[None]:
    """Warnings inside the block become notes on stderr after it, unless it fails."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for warning in caught:
        note(str(warning.message))


def note(message: str) -> None:
    err.print(f"note: {message}", style="yellow", soft_wrap=True, highlight=False, markup=False)


@contextmanager
def working(what: str) -> Iterator[None]:
    """A word on the terminal while something lasts; it goes when the block ends."""
    if not err.is_terminal:
        yield
        return
    with err.status(Text(visible(what))):
        yield


def complain(message: str) -> None:
    err.print(
        "error: " + " ".join(message.split()), style="red", soft_wrap=True, highlight=False, markup=False
    )


def print_json(value: object) -> None:
    """JSON on stdout; what is not finite becomes null, which JSON lacks numbers for."""
    out.file.write(json.dumps(_finite(value), indent=1, default=str) + "\n")


def _finite(value: object) -> object:
    if isinstance(value, Mapping):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def say(line: object, style: str = "") -> None:
    """A line on stdout, as it is."""
    out.print(str(line), style=style, soft_wrap=True, highlight=False, markup=False)


def show_log(verbose: int) -> None:
    """Lines of the logger "amontons" on stderr: what is done, with 2 every step and solve."""
    plain = NullHighlighter()
    handler = _Log(
        console=err,
        show_path=False,
        show_level=False,
        log_time_format="%H:%M:%S",
        highlighter=plain,
    )
    logger = logging.getLogger("amontons")
    logger.handlers = [handler]
    logger.setLevel(logging.INFO if verbose == 1 else logging.DEBUG)


def facts_table(facts: Iterable[tuple[str, object]], title: str | None = None) -> None:
    """Names and values, one per line, on stdout."""
    table = Table(show_header=False, box=None, pad_edge=False, title=title, title_justify="left")
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for key, value in facts:
        table.add_row(key, str(value))
    out.print(table, highlight=False, markup=False)


@contextmanager
def one_line_errors(where: object = None) -> Iterator[None]:
    """Errors of the input end the command with one line; `where` names what they are about."""
    try:
        yield
    except (InputError, OSError) as error:
        message = str(error)
        if isinstance(error, OSError) and error.strerror:  # from the system: its text has an errno in front
            message = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
        complain(message if where is None else _with_name(where, message))
        raise typer.Exit(BAD_INPUT) from None
    except SimulationError as error:
        complain(str(error))
        raise typer.Exit(NOT_CONVERGED) from None


@contextmanager
def progress(total: int) -> Iterator[Callable[[str], None]]:
    """A bar on stderr; the function that it gives names the step that begins."""
    columns = (Words("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task("", total=total)
        started = False

        def advance(description: str) -> None:
            nonlocal started
            bar.update(task, description=description, advance=1 if started else 0)
            started = True

        yield advance
