"""What the simulator must show, at full length: every claim with the figure reached, as a CSV file.

    python benchmarks/physics.py [--quick] [--out FOLDER]

tests/physics checks the same claims on shorter runs; both use the same measurements and scenes.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from time import perf_counter

import amontons
import amontons.scenes
import numpy as np
from amontons.model.turns import conjugate, rotate
from common import ROOT, Row, arguments, fill, with_folders

sys.path.insert(0, str(ROOT / "tests" / "physics"))
import measures as m
from units import ratio_of_motion

G = 9.81


@dataclass
class Figure:
    claim: str
    figure: str
    value: float
    limit: float
    """the value must be below it; a negative one is a bound from below"""
    unit: str = ""

    @property
    def met(self) -> bool:
        return self.value <= self.limit if self.limit >= 0 else self.value >= -self.limit


Figures = Iterator[Figure]


def sliding_cube(scale: float) -> Figures:
    v, mu = 6.0, 0.5
    for h in (1e-2, 5e-3, 1e-3):
        sim = m.simulate("sliding_cube", {"speed": v, "mu": mu}, dt=h)
        z = [sim.state.positions[0, 2]]
        m.run(sim, 1.5, lambda s, _, z=z: z.append(s.state.positions[0, 2]))
        error = abs(sim.state.positions[0, 0] - v * v / (2 * mu * G))
        claim = f"cube at 6 m/s, mu 0.5, h {h * 1e3:g} ms"
        yield Figure(claim, "lift", max(z) - z[0], 1e-9, "m")
        yield Figure(claim, "error of the stopping distance", error, 0.51 * v * h, "m")
    sim = m.simulate("sliding_cube", {"speed": v, "mu": mu}, law="associated", dt=1e-3)
    z = [sim.state.positions[0, 2]]
    m.run(sim, 0.5, lambda s, _: z.append(s.state.positions[0, 2]))
    hop = (mu * v / (1 + mu**2)) ** 2 / (2 * G)
    yield Figure("cube under associated", "hop less 0.294 m", abs(max(z) - z[0] - hop), 2.4e-3, "m")


def ramp(scale: float) -> Figures:
    sim = m.simulate("incline", {"angle": 10.0, "mu": 0.5}, dt=1e-2)
    m.run(sim, 0.1)
    start, duration = np.array(sim.state.positions[0]), 10.0
    m.run(sim, duration)
    creep = float(np.linalg.norm(sim.state.positions[0] - start)) / duration
    yield Figure("block on a 10 degree ramp, mu 0.5, h 10 ms, 10 s", "creep", creep, 1e-12, "m/s")
    mu, h = 0.5, 5e-3
    angle = math.atan(mu) + math.radians(0.5)
    sim = m.simulate("incline", {"angle": math.degrees(angle), "mu": mu}, dt=h)
    m.run(sim, 1.0)
    a = G * (math.sin(angle) - mu * math.cos(angle))
    error = abs(np.linalg.norm(sim.state.linear_velocities[0]) - a)
    yield Figure(
        "ramp 0.5 degrees above the friction angle", "error of the acceleration", error, 1e-4, "m/s^2"
    )


def plates(scale: float) -> Figures:
    for ratio in (1.0, 1e2, 1e4, 1e6):
        result = m.stand(m.simulate("plates", {"ratio": ratio}, dt=1e-2), 10.0 * scale)
        claim = f"B3, 20 plates 1:{ratio:g}, h 10 ms, {10 * scale:g} s"
        limit = math.inf if ratio > 1e4 else 1.0  # 1e6 is shown, not claimed
        yield Figure(claim, "force error", result.force_error, 1e-4 * limit)
        yield Figure(claim, "drift", result.drift, 1e-6 * limit, "m")


def wall(scale: float) -> Figures:
    duration = 5.0 * scale
    sim = m.simulate("wall_at_rest")
    start = np.array(sim.state.positions)
    reports = m.run(sim, duration)
    moved = np.linalg.norm(sim.state.positions - start, axis=1).max()
    claim = f"B4 at rest, {duration:g} s"
    yield Figure(claim, "largest displacement", moved, 1e-4, "m")
    yield Figure(claim, "largest residual", max(r.residual for r in reports), 1e-2)
    yield Figure(
        claim, "wall clock per step", sum(r.timings.total for r in reports) / len(reports), math.inf, "s"
    )
    duration = 0.8 if scale == 1 else 0.4  # the ball strikes after 0.385 s
    result = m.impact(m.simulate("wall"), duration)
    claim = f"B4 impact, h 5 ms, {duration:g} s"
    yield Figure(claim, "momentum error of a step", float(result.momentum_error), 1e-6)
    yield Figure(claim, "energy growth of a step", float(result.energy_growth), 1e-6)
    yield Figure(claim, "deepest penetration", result.penetration, 1e-3, "m")
    yield Figure(claim, "largest residual", result.worst_residual, 1e-2)
    yield Figure(claim, "chain's joint error", result.joint_error, 1e-3, "m")
    yield Figure(claim, "wall clock per step", result.seconds / result.steps, math.inf, "s")


def chain(scale: float) -> Figures:
    duration = 5.0 * scale
    reports = m.run(m.simulate("chain", dt=5e-3), duration)
    claim = f"chain of 100 links, 1000:1, h 5 ms, {duration:g} s"
    yield Figure(claim, "joint error", max(r.joint_error for r in reports), 1e-4, "m")


def ball(scale: float) -> Figures:
    """Dropped by 1 m it rises by e^2 m, or more: its step begins up to v h above the floor."""
    for e in (1.0, 0.9, 0.5):
        for h in (5e-3, 1e-3):
            heights = m.bounce_heights(e, h, 1.3)
            low = int(np.argmin(heights[: round(0.7 / h)]))
            claim = f"ball with restitution {e:g}, h {h * 1e3:g} ms"
            limit = (1 - e * e) * math.sqrt(2 * G) * h + G * h * h / 8 + 1e-9
            yield Figure(claim, "error of the bounce", abs(max(heights[low:]) - e * e), limit, "m")


def four_bar(scale: float) -> Figures:
    duration = 100.0 * scale
    sim = m.simulate("four_bar", {"driven": False, "gravity": 0.0})
    energies: list[float] = []
    reports = m.run(sim, duration, lambda s, r: energies.append(r.energy))
    errors = np.array([r.joint_error for r in reports])
    tenth = len(errors) // 10
    claim = f"four-bar, conservative, {duration:g} s"
    yield Figure(
        claim, "joint error, last tenth over first", errors[-tenth:].max() / errors[:tenth].max(), 1.5
    )
    yield Figure(claim, "joint error", float(errors.max()), 1e-3, "m")
    yield Figure(claim, "relative drift of energy", abs(energies[-1] / energies[0] - 1), 0.05)
    yield Figure(claim, "out-of-plane motion", float(np.abs(sim.state.positions[:, 1]).max()), 1e-9, "m")


def smooth(scale: float) -> Figures:
    for name, made in m.SMOOTH.items():
        claim = f"{name} under gravity, h 5 ms, {10 * scale:g} s"
        yield Figure(
            claim, "energy lost or gained, of the peak", abs(m.energy_loss(made(5e-3), 10 * scale)), 1e-3
        )
    total, _ = m.energies(m.rolling_ellipsoid(1e-2), 5 * scale)
    claim = f"rolling ellipsoid, h 10 ms, {5 * scale:g} s"
    yield Figure(claim, "energy kept", float(total[-1] / total[0]), -0.99)
    yield Figure(claim, "largest gain", float(total.max() / total[0] - 1), 1e-6)


def free_body(scale: float) -> Figures:
    duration = 100.0 * scale
    sim = m.simulate("free_body")
    inertia = np.array(sim.model.bodies[0].inertia)

    def angular_momentum() -> np.ndarray:
        q = sim.state.orientations[0]
        return rotate(q, inertia @ rotate(conjugate(q), sim.state.angular_velocities[0]))

    before, spin = angular_momentum(), np.linalg.norm(sim.state.angular_velocities[0])
    energies = [r.kinetic_energy for r in m.run(sim, duration)]
    revolutions = spin * duration / (2 * math.pi)
    drift = np.linalg.norm(angular_momentum() - before) / np.linalg.norm(before) / revolutions
    claim = f"free body, {revolutions:.0f} revolutions"
    yield Figure(claim, "change of angular momentum per revolution", float(drift), 1e-9)
    growth = float(np.diff(energies).max()) / energies[0]
    yield Figure(claim, "energy growth of a step", growth, 1e-14)


def cradle(scale: float) -> Figures:
    sim = m.simulate("newtons_cradle")
    energies: list[float] = []
    m.run(sim, 5.0 * scale, lambda s, r: energies.append(r.energy))
    mass = sim.model.bodies[0].mass
    fall = mass * G * 0.5 * (1 - math.cos(math.radians(40)))
    claim = f"cradle, e = 1, {5 * scale:g} s"
    swing = G / 0.5 * sim.dt**2  # (w h)^2, the share that comes and goes within a swing
    yield Figure(claim, "energy above the initial one", (max(energies) - energies[0]) / fall, swing)
    yield Figure(claim, "energy lost", (energies[0] - energies[-1]) / fall, math.inf)


def units(scale: float) -> Figures:
    yield Figure(
        "lengths and masses x 1024", "difference of motion", ratio_of_motion(1024.0, 1024.0), 0.0, "m, m/s"
    )
    for name, factor in (("mm-g", 1e3), ("km-t", 1e-3)):
        difference = ratio_of_motion(factor, factor, tolerance=1e-12)
        yield Figure(
            f"{name} against m-kg, tolerance 1e-12", "difference of motion", difference, 1e-9, "m, m/s"
        )


def vehicle(scale: float) -> Figures:
    sim = m.simulate("tracked_vehicle")
    duration = 9.5 if scale == 1 else 1.0
    result = m.drive(sim, duration)
    claim = f"tracked vehicle over 24 slabs, h 5 ms, {duration:g} s"
    yield Figure(claim, "distance", result.distance, -20.0 if scale == 1 else math.inf, "m")
    yield Figure(claim, "lost shoes", result.lost_shoes, 0)
    yield Figure(claim, "real-time factor on one core", result.real_time_factor, -1.0)
    yield Figure(claim, "simulated time over processor time", result.processor_factor, -1.0)
    yield Figure(claim, "joint error", result.joint_error, 5e-3, "m")
    yield Figure(claim, "deepest penetration", result.penetration, math.inf, "m")
    yield Figure(claim, "largest residual", result.worst_residual, 1e-2)


PARTS: tuple[Callable[[float], Figures], ...] = (
    sliding_cube, ramp, plates, chain, ball, four_bar, smooth, free_body, cradle, units, vehicle, wall,
)  # fmt: skip


def main() -> None:
    options = with_folders(arguments(__doc__).parse_args())
    warnings.simplefilter("ignore", amontons.StepWarning)  # the largest residual is one of the figures

    def rows(part: Callable[[float], Figures]) -> list[Row]:
        start = perf_counter()
        found = list(part(0.1 if options.quick else 1.0))
        more = {"seconds": perf_counter() - start}
        return [asdict(f) | {"met": "yes" if f.met else "no"} | more for f in found]

    fill(options.out / "physics.csv", PARTS, rows, "claim figure value limit unit met")


if __name__ == "__main__":
    main()
