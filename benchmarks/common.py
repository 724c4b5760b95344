"""What the benchmarks share: where things are, one core, repeated runs, CSV files."""

from __future__ import annotations

import argparse
import csv
import os
import shlex
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

import amontons
import numpy as np
from amontons.report.health import machine
from PIL import Image
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
EXAMPLES = ROOT / "examples" / "problems"
RESULTS = ROOT / "benchmarks" / "results"
TABLES = RESULTS / "processor"
"""What one processor measured; tables.csv names it for each table."""
FIGURES = ROOT / "docs" / "figures"
SAMPLE = ROOT / "out" / "bench"
"""Where quick runs, and runs without the data folder, leave their results."""
Row = dict[str, Any]

SHARE = 0.25
"""of the range of a control: how far random ones are from its middle at most"""


def arguments(description: str | None) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(description or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a sample, to see that everything runs")
    parser.add_argument("--data", type=Path, default=DATA, help="folder with fclib/ and chrono/")
    parser.add_argument(
        "--out", type=Path, help="folder for the CSV files (default: benchmarks/results/processor)"
    )
    parser.add_argument("--figures", type=Path, help="folder for the figures (default: docs/figures)")
    return parser


def begin(options: argparse.Namespace, **how: Any) -> argparse.Namespace:
    """The options with folders; from here on this process, with every thread it starts, is on one core, and
    steps give no warnings."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    else:
        print("this system cannot bind a process to a core; times may include other cores")
    warnings.simplefilter("ignore", amontons.StepWarning)  # the tables have the residuals
    return with_folders(options, **how)


def with_folders(
    options: argparse.Namespace, *, sample: bool = False, home: Path = TABLES,
    needs: Sequence[str] = ("fclib", "chrono"),
) -> argparse.Namespace:  # fmt: skip
    """Fills in the folders, and `complete`: whether the run renews the committed figures and results (home).

    A sample, a run without the data or one with an --out of its own leaves those alone.
    """
    has_data = all((options.data / part).is_dir() for part in needs)
    options.complete = has_data and not (options.quick or sample) and options.out is None
    options.figures = options.figures or (FIGURES if options.complete else options.out or SAMPLE)
    options.out = options.out or (home if options.complete else SAMPLE)
    options.out.mkdir(parents=True, exist_ok=True)
    options.figures.mkdir(parents=True, exist_ok=True)
    return options


def random_controls(model: amontons.Model, rng: np.random.Generator) -> dict[str, float]:
    """Of each actuator: within SHARE of its range from zero, or from the end of the range next to it."""
    values = {}
    for drive in model.actuators:
        low, high = control_range(drive)
        values[drive.name] = min(max(0.0, low), high) + SHARE * (high - low) * float(rng.uniform(-1, 1))
    return values


def control_range(drive: Any) -> tuple[float, float]:
    """That of an actuator; one without bounds is driven from -1 to 1."""
    low, high = drive.lower_control, drive.upper_control
    return (low, high) if np.isfinite(high - low) else (-1.0, 1.0)


def told(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Prints a table: texts of the first column to the left, those of the others to the right."""
    table = Table(box=None, header_style="bold", padding=(0, 1))
    for k, name in enumerate(header):
        table.add_column(name, justify="right" if k else "left")
    for row in rows:
        table.add_row(*row)
    Console(width=max(120, 24 + 18 * len(header))).print(table)


def read(path: Path) -> amontons.vi.Problem:
    """The problem of a file; that its matrix was symmetrised is noted in the problem, not on the screen."""
    with warnings.catch_warnings(action="ignore", category=amontons.vi.SymmetrisedWarning):
        return amontons.vi.read_problem(path)


def tracked(items: Sequence[Any], description: str) -> Iterator[Any]:
    """Yields the items behind a progress bar that names the current one."""
    parts = (TextColumn("{task.description:10s}"), BarColumn(24), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*parts, TextColumn("{task.fields[item]}")) as bar:
        task = bar.add_task(description, total=len(items), item="")
        for item in items:
            bar.update(task, item=str(getattr(item, "name", item))[:60])
            yield item
            bar.advance(task)
        bar.update(task, item="")


def shrink(figure: Path) -> None:
    """Reduces a PNG file to 64 colours, a fifth of its size; lines and letters need no more."""
    with Image.open(figure) as image:
        reduced = image.convert("RGB").quantize(64, dither=Image.Dither.NONE)
    reduced.save(figure, optimize=True)


ORIGINS = "tables.csv"
"""In a folder of results: the revision, the date, the command and the processor of each table."""
MEASURED = ("CMakeLists.txt", "bindings", "cmake", "include", "python/amontons", "src")
"""What the benchmarks measure; a change of it that is not committed marks the revision by a plus."""


def git(*words: str) -> str:
    """What git prints, without the line end; nothing without git or outside a checkout."""
    try:
        run = subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True)
    except OSError:
        return ""
    return run.stdout.strip() if run.returncode == 0 else ""


@cache
def revision() -> str:
    """The revision of the measured code; with a plus if it has changes that are not committed."""
    changed = git("status", "--porcelain", "--", *MEASURED)
    return (git("rev-parse", "--short=7", "HEAD") or "unknown") + "+" * bool(changed)


FOLDERS = ("--data", "--out", "--figures", "--build", "--details")
"""Options whose values are folders, which belong to a machine."""


def command() -> str:
    """The running program and its options, without folders."""
    program, *words = sys.argv
    folders = {word for option in FOLDERS if option in words
               for word in words[words.index(option) : words.index(option) + 2]}  # fmt: skip
    path = Path(program)
    if path.name == "__main__.py":
        how = ["-m", path.parent.name]
    elif (path.parent / "__init__.py").exists():
        how = ["-m", f"{path.parent.name}.{path.stem}"]
    else:
        how = [f"benchmarks/{path.name}"]
    return shlex.join(["python", *how, *(w for w in words if w not in folders)])


def task_row(task: str, method: str, time: float | str = "", error: float | str = "") -> Row:
    """The first columns of all tables that compare methods or engines: what one does with a task, in which
    time (s), and with which error; blank where it fails. Further columns follow."""
    return {"task": task, "method": method, "time": time, "error": error}


def fill(
    path: Path, items: Sequence[Any], rows_of: Callable[[Any], Iterable[Row]], show: str = "", jobs: int = 1
) -> list[Row]:
    """The rows of all items behind a progress bar, written as they come. Prints the columns of `show`."""
    rows: list[Row] = []
    with ThreadPoolExecutor(jobs) as pool:
        found = pool.map(rows_of, items) if jobs > 1 else map(rows_of, items)
        for _, some in zip(tracked(items, path.stem), found, strict=True):
            for row in some:
                rows.append(row)
                write_csv(path, rows)
    if show:
        told(show.split(), [[shown(row.get(key)) for key in show.split()] for row in rows])
    print(f"{len(rows)} rows in {path}")
    return rows


def shown(value: Any) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def write_csv(path: Path, rows: Iterable[Row]) -> None:
    """The rows as a table of results, and its origin in tables.csv beside it."""
    write_rows(path, rows)
    known = {row["table"]: row for row in read_csv(path.with_name(ORIGINS))}
    origin = {"table": path.name, "revision": revision(), "date": date.today().isoformat()}
    known[path.name] = origin | {"command": command(), "processor": machine()["processor"]}
    write_rows(path.with_name(ORIGINS), [known[name] for name in sorted(known)])


def write_rows(path: Path, rows: Iterable[Row]) -> None:
    """The rows as a CSV file with a header, blank where a row lacks a column; floats with eight digits."""
    rows = list(rows)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        columns = dict.fromkeys(key for row in rows for key in row)
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({key: f"{v:.8g}" if isinstance(v, float) else v for key, v in row.items()})


def read_csv(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file, or none where there is no file."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
