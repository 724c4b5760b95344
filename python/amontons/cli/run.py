"""amontons run: simulate, record, report."""

from __future__ import annotations

import signal
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import BarColumn, Progress, TimeElapsedColumn, TimeRemainingColumn

from ..checks import Array
from ..errors import FileError, InputError, SimulationError
from ..io import record as record_to
from ..io.files import writable
from ..io.recordings.recorder import Recorder
from ..simulation.loads import Loads
from ..simulation.signals import Signals
from ..simulation.simulation import Simulation
from ..simulation.step_report import Report, reports_array
from .choices import set_up
from .common import (
    NOT_CONVERGED,
    AsJson,
    Words,
    complain,
    err,
    facts_table,
    make_folder,
    most_steps,
    note,
    notes,
    one_line_errors,
    print_json,
    say,
)
from .pictures import pictured
from .replays import Wanted, export_recording
from .subject import Choices, Name, Subject, open_subject

if TYPE_CHECKING:
    from ..report.picture import View

RecordSignals = Annotated[
    bool, typer.Option(help="Record motor efforts, controls, reactions and sensors as well.")
]
FILM_FPS = 25.0
"""Pictures of a film per second, which are shown at the speed of the motion"""
MOST_READINGS = 20_000_000
"""Numbers (of 8 bytes) of signals that a report keeps until it is written"""


@dataclass
class Outcome:
    """The result of a run."""

    reports: list[Report] = field(default_factory=list)
    frames: list[Any] = field(default_factory=list)
    """snapshots"""
    wall: float = 0.0
    """s"""
    ended: str = ""
    """why it ended early, or nothing"""
    measured: Signals | None = None
    """what is read after each step besides its report"""
    readings: list[Array] = field(default_factory=list)
    """of each step"""
    loads: Loads | None = None
    """of joints and contacts, for a report"""


@set_up()
@pictured
def run(
    subject: Name,
    duration: Annotated[
        float | None, typer.Option(help="Simulated time (s); default: that of the scene, or 5.")
    ] = None,
    *,
    choices: Choices,
    record: Annotated[Path | None, typer.Option(help="File for states, contacts, reports (HDF5).")] = None,
    record_every: Annotated[int, typer.Option(help="Number of steps between recorded states.")] = 1,
    record_contacts: Annotated[bool, typer.Option(help="Record contact tables.")] = True,
    record_signals: RecordSignals = True,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing recording.")] = False,
    report: Annotated[
        Path | None, typer.Option(help="Folder for figures and a CSV file with a row per step.")
    ] = None,
    snapshots: Annotated[int, typer.Option(help="Number of pictures in the report; 0: none.")] = 4,
    film: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Film of the run: .gif, .webp, or .mp4 by ffmpeg; of the frames of --record, if given.",
        ),
    ] = None,
    save: Annotated[
        Path | None,
        typer.Option(help="File to save the last state in (HDF5); `run` and `export` start from it."),
    ] = None,
    as_json: AsJson = False,
    view: Any,
) -> None:
    """Simulate a scene, a model or a saved simulation; record it, report on it.

    Ctrl-C ends a run at once, with the step before; what was recorded so far is kept.

    The exit code is 0 if all steps converged, 1 if some did not or the run ended early, 2 for input that
    could not be used.
    """
    with one_line_errors():
        with notes():
            chosen = open_subject(subject, choices)
        steps = _steps(chosen, duration)
        _require(chosen, snapshots, view, save, film)
    if report is not None:
        with one_line_errors(report):
            make_folder(report)
    with _place(record, film) as place:
        every = record_every if record else max(1, round(1 / (FILM_FPS * chosen.simulation.dt)))
        kept = (record_contacts, record_signals) if record else (bool(view.forces), False)
        with (
            one_line_errors(record),
            _signals() as signals,
            _recorder(place, chosen, every, kept, overwrite) as recorder,
        ):
            outcome = Outcome() if report is None else _reported(chosen, steps)
            _simulate(
                chosen, outcome, steps, recorder, snapshots if report else 0, signals, bool(view.forces)
            )
            _close(recorder, outcome)
        with one_line_errors():
            if save is not None:
                chosen.simulation.save(save)
        with one_line_errors(film):
            made = [] if film is None else export_recording(str(place), _film(film, view))
    with one_line_errors(report):
        made += [] if report is None else _draw(chosen, outcome, report, view)
    _end(chosen, outcome, [*made, *(path for path in (record, save) if path is not None)], as_json)


@contextmanager
def _place(record: Path | None, film: Path | None) -> Iterator[Path | None]:
    """Where the run is recorded: a film alone needs no file that stays."""
    if film is None or record is not None:
        yield record
        return
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder) / "film.h5"


def _film(path: Path, view: View) -> Wanted:
    kind = "mp4" if path.suffix.lower() == ".mp4" else "gif"
    return Wanted({kind: path}, times=None, size="960x540", fps=FILM_FPS, speed=1.0, view=view)


def _close(recorder: Recorder | None, outcome: Outcome) -> None:
    if recorder is None:
        return
    try:
        recorder.close(complete=not outcome.ended)
    except FileError as error:
        outcome.ended = outcome.ended or str(error)


def _end(chosen: Subject, outcome: Outcome, written: Sequence[Path], as_json: bool) -> None:
    """The summary, and what was written; the exit code says whether all went well."""
    if outcome.ended:
        complain(outcome.ended)
    if as_json:
        print_json(_as_dict(chosen, outcome, written))
    else:
        _tell(chosen, outcome)
        for path in written:
            say(path)
    if outcome.ended or not all(step.converged for step in outcome.reports):
        raise typer.Exit(NOT_CONVERGED)


def _require(chosen: Subject, snapshots: int, view: View, save: Path | None, film: Path | None) -> None:
    """Outputs that cannot be drawn or saved are refused before the run starts."""
    if isinstance(view.target, str):
        chosen.simulation.model.body_index(view.target)
    if snapshots < 0:
        raise InputError(f"snapshots = {snapshots}; it must be zero or positive")
    if save is not None:
        writable(save)
    if film is not None:
        if film.suffix.lower() not in (".gif", ".webp", ".mp4"):
            raise InputError(f"--film {film}: give a name that ends in .gif, .webp or .mp4")
        writable(film)


def _recorder(
    path: Path | None, chosen: Subject, every: int, kept: tuple[bool, bool], overwrite: bool
) -> AbstractContextManager[Recorder | None]:
    if path is None:
        return nullcontext()
    return record_to(
        path,
        chosen.simulation,
        every=every,
        contacts=kept[0],
        signals=kept[1],
        source=chosen.source,
        overwrite=overwrite,
    )


def _steps(subject: Subject, duration: float | None) -> int:
    wanted = subject.duration if duration is None else duration
    if not 0 < wanted < float("inf"):
        raise InputError(f"duration = {wanted:g}; it must be positive and finite")
    return most_steps("duration", wanted, max(1, round(wanted / subject.simulation.dt)))


def _reported(chosen: Subject, steps: int) -> Outcome:
    """An outcome that keeps what a report shows."""
    return Outcome(measured=_measured(chosen, steps), loads=chosen.simulation.forces.loads())


def _measured(chosen: Subject, steps: int) -> Signals | None:
    """The signals of the table of steps; None, with a note, where they would be too many."""
    signals = Signals(chosen.simulation.model)
    if steps * len(signals.units) <= MOST_READINGS:
        return signals
    note(
        f"the report leaves out {len(signals.units)} efforts, reactions and sensors, which are too many for "
        f"{steps} steps; record them: --record FILE.h5 --record-every N"
    )
    return None


def _simulate(
    subject: Subject,
    outcome: Outcome,
    steps: int,
    recorder: Recorder | None,
    snapshots: int,
    signals: _Signals,
    forces: bool,
) -> None:
    sim = subject.simulation
    pictured = {round(k * steps / max(1, snapshots - 1)) for k in range(snapshots)}

    if snapshots:  # takes long, before the clock starts; a run without pictures does without
        from ..report.picture import frame_of

    def picture() -> None:
        outcome.frames.append(frame_of(sim, forces=forces))

    start = time.perf_counter()
    with _bar(subject, steps) as show:
        if 0 in pictured:
            picture()
        for k in range(1, steps + 1):
            try:
                report = signals.step(sim)
                if report is not None:
                    outcome.reports.append(report)
                    if outcome.measured is not None:
                        outcome.readings.append(outcome.measured.read(sim))
                    if recorder is not None:
                        recorder.add(report)
            except (SimulationError, InputError) as error:  # such as velocities not finite, or a full disk
                outcome.ended = str(error)
                break
            if report is not None:
                if k in pictured:
                    picture()
                show(k, report, time.perf_counter() - start)
            if signals.caught:
                done = len(outcome.reports)
                outcome.ended = f"{signals.word} at t = {sim.time:g} s, after {done} of {steps} steps"
                break
    outcome.wall = time.perf_counter() - start
    if outcome.ended and snapshots and (not outcome.frames or outcome.frames[-1].time != sim.time):
        picture()


@dataclass
class _Signals:
    """Ctrl-C and the wish of the system that the process ends: they end a step, and so the run."""

    caught: int = 0
    """number of the first signal"""
    in_step: bool = False

    @property
    def word(self) -> str:
        return "terminated" if self.caught == signal.SIGTERM else "interrupted"

    def __call__(self, number: int, frame: FrameType | None) -> None:
        again, self.caught = self.caught != 0, number
        if self.in_step or again:  # between steps the run looks for itself, and what a step made is recorded
            raise KeyboardInterrupt

    def step(self, sim: Simulation) -> Report | None:
        """A step; None where a signal ended it, with the state that was before."""
        try:
            self.in_step = True
            return sim.step()
        except KeyboardInterrupt:
            return None
        finally:
            self.in_step = False


@contextmanager
def _signals() -> Iterator[_Signals]:
    signals = _Signals()
    previous = {number: signal.signal(number, signals) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield signals
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextmanager
def _bar(subject: Subject, steps: int) -> Iterator[Any]:
    """A bar on stderr with simulated time, real-time factor, contacts and residual."""
    columns = (
        Words("{task.description}"),
        BarColumn(),
        Words("{task.fields[status]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    first, dt = subject.simulation.time, subject.simulation.dt
    last = 0.0
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as progress:
        task = progress.add_task(subject.name, total=steps, status="")

        def show(step: int, report: Report, wall: float) -> None:
            nonlocal last
            if wall - last < 0.05 and step < steps:
                return
            last = wall
            status = (
                f"t {report.time:.2f} of {first + steps * dt:g} s  x{step * dt / wall:.2f} real time  "
                f"{report.contacts} contacts  residual {report.residual:.0e}"
            )
            progress.update(task, completed=step, status=status)

        yield show


def _tell(subject: Subject, outcome: Outcome) -> None:
    """The summary on stdout."""
    from ..report.run_summary import facts

    reports, tolerance = reports_array(outcome.reports), float(subject.simulation.options["tolerance"])
    told = facts(reports, dt=subject.simulation.dt, wall=outcome.wall, tolerance=tolerance)
    facts_table(told, title=subject.source)


def _as_dict(subject: Subject, outcome: Outcome, files: Sequence[Path]) -> dict[str, Any]:
    from ..report.run_summary import numbers

    sim = subject.simulation
    options = {name: sim.options[name] for name in ("law", "method", "tolerance", "dt", "threads")}
    told = numbers(reports_array(outcome.reports), dt=sim.dt, wall=outcome.wall)
    return {
        "subject": subject.source,
        **options,
        **told,
        "ended_early": outcome.ended or None,
        "files": files,
    }


def _draw(subject: Subject, outcome: Outcome, folder: Path, view: View) -> list[Path]:
    """The files of the report."""
    from ..report.loads import write_loads
    from ..report.run_summary import run_figure, write_reports
    from ..report.snapshots import snapshots_figure

    sim = subject.simulation
    reports, tolerance = reports_array(outcome.reports), float(sim.options["tolerance"])
    if not len(reports):
        return []
    title = f"{subject.source}: law {sim.options['law']}, method {sim.options['method']}, dt {sim.dt:g} s"
    run_figure(reports, folder / "report.png", title=title, tolerance=tolerance)
    names = outcome.measured.units if outcome.measured else {}
    write_reports(reports, folder / "steps.csv", names=list(names), readings=outcome.readings)
    made = [folder / "report.png", folder / "steps.csv"]
    if outcome.loads is not None and len(outcome.loads):
        made.append(folder / "loads.csv")
        write_loads(outcome.loads, made[-1])
    if outcome.frames and sim.model.geoms:
        made.append(folder / "snapshots.png")
        snapshots_figure(sim.model, outcome.frames, made[-1], view=view)
    return made
