"""amontons export: the variational inequality of a time step as a problem file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import FileError, InputError
from ..io import HDF5, SUFFIXES
from ..io.files import writable
from ..report.first_contact import touched
from ..simulation.simulation import Simulation
from ..simulation.step_report import Report
from .choices import set_up
from .common import (
    NOT_CONVERGED,
    AsJson,
    most_steps,
    notes,
    one_line_errors,
    print_json,
    progress,
    say,
)
from .pictures import pictured
from .replays import (
    Csv,
    Fps,
    Gif,
    Html,
    Mp4,
    Png,
    Size,
    Speed,
    Times,
    Usd,
    Wanted,
    export_recording,
)
from .subject import Choices, Name, Subject, open_subject


@set_up()
@pictured
def export(
    subject: Name,
    output: Annotated[
        Path | None,
        typer.Option("--out", "--output", "-o", help="File: FCLIB .hdf5, or .npz, which holds any step."),
    ] = None,
    step: Annotated[int | None, typer.Option(help="Number of the step to write; the first is 1.")] = None,
    at: Annotated[
        float | None, typer.Option("--time", help="Instead of --step: time at the end of the step (s).")
    ] = None,
    touch: Annotated[
        str | None,
        typer.Option(metavar="BODY", help="Instead of --step: first step with a contact force on it."),
    ] = None,
    every: Annotated[
        int | None, typer.Option(help="Also write each N-th step before that one, as NAME-000123.hdf5.")
    ] = None,
    *,
    choices: Choices,
    html: Html = None,
    png: Png = None,
    mp4: Mp4 = None,
    gif: Gif = None,
    usd: Usd = None,
    csv: Csv = None,
    times: Times = None,
    size: Size = "960x540",
    fps: Fps = 25.0,
    speed: Speed = 1.0,
    as_json: AsJson = False,
    view: Any,
) -> None:
    """Simulate up to a step and write its problem with the solution; or turn a recording into a page,
    pictures, movies, a scene of USD or a table.

    Steps count from where the simulation begins: a saved one at the step that it was saved after.

    The exit code is 0 if the steps written converged, 1 if some did not, 2 for input that could not be used.
    """
    files = {"html": html, "png": png, "mp4": mp4, "gif": gif, "usd": usd, "csv": csv}
    with one_line_errors():
        wanted = Wanted(files, times, size, fps, speed, view)
        if wanted.any:
            return _tell(export_recording(subject, wanted), as_json)
        output = _require_output(output)
        with notes():
            chosen = open_subject(subject, choices)
        written = _export(chosen, output, _last_step(chosen, step, at, touch), every, touch, as_json)
    if as_json:
        print_json([_as_dict(path, report) for path, report in written.items()])
    reports = written.values()
    if not all(report.converged for report in reports):
        raise typer.Exit(NOT_CONVERGED)


def _export(
    chosen: Subject, output: Path, last: int, every: int | None, touch: str | None, quiet: bool
) -> dict[Path, Report]:
    """Files and reports of the steps that were written."""
    sim = chosen.simulation
    if every is not None and (touch is not None or not 1 <= every <= last):
        raise InputError(f"every = {every}; it must be from 1 to {last}, the last step, without --touch")
    body = None if touch is None else sim.model.body_index(touch)
    written: dict[Path, Report] = {}
    with progress(last) as advance:
        for k in range(1, last + 1):
            advance(f"{chosen.name} t = {sim.time:.3g} s")
            report = sim.step()
            hit = body is not None and touched(sim, body)
            if hit or (body is None and k % (every or last) == 0):
                digits = max(6, len(str(last)))
                path = output
                if every is not None:
                    path = writable(output.with_stem(f"{output.stem}-{k:0{digits}d}"), own=True)
                _write(sim, chosen.source, path)
                written[path] = report
                if not quiet:
                    say(_line(path, report))
            if hit:
                break
    if not written:
        raise InputError(f"no contact pushes {touch!r} in the first {sim.time:g} s")
    return written


def _require_output(output: Path | None) -> Path:
    """Before minutes of work."""
    if output is None:
        raise InputError("give --out FILE for the problem of a step, or of a recording --html, --png, ...")
    if output.suffix.lower() not in SUFFIXES:
        raise FileError(f"{output}: unknown kind of file; known suffixes are {', '.join(SUFFIXES)}")
    writable(output)
    return output


def _last_step(chosen: Subject, step: int | None, at: float | None, touch: str | None) -> int:
    sim = chosen.simulation
    if sum(way is not None for way in (step, at, touch)) != 1:
        raise InputError("give one of --step, --time and --touch")
    if touch is not None:
        return max(1, round(chosen.duration / sim.dt))
    if at is not None:
        if not sim.time < at < float("inf"):
            raise InputError(f"time = {at:g}; it must be after the start, {sim.time:g} s")
        # The step whose end is the first at or after that time, rounding aside.
        return most_steps("time", at, max(1, math.ceil((at - sim.time) / sim.dt * (1 - 1e-9))))
    assert step is not None
    if step < 1:
        raise InputError(f"step = {step}; the first is 1")
    return most_steps("step", step, step)


def _write(sim: Simulation, source: str, path: Path) -> None:
    problem = sim.problem()
    problem.name = f"{source}, {problem.name}"
    problem.write(path, solution=sim.forces.impulses if path.suffix.lower() in HDF5 else None)


def _tell(files: list[Path], as_json: bool) -> None:
    if as_json:
        print_json({"files": files})
        return
    for file in files:
        say(file)


def _as_dict(path: Path, report: Report) -> dict[str, object]:
    names = ("time", "contacts", "joint_rows", "status", "residual", "iterations", "method")
    return {"file": path} | {name: getattr(report, name) for name in names}


def _line(path: Path, report: Report) -> str:
    return (
        f"{path}  t = {report.time:g} s, {report.contacts} contacts, {report.joint_rows} joint rows, "
        f"{report.status}, residual {report.residual:.1e}"
    )
