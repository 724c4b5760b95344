"""A friction damper that sines drive: its force beside dry friction of a slide, with and without clearance.

Data: ARTS-Laboratory, Dataset-Friction-Damper-with-Backlash (CC BY-SA 4.0); rows of time (s), displacement
(inch), force (kip) and velocity (inch/s).
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import amontons
import numpy as np

Array = np.ndarray[Any, Any]
INCH, KIP = 0.0254, 4448.2216  # m, N
MASS = 1.0  # kg, of rod and band: their inertia is below a thousandth of the friction
CLEARANCES = tuple(np.round(np.arange(0.0, 26e-3, 2e-3), 4).tolist())  # m


@dataclass(frozen=True)
class Sines:
    """A test: samples (n,) of time (s), displacement (m), force (N), and the samples of a cycle."""

    name: str
    time: Array
    displacement: Array
    force: Array
    cycle: int

    def part(self, first: int, last: int) -> Sines:
        """Whole cycles."""
        cut = slice(first * self.cycle, last * self.cycle)
        return Sines(self.name, self.time[cut], self.displacement[cut], self.force[cut], self.cycle)

    @property
    def cycles(self) -> int:
        return len(self.time) // self.cycle

    def scatter(self) -> float:
        """Rms difference of a cycle from the mean of all cycles, at the same phase (N)."""
        cycles = self.force[: self.cycles * self.cycle].reshape(self.cycles, self.cycle)
        return float(np.sqrt(np.mean((cycles - cycles.mean(axis=0)) ** 2)))


def read_sines(path: Path) -> Sines:
    """A test whose name begins with its frequency, as 0.5Hz30lb..."""
    found = re.match(r"([\d.]+)Hz", path.name)
    if found is None:
        raise amontons.FileError(f"{path.name}: the name tells no frequency, as 0.5Hz...")
    rows = np.array(json.loads(path.read_text())["data"])
    cycle = round(1 / (float(found[1]) * (rows[1, 0] - rows[0, 0])))
    return Sines(path.stem, rows[:, 0], INCH * rows[:, 1], KIP * rows[:, 2], cycle)


def damper(friction: float, clearance: float) -> amontons.Model:
    """A rod that a motor moves, and a band with dry friction to the ground that it takes along; between them
    a slide with limits half the clearance to each side, or none."""
    builder = amontons.ModelBuilder(gravity=(0, 0, 0))
    x, motor = (1, 0, 0), amontons.Motor("position")
    rod = builder.add_body("rod", mass=MASS, inertia=(1, 1, 1))
    if not clearance:
        builder.add_prismatic_joint(rod, axis=x, name="rod", motor=motor, friction=friction)
        return builder.build()
    band = builder.add_body("band", mass=MASS, inertia=(1, 1, 1))
    builder.add_prismatic_joint(rod, axis=x, name="rod", motor=motor)
    builder.add_prismatic_joint(band, axis=x, name="band", friction=friction)
    builder.add_prismatic_joint(band, rod, axis=x, name="clearance", limits=(-clearance / 2, clearance / 2))
    return builder.build()


def forces(sines: Sines, friction: float, clearance: float) -> Array:
    """Force of the motor that moves the rod as measured (N), at each sample but the last."""
    dt = float(sines.time[1] - sines.time[0])
    simulation = amontons.Simulation(damper(friction, clearance), dt=dt, on_failure="ignore")
    found = []
    for target in sines.displacement[1:] - sines.displacement[0]:
        simulation.set_control("rod", float(target))
        simulation.step()
        found.append(simulation.forces.effort("rod").motor)
    return np.array(found)


def error(sines: Sines, friction: float, clearance: float) -> float:
    """Rms difference from the measured force after the first cycle, in which the band finds its side (N)."""
    ours = forces(sines, friction, clearance)
    late = slice(sines.cycle, None)
    return float(np.sqrt(np.mean((ours[late] - sines.force[1:][late]) ** 2)))


def fast(sines: Sines) -> Array:
    """Samples at which the rod moves by more than 0.8 of its greatest speed: there the band slides."""
    speed = np.abs(np.gradient(sines.displacement, sines.time))
    return speed > 0.8 * np.percentile(speed, 99)


def rows(folder: Path, quick: bool) -> Iterator[dict[str, Any]]:
    """Friction from the fast part of the first half of the cycles, clearance from their errors."""
    for path in sorted(folder.glob("*.json")):
        sines = read_sines(path)
        half = sines.cycles // 2
        fitting, testing = sines.part(0, half), sines.part(half, sines.cycles)
        friction = float(np.median(np.abs(fitting.force[fast(fitting)])))
        clearances = CLEARANCES[:: 6 if quick else 1]
        clearance = min(clearances, key=lambda p: error(fitting, friction, p))
        size = float(np.sqrt(np.mean(testing.force**2)))
        for model, gap in (("dry friction", 0.0), ("dry friction and clearance", clearance)):
            yield {
                "test": sines.name, "model": model, "friction_N": friction, "clearance_mm": 1e3 * gap,
                "rms_error_percent": 100 * error(testing, friction, gap) / size,
                "scatter_percent": 100 * testing.scatter() / size, "rms_force_N": size,
            }  # fmt: skip
