"""What the tests of the scenes and benchmarks/physics.py measure, once."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import amontons
import amontons.scenes
import numpy as np
from amontons.model.turns import rotate

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "support"))
from middle import energies_in_the_middle, kick, middle


def simulate(name: str, parameters: dict[str, Any] | None = None, **options: Any) -> amontons.Simulation:
    """A simulation of a scene with the scene's own settings, but for those given."""
    scene = amontons.scenes.get(name)
    settings = {"dt": scene.dt, **scene.options, **options}
    return amontons.Simulation(scene.make(**(parameters or {})), **settings)


def force_on(sim: amontons.Simulation, body: int | str, others: set[int] | None = None) -> np.ndarray:
    """The force that contacts exert on a body, all of them or those of some other bodies (N)."""
    body = sim.model.body_index(body)
    total = np.zeros(3)
    for c in sim.contacts:
        if c["body_a"] == body and (others is None or int(c["body_b"]) in others):
            total += c["force"]
        elif c["body_b"] == body and (others is None or int(c["body_a"]) in others):
            total -= c["force"]
    return total


def weights(sim: amontons.Simulation) -> np.ndarray:
    """The weights of the bodies (N)."""
    return np.array([body.mass for body in sim.model.bodies]) * np.linalg.norm(sim.model.gravity)


def run(
    sim: amontons.Simulation, duration: float, each: Callable[[amontons.Simulation, Any], None] | None = None
) -> list[Any]:
    """Steps for a duration; the reports."""
    reports = []
    for _ in range(round(duration / sim.dt)):
        reports.append(sim.step())
        if each is not None:
            each(sim, reports[-1])
    return reports


def energy_in_the_middle(sim: amontons.Simulation) -> float:
    """Of motion and gravity (J), in the middle of the last step."""
    return sum(energies_in_the_middle(sim))


@dataclass
class Standing:
    """What a stack did that should have stood still."""

    force_error: float
    """largest |contact force at a level - weight above| / that weight"""
    drift: float
    """largest displacement of a body after the first second (m)"""
    residual: float


def stand(sim: amontons.Simulation, duration: float) -> Standing:
    """Lets a vertical stack stand: body k rests on body k - 1, body 0 on the world."""
    above = np.cumsum(weights(sim)[::-1])[::-1]
    settle = min(1.0, duration / 2)
    worst = max(r.residual for r in run(sim, settle))
    start = np.array(sim.state.positions)
    drift = force_error = 0.0
    for report in run(sim, duration - settle, lambda s, _: None):
        worst = max(worst, report.residual)
        drift = max(drift, float(np.abs(sim.state.positions - start).max()))
    for k in range(len(above)):
        carried = force_on(sim, k, {k - 1})[2]
        force_error = max(force_error, abs(carried - above[k]) / above[k])
    return Standing(force_error, drift, worst)


@dataclass
class Impact:
    """What the wall and the ball did."""

    bricks_moved: int
    energy_growth: float
    """largest growth of the total energy in a step, over the ball's kinetic energy at the start"""
    momentum_error: float
    """largest |change of momentum - impulses from outside| in a step, over the ball's momentum"""
    penetration: float
    """m"""
    worst_residual: float
    joint_error: float
    """m"""
    seconds: float
    """wall clock"""
    steps: int


def impact(sim: amontons.Simulation, duration: float) -> Impact:
    """Runs B4; momentum and energy are balanced in every step."""
    start = np.array(sim.state.positions)
    ball = sim.model.body_index("ball")
    scale = sim.model.bodies[ball].mass * np.linalg.norm(sim.state.linear_velocities[ball])
    energy_scale = 0.5 * sim.model.bodies[ball].mass * np.sum(sim.state.linear_velocities[ball] ** 2)
    gravity = np.array(sim.model.gravity) * sim.model.total_mass
    anchor = sim.model.joint_index("chain 0")
    last = None
    growth = momentum_error = 0.0
    reports = []
    for _ in range(round(duration / sim.dt)):
        before = np.array(middle(sim).forces.momentum()[0])
        report = sim.step()
        contacts = sim.contacts
        outside = contacts["impulse"][contacts["body_b"] == -1].sum(axis=0)
        chain = np.asarray(sim.forces.joint_reactions["force"][anchor]) * kick(sim)
        error = np.array(middle(sim).forces.momentum()[0]) - before - outside - chain - gravity * kick(sim)
        momentum_error = max(momentum_error, float(np.linalg.norm(error)) / scale)
        now = energy_in_the_middle(sim)
        if last is not None:
            growth = max(growth, (now - last) / energy_scale)
        last = now
        reports.append(report)
    moved = np.linalg.norm(sim.state.positions - start, axis=1)
    bricks = [i for i, name in enumerate(sim.model.body_names) if name.startswith("brick")]
    return Impact(
        bricks_moved=int((moved[bricks] > 0.05).sum()),
        energy_growth=growth,
        momentum_error=momentum_error,
        penetration=max(r.penetration for r in reports),
        worst_residual=max(r.residual for r in reports),
        joint_error=max(r.joint_error for r in reports),
        seconds=sum(r.timings.total for r in reports),
        steps=len(reports),
    )


@dataclass
class Drive:
    """What the tracked vehicle did."""

    distance: float
    """m"""
    lost_shoes: int
    """whose pins opened by more than a centimetre, or that lie off their track"""
    real_time_factor: float
    """simulated time over wall clock"""
    processor_factor: float
    """simulated time over processor time, which other processes do not change"""
    joint_error: float
    worst_residual: float
    penetration: float


def drive(sim: amontons.Simulation, duration: float) -> Drive:
    """Drives the tracked vehicle straight ahead."""
    names = sim.model.body_names
    hull = names.index("hull")
    start = np.array(sim.state.positions[hull])
    began = process_time()
    reports = run(sim, duration)
    spent = process_time() - began
    shoes = [i for i, name in enumerate(names) if " shoe " in name]
    relative = sim.state.positions[shoes] - sim.state.positions[hull]
    # Wheels and guides hold a shoe sideways within its clearance; a thrown track lies outside.
    sideways = np.abs(relative @ rotate(sim.state.orientations[hull], (0, 1, 0)))
    lost = int(((np.abs(sideways - 0.75) > 0.1) | (np.linalg.norm(relative, axis=1) > 3)).sum())
    wall = sum(r.timings.total for r in reports)
    return Drive(
        distance=float(sim.state.positions[hull][0] - start[0]),
        lost_shoes=lost,
        real_time_factor=duration / wall,
        processor_factor=duration / spent,
        joint_error=max(r.joint_error for r in reports),
        worst_residual=max(r.residual for r in reports),
        penetration=max(r.penetration for r in reports),
    )


def energies(sim: amontons.Simulation, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Total energy in the middle of every step, kinetic energy at its end (J); no step may make energy."""
    total: list[float] = []
    reports = run(sim, duration, lambda s, r: total.append(energy_in_the_middle(s) + r.spring_energy))
    assert all(r.balanced for r in reports)
    return np.array(total), np.array([r.kinetic_energy for r in reports])


def energy_loss(sim: amontons.Simulation, duration: float) -> float:
    """Of the mean energy between the first and the last fiftieth, over the peak of the kinetic energy."""
    total, kinetic = energies(sim, duration)
    n = len(total) // 50
    return float((total[:n].mean() - total[-n:].mean()) / kinetic.max())


def bounce_heights(restitution: float, h: float, duration: float) -> list[float]:
    """Heights over the floor of a ball that was dropped by 1 m, after each step."""
    b = amontons.ModelBuilder()
    b.add_geom(None, amontons.shapes.Plane(), material=amontons.Material(restitution=restitution))
    b.add_body(position=(0, 0, 1.1), shape=amontons.shapes.Sphere(0.1), mass=2.0)
    heights: list[float] = []
    sim = amontons.Simulation(b.build(), dt=h)
    run(sim, duration, lambda s, _: heights.append(s.state.positions[0, 2] - 0.1))
    return heights


def pendulum(links: int, h: float, **options: Any) -> amontons.Simulation:
    """Bars of 1 m and 1 kg on hinges, released from the horizontal."""
    b = amontons.ModelBuilder()
    before = None
    for i in range(links):
        link = b.add_body(shape=amontons.shapes.Box((0.5, 0.025, 0.025)), mass=1, position=(0.5 + i, 0, 0))
        b.add_revolute_joint(link, before, point=(i, 0, 0), axis=(0, 1, 0))
        before = link
    return amontons.Simulation(b.build(), dt=h, **options)


def rolling_ellipsoid(h: float) -> amontons.Simulation:
    """It rolls over its long axis at 15 rad/s."""
    b = amontons.ModelBuilder()
    grip = amontons.Material(friction=0.8)
    b.add_geom(None, amontons.shapes.Plane(), material=grip)
    b.add_body(
        shape=amontons.shapes.Ellipsoid((0.15, 0.1, 0.1)),
        density=1000,
        position=(0, 0, 0.1),
        linear_velocity=(1.5, 0, 0),
        angular_velocity=(0, 15, 0),
        material=grip,
    )
    return amontons.Simulation(b.build(), dt=h)


SMOOTH = {
    "pendulum": lambda h: pendulum(1, h),
    "double pendulum": lambda h: pendulum(2, h),
    "four-bar": lambda h: amontons.Simulation(amontons.scenes.four_bar(driven=False), dt=h),
    "chain 1000:1": lambda h: amontons.Simulation(amontons.scenes.chain(), dt=h),
}
"""Mechanisms without friction, motors or contacts, under gravity."""
