"""A recording as pictures: single ones, and movies."""

from __future__ import annotations

import io
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...checks import Array
from ...errors import FileError, InputError
from ...io.files import write_whole
from ..picture import Frame, Picture, View, require_contacts

if TYPE_CHECKING:
    from ...io.recordings.recording import Recording

SURVEYED = 12
"""Frames that say what all pictures must hold."""
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Shot:
    """How a recording is pictured."""

    width: int = 960
    height: int = 540
    view: View = field(default_factory=View)
    fps: float = 25.0
    """pictures per second of a movie"""
    speed: float = 1.0
    """of a movie: simulated over shown time"""

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            if not 16 <= getattr(self, name) <= 8192:
                raise InputError(f"{name} = {getattr(self, name)}; it must be from 16 to 8192 pixels")
        for name in ("fps", "speed"):
            if not 0 < getattr(self, name) < float("inf"):
                raise InputError(f"{name} = {getattr(self, name):g}; it must be positive and finite")


class Film:
    """Draws frames of a recording, all of one width, which holds what moves unless the view says it."""

    def __init__(self, recording: Recording, shot: Shot) -> None:
        if not len(recording):
            raise InputError(f"{recording.path}: the recording has no frames")
        self.recording, self.shot = recording, shot
        self._picture = Picture(recording.model, shot.view)
        survey = np.unique(np.linspace(0, len(recording) - 1, SURVEYED).astype(int))
        some = [self.frame(k) for k in survey.tolist()]
        if shot.view.forces:
            require_contacts(some, bool(recording.reports["contacts"].any()), str(recording.path))
        self._framing = self._picture.framing(some, shot.width / shot.height)

    def frame(self, k: int) -> Frame:
        """One moment."""
        r = self.recording
        contacts = r.contacts(k) if self.shot.view.forces else None
        return Frame(float(r.times[k]), r.positions[k], r.orientations[k], contacts)

    def image(self, k: int) -> NDArray[np.uint8]:
        """(height, width, 3), the highest row first."""
        return self._picture.draw(self.frame(k), self._framing, self.shot.width, self.shot.height)

    def frames(self) -> Array:
        """The frame of each picture of a movie."""
        return movie_frames(self.recording.times, self.shot.fps, self.shot.speed)


def movie_frames(times: Array, fps: float, speed: float) -> Array:
    """The last frame that has begun at the time of each picture; the last picture is the last frame."""
    count = max(1, round((times[-1] - times[0]) / speed * fps)) + 1
    wanted = times[0] + speed / fps * np.arange(count)
    frames = np.searchsorted(times, wanted + 1e-9, side="right") - 1
    return np.minimum(frames, len(times) - 1)


def write_pictures(recording: Recording, path: Path, times: Sequence[float], shot: Shot) -> list[Path]:
    """A PNG of the frame nearest to each time (s); of several, the times are put into the names."""
    from PIL import Image

    film = Film(recording, shot)
    first, last = float(recording.times[0]), float(recording.times[-1])
    slack = 0.5 * (last - first) / max(len(recording) - 1, 1) + 1e-9
    for time in times:
        if not first - slack <= time <= last + slack:
            raise InputError(
                f"t = {time:g} s is not recorded; the recording goes from {first:g} to {last:g} s"
            )
    paths = [path if len(times) == 1 else path.with_stem(f"{path.stem}-{time:g}s") for time in times]
    made = {}
    for path, time in zip(paths, times, strict=True):
        data = io.BytesIO()
        Image.fromarray(film.image(recording.frame_at(time))).save(data, format="PNG")
        made[path] = data.getbuffer()
    write_whole(made, own=set(made) if len(times) > 1 else ())
    return paths


def write_animation(recording: Recording, path: Path, shot: Shot, tell: Progress) -> None:
    """A GIF, or a WebP, which is smaller: the pictures of a movie, over and over."""
    from PIL import Image

    images = [Image.fromarray(image) for image in _images(Film(recording, shot), tell)]
    kind = path.suffix.lower().lstrip(".").upper()
    options = {"quality": 60, "method": 4} if kind == "WEBP" else {"optimize": True}
    data = io.BytesIO()
    images[0].save(
        data,
        format=kind,
        save_all=True,
        append_images=images[1:],
        duration=round(1000 / shot.fps),
        loop=0,
        **options,
    )
    write_whole({path: data.getbuffer()})


def write_movie(recording: Recording, path: Path, shot: Shot, tell: Progress) -> None:
    """An MP4 (H.264) by way of ffmpeg."""
    if shot.width % 2 or shot.height % 2:
        raise InputError(f"{shot.width} x {shot.height}: MP4 has even numbers of pixels")
    program = shutil.which("ffmpeg")
    if program is None:
        raise InputError(
            "--mp4 needs ffmpeg on the path; install it, or write --gif FILE.webp, which needs nothing"
        )
    film = Film(recording, shot)
    size = f"{shot.width}x{shot.height}"
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{shot.fps:g}", "-i", "-"]
    made = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "20", "-movflags", "+faststart", "-f", "mp4"]
    with tempfile.TemporaryDirectory() as folder:
        temporary = Path(folder) / "movie.mp4"
        command = [program, "-y", "-loglevel", "error", *source, *made, str(temporary)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdin is not None
            assert process.stderr is not None
            try:
                for image in _images(film, tell):
                    process.stdin.write(image.tobytes())
                process.stdin.close()
            except BrokenPipeError:  # it says why below
                pass
            said = process.stderr.read().decode(errors="replace").strip()
        if process.returncode:
            raise FileError(f"{path}: ffmpeg failed: {said.splitlines()[-1] if said else process.returncode}")
        write_whole({path: temporary.read_bytes()})


def _images(film: Film, tell: Progress) -> Iterator[NDArray[np.uint8]]:
    """A frame that is shown twice uses the same picture."""
    last, image = -1, None
    for k in film.frames().tolist():
        tell(f"t = {film.recording.times[k]:.3g} s")
        if image is None or k != last:
            last, image = k, film.image(k)
        yield image
