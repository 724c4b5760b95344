"""Tosses of a real cube onto a table, simulated open loop from their first row, by us and by others."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import amontons
import numpy as np
from amontons.shapes import Box, Sphere
from beside.engine import Engine, python_of
from beside.measure import Array
from beside.plain import Unsupported, Variant
from beside.scenes import plain

from .toss_data import EDGE, GIVEN, RATE, Toss, add_cube, read_tosses

OURS = "amontons"
SHORT = 0.978
"""Tracked lengths over true ones: height at rest and free fall agree on it."""
RADIUS = 1e-3
"""m: of spheres at the corners."""
FITTED = 60
"""Tosses that coefficients are fitted on; the others test them."""
VARIED = {"friction": (0.12, 0.27), "restitution": (0.0, 0.25)}
"""Other coefficients: two thirds and three halves of the friction, none and twice the restitution."""
FRICTIONS = tuple(np.round(np.arange(0.1, 0.261, 0.02), 3).tolist())
RESTITUTIONS = (0.0, 0.125, 0.25, 0.375)


def cube(row: Array, friction: float, restitution: float, corners: bool = False) -> amontons.Model:
    """The cube at a row of a toss, above a table whose top is z = 0.

    corners: eight small spheres within the corners instead of a box, which gets one point from Drake.
    """
    surface = amontons.Material(friction=friction, restitution=restitution)
    builder = amontons.ModelBuilder(gravity=(0, 0, -9.81))
    builder.add_geom(None, Box((2, 2, 1)), position=(0, 0, -1), material=surface)
    body = add_cube(builder, "cube", row)
    if corners:
        for corner in itertools.product(*[(RADIUS - EDGE / 2, EDGE / 2 - RADIUS)] * 3):
            builder.add_geom(body, Sphere(RADIUS), position=corner, material=surface)
    else:
        builder.add_geom(body, Box((EDGE / 2,) * 3), material=surface)
    return builder.build()


@dataclass(frozen=True)
class Entrant:
    """An engine, with so many steps per sample and its coefficients."""

    engine: Engine
    steps: int = 1
    friction: float = GIVEN[0]
    restitution: float = GIVEN[1]

    @property
    def is_ours(self) -> bool:
        return self.engine.name == OURS

    def errors(self, toss: Toss) -> tuple[float, float]:
        """Means over a toss: of the position (% of the edge) and of the orientation (deg)."""
        corners = self.engine.name.startswith("Drake")
        model = cube(toss.rows[0], self.friction, self.restitution, corners)
        running = self.engine.start(plain(model), 1 / RATE / self.steps)
        positions, quaternions = [], []
        for _ in toss.rows[1:]:
            running.advance(self.steps)
            motion = running.motion()
            positions.append(motion.positions[0])
            quaternions.append(motion.orientations[0])
        running.close()
        return compare(toss.rows[1:], np.array(positions), np.array(quaternions))

    def all_errors(self, tosses: Sequence[Toss]) -> Array:
        """(tosses, 2)."""
        return np.array([self.errors(toss) for toss in tosses])


def compare(rows: Array, positions: Array, quaternions: Array) -> tuple[float, float]:
    """Mean distance (% of the edge) and mean angle (deg) from rows of a toss."""
    distance = np.linalg.norm(positions - rows[:, 4:7], axis=1)
    along = np.abs(np.sum(quaternions * rows[:, :4], axis=1))
    along /= np.linalg.norm(quaternions, axis=1) * np.linalg.norm(rows[:, :4], axis=1)
    angle = 2 * np.degrees(np.arccos(np.minimum(along, 1)))
    return 100 * float(distance.mean()) / EDGE, float(angle.mean())


ENGINES = (
    ("amontons", Variant(OURS, {"tolerance": 1e-6})),
    ("mujoco", Variant("MuJoCo, pyramid")),
    ("mujoco", Variant("MuJoCo, round cone", {"option": 'cone="elliptic"'})),
    ("pybullet", Variant("PyBullet")),
    # With its default, "lagged", a cube of stiff points stops where it lands at these steps.
    ("drake", Variant("Drake, sap", {"approximation": "sap"})),
)


def engines() -> Iterator[Engine]:
    """Ours and those that are installed, with their default settings; MuJoCo also with its round cone."""
    for key, variant in ENGINES:
        if python := python_of(key):
            yield Engine(key, variant, python)


def fitted(entrant: Entrant, tosses: Sequence[Toss]) -> Entrant:
    """Coefficients with the least error of position, from a grid; other engines have no restitution."""
    grid = itertools.product(FRICTIONS, RESTITUTIONS if entrant.is_ours else (GIVEN[1],))
    tried = [replace(entrant, friction=mu, restitution=e) for mu, e in grid]
    return min(tried, key=lambda one: one.all_errors(tosses)[:, 0].mean())


def split(count: int) -> tuple[Array, Array]:
    """Indices of tosses to fit on, drawn once for all, and of the rest."""
    order = np.random.default_rng(0).permutation(count)
    first = min(FITTED, count // 2)
    return np.sort(order[:first]), np.sort(order[first:])


def entry(entrant: Entrant, scale: str, coefficients: str, errors: Array) -> dict[str, Any]:
    position, angle = errors.mean(axis=0).tolist()
    return {
        "engine": entrant.engine.name, "scale": scale, "coefficients": coefficients,
        "steps_per_sample": entrant.steps, "friction": entrant.friction,
        "restitution": entrant.restitution if entrant.is_ours else "",
        "tosses": len(errors), "position_percent": position, "angle_deg": angle,
    }  # fmt: skip


SCALES = {"as tracked": 1.0, "true": 1 / SHORT}
"""Factors of the lengths of the data."""
STEPS, FEW = (1, 2, 4, 8), (1, 4)
"""Steps per sample; few for engines that take long to start."""


def rows(folder: Path, quick: bool) -> Iterator[dict[str, Any]]:
    """Errors of all entrants: as tracked and in true lengths, given and fitted, over steps per sample."""
    tracked = read_tosses(folder)[: 8 if quick else None]
    parts = list(itertools.product(range(len(list(engines()))), SCALES))
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for found in pool.map(part, *zip(*parts, strict=True), itertools.repeat(tracked)):
            yield from found


def part(index: int, scale: str, tracked: list[Toss]) -> list[dict[str, Any]]:
    """The rows of one engine, by its place, at one scale."""
    engine = list(engines())[index]
    tosses = [toss.scaled(SCALES[scale]) for toss in tracked]
    fitting, testing = split(len(tosses))
    found = []
    try:
        cheap = engine.name == OURS or engine.name.startswith("MuJoCo")
        runs = {k: Entrant(engine, k).all_errors(tosses) for k in (STEPS if cheap else FEW)}
        found += [entry(Entrant(engine, k), scale, "given", errors) for k, errors in runs.items()]
        found.append(entry(Entrant(engine), scale, "given, held out", runs[1][testing]))
        for key, values in VARIED.items() if scale == "as tracked" else ():
            for value in values if key == "friction" or engine.name == OURS else ():
                varied = replace(Entrant(engine), **{key: value})
                found.append(entry(varied, scale, f"{key} {value:g}", varied.all_errors(tosses)))
        best = fitted(Entrant(engine), [tosses[k] for k in fitting])
        held = best.all_errors([tosses[k] for k in testing])
        found.append(entry(best, scale, "fitted, held out", held))
    except Unsupported as error:
        print(f"{engine.name}: no {error}")
    return found
