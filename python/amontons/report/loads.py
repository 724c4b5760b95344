"""Loads of joints and contacts: of recordings, as CSV files and as tables on the terminal."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
from rich.table import Table

from ..errors import InputError
from ..io.files import write_whole
from ..io.recordings.recording import Recording
from ..simulation.determinacy import Pose, determined
from ..simulation.loads import Loads, in_frames_b
from ..simulation.signals import Signals
from .complete_files import csv_bytes


def loads_of(recording: Recording) -> Loads:
    """The loads of a recording, of its frames only; efforts of degrees of freedom are not in it.

    A frame stands for the time since the frame before it. Raises InputError if the recording has no reactions
    or only one frame.
    """
    model, signals = recording.model, Signals(recording.model)
    loads, dt = Loads(model, efforts=False), float(recording.options["dt"])
    if list(signals.units) != list(recording.signal_units):
        raise InputError(f"{recording.path}: has no reactions of joints; record without --no-record-signals")
    frames = np.flatnonzero(recording.steps[...] > 0)
    if len(frames) < 2:
        raise InputError(f"{recording.path}: has {len(frames)} frames with forces; loads need two or more")
    times = recording.times
    for k in frames:
        pose = Pose(
            recording.positions[k], recording.orientations[k], recording.linear_velocities[k],
            recording.angular_velocities[k], recording.joint_coordinates[k],
        )  # fmt: skip
        contacts = recording.contacts(k)
        reactions = np.asarray(recording.signals[k])[signals.reactions].reshape(-1, 6)  # type: ignore[index]
        before = times[k - 1] if k else times[k] - (times[1] - times[0])
        values = in_frames_b(model, pose, reactions, dt).ravel()
        loads.add(values, contacts, times[k] - dt, times[k] - before)
        if loads.changed(contacts, np.zeros(0)) or k == frames[-1]:
            loads.judge(determined(model, pose, contacts))
    return loads


def write_loads(loads: Loads, path: Path) -> None:
    """A CSV file of both tables, a row for each component."""
    header, *rows = loads.rows()
    write_whole({path: csv_bytes(header, rows)}, own={path})


def loads_table(loads: Loads) -> Table:
    """Both tables for the terminal, a line for each component."""
    table = Table(box=None, pad_edge=False)
    for name in ("load", "unit", "peak", "time (s)", "mean", "rms", "impulse (unit s)", ""):
        table.add_column(name, justify="left" if name in ("load", "unit", "") else "right", no_wrap=True)
    for row in itertools.islice(loads.rows(), 1, None):
        _, name, component, unit, *values, known = row
        cells = [f"{value:.4g}" for value in values]
        table.add_row(f"{name}.{component}", unit, *cells, "" if known else "not determined")
    return table
