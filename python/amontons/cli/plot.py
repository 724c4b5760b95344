"""amontons plot: columns of a recording over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from ..io.files import existing, writable
from ..io.recordings import is_recording, read_recording
from .common import AsJson, facts_table, one_line_errors, out, print_json, say
from .completion import recordings

if TYPE_CHECKING:
    from ..io.recordings.recording import Recording

SUFFIXES = (".png", ".pdf", ".svg")


def plot(
    recording: Annotated[
        str, typer.Argument(help="Recording made by `amontons run --record`.", autocompletion=recordings)
    ],
    columns: Annotated[
        list[str] | None,
        typer.Argument(
            help="Names of signals (screw.motor) or patterns ('foot.f*'); default: list the signals."
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "--out",
            "-o",
            help="Figure to write (PNG, PDF or SVG); default: the recording's name with .png.",
        ),
    ] = None,
    loads: Annotated[
        bool,
        typer.Option("--loads", help="Print a table of joint and contact loads; --output writes it as CSV."),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Draw columns of a recording over time, a panel for each unit; without columns, list them.

    Columns are motor efforts, controls, reactions and sensors (screw.motor, foot.fx), coordinates of joints
    (screw), positions and velocities of bodies (ball.z, ball.vz) and the numbers of reports (energy).

    --loads lists peak, time of the peak, mean, rms and impulse of reactions of joints and of forces between
    pairs of geoms. Reactions are in the axes of each joint. It marks components that are not determined.
    """
    with one_line_errors():
        path = existing(recording, "a recording")
        if not is_recording(path):
            raise InputError(f"{path}: is no recording; make one with amontons run ... --record FILE.h5")
        if loads:
            return _loads(path, columns, output, as_json)
        target = _target(path, output)
        with read_recording(path) as opened:
            if not columns:
                return _list(opened.columns, as_json)
            _draw(opened, _matching(columns, opened), target)
    if as_json:
        print_json({"files": [target]})
    else:
        say(target)


def _loads(path: Path, columns: Sequence[str] | None, output: Path | None, as_json: bool) -> None:
    """The loads of a recording as a table, as JSON or as a CSV file."""
    from ..report.loads import loads_of, loads_table, write_loads

    if columns:
        raise InputError(f"--loads lists all joints and contacts; leave out {columns[0]}")
    if output is not None and output.suffix.lower() != ".csv":
        raise InputError(f"--output {output}: loads are a table; give a name that ends in .csv")
    with read_recording(path) as opened:
        found = loads_of(opened)
    if output is not None:
        write_loads(found, writable(output))
    if as_json:
        header, *rows = found.rows()
        listed = [dict(zip(header, row, strict=True)) for row in rows]
        print_json({"loads": listed, "files": [output] if output else []})
    elif output is not None:
        say(output)
    else:
        out.print(loads_table(found), highlight=False, markup=False, soft_wrap=True)


def _target(recording: Path, output: Path | None) -> Path:
    target = Path(recording.with_suffix(".png").name) if output is None else output
    if target.suffix.lower() not in SUFFIXES:
        raise InputError(f"--output {target}: give a name that ends in {' or '.join(SUFFIXES)}")
    return writable(target, own=output is None)


def _list(columns: Mapping[str, str], as_json: bool) -> None:
    """Names and units on stdout."""
    if as_json:
        print_json({"columns": columns})
    else:
        facts_table(columns.items())


def _matching(patterns: Sequence[str], recording: Recording) -> list[str]:
    """The columns that names and patterns stand for, each once. Raises InputError, which lists the known."""
    found: dict[str, None] = {}
    for pattern in patterns:
        matching = [pattern] if pattern in recording.columns else []
        if not matching and any(sign in pattern for sign in "*?["):
            matching = [name for name in recording.columns if fnmatchcase(name, pattern)]
        found |= dict.fromkeys(matching or [recording.column(pattern).name])
    return list(found)


def _draw(recording: Recording, names: Sequence[str], target: Path) -> None:
    from ..report.curves import curves_figure

    title = f"{recording.path.name}: {recording.source}" if recording.source else recording.path.name
    curves_figure([recording.column(name) for name in names], target, title=title)
