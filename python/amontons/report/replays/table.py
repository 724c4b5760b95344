"""A recording as a table of text."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...io.files import write_whole
from ..whole import cell

if TYPE_CHECKING:
    from ...io.recordings.recording import Recording

PARTS = {
    "positions": ("x", "y", "z"),
    "orientations": ("qw", "qx", "qy", "qz"),
    "linear_velocities": ("vx", "vy", "vz"),
    "angular_velocities": ("wx", "wy", "wz"),
}


def write_table(recording: Recording, path: Path) -> None:
    """A row per frame: step, time (s), of each body NAME.x, .y, .z (m), .qw, ..., .vx, ... (m/s), .wx, ...
    (rad/s), and the coordinate of each degree of freedom (m, rad) by the name of its joint."""
    model = recording.model
    bodies = [body.name or f"body {k}" for k, body in enumerate(model.bodies)]
    header = [
        "step",
        "time",
        *(f"{body}.{part}" for body in bodies for parts in PARTS.values() for part in parts),
    ]
    for k, joint in enumerate(model.joints):
        name = joint.name or f"joint {k}"
        several = len(joint.dofs) > 1
        header += [dof.name or (f"{name}.{d}" if several else name) for d, dof in enumerate(joint.dofs)]
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(map(cell, header))
    for frame in range(len(recording)):
        state = np.concatenate([getattr(recording, name)[frame] for name in PARTS], axis=1)
        coordinates = recording.joint_coordinates[frame]
        row = [*state.ravel().tolist(), *np.ravel(coordinates).tolist()]
        writer.writerow([int(recording.steps[frame]), repr(float(recording.times[frame])), *map(repr, row)])
    write_whole({path: text.getvalue().encode()})
