"""Names that strangers give, and links and pipes that they leave where something is going to be written."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import amontons
from amontons import cli
from amontons.errors import FileError
from amontons.escapes import visible
from amontons.viewer.events import literal
from typer.testing import CliRunner

from .family import Case, Failure, Family, Measures
from .mutate.raw import Rng, pick

PIECES = (
    "\x1b[31m", "\x1b]0;title\x07", "\x9b2J", "\r", "\n", "\t", "\x7f", "\u202e", "\u2066", "\u2028", "[red]",
    "[/]", "[link=x]", "<b>", "<script>top.bad=1</script>", "<iframe srcdoc='x'>", "&lt;", "`", "``", "**",
    "# ", "=1+1", "+", "-", "@", "$x$", "$", "\\", "%s", "{0}", "..", " ", "a", "body", "車", "\udcff",
    "\ud800",
)  # fmt: skip
OBEYED = ("\x1b", "\x9b", "\x07", "\u202e", "\u2066", "\r")
SECRET = "irreplaceable"
PATIENCE = 60
"""Seconds of wall clock of one case: a pipe takes no processor time."""


def name(rng: Rng) -> str:
    """A name of some pieces."""
    return "".join(str(pick(rng, list(PIECES))) for _ in range(int(rng.integers(1, 6))))


def names(case: Case) -> Measures:
    """A name of a body goes everywhere where names go."""
    rng = case.rng()
    given = name(rng)
    text = visible(given)
    _require(not any(c in text for c in (*OBEYED, "\n")) and visible(text) == text, f"visible: {text!r}")
    code = literal(given)
    fence = code[: len(code) - len(code.lstrip("`"))]
    _require(fence and fence not in code[len(fence) : -len(fence)] and "\n" not in code, f"literal: {code!r}")
    try:
        sim = _simulation(given)
    except amontons.InputError as error:
        _require(not any(c in str(error) for c in OBEYED), f"message: {error!s:.200}")
        return {"outcome": "refused"}
    path = case.folder / "run.h5"
    with amontons.record(path, sim) as recorder:
        recorder.add(sim.step())
    _exported(path, case.folder / "run.csv")
    try:
        sim.model.body_index(given + "x")
    except amontons.InputError as error:
        _require(not any(c in str(error) for c in OBEYED), f"message: {error!s:.200}")
    return {"outcome": "accepted"}


def _simulation(given: str) -> amontons.Simulation:
    builder = amontons.ModelBuilder()
    builder.add_body(given, shape=amontons.shapes.Sphere(0.1), density=1000)
    return amontons.Simulation(builder.build())


def _exported(path: Path, table: Path) -> None:
    result = CliRunner().invoke(cli.app, ["export", str(path), "--csv", str(table)])
    _require(result.exception is None or isinstance(result.exception, SystemExit), repr(result.exception))
    _require(not any(c in result.output for c in OBEYED), f"output: {result.output[:200]!r}")
    text = table.read_text()
    _require(not any(c in text for c in OBEYED[:-1]), f"table: {text[:200]!r}")
    for cell in text.splitlines()[0].split(","):
        _require(not cell.strip('"').startswith(("=", "+", "@", "-")), f"a formula: {cell!r}")


def _require(holds: object, what: str) -> None:
    if not holds:
        raise Failure("unshown name", what)


WAYS: dict[str, tuple[tuple[str, ...], Callable[[Path], Any]]] = {}
"""What writes, and the names at which it does."""


def way(*files: str) -> Callable[[Callable[[Path], Any]], Callable[[Path], Any]]:
    def enter(call: Callable[[Path], Any]) -> Callable[[Path], Any]:
        WAYS[call.__name__] = files, call
        return call

    return enter


@way("rows.parquet", ".rows.parquet.lock")
def study(folder: Path) -> None:
    grid = {"mu": [0.5], "stones": [3], "duration": [0.01]}
    amontons.sweep("arch", grid, out=folder / "rows.parquet", executor=0, progress=False)


@way("study.parquet", ".study.parquet.lock")
def study_file(folder: Path) -> None:
    (folder / "study.toml").write_text(
        'run = "arch"\nprocesses = 0\n[grid]\nmu = [0.5]\n[fixed]\nduration = 0.01\n'
    )
    _command("sweep", folder / "study.toml")


@way("report/report.png", "report/steps.csv", "report/snapshots.png")
def report(folder: Path) -> None:
    _command("run", "stack", "--set", "boxes=1", "--duration", "0.01", "--report", folder / "report")


@way("a.h5")
def recording(folder: Path) -> None:
    sim = amontons.Simulation(amontons.scenes.make("stack", boxes=1))
    with amontons.record(folder / "a.h5", sim, overwrite=True) as recorder:
        recorder.add(sim.step())


@way("p.mtx", "p.npz")
def problem(folder: Path) -> None:
    amontons.vi.Problem([[2.0]], [-1.0], "bilateral").write(folder / "p.mtx")


def _command(*arguments: object) -> None:
    result = CliRunner().invoke(cli.app, [str(a) for a in arguments])
    if result.exit_code == 2:
        raise FileError(result.output)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception


NAMED = ("rows.parquet", "a.h5", "p.mtx")
"""Names that the caller gives, where a link is followed to a file that may be replaced."""


def links(case: Case) -> Measures:
    """What is not a file of the writer stands at one of its names; nothing else may change."""
    rng = case.rng()
    files, call = WAYS[str(pick(rng, list(WAYS)))]
    place = case.folder / str(pick(rng, list(files)))
    place.parent.mkdir(exist_ok=True)
    victim = case.folder / "elsewhere" / "notes.txt"
    victim.parent.mkdir()
    victim.write_text(SECRET)
    kind = str(pick(rng, ["link", "dangling", "hard", "pipe", "folder", "loop", "device", "file"]))
    _prepare(kind, place, victim)
    before = place.lstat()
    outcome = "accepted"
    try:
        with _patience():
            call(case.folder)
    except (amontons.InputError, OSError):
        outcome = "refused"
    named = place.name in NAMED
    meant = named and kind in ("link", "hard") and outcome == "accepted"
    if not meant and victim.read_text() != SECRET:
        raise Failure("followed link", f"{call.__name__}: {kind} at {place.name} changed what it leads to")
    if os.listdir(victim.parent) != ["notes.txt"]:
        raise Failure("followed link", f"{call.__name__}: {kind} at {place.name} made a file elsewhere")
    if kind not in ("hard", "file") and not (named and kind == "link"):
        if not place.is_symlink() and not place.exists():
            raise Failure("followed link", f"{call.__name__}: {kind} at {place.name} was removed")
        if stat.S_IFMT(place.lstat().st_mode) != stat.S_IFMT(before.st_mode):
            raise Failure("followed link", f"{call.__name__}: {kind} at {place.name} was replaced")
    return {"outcome": outcome}


def _prepare(kind: str, place: Path, victim: Path) -> None:
    match kind:
        case "link":
            place.symlink_to(victim)
        case "dangling":
            place.symlink_to(victim.with_name("new"))
        case "hard":
            os.link(victim, place)
        case "pipe":
            os.mkfifo(place)
        case "folder":
            place.mkdir()
        case "loop":
            place.symlink_to(place.name)
        case "device":
            place.symlink_to("/dev/full")
        case _:
            place.write_text("mine")


@contextlib.contextmanager
def _patience() -> Iterator[None]:
    def late(*_: object) -> None:
        raise Failure("hang", "it waits")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(PATIENCE)
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


FAMILIES = [
    Family("names", "names with escapes, markup and formulas", names),
    Family("links", "links and pipes at names that are written", links),
]
