"""Supports that move: ground motions of files and pulses, and what blocks do on them."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from ...checks import Array, chosen, entries, finite, positive, reals
from ...errors import FileError, InputError
from ...io.files import existing
from ...model.assembly import Assembly
from ...simulation.simulation import Simulation

UNITS = {"m/s2": 1.0, "g": 9.80665, "cm/s2": 0.01}
"""m/s^2 per unit of a record"""
FALLEN = 0.5
"""Displacement over the size of a block, relative to the supports, from which it has fallen"""


@dataclass(frozen=True, eq=False)
class GroundMotion:
    """Accelerations of the supports over time, linear between the given times, and at rest before and after.

    Raises InputError for times that do not increase, and shapes that do not fit.

    >>> from amontons.studies import GroundMotion
    >>> GroundMotion([0, 1, 1.5], [(1, 0, 0), (1, 0, 0), (0, 0, 0)]).duration
    1.5
    """

    times: Array
    """(k,) s, increasing"""
    accelerations: Array
    """(k, 3) m/s^2, world axes"""

    def __post_init__(self) -> None:
        times = finite("ground motion: times", reals("ground motion: times", self.times)).astype(float)
        values = finite("ground motion: accelerations", reals("accelerations", self.accelerations)).astype(
            float
        )
        if times.ndim != 1 or len(times) < 2 or np.any(np.diff(times) <= 0):
            raise InputError("ground motion: times must be two or more increasing numbers (s)")
        if values.shape != (len(times), 3):
            raise InputError(
                f"ground motion: accelerations have shape {values.shape}; give ({len(times)}, 3)"
            )
        object.__setattr__(self, "times", times - times[0])
        object.__setattr__(self, "accelerations", values)

    @property
    def duration(self) -> float:
        """s"""
        return float(self.times[-1])

    def displacement(self, times: Array) -> Array:
        """(n, 3) of the supports at the given times (m); the velocity at the end of the record stays."""
        step = np.diff(self.times)[:, None]
        a, b = self.accelerations[:-1], self.accelerations[1:]
        speed = np.concatenate((np.zeros((1, 3)), np.cumsum(step * (a + b) / 2, axis=0)))
        place = np.cumsum(speed[:-1] * step + step**2 * (2 * a + b) / 6, axis=0)
        place = np.concatenate((np.zeros((1, 3)), place))
        k = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(step) - 1)
        since = np.clip(times - self.times[k], 0.0, None)
        inside = np.minimum(since, step[k, 0])[:, None]
        slope = (b[k] - a[k]) / step[k]
        moved = place[k] + speed[k] * inside + a[k] * inside**2 / 2 + slope * inside**3 / 6
        return moved + speed[k + 1] * (since[:, None] - inside)


def pulse(
    acceleration: tuple[float, float, float], duration: float, *, shape: str = "rectangle"
) -> GroundMotion:
    """One pulse of the supports: rectangle, half-sine or sine, of the given peak (m/s^2) and duration (s).

    A rectangle rises within a thousandth of its duration. Raises InputError.

    >>> from amontons.studies import pulse
    >>> pulse((3, 0, 0), 0.2, shape="sine").duration
    0.2
    """
    peak, duration = np.array(entries("acceleration", acceleration, 3)), positive("duration", duration)
    chosen("shape", shape, {"rectangle": True, "half-sine": True, "sine": True})
    if shape == "rectangle":
        edge = 1e-3 * duration
        return GroundMotion(np.array([0, edge, duration, duration + edge]), np.outer((0, 1, 1, 0), peak))
    times = np.linspace(0, duration, 201)
    turns = 1.0 if shape == "half-sine" else 2.0
    return GroundMotion(times, np.outer(np.sin(turns * math.pi * times / duration), peak))


def read_ground_motion(path: str | PathLike[str], *, unit: str = "m/s2") -> GroundMotion:
    """A record as CSV: time (s) and accelerations along x, or x and y, or x, y and z; a header may be there.

    unit: of the accelerations, m/s2, cm/s2 or g. Raises FileNotFoundError, FileError with the line,
    InputError.

    >>> from pathlib import Path
    >>> from amontons.studies import read_ground_motion
    >>> written = Path("record.csv").write_text("t,ax\\n0,0\\n0.5,1\\n1,0\\n")
    >>> read_ground_motion("record.csv").duration
    1.0
    """
    chosen("unit", unit, dict.fromkeys(UNITS, True))
    path = existing(path, "a ground motion")
    rows: list[list[float]] = []
    with Path(path).open(newline="", encoding="utf-8", errors="replace") as file:
        for number, words in enumerate(csv.reader(file), start=1):
            if not any(word.strip() for word in words):
                continue
            try:
                rows.append([float(word) for word in words])
            except ValueError:
                if rows or number > 1:
                    raise FileError(
                        f"{path}, line {number}: {words[:4]} are no numbers; give time, ax, ay, az"
                    ) from None
                continue  # the header
            if not 2 <= len(rows[-1]) <= 4 or len(rows[-1]) != len(rows[0]):
                raise FileError(
                    f"{path}, line {number}: has {len(words)} columns; give time and 1 to 3 accelerations"
                )
    if len(rows) < 2:
        raise FileError(f"{path}: has {len(rows)} rows of numbers; a record has two or more")
    table = np.array(rows)
    values = np.zeros((len(table), 3))
    values[:, : table.shape[1] - 1] = UNITS[unit] * table[:, 1:]
    return GroundMotion(table[:, 0], values)


@dataclass(frozen=True, eq=False)
class Shaking:
    """Blocks on supports that moved; made by `shake`.

    >>> from amontons.studies import pulse, read_assembly, shake
    >>> arch = read_assembly(examples.path("arch.obj"), unit="m", up="z")
    >>> shaking = shake(arch, pulse((0.1, 0, 0), 0.02), after=0.02)
    >>> len(shaking.names) == shaking.displacements.shape[1]
    True
    """

    times: Array
    """(k,) after each step (s)"""
    displacements: Array
    """(k, n) distance of each free block from its place on the supports, over its size"""
    names: tuple[str, ...]
    """(n,) of the free blocks"""
    simulation: Simulation
    """after the last step"""

    @property
    def fallen(self) -> tuple[str, ...]:
        """Names of the blocks that moved by more than half their size."""
        worst = self.displacements.max(axis=0, initial=0.0)
        return tuple(name for name, far in zip(self.names, worst, strict=True) if far > FALLEN)


def shake(assembly: Assembly, motion: GroundMotion, *, dt: float = 2e-3, after: float = 2.0) -> Shaking:
    """Simulate the blocks while their supports follow a ground motion, and `after` seconds (s) more.

    dt: time step (s). The supports move from and to where the record puts them in each step; after it they
    keep its last velocity. Raises InputError.

    >>> from amontons.studies import pulse, read_assembly, shake
    >>> arch = read_assembly(examples.path("arch.obj"), unit="m", up="z")
    >>> bool(shake(arch, pulse((0.1, 0, 0), 0.02), after=0.02).displacements.max() < 0.01)
    True
    """
    if not isinstance(assembly, Assembly):
        raise InputError("shake: give an Assembly, as read_assembly makes")
    dt = positive("dt", dt)
    model = assembly.model(moving_supports=True)
    simulation = Simulation(model, dt=dt, on_failure="ignore")
    supports = [model.body_index(name) for name in assembly.supports]
    free = [block for block in assembly.blocks if not block.fixed]
    moving = [model.body_index(block.name) for block in free]
    sizes = np.array([block.size for block in free])
    start = simulation.state.positions[moving].copy()
    steps = max(1, math.ceil((motion.duration + after) / dt))
    times = dt * np.arange(steps + 1)
    ground = motion.displacement(times)
    far = np.zeros((steps, len(free)))
    for k in range(steps):
        simulation.state.linear_velocities[supports] = (ground[k + 1] - ground[k]) / dt
        simulation.step()
        relative = simulation.state.positions[moving] - start - ground[k + 1]
        far[k] = np.linalg.norm(relative, axis=1) / sizes
    return Shaking(times[1:], far, tuple(block.name for block in free), simulation)
