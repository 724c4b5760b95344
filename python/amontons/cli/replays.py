"""Outputs of `export` for a recording: a page, pictures, movies, a scene of USD, a table."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from ..io.files import existing, writable
from ..io.recordings import is_recording, read_recording
from .common import progress

if TYPE_CHECKING:
    from ..report.picture import View

PANEL = "Files made from a recording"


def _path(help: str) -> typer.models.OptionInfo:
    return typer.Option(metavar="FILE", help=help, rich_help_panel=PANEL)


Html = Annotated[Path | None, _path("Web page with a play bar, in one file that needs no network.")]
Png = Annotated[Path | None, _path("Pictures at --times (PNG).")]
Mp4 = Annotated[Path | None, _path("Movie (needs ffmpeg).")]
Gif = Annotated[Path | None, _path("Animation (.gif or .webp).")]
Usd = Annotated[Path | None, _path("USD scene (.usd, .usda or .usdc; needs usd-core).")]
Csv = Annotated[Path | None, _path("Poses, velocities and joint coordinates, one row per frame.")]
Times = Annotated[
    str | None,
    typer.Option(
        metavar="T,...",
        help="Times of the pictures of --png (s); default: the last frame.",
        rich_help_panel=PANEL,
    ),
]
Size = Annotated[
    str, typer.Option(metavar="WxH", help="Size of pictures and movies (pixels).", rich_help_panel=PANEL)
]
Fps = Annotated[float, typer.Option(help="Frames per second of movies and pages.", rich_help_panel=PANEL)]
Speed = Annotated[
    float, typer.Option(help="Playback speed: simulated time over real time.", rich_help_panel=PANEL)
]
SUFFIXES = {
    "html": (".html", ".htm"), "png": (".png",), "mp4": (".mp4",), "gif": (".gif", ".webp"),
    "usd": (".usd", ".usda", ".usdc"), "csv": (".csv",),
}  # fmt: skip


@dataclass(frozen=True)
class Wanted:
    """The files to make by option, and how they look."""

    files: dict[str, Path | None]
    times: str | None
    size: str
    fps: float
    speed: float
    view: View

    @property
    def any(self) -> bool:
        return any(path is not None for path in self.files.values())


def export_recording(subject: str, wanted: Wanted) -> list[Path]:
    """Make the files that are wanted of a recording; they are returned. Raises InputError, FileError."""
    from ..report.replays.film import Shot, write_animation, write_movie, write_pictures
    from ..report.replays.table import write_table
    from ..report.replays.usd import write_usd

    path = existing(subject, "a recording")
    if not is_recording(path):
        options = ", ".join(f"--{name}" for name, file in wanted.files.items() if file is not None)
        raise InputError(
            f"{path}: is no recording, which {options} need; make one with amontons run ... --record FILE.h5"
        )
    files = {name: _checked(name, file) for name, file in wanted.files.items() if file is not None}
    width, height = _size(wanted.size)
    shot = Shot(width, height, wanted.view, wanted.fps, wanted.speed)
    with read_recording(path) as recording:
        if not len(recording):
            raise InputError(f"{path}: the recording has no frames")
        times = _times(wanted.times, float(recording.times[-1]))
        pictures = len(recording)
        makers: dict[str, Callable[[Path, Callable[[str], None]], object]] = {
            "html": lambda file, _: _page()(
                recording, file, fps=shot.fps, speed=shot.speed, forces=bool(shot.view.forces)
            ),
            "png": lambda file, _: write_pictures(recording, file, times, shot),
            "mp4": lambda file, tell: write_movie(recording, file, shot, tell),
            "gif": lambda file, tell: write_animation(recording, file, shot, tell),
            "usd": lambda file, _: write_usd(recording, file),
            "csv": lambda file, _: write_table(recording, file),
        }
        written: list[Path] = []
        for name, file in files.items():
            with progress(pictures) as tell:
                made = makers[name](file, tell)
            written += made if isinstance(made, list) else [file]
    return written


def _page() -> Callable[..., None]:
    from ..viewer.page import write_page

    return write_page


def _checked(name: str, file: Path) -> Path:
    if file.suffix.lower() not in SUFFIXES[name]:
        raise InputError(f"--{name} {file}: give a name that ends in {' or '.join(SUFFIXES[name])}")
    return writable(file)


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch("([0-9]{1,9})x([0-9]{1,9})", text.lower())
    if found is None:
        raise InputError(f"--size {text:.40}: write WIDTHxHEIGHT in pixels, as in 960x540")
    return int(found[1]), int(found[2])


def _times(text: str | None, last: float) -> list[float]:
    try:
        return [last] if text is None else [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"--times {text}: write times in seconds, as in 0.5,1,1.5") from None
