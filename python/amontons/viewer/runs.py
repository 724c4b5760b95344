"""The subject of a page: a running simulation, or a recording."""

from __future__ import annotations

import time
from collections import deque
from typing import Protocol

import numpy as np

from ..checks import Array, positive
from ..errors import InputError
from ..io.recordings.recording import Recording
from ..model.model import Model
from ..simulation.simulation import Simulation
from ..simulation.step_report import Table, energy
from .spring import Spring

HISTORY = 600
"""Steps that the plots show."""
SERIES = ("time", "residual", "iterations", "energy", "contacts", "real-time factor")
"""Plotted values: time (s), energy (J), and the pace, simulated time over wall-clock time of each step."""
SHARE = 0.8
"""Share of the time between two pictures for steps, before the page is served."""


class Run(Protocol):
    """The subject of a page."""

    model: Model
    playing: bool
    speed: float
    """simulated over real time"""
    achieved: float
    """the same as it came out, a mean over about the last second"""

    @property
    def time(self) -> float: ...
    @property
    def positions(self) -> Array: ...
    @property
    def orientations(self) -> Array: ...
    @property
    def linear_velocities(self) -> Array: ...
    @property
    def angular_velocities(self) -> Array: ...
    @property
    def contacts(self) -> Table: ...

    @property
    def history(self) -> Array:
        """(n, 6) of the last steps, the newest at the end: what SERIES names."""

    def advance(self, elapsed: float, period: float) -> None:
        """Play for `elapsed` seconds, and take at most a part of `period` for it."""

    def step(self) -> None:
        """The next step or frame."""

    def reset(self) -> None:
        """Back to the beginning."""


class LiveRun:
    """A simulation that goes on; what changes it are its owner's calls alone, one after the other."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation, self.model = simulation, simulation.model
        self._history: deque[tuple[float, ...]] = deque(maxlen=HISTORY)
        self.playing, self.speed, self.achieved = False, 1.0, 0.0
        self.spring = Spring(simulation)
        simulation.before_step.append(self.spring.before_step)
        self._start = simulation._core.snapshot()
        self._owed = 0.0  # simulated time that the clock is ahead by (s)

    @property
    def time(self) -> float:
        return self.simulation.time

    @property
    def positions(self) -> Array:
        return self.simulation.state.positions

    @property
    def orientations(self) -> Array:
        return self.simulation.state.orientations

    @property
    def linear_velocities(self) -> Array:
        return self.simulation.state.linear_velocities

    @property
    def angular_velocities(self) -> Array:
        return self.simulation.state.angular_velocities

    @property
    def contacts(self) -> Table:
        return self.simulation.contacts

    @property
    def history(self) -> Array:
        return np.array(self._history, dtype=np.float64).reshape(-1, len(SERIES))

    def advance(self, elapsed: float, period: float) -> None:
        end = time.perf_counter() + SHARE * period
        dt, begin = self.simulation.dt, self.time
        self._owed += self.speed * elapsed
        while self._owed >= dt * (1 - 1e-9):  # rounding of the sum
            self.step()
            self._owed -= dt
            if time.perf_counter() >= end:
                self._owed = min(self._owed, dt)  # what cannot be caught up with is dropped
                break
        self.achieved = mean_speed(self.achieved, self.time - begin, elapsed)

    def step(self) -> None:
        report = self.simulation.step()
        pace = self.simulation.dt / max(report.timings.total, 1e-9)
        row = (report.time, report.residual, report.iterations, report.energy, report.contacts, pace)
        self._history.append(row)

    def reset(self) -> None:
        """As it was when it was first shown, with the present options."""
        self.spring.release()
        self.simulation._core.restore(self._start)
        self.simulation._contacts = None
        self._history.clear()
        self._owed = self.achieved = 0.0

    def close(self) -> None:
        """Leave the simulation to its user."""
        self.spring.release()
        self.simulation.before_step.remove(self.spring.before_step)


class ReplayRun:
    """A recording, frame by frame."""

    def __init__(self, recording: Recording) -> None:
        if not len(recording):
            raise InputError(
                f"{recording.path}: the recording has no frames; record with after_step=recorder"
            )
        self.recording, self.model = recording, recording.model
        self.playing, self.speed, self.achieved = False, 1.0, 0.0
        self.frame = 0
        self._clock = float(recording.times[0])
        self._last_row = np.searchsorted(recording.reports["time"], recording.times + 1e-9) - 1

    @property
    def history(self) -> Array:
        """Values of the steps up to the frame."""
        last = int(self._last_row[self.frame]) + 1
        rows = self.recording.reports[max(0, last - HISTORY) : last]
        columns = [rows[name] for name in ("time", "residual", "iterations")]
        pace = float(self.recording.options["dt"]) / np.maximum(rows["total"], 1e-9)
        return np.column_stack([*columns, energy(rows), rows["contacts"], pace])

    @property
    def time(self) -> float:
        return float(self.recording.times[self.frame])

    @property
    def positions(self) -> Array:
        return self.recording.positions[self.frame]

    @property
    def orientations(self) -> Array:
        return self.recording.orientations[self.frame]

    @property
    def linear_velocities(self) -> Array:
        return self.recording.linear_velocities[self.frame]

    @property
    def angular_velocities(self) -> Array:
        return self.recording.angular_velocities[self.frame]

    @property
    def contacts(self) -> Table:
        return self.recording.contacts(self.frame)

    def advance(self, elapsed: float, period: float) -> None:
        times = self.recording.times
        before = self.time
        self._clock += self.speed * elapsed
        self.frame = int(np.clip(np.searchsorted(times, self._clock, side="right") - 1, 0, len(times) - 1))
        self.achieved = mean_speed(self.achieved, self.time - before, elapsed)
        if self.frame == len(times) - 1:
            self.playing = False

    def step(self) -> None:
        self.seek(self.frame + 1)

    def seek(self, frame: int) -> None:
        """Go to a frame, the nearest that there is."""
        self.frame = min(max(frame, 0), len(self.recording) - 1)
        self._clock = self.time

    def reset(self) -> None:
        self.seek(0)


def pace(speed: object) -> float:
    """A speed, simulated over real time, that can be played: positive and finite."""
    return positive("speed", speed)


def mean_speed(before: float, simulated: float, elapsed: float) -> float:
    """The mean that forgets what is more than about a second ago."""
    part = min(1.0, elapsed)
    return before + part * (simulated / max(elapsed, 1e-6) - before)
