"""`sweep`: a function at all points of a grid."""

from __future__ import annotations

import functools
import importlib
import inspect
import json
import logging
import sys
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..checks import integer, positive_number, suggestion
from ..errors import FileError, InputError
from ..guidance import guided
from ..io.files import writable
from ..simulation.rollout import usable_cores
from .executors import Attendance, Died, Executor, Here, Processes, Submitted
from .points import Point, points
from .rows import Rows, alone
from .subjects import FileRun, Subject
from .task import STATUSES, Row, Task, machine

if TYPE_CHECKING:
    import pyarrow

logger = logging.getLogger(__name__)


@guided
def sweep(
    run: str | Callable[..., Mapping[str, Any] | None],
    grid: Mapping[str, Any] | Sequence[Mapping[str, Any]],
    *,
    out: str | PathLike[str] | None = None,
    executor: int | Executor | None = None,
    seeds: int | Sequence[int] | None = None,
    retries: int = 2,
    timeout: float | None = None,
    patience: float | None = 60.0,
    redo: Collection[str] = (),
    progress: bool = True,
) -> pyarrow.Table:
    """Call `run` at every point of a grid, many at a time; one row per run comes back as a PyArrow table.

    run: called as run(**parameters); it returns a mapping, name -> number, text or array of them, whose
        entries become columns. An error in it becomes a row too. Or the name of a scene or of a model file:
        the grid then holds its parameters, options of `Simulation` and the duration, and the results are
        those of docs/studies.md.
    grid: name -> values, of which all combinations are run, or a list of points, name -> value.
    out: a .parquet file, whole at every moment, to which rows come as runs end. Where it holds rows of this
        study already, only the others are run: a study that was stopped goes on.
    executor: how many processes (one per core by default; 0: one run after the other in this process), or an
        object with `submit(function, *args) -> future`: Dask's Client, an executor of concurrent.futures.
    seeds: so many runs of each point, or the seeds themselves. `run` is called with seed=..., an integer
        that follows from the parameters (and which of the runs it is), if it takes one.
    retries: how often a run is tried again whose worker died.
    timeout: wall clock of a run (s). It ends between two steps of a simulation; a process that does not come
        to one is killed.
    patience: how long runs wait while no worker is alive (s); then InputError, and rows that are done stay.
        None: without end. It acts where workers can be counted: processes of loky and concurrent.futures,
        and workers of Dask.
    redo: statuses of rows to repeat: "failed", "timeout", "died".
    progress: a bar on standard error, if that is a terminal; it tells how many workers are alive.

    Columns beside parameters and results: key, repetition and seed where there are some, status ("done",
    "failed", "timeout", "died"), error, traceback, attempts, wall (s), steps, missed (steps and solves that
    did not converge), worst_residual (natural, of all of them), started, host, and the versions of amontons,
    python and numpy.

    Raises InputError and FileError before anything is run, and InputError when the executor is lost.
    Needs `pip install "amontons[studies]"`.

    >>> def run(angle):
    ...     return {"height": np.cos(angle)}
    >>> sweep(run, {"angle": [0.0, 0.5]}, executor=0, progress=False).num_rows
    2
    """
    require_parts("pyarrow")
    if isinstance(run, str):
        run = Subject(run)
    seeded = _require_run(run, grid, seeds)
    path = _output(out)
    retries = integer("retries", retries, 0)
    timeout = None if timeout is None else positive_number("timeout", timeout)
    patience = None if patience is None else positive_number("patience", patience)
    _require_statuses(redo)
    todo = points(grid, seeds, seeded=seeded)
    workers = _workers(executor, run, len(todo))
    names = list(todo[0].parameters) if todo else []
    with alone(path):
        rows = Rows(path, identity(run), names)
        left = [p for p in todo if p.key not in rows or rows[p.key]["status"] in redo]
        before = len(todo) - len(left)
        logger.info("study of %s: %d runs, %d of them done before", identity(run), len(todo), before)
        with _kept(workers, rows, todo), _bar(len(todo), progress) as tell:
            tell(before, 0, None)
            _drive(left, run, workers, rows, retries, timeout, Attendance(workers, patience), tell)
        return rows.table(p.key for p in todo)


@contextmanager
def _kept(workers: Here | Submitted | Processes, rows: Rows, todo: Sequence[Point]) -> Iterator[None]:
    """Closes the workers at the end and writes the rows, whatever ends the study."""
    try:
        yield
    finally:
        try:
            workers.close()
        finally:
            rows.write(first=(p.key for p in todo))


def _require_statuses(redo: Collection[str]) -> None:
    for status in redo:
        if status not in STATUSES:
            raise InputError(f"redo: unknown status {status!r}; known are {', '.join(STATUSES)}")


def _drive(
    left: Sequence[Point],
    run: Callable[..., Any],
    workers: Here | Submitted | Processes,
    rows: Rows,
    retries: int,
    timeout: float | None,
    attendance: Attendance,
    tell: Callable[[int, int, int | None], None],
) -> None:
    waiting, running, suspects = deque(left), dict[str, Point](), deque[Point]()
    attempts: Counter[str] = Counter()
    while waiting or running or suspects:
        if not waiting and not running:
            waiting.append(suspects.popleft())  # alone: no other can be the cause of its death
        while waiting and len(running) < workers.capacity:
            point = waiting.popleft()
            attempts[point.key] += 1
            running[point.key] = point
            workers.start(point.key, Task(run, point.arguments, timeout))
        ended = workers.wait(0.1)
        for key, outcome in ended:
            point = running.pop(key)
            if isinstance(outcome, Died):
                logger.warning("%s died, attempt %d: %s", point.parameters, attempts[key], outcome.reason)
                if attempts[key] <= retries:
                    (waiting if workers.own else suspects).append(point)
                    continue
                outcome = {"status": "died", "error": outcome.reason}
            if workers.own:
                outcome = machine() | outcome
            row = rows.add(key, _row(point, outcome, attempts[key]))
            logger.info("%s: %s %s", point.parameters, row["status"], row.get("error", ""))
            tell(1, row["status"] != "done", attendance.count)
        rows.write_if_due()
        attendance.look(came=bool(ended))
        tell(0, 0, attendance.count)
        attendance.require()


def _row(point: Point, outcome: Row, attempts: int) -> Row:
    own = {"repetition": point.repetition, "seed": point.seed, "attempts": attempts}
    row = {**point.parameters, **own, **outcome}
    return {name: value for name, value in row.items() if value is not None}


def require_parts(*modules: str) -> None:
    """InputError if one of the modules that studies need is not installed."""
    for module in modules:
        try:
            importlib.import_module(module)
        except ImportError as error:
            raise InputError(f'studies need {module} ({error}): pip install "amontons[studies]"') from None


def _require_run(run: object, grid: Any, seeds: object) -> bool:
    """Whether runs take a seed. InputError if `run` cannot be called with the parameters of the grid."""
    if not callable(run):
        raise InputError(f"run is a {type(run).__name__}; give a function of the parameters")
    try:
        parameters = inspect.signature(run).parameters
    except InputError:  # a scene that there is not
        raise
    except (TypeError, ValueError):  # built in: nothing is known
        return seeds is not None
    names = list(grid) if isinstance(grid, Mapping) else list(grid[0]) if len(grid) else []
    seeded = "seed" in parameters or seeds is not None
    _require_call(identity(run), parameters, [*names, *(["seed"] if seeded else [])])
    return seeded


def _require_call(name: str, parameters: Mapping[str, inspect.Parameter], given: Collection[str]) -> None:
    """InputError unless a function of these parameters can be called with those given by name."""
    every = any(p.kind is p.VAR_KEYWORD for p in parameters.values())
    named = {key: p for key, p in parameters.items() if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)}
    for key in given:
        if key not in named and not every:
            known = ", ".join(named) or "none"
            raise InputError(
                f"{name} takes no argument {key!r}{suggestion(key, named)}; its arguments: {known}"
            )
    for key, p in parameters.items():
        if p.default is p.empty and p.kind is p.POSITIONAL_ONLY:
            raise InputError(f"{name} needs the argument {key!r}; it must have a name to be given by")
        if p.default is p.empty and key in named and key not in given:
            raise InputError(f"{name} needs the argument {key!r}; the grid lacks it")


def identity(run: Callable[..., Any]) -> str:
    """The name of a run, by which a study on file is known again; with what `functools.partial` holds."""
    if isinstance(run, Subject | FileRun):
        return run.name
    if isinstance(run, functools.partial):
        held = json.dumps([run.args, run.keywords], sort_keys=True, default=repr)
        return f"{identity(run.func)} {held}"
    return str(getattr(run, "__qualname__", type(run).__qualname__))


def _output(out: str | PathLike[str] | None) -> Path | None:
    if out is None:
        return None
    path = writable(out)
    if path.suffix.lower() != ".parquet":
        raise FileError(f"{path}: unknown kind of file; give a name that ends in .parquet")
    return path


def _workers(executor: Any, run: Callable[..., Any], runs: int) -> Here | Submitted | Processes:
    if executor is not None and not isinstance(executor, int):
        if not callable(getattr(executor, "submit", None)):
            raise InputError(
                f"executor is a {type(executor).__name__}; give a number of processes, or an object with "
                "submit(function, *args) -> future"
            )
        return Submitted(executor)
    count = usable_cores() if executor is None else integer("executor", executor, 0)
    if count == 0:
        return Here()
    require_parts("loky")
    from cloudpickle import dumps  # type: ignore[import-untyped]

    try:
        dumps(run)
    except Exception as error:  # pickling raises whatever the objects do
        raise InputError(
            f"run cannot be sent to another process ({error}); make what it needs inside it, or give "
            "executor=0"
        ) from None
    return Processes(max(1, min(count, runs)))


@contextmanager
def _bar(total: int, wanted: bool) -> Iterator[Callable[[int, int, int | None], None]]:
    """A bar on stderr where that is a terminal; the function adds runs, how many of them failed, and says how
    many workers are alive.

    Rich draws it (`amontons[cli]`); without Rich there is none.
    """
    try:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )
    except ImportError:
        yield lambda runs, failed, alive: None
        return

    console = Console(file=sys.stderr)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[failed]}"),
        TextColumn("{task.fields[alive]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    shown = wanted and console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=not shown) as bar:
        task = bar.add_task("runs", total=total, failed="", alive="")
        count = 0

        def tell(runs: int, failed: int, alive: int | None) -> None:
            nonlocal count
            count += failed
            workers = "" if alive is None else f"{alive} workers alive"
            bar.update(task, advance=runs, failed=f"{count} failed" if count else "", alive=workers)

        yield tell
