"""Our own engine, on one thread."""

from __future__ import annotations

from collections.abc import Iterator

import amontons

from .engine import Engine, Motion, Running, Subject


class _Ours:
    def __init__(self, subject: Subject, dt: float, tolerance: float) -> None:
        self.simulation = amontons.Simulation(
            subject.model, dt=dt, tolerance=tolerance, on_failure="ignore", threads=1
        )

    def advance(self, steps: int) -> None:
        self.simulation.run(steps * self.simulation.dt)

    def close(self) -> None:
        pass

    def motion(self) -> Motion:
        s = self.simulation.state
        return Motion(
            s.positions.copy(), s.orientations.copy(), s.linear_velocities.copy(), s.angular_velocities.copy()
        )


def _engine(tolerance: float) -> Engine:
    def start(subject: Subject, dt: float) -> Running:
        return _Ours(subject, dt, tolerance)

    return Engine(f"amontons, {tolerance:.0e}".replace("e-0", "e-"), tolerance != 1e-6, start)


def engines() -> Iterator[Engine]:
    """The default tolerance, and one that is enough to look at."""
    yield _engine(1e-6)
    yield _engine(1e-3)
