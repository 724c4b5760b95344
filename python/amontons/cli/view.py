"""amontons view: a simulation or a recording on a page in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from ..io.recordings import is_recording, read_recording
from ..simulation.simulation import Simulation
from ..viewer import HOST, PORT
from ..viewer import view as open_view
from ..viewer.title import title_of
from .choices import set_up
from .common import notes, one_line_errors, say
from .subject import SAVED, Choices, open_subject

SOON = 0.3
"""Seconds after Ctrl-C that a step may still last."""

if TYPE_CHECKING:
    from ..io.recordings.recording import Recording


@set_up()
def view(
    subject: Annotated[
        str,
        typer.Argument(
            metavar="MODEL_OR_SCENE_OR_RECORDING",
            help="Scene (see `amontons scenes`), model (MJCF .xml, .urdf), saved simulation or "
            "recording (.h5).",
            show_default=False,
        ),
    ],
    play: Annotated[bool, typer.Option("--play/--pause", help="Start playing at once.")] = False,
    speed: Annotated[float, typer.Option(help="Playback speed: simulated time over real time.")] = 1.0,
    host: Annotated[
        str, typer.Option(help="Address to serve the page at; default: only this machine can open it.")
    ] = HOST,
    port: Annotated[int, typer.Option(help="Port of the page; the next free one if it is taken.")] = PORT,
    allow_origin: Annotated[
        list[str] | None,
        typer.Option(help="Further address of the page, http://NAME:PORT. Repeatable."),
    ] = None,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the default browser.")
    ] = True,
    *,
    choices: Choices,
) -> None:
    """Watch a scene, a model, a saved simulation or a recording in the browser, until Ctrl-C.

    The page is served by this command and loads nothing from elsewhere. Needs viser:
    pip install 'amontons[view]'.

    The exit code is 0, or 2 for input that could not be used.
    """
    with one_line_errors():
        if not 0 < speed < float("inf"):
            raise InputError(f"speed = {speed:g}; it must be positive and finite")
        with notes():
            shown, title = _open(subject, choices)
        viewer = open_view(
            shown, play=play, speed=speed, host=host, port=port, open_browser=browser, title=title,
            allow_origin=allow_origin or (),
        )  # fmt: skip
    say(f"{viewer.url}  (Ctrl-C ends)")
    viewer.wait()
    viewer.close(wait=SOON)


def _open(subject: str, choices: Choices) -> tuple[Simulation | Recording, str]:
    """Returns the object to show, and its title."""
    path = Path(subject)
    if path.suffix.lower() not in SAVED or not is_recording(path):
        chosen = open_subject(subject, choices)
        return chosen.simulation, chosen.name
    if choices != Choices():
        raise InputError(f"{subject}: a recording is shown as it is; options of simulations are not for it")
    recording = read_recording(path)
    return recording, title_of(recording.source, path)
