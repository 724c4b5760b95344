"""The time steps that the figures are about, made by running the scenes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from amontons.problem.problem import Problem
from amontons.report.first_contact import touched
from amontons.report.picture import Frame
from amontons.scenes import get, make
from amontons.simulation.simulation import Simulation

SOLVES: dict[str, Any] = {"tolerance": 1e-3, "max_iterations": 600, "on_failure": "ignore"}
"""Options of the steps before the measured one: plausible states at a bounded cost."""
METHODS = {"network": "auto", "spheres_in_box": "apgd", "plates": "auto", "wall": "apgd"}
"""APGD gets farthest in so many iterations where many contacts share few bodies."""

INTO_IMPACT = 2
"""Steps from the first touch of the ball to the one that is measured: by then it pushes many bricks."""


@dataclass(frozen=True)
class Plan:
    """Sizes of a run, and the time for each method."""

    network: int
    """parts along each edge of the lattice of B1"""
    spheres: int
    plates: int
    wall: tuple[int, int]
    """columns and rows"""
    settle: float
    """simulated time in which the spheres come to rest (s)"""
    after: float
    """simulated time that the pictures show after the impact (s)"""
    pixels: int
    """width of the pictures"""
    iterations: int
    """of the figure of the objective"""
    deadline: float
    """wall clock per method and problem (s)"""
    sweep_deadline: float
    """the same where size and mass ratio vary (s)"""
    network_sizes: tuple[int, ...]
    sphere_sizes: tuple[int, ...]
    plate_sizes: tuple[int, ...]
    wall_sizes: tuple[tuple[int, int], ...]
    ratios: tuple[float, ...]


FULL = Plan(
    network=10,
    spheres=1000,
    plates=20,
    wall=(37, 20),
    settle=2.0,
    after=1.2,
    pixels=1300,
    iterations=1000,
    deadline=10.0,
    sweep_deadline=3.0,
    network_sizes=(3, 5, 7, 10),
    sphere_sizes=(60, 250, 1000),
    plate_sizes=(5, 10, 20, 40, 80),
    wall_sizes=((6, 5), (12, 10), (24, 14), (37, 20)),
    ratios=(1, 10, 1e2, 1e3, 1e4, 1e5, 1e6),
)
QUICK = Plan(
    network=4,
    spheres=27,
    plates=8,
    wall=(6, 5),
    settle=0.5,
    after=0.3,
    pixels=500,
    iterations=100,
    deadline=0.05,
    sweep_deadline=0.02,
    network_sizes=(2, 3),
    sphere_sizes=(8, 27),
    plate_sizes=(4, 8),
    wall_sizes=((4, 3), (6, 5)),
    ratios=(1, 1e2, 1e4),
)


@dataclass
class Case:
    """A time step of a scene."""

    name: str
    title: str
    problem: Problem
    bodies: int
    frames: list[Frame] = field(default_factory=list)
    simulation: Simulation | None = None


def network(parts: int, steps: int = 30) -> Case:
    """B1 in motion."""
    return _after("B1", "network of joints", "network", steps, columns=parts, layers=parts)


def spheres(count: int, settle: float) -> Case:
    """B2 at rest."""
    steps = round(settle / get("spheres_in_box").dt)
    return _after("B2", "smooth spheres in a box", "spheres_in_box", steps, count=count)


def plates(count: int, ratio: float = 100.0, steps: int = 10) -> Case:
    """B3 at rest."""
    return _after("B3", f"plates, masses 1:{ratio:g}", "plates", steps, count=count, ratio=ratio)


def wall(columns: int, rows: int, after: float = 0.0, pictures: int = 6) -> Case:
    """B4 shortly after the ball first pushes a brick; then on, for the pictures."""
    sim = _start("wall", columns=columns, rows=rows)
    ball = sim.model.body_index("ball")
    frames = [_frame(sim)]

    _run(sim, round(get("wall").duration / sim.dt), lambda sim: touched(sim, ball))
    _run(sim, INTO_IMPACT)
    problem = sim.problem()
    frames.append(_frame(sim))
    for _ in range(pictures - 2 if after > 0 else 0):
        _run(sim, max(1, round(after / (pictures - 2) / sim.dt)))
        frames.append(_frame(sim))
    return _case("B4", "wall under impact", problem, sim, frames)


def _start(scene: str, **parameters: Any) -> Simulation:
    entry = get(scene)
    options = {"dt": entry.dt, **entry.options, **SOLVES, "method": METHODS[scene]}
    return Simulation(make(scene, **parameters), **options)


def _after(name: str, title: str, scene: str, steps: int, **parameters: Any) -> Case:
    sim = _start(scene, **parameters)
    _run(sim, steps)
    return _case(name, title, sim.problem(), sim, [])


def _run(sim: Simulation, steps: int, until: Callable[[Simulation], bool] = lambda sim: False) -> None:
    for _ in range(steps):
        sim.step()
        if until(sim):
            return


def _frame(sim: Simulation) -> Frame:
    return Frame(sim.time, sim.state.positions.copy(), sim.state.orientations.copy())


def _case(name: str, title: str, problem: Problem, sim: Simulation, frames: list[Frame]) -> Case:
    bodies = sum(body.motion == "dynamic" for body in sim.model.bodies)
    problem.name = name
    return Case(name, title, problem, bodies, frames, sim)
