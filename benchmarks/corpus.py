"""A corpus of time steps to choose methods by: scenes, piles, robots; at rest, sliding, after impacts.

A file per sequence in out/corpus: problems as they come from the simulation, each with the impulses of the
step before it as a warm start. Half of the sequences, by a hash of their names, are kept out of all tuning
(`held_out`). The simulations are solved by fixed methods with fixed limits, so that the corpus depends on no
choice of `auto` and on no clock. `performance_profile.py` makes it and runs the methods on it.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import amontons
import numpy as np
from amontons import scenes
from amontons.model.builder import ModelBuilder
from amontons.model.model import Model
from amontons.model.parts import Material
from amontons.model.shapes import Box, Capsule, Cylinder, Ellipsoid, Hull, Plane, Shape, Sphere
from common import ROOT, tracked

FOLDER = ROOT / "out" / "corpus"
MATCH = 0.05
"""Contact points of one pair of geoms that are so near (m) are one contact in two steps."""
QUICK = 5
"""A quick corpus has every so many sequence."""


@dataclass(frozen=True)
class Sequence:
    """A simulation, and the steps of it that are kept."""

    name: str
    make: Callable[[], Model]
    dt: float
    steps: tuple[int, ...]
    options: dict[str, Any] = field(default_factory=dict)
    prepare: Callable[[amontons.Simulation], None] | None = None


@dataclass(frozen=True)
class Step:
    """A problem as arrays, so that it can be stored; `x0` are the impulses of the step before, matched."""

    name: str
    sequence: str
    operator: type
    arrays: dict[str, Any]
    b: np.ndarray[Any, Any]
    cones: list[Any]
    x0: np.ndarray[Any, Any]

    def problem(self) -> amontons.vi.Problem:
        return amontons.vi.Problem(self.operator.from_arrays(self.arrays), self.b, self.cones, name=self.name)


def held_out(sequence: str) -> bool:
    return hashlib.sha256(sequence.encode()).digest()[0] % 2 == 1


# What is simulated

SAMPLES = (1, 3, 10, 30, 60, 100)
JOINTED = {"method": "newton", "max_iterations": 60}
"""Where joints are many or all there is, a first-order method with few iterations would tear them."""


def of_scenes() -> Iterator[Sequence]:
    """Every scene with its defaults, and those with a parameter that makes them hard with others."""
    jointed = ("capstan", "chain", "four_bar", "network", "newtons_cradle", "pendulum", "slider_crank")
    chosen = {"tracked_vehicle": (20, 60, 120, 200), "wall": (2, 10, 60), "wall_at_rest": (1, 4),
              "spheres_in_box": (20, 45, 60), "network": (1, 10)}  # fmt: skip
    for name in scenes.names():
        if name == "free_body":
            continue
        options = JOINTED if name in jointed else {}
        yield of_scene(name, chosen.get(name, SAMPLES), options)
    for count, mu in ((30, 0.0), (200, 0.5), (100, 5.0), (300, 0.0)):
        yield of_scene("spheres_in_box", (12, 25, 40, 60), {}, dt=1e-2, count=count, mu=mu)
    yield of_scene("spheres_in_box", (30, 46, 60), {}, dt=1e-2, count=1000, mu=0.5)
    for ratio in (1.0, 100.0, 1e4):
        yield of_scene("chain", (1, 10, 60), JOINTED, end_mass_ratio=ratio, links=40)
        yield of_scene("plates", (1, 4, 20), {}, ratio=ratio, count=10)
        yield of_scene("plates", (1, 20), {}, ratio=ratio, heavy_first=True)
    for mu in (0.2, 0.6, 2.0):
        yield of_scene("arch", (1, 5, 30, 60), {}, mu=mu, stones=21)
        yield of_scene("card_house", (1, 10, 40, 80), {}, mu=mu)
        yield of_scene("incline", (1, 5, 40), {}, mu=mu, angle=30.0)
    for columns, rows in ((5, 4), (10, 8), (16, 12)):
        for links in (4, 8):
            yield of_scene("wall", (1, 50, 80, 95, 110, 150), {}, columns=columns, rows=rows, links=links)
    for boxes in (3, 20, 40):
        yield of_scene("stack", (1, 5, 30), {}, boxes=boxes)
    for mu in (0.0, 0.2, 1.0):
        yield of_scene("hopper", (60, 90, 130), {}, mu=mu, count=150)
    yield of_scene("domino_run", (20, 60, 120, 200), {}, count=60)


def of_scene(
    name: str, steps: tuple[int, ...], options: dict[str, Any], dt: float | None = None, **parameters: Any
) -> Sequence:
    entry = scenes.get(name)
    extra = {key: value for key, value in entry.options.items() if key not in ("method", "tolerance")}
    title = " ".join([name, *(f"{key}={value}" for key, value in parameters.items())])
    return Sequence(
        title, lambda: entry.make(**parameters), entry.dt if dt is None else dt, steps, extra | options
    )


def of_piles() -> Iterator[Sequence]:
    """Bodies of every shape thrown on a heap: while they fall, at the impact, and when they lie."""
    for index, (kind, mu, count) in enumerate(
        (kind, mu, count)
        for kind in (*SHAPES, "mixed")
        for mu, count in ((0.0, 40), (0.3, 12), (0.5, 80), (1.0, 30), (5.0, 20))
    ):
        yield Sequence(
            f"pile {kind} mu={mu} count={count}",
            lambda kind=kind, mu=mu, count=count, seed=index: pile(kind, mu, count, seed),  # type: ignore[misc]
            (2e-3, 5e-3, 1e-2)[index % 3],
            (20, 60, 100) if index % 3 == 2 else (40, 100, 200),
        )
    for kind in ("sphere", "mixed", "box"):
        yield Sequence(f"pile {kind} count=400", lambda kind=kind: pile(kind, 0.5, 400, 99), 1e-2, (30, 60))  # type: ignore[misc]


def hull(rng: np.random.Generator, size: float) -> Shape:
    points = rng.normal(size=(12, 3))
    return Hull(size * points / np.linalg.norm(points, axis=1)[:, None])


SHAPES: dict[str, Callable[[np.random.Generator, float], Shape]] = {
    "sphere": lambda rng, r: Sphere(r),
    "box": lambda rng, r: Box(tuple(r * rng.uniform(0.4, 0.8, 3))),
    "capsule": lambda rng, r: Capsule(0.4 * r, 0.6 * r),
    "cylinder": lambda rng, r: Cylinder(0.6 * r, 0.5 * r),
    "ellipsoid": lambda rng, r: Ellipsoid(tuple(r * rng.uniform(0.4, 0.9, 3))),
    "hull": hull,
}


def pile(kind: str, mu: float, count: int, seed: int) -> Model:
    """`count` bodies of a kind, each of its own size and attitude, above a plane between four walls."""
    rng = np.random.default_rng(seed)
    material = Material(friction=mu)
    b = ModelBuilder(friction_rule="maximum")
    b.add_geom(None, Plane(), material=material, name="floor")
    per_row = max(2, round((count / 3) ** 0.5))
    half = 0.11 * per_row
    for name, x, y in (("-x", -1, 0), ("+x", 1, 0), ("-y", 0, -1), ("+y", 0, 1)):
        size = (0.02, half + 0.04, 2.0) if x else (half + 0.04, 0.02, 2.0)
        position = (x * (half + 0.02), y * (half + 0.02), 2.0)
        b.add_geom(None, Box(size), position=position, material=material, name=name)
    names = list(SHAPES)
    for i in range(count):
        layer, site = divmod(i, per_row**2)
        row, column = divmod(site, per_row)
        q = rng.normal(size=4)
        shape = SHAPES[names[i % len(names)] if kind == "mixed" else kind](rng, 0.1 * rng.uniform(0.6, 1.0))
        b.add_body(
            f"body {i}",
            position=(0.22 * column - half + 0.11, 0.22 * row - half + 0.11, 0.12 + 0.22 * layer),
            orientation=tuple(q / np.linalg.norm(q)),
            linear_velocity=tuple(rng.normal(scale=0.5, size=3)),
            shape=shape,
            density=1000,
            material=material,
        )
    return b.build()


def of_robots(folder: Path) -> Iterator[Sequence]:
    """Model files of others, with random controls; those that do not load are left out.

    Joints are rows: in coordinates of joints A is a matrix, and most methods work on bodies.
    """
    from robots import models

    for path in models(folder):
        yield Sequence(
            f"robot {path.relative_to(folder).as_posix()}",
            lambda path=path: replace(amontons.load_model(path), trees="none"),  # type: ignore[misc]
            2e-3,
            (5, 50, 150),
            {"max_iterations": 2000},
            shaken,
        )


def shaken(simulation: amontons.Simulation) -> None:
    """Velocities and controls at random, so that a robot does more than to sink into its rest."""
    rng = np.random.default_rng(7)
    simulation.qd = simulation.qd + rng.normal(scale=0.5, size=len(simulation.qd))
    if len(simulation.controls):
        simulation.controls = rng.uniform(-0.5, 0.5, size=len(simulation.controls))


# From a simulation to steps


def steps_of(sequence: Sequence) -> Iterator[Step]:
    options = {"tolerance": 1e-5, "method": "apgd", "max_iterations": 1000} | sequence.options
    model = sequence.make()
    simulation = amontons.Simulation(model, dt=sequence.dt, on_failure="ignore", **options)
    if sequence.prepare:
        sequence.prepare(simulation)
    before = None
    for k in range(1, max(sequence.steps) + 1):
        if k in sequence.steps and k > 1:
            before = (simulation.contacts.copy(), simulation.forces.impulses.copy(), simulation.problem())
        simulation.step()
        if k not in sequence.steps:
            continue
        problem = simulation.problem()
        if problem.rows == 0:
            continue
        x0 = matched(before, simulation.contacts, problem) if before else np.zeros(problem.rows)
        yield Step(
            f"{sequence.name} step {k}", sequence.name, type(problem.A),
            {name: value for name, value in vars(problem.A).items() if isinstance(value, np.ndarray)},
            np.array(problem.b), problem.cones, x0,
        )  # fmt: skip


def contact_rows(problem: amontons.vi.Problem) -> np.ndarray[Any, Any]:
    rows = getattr(problem.A, "rows", None)
    return np.zeros(0, int) if rows is None or np.ndim(rows) == 0 else np.asarray(rows)


def matched(before: Any, contacts: Any, problem: amontons.vi.Problem) -> np.ndarray[Any, Any]:
    """Rows of a contact from the nearest of the step before between the same geoms, joints from themselves.

    Tangents follow from normals, so that rows keep their meaning as long as these turn little.
    """
    old_contacts, old_x, old_problem = before
    x0 = np.zeros(problem.rows)
    rows, old_rows = contact_rows(problem), contact_rows(old_problem)
    start, old_start = np.concatenate([[0], np.cumsum(rows)]), np.concatenate([[0], np.cumsum(old_rows)])
    joints = problem.rows - start[-1]
    if joints == old_problem.rows - old_start[-1]:
        x0[start[-1] :] = old_x[old_start[-1] :]
    by_pair: dict[tuple[int, int], list[int]] = {}
    for j in range(min(len(old_rows), len(old_contacts))):
        by_pair.setdefault((old_contacts["geom_a"][j], old_contacts["geom_b"][j]), []).append(j)
    for i in range(min(len(rows), len(contacts))):
        candidates = by_pair.get((contacts["geom_a"][i], contacts["geom_b"][i]), [])
        if not candidates:
            continue
        away = np.linalg.norm(old_contacts["point"][candidates] - contacts["point"][i], axis=1)
        j = candidates[int(np.argmin(away))]
        if away.min() < MATCH and rows[i] == old_rows[j]:
            x0[start[i] : start[i + 1]] = old_x[old_start[j] : old_start[j + 1]]
    return x0


def sequences(robots: Path | None) -> list[Sequence]:
    found = [*of_scenes(), *of_piles()]
    return found + list(of_robots(robots)) if robots and robots.is_dir() else found


def load(folder: Path) -> Iterator[Step]:
    """All steps of a folder that this program wrote, in the order of their names."""
    for path in sorted(folder.glob("*.pickle")):
        with path.open("rb") as file:
            yield from pickle.load(file)


def write(folder: Path, chosen: Iterable[Sequence]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for sequence in tracked(list(chosen), "corpus"):
        try:
            steps = list(steps_of(sequence))
        except (amontons.InputError, amontons.SimulationError, OSError) as error:
            print(f"corpus: {sequence.name} left out: {' '.join(str(error).split())[:120]}")
            continue
        name = hashlib.sha256(sequence.name.encode()).hexdigest()[:12]
        with (folder / f"{name}.pickle").open("wb") as file:
            pickle.dump(steps, file)
