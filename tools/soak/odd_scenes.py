"""Random scenes: every shape, joint, motor, size, mass, friction and step, often several extremes at once.

A case is a scene of some parts: bodies first, then joints. What must hold of each of its steps is in `judge`.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from typing import Any

import amontons
import numpy as np
from amontons import Material, ModelBuilder, Motor, shapes

from .family import Case, Failure, Family, Measures
from .watch import WIDE, Watch

STEPS = 400
BODIES = 24
JOINTS = 12

Rng = np.random.Generator


def log_uniform(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def turned(rng: Rng) -> tuple[float, ...]:
    q = rng.standard_normal(4)
    return tuple(q / np.linalg.norm(q))


def axis(rng: Rng) -> tuple[float, ...]:
    v = rng.standard_normal(3)
    return tuple(v / np.linalg.norm(v))


def shape(rng: Rng, size: float) -> shapes.Shape:
    """One that moves, of about this half extent."""
    a, b, c = (size * float(s) for s in rng.uniform(0.4, 1.0, 3))
    kind = rng.integers(6)
    if kind == 0:
        return shapes.Sphere(a)
    if kind == 1:
        return shapes.Box((a, b, c))
    if kind == 2:
        return shapes.Capsule(a, b)
    if kind == 3:
        return shapes.Cylinder(a, b)
    if kind == 4:
        return shapes.Ellipsoid((a, b, c))
    return shapes.Hull(size * rng.uniform(-1, 1, (int(rng.integers(6, 20)), 3)))


def material(rng: Rng) -> Material:
    friction = float(rng.choice([0.0, 0.2, 0.5, 1.0, 4.0, 10.0, 100.0]))
    values: dict[str, float] = {"friction": friction}
    if rng.random() < 0.2:
        values["restitution"] = float(rng.uniform(0, 1))
    if rng.random() < 0.15:
        values["torsional_friction"] = 0.01 * float(rng.random())
        values["rolling_friction"] = 0.01 * float(rng.random())
    return Material(**values)


class Scene:
    """A random scene: its model, the options of its simulation, and what a judge needs to know of it."""

    def __init__(self, case: Case) -> None:
        rng = case.rng()
        self.size = log_uniform(rng, 1e-4, 10.0)
        self.masses = float(rng.choice([1.0, 1.0, 1e4, 1e16]))
        """largest over smallest"""
        self.overlap = bool(rng.random() < 0.3)
        self.driven = bool(rng.random() < 0.4)
        self.common = material(rng) if rng.random() < 0.5 else None
        gravity = 9.81 * float(rng.choice([1.0, 1.0, 0.1]))
        self.dt = log_uniform(rng, 1e-3, 2e-2) * min(1.0, np.sqrt(self.size / 0.1))
        self.dt = float(self.dt)
        self.options: dict[str, Any] = dict(
            dt=self.dt,
            law=str(rng.choice(["coulomb", "coulomb", "coulomb", "associated"])),
            tolerance=float(rng.choice([1e-3, 1e-6])),
            recovery=str(rng.choice(["projection", "projection", "velocity"])),
            max_substeps=int(rng.choice([1, 1, 4])),
            threads=int(rng.integers(1, 4)),
            on_failure="ignore",
        )
        builder = ModelBuilder(gravity=(0, 0, -gravity))
        self.floor(builder, rng)
        self.extents: list[float] = []
        self.bodies: list[int] = []
        self.places: dict[int, np.ndarray[Any, Any]] = {}
        for part in range(int(rng.integers(1, BODIES + 1))):
            if case.kept(part):
                self.body(builder, case.rng(part))
        for part in range(BODIES, BODIES + int(rng.integers(0, JOINTS + 1))):
            if case.kept(part) and self.bodies:
                self.joint(builder, case.rng(part))
        self.model = builder.build()

    def floor(self, builder: ModelBuilder, rng: Rng) -> None:
        """Its height is zero; walls keep what rolls."""
        of = material(rng) if self.common is None else self.common
        kind, wide = rng.integers(3), WIDE * self.size
        self.endless = bool(kind == 0)
        if kind == 0:
            builder.add_geom(None, shapes.Plane(), material=of)
        elif kind == 1:
            half = (wide, wide, self.size)
            builder.add_geom(None, shapes.Box(half), position=(0, 0, -self.size), material=of)
        else:
            n = int(rng.integers(3, 9))
            heights = -0.2 * self.size * rng.random((n, n))
            builder.add_geom(None, shapes.HeightField(heights, 2 * wide, 2 * wide), material=of)
        for side in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            half = tuple(0.2 * wide if s else wide for s in side) + (wide,)
            at = tuple(1.2 * wide * s for s in side) + (0,)
            builder.add_geom(None, shapes.Box(half), position=at, material=of)

    def body(self, builder: ModelBuilder, rng: Rng) -> None:
        size = self.size * float(rng.uniform(0.5, 1.0))
        count = len(self.bodies)
        room = (0.8 if self.overlap else 2.2) * self.size
        place = np.array([count % 3 - 1, count // 3 % 3 - 1, 0.6 + count // 9]) * room
        place[2] += 0 if self.overlap else self.size
        place += rng.uniform(-0.1, 0.1, 3) * self.size
        density = 1000 * self.masses ** float(rng.uniform(-0.5, 0.5))
        fast = rng.random() < 0.3
        speed = np.sqrt(9.81 * self.size)
        self.bodies.append(
            builder.add_body(
                shape=shape(rng, size),
                density=density,
                position=tuple(place),
                orientation=turned(rng),
                linear_velocity=tuple(3 * speed * rng.standard_normal(3)) if fast else (0, 0, 0),
                angular_velocity=tuple(3 * speed / self.size * rng.standard_normal(3)) if fast else (0, 0, 0),
                material=self.common or material(rng),
            )
        )
        self.places[self.bodies[-1]] = place
        self.extents.append(1.8 * size)  # of a hull the corner of the cube

    def joint(self, builder: ModelBuilder, rng: Rng) -> None:
        """Between two bodies or a body and the world, at a point near the first."""
        a = int(rng.choice(self.bodies))
        others = [None, *(b for b in self.bodies if b != a)]
        b = others[int(rng.integers(len(others)))]
        place = self.places[a]
        point = tuple(np.array(place) + rng.uniform(-1, 1, 3) * self.size)
        # Whatever the bodies weigh: a motor may drive the lightest of them to any speed.
        weight = 1000 * (2 * self.size) ** 3 * 9.81
        options: dict[str, Any] = {}
        if rng.random() < 0.3:
            options["damping"] = log_uniform(rng, 1e-3, 10) * weight * self.size
        if rng.random() < 0.3:
            options["friction"] = log_uniform(rng, 1e-3, 10) * weight * self.size
        if rng.random() < 0.3:
            options["stiffness"] = log_uniform(rng, 1e-2, 1e4) * weight * self.size
        turning = dict(options)
        if rng.random() < 0.3:
            turning["limits"] = (-float(rng.uniform(0.1, 2)), float(rng.uniform(0.1, 2)))
        if self.driven and rng.random() < 0.5:
            kind = str(rng.choice(["effort", "speed", "position"]))
            gain = log_uniform(rng, 1, 1e4) * weight * self.size if kind == "position" else 0.0
            turning["motor"] = (
                Motor(
                    kind,
                    target=float(rng.uniform(-3, 3)),
                    max_effort=log_uniform(rng, 0.1, 100) * weight * self.size,
                    gain=gain,
                )
                if kind != "effort"
                else Motor(kind, target=float(rng.uniform(-3, 3)) * weight * self.size)
            )
        kind = rng.integers(8)
        if kind == 0:
            builder.add_ball_joint(a, b, point=point)
        elif kind == 1:
            builder.add_fixed_joint(a, b)
        elif kind == 2:
            builder.add_revolute_joint(a, b, point=point, axis=axis(rng), **turning)
        elif kind == 3:
            builder.add_prismatic_joint(a, b, axis=axis(rng), **options)
        elif kind == 4:
            builder.add_cylindrical_joint(a, b, point=point, axis=axis(rng))
        elif kind == 5:
            one = axis(rng)
            two = np.cross(one, axis(rng))
            builder.add_universal_joint(
                a, b, point=point, axis_1=one, axis_2=tuple(two / np.linalg.norm(two))
            )
        elif kind == 6:
            builder.add_planar_joint(a, b, normal=axis(rng))
        else:
            other = (0.0, 0.0, 3 * self.size) if b is None else self.places[b]
            builder.add_distance_joint(a, b, point_a=tuple(place), point_b=tuple(other))


def judge(scene: Scene, sim: amontons.Simulation, steps: int) -> Measures:
    """Makes the steps and holds them to what is promised (watch.py)."""
    seconds, work = [], []
    watch = Watch(scene, sim)
    for _ in range(steps):
        start = time.thread_time()
        report = watch.step()
        if report is None:
            break
        seconds.append(time.thread_time() - start)
        work.append(report.products + 20 * report.factorizations)
    watch.end()
    typical = max(float(np.median(seconds)), 2e-5)
    return {
        "outcome": "ended after misses" if watch.ended else "missed some" if watch.missed else "held",
        "longest step over median": max(seconds) / typical,
        "longest step (s)": max(seconds),
        "most products in a step": max(work),
        "residual": watch.worst,
        "missed steps": watch.missed,
        "energy over allowance": watch.rise,
        "closing speed": watch.closing,
        "lost after a miss": watch.lost,
    }


def run(case: Case) -> Measures:
    rng = case.rng(10_000)
    try:
        scene = Scene(case)
    except amontons.InputError as error:
        return {"outcome": "refused", "why": str(error)}
    again = rng.random() < 0.25
    sim = amontons.Simulation(scene.model, **scene.options)
    half = sim.copy() if again else None
    measures = judge(scene, sim, STEPS)
    if half is not None and sim.steps == STEPS:
        repeat(case, scene, sim, half)
    return measures


def repeat(case: Case, scene: Scene, done: amontons.Simulation, fresh: amontons.Simulation) -> None:
    """The same scene with other threads, saved and loaded in the middle, has the same bits."""
    threads = done.options["threads"] % 3 + 1
    path = case.folder / "half.h5"
    fresh.run(STEPS // 2 * scene.dt)
    fresh.save(path)
    other = amontons.Simulation.load(path, threads=threads)
    while other.steps < done.steps:
        other.step()
    for name in ("positions", "orientations", "linear_velocities", "angular_velocities"):
        if not np.array_equal(getattr(done.state, name), getattr(other.state, name)):
            raise Failure(
                "other bits", f"{name} after {done.steps} steps with {threads} threads and a restart"
            )


def run_budgets(case: Case) -> Measures:
    """The same scenes with a budget of wall clock for each step, and their last step solved with a deadline
    by every method. The processor time is measured, as other programs run here, too; and a case with
    something late is run again, as virtual machines have pauses that count as time of the processor."""
    first = measure_lateness(case)
    if first["outcome"] in ("refused", "in time"):
        return first
    return min(first, measure_lateness(case), key=lambda m: (m["late steps"], m["late solves"]))


def measure_lateness(case: Case) -> Measures:
    rng = case.rng(20_000)
    budget = log_uniform(rng, 1e-3, 2e-2)
    try:
        scene = Scene(case)
    except amontons.InputError as error:
        return {"outcome": "refused", "why": str(error)}
    sim = amontons.Simulation(scene.model, **(scene.options | {"budget": budget, "threads": 1}))
    beyond = [lateness(budget, sim.step) for _ in range(BUDGETED)]
    if not np.isfinite(sim.state.positions).all():
        raise Failure("not finite", f"budget {budget}")
    late = sum(too_late(budget, by) for by in beyond)
    solves = [late_solve(sim.problem(), method, log_uniform(rng, 1e-3, 2e-2)) for method in METHODS]
    return {
        "outcome": "late steps" if late else "late solves" if any(solves) else "in time",
        "most over budget (ms)": 1e3 * max(beyond),
        "late steps": late,
        "late solves": sum(solves),
    }


def lateness(limit: float, work: Callable[[], Any]) -> float:
    start = time.thread_time()
    work()
    return time.thread_time() - start - limit


def too_late(limit: float, by: float) -> bool:
    return by > max(0.2 * limit, 1e-3)


def late_solve(problem: amontons.Problem, method: str, deadline: float) -> bool:
    def solve() -> None:
        # Some methods are for other problems.
        with contextlib.suppress(amontons.InputError):
            problem.solve(method=method, deadline=deadline, tolerance=0, threads=1)

    return too_late(deadline, lateness(deadline, solve))


METHODS = amontons.methods()
BUDGETED = 100

FAMILIES = [
    Family("scenes", "random scenes of 400 steps", run, cpu_s=300.0, memory=2 << 30, share=3.0),
    Family("budgets", "random scenes with a budget of time", run_budgets, cpu_s=60.0, memory=2 << 30),
]
