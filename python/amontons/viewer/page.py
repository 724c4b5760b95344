"""A recording as one file with a play bar, which needs nothing but a browser."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..checks import Array
from ..io.files import write_whole
from ..io.recordings.recording import Recording
from ..report.replays.film import movie_frames
from .gate import Gate
from .stage import Stage
from .viewer import serve, stop

DIGITS = 12
"""Bits of the fraction of the poses in the file: neighbouring frames then compress to a third."""


def write_page(recording: Recording, path: Path, *, fps: float = 25.0, speed: float = 1.0) -> None:
    """A page with the scene, that plays `fps` pictures per second at `speed` times real time."""
    gate = Gate("127.0.0.1")
    server = serve("127.0.0.1", 8080, recording.path.stem, gate)
    try:
        model = recording.model
        stage = Stage(server, model)
        stage.frame(recording.positions[0])
        frames = movie_frames(recording.times, fps, speed)
        stage.move(*_poses(recording, 0, model.length))
        film = server.get_scene_serializer()
        last = 0
        for k in frames[1:].tolist():
            film.insert_sleep(1 / fps)
            if k != last:
                stage.move(*_poses(recording, k, model.length))
            last = k
        film.insert_sleep(1 / fps)
        write_whole({path: film.as_html().encode()})
    finally:
        stop(server, gate)


def _poses(recording: Recording, frame: int, length: float) -> tuple[Array, Array]:
    """Rounded far below what is seen: positions to 2^-12 of a body, rotations to 2^-12."""
    grain = 2.0 ** np.floor(np.log2(length) - DIGITS)
    positions = np.round(recording.positions[frame] / grain) * grain
    return positions, np.round(recording.orientations[frame] * 2**DIGITS) / 2**DIGITS
