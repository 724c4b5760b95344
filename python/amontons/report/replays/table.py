"""A recording as a table of text."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...io.files import write_whole
from ...io.recordings.columns import rates_of
from ...simulation.signals import STATE, state_units
from ..complete_files import cell

if TYPE_CHECKING:
    from ...io.recordings.recording import Recording


def write_table(recording: Recording, path: Path) -> None:
    """A row per frame: step, time (s), of each body NAME.x, .y, .z (m), .qw, ..., .vx, ... (m/s), .wx, ...
    (rad/s), the coordinate of each degree of freedom (m, rad) by its name, what `Signals` has: motor efforts,
    controls, reactions, sensors, and NAME.rate of hinges and slides."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    names = [*state_units(recording.model), *recording.signal_units]
    rates = rates_of(recording, names)
    names += rates
    writer.writerow(map(cell, ["step", "time", *names]))
    for frame in range(len(recording)):
        state = np.concatenate([getattr(recording, name)[frame] for name in STATE], axis=1)
        row = np.concatenate([state.ravel(), np.ravel(recording.joint_coordinates[frame])]).tolist()
        row += [] if recording.signals is None else recording.signals[frame].tolist()
        row += [float(recording.qd[frame, place]) for _, place in rates.values()]
        writer.writerow([int(recording.steps[frame]), repr(float(recording.times[frame])), *map(repr, row)])
    write_whole({path: text.getvalue().encode()})
