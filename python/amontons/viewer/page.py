"""A recording as one file with a play bar, which needs nothing but a browser."""

from __future__ import annotations

import base64
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import Array
from ..escapes import visible
from ..io.files import write_whole
from ..io.recordings.recording import Recording
from ..model.model import Model
from ..report.batches import visuals_of
from ..report.extents import Balls
from ..report.force_lines import Forces, force_lines, forces_of, width_per_newton
from ..report.picture import Frame, require_contacts
from ..report.replays.film import movie_frames
from .gate import Gate
from .network import Network
from .stage import Stage
from .title import title_of, with_title
from .viewer import serve, stop

DIGITS = 12
"""Bits of the fraction of the poses in the file: neighbouring frames then compress to a third."""
FORCE_DIGITS = 3
"""Digits of the forces that a click shows."""
CLOCK = "/frame"
"""A node that is not seen, whose x is the number of the frame: what a click tells is that of the frame."""
SCRIPT = Path(__file__).with_name("replay.js")
PLACE = "/*amontons*/"


def write_page(
    recording: Recording, path: Path, *, fps: float = 25.0, speed: float = 1.0, forces: bool = False
) -> None:
    """A page with the scene, that plays `fps` pictures per second at `speed` times real time.

    A click on a body shows its name, its mass and its contacts in the frame.

    forces: draw contact forces as lines between bodies of glass, as thick as they are large.

    Raises InputError if forces are requested that were not recorded.
    """
    gate, title = Gate("127.0.0.1"), title_of(recording.source, recording.path)
    server = serve("127.0.0.1", 8080, title, gate)
    try:
        stage = Stage(server, recording.model)
        stage.frame(np.array([recording.positions[k] for k in (0, len(recording) // 2)]))
        stage.fade(forces)
        frames = movie_frames(recording.times, fps, speed).tolist()
        reel = _Reel(recording, server, stage, sorted(set(frames)), forces)
        reel.show(frames[0])
        film = server.get_scene_serializer()
        last = frames[0]
        for k in frames[1:]:
            film.insert_sleep(1 / fps)
            if k != last:
                reel.show(k)
            last = k
        film.insert_sleep(1 / fps)
        page = with_title(film.as_html(), title)
        end = page.index("</body>")
        script = SCRIPT.read_text(encoding="utf-8").replace(PLACE, _as_json(reel.told(stage)))
        write_whole({path: f"{page[:end]}<script>{script}</script>{page[end:]}".encode()})
    finally:
        stop(server, gate)


class _Reel:
    """Shows frames on the page, and remembers what touched what in them."""

    def __init__(
        self, recording: Recording, server: Any, stage: Stage, frames: list[int], forces: bool
    ) -> None:
        self._recording, self._stage = recording, stage
        self._clock = server.scene.add_frame(CLOCK, visible=False)
        self._number = {k: n for n, k in enumerate(frames)}
        self._contacts: dict[int, list[Any]] = {}
        tables = {k: recording.contacts(k) for k in frames}
        self._tables, self._network = tables, None
        if forces:
            some = [Frame(0.0, np.zeros(0), np.zeros(0), table) for table in tables.values()]
            require_contacts(some, bool(recording.reports["contacts"].any()), str(recording.path))
            balls = Balls.of(visuals_of(recording.model))
            self._width = width_per_newton(list(tables.values()), balls.median(balls.thickness))
            most = max(2 * len(forces_of(table).forces) for table in tables.values())
            self._network = Network(server, f"{stage.root}/force network", room=most)

    def show(self, frame: int) -> None:
        recording, model = self._recording, self._recording.model
        positions, orientations = _poses(recording, frame, model.length)
        self._stage.move(positions, orientations)
        self._clock.position = (float(self._number[frame]), 0.0, 0.0)
        table = self._tables[frame]
        acting = forces_of(table)
        self._contacts[self._number[frame]] = _pairs(acting)
        if self._network is not None:
            self._network.show(force_lines(model, positions, orientations, table, self._width))

    def told(self, stage: Stage) -> dict[str, Any]:
        """Data for the script of the page."""
        model = self._recording.model
        return {
            "bodies": [[_name(model, k), _mass(body)] for k, body in enumerate(model.bodies)],
            "instances": {name: bodies.tolist() for name, bodies in stage.clickable.items()},
            "times": [float(f"{self._recording.times[k]:.6g}") for k in self._number],
            "contacts": self._packed_contacts(),
            "clock": CLOCK,
        }

    def _packed_contacts(self) -> str | None:
        """By frame, compressed; None where contacts were left out of the recording."""
        rows = [self._contacts[n] for n in range(len(self._number))]
        if not any(rows) and self._recording.reports["contacts"].any():
            return None
        return base64.b64encode(zlib.compress(json.dumps(rows, separators=(",", ":")).encode(), 9)).decode()


def _pairs(acting: Forces) -> list[Any]:
    """For each pair the bodies, the force (N) and the state, without repetitions."""
    columns = (acting.body_a, acting.body_b, acting.forces, acting.states)
    rows = zip(*(column.tolist() for column in columns), strict=True)
    return [[a, b, float(f"{force:.{FORCE_DIGITS}g}"), state] for a, b, force, state in rows]


def _name(model: Model, body: int) -> str:
    return visible(model.bodies[body].name or f"body {body}")


def _mass(body: Any) -> str:
    return f"{body.mass:.4g} kg" if body.motion == "dynamic" else str(body.motion)


def _as_json(value: Any) -> str:
    """JSON within a script: no name in it can end the script."""
    return json.dumps(value, separators=(",", ":")).replace("<", "\\u003c")


def _poses(recording: Recording, frame: int, length: float) -> tuple[Array, Array]:
    """Rounded far below what is seen: positions to 2^-12 of a body, rotations to 2^-12."""
    grain = 2.0 ** np.floor(np.log2(length) - DIGITS)
    positions = np.round(recording.positions[frame] / grain) * grain
    return positions, np.round(recording.orientations[frame] * 2**DIGITS) / 2**DIGITS
