"""Assemblies of dry blocks: the verdict, the simulation of the same blocks, and arches of the literature."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import amontons
import amontons.scenes
import numpy as np
from amontons.studies import Assembly, Block, horizontal, read_assembly, stability
from scipy.spatial import ConvexHull

Array = np.ndarray[Any, Any]
FRICTION = 0.84
"""That of the authors' programs, where they give no other."""
FRICTIONS = {"shelf": 0.9, "shelf-stable": 0.9, "shelf-s1": 0.9, "bridge": 0.9, "snake": 0.7}
SUPPORTS = {name: ("0", "1") for name in ("A", "H", "bridge", "type-a", "type-b")}
"""Fixed blocks, where they are others than block 0."""
VERDICTS = {"shelf-stable": True, "shelf": False}
"""Those of the authors' limit analysis, as far as the data tell it."""
SECONDS, STEP = 2.0, 5e-3
DENT = 0.01
"""Depth of dents that parts of a block may fill, over the size of the block."""
MOVES = 0.02
"""Displacement over the size of a block from which it has fallen: twice the depth of filled dents."""
MILANKOVITCH, HEYMAN, OPPENHEIM = 0.1075, 0.042, 0.37
"""Thickness over mean radius of the thinnest semicircular arch (Milankovitch, 1907, as Makris and Alexakis,
2013, give it) and hemispherical dome (Heyman, 1967); acceleration (g) of the arch of Oppenheim (1992), as De
Lorenzis et al. (2007) give it. The last two were not compared with the papers."""
COCCHETTI_THIN, COCCHETTI_FRICTION = (0.107426, 0.395832), 0.309215
"""Thickness over mean radius of the thinnest semicircular arch and the friction from which it has it; that
below which no semicircular arch stands (Cocchetti and Rizzi, 2020, table 3)."""
UPRIGHT = 0.1095
"""Thickness over mean radius of the thinnest arch with vertical cuts (Makris and Alexakis, 2013)."""
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
FACES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])
ROUGH = 50.0
"""Friction of joints that do not slide."""
LUNE = math.tan(math.radians(5))
"""Half the width of a lune of 10 degrees over the distance from the axis of its dome"""


def assembly(path: Path) -> Assembly:
    """The blocks of a file with the supports and the friction of its authors."""
    name = path.stem
    friction = FRICTIONS.get(name, FRICTION)
    return read_assembly(
        path, unit="m", up="z", density=2400, friction=friction, supports=SUPPORTS.get(name, ("0",))
    )


def watch(blocks: Assembly, seconds: float, compliance: float | None = None) -> tuple[float, float]:
    """Largest displacement over the size of a block, and when it passed MOVES (s; NaN if it did not)."""
    sizes = np.array([block.size for block in blocks.blocks if not block.fixed])
    simulation = amontons.Simulation(blocks.model(dent=DENT, compliance=compliance), dt=STEP)
    start, worst = simulation.state.positions.copy(), 0.0
    while simulation.time < seconds:
        simulation.step()
        moved = np.linalg.norm(simulation.state.positions - start, axis=1) / sizes
        worst = max(worst, float(moved.max(initial=0.0)))
        if worst > MOVES:
            return worst, simulation.time
    return worst, float("nan")


def rows(folder: Path, quick: bool) -> Iterator[dict[str, Any]]:
    warnings.simplefilter("ignore", amontons.StepWarning)
    for path in sorted(folder.glob("*.json")):
        blocks = assembly(path)
        verdict = stability(blocks, friction_margin=True)
        need = verdict.factors[0] if verdict.factors else None
        friction = FRICTIONS.get(path.stem, FRICTION)
        times = [watch(blocks, 0.2 if quick else SECONDS, compliance)[1] for compliance in (None, 0.0)]
        yield {
            "assembly": path.stem, "blocks": len(blocks.blocks), "friction": friction,
            "theirs": _word(VERDICTS.get(path.stem)), "verdict": verdict.verdict,
            "needed_with_prestress": "" if need is None else need.upper * friction,
            "needed": "" if need is None or math.isnan(need.placed) else need.placed * friction,
            "in_time": _fell(times[0]), "rigid_in_time": _fell(times[1]),
        }  # fmt: skip
    for name, theirs, ours in references(quick):
        yield {"assembly": name, "theirs": theirs, "verdict": ours}
    for what, seconds in times_of_a_wall(quick):
        yield {"assembly": what, "theirs": "", "verdict": seconds}


def references(quick: bool) -> Iterator[tuple[str, float, float]]:
    """Name, published value, ours."""
    for stones in (16, 31) if quick else (16, 31, 61, 121):
        least = thinnest_arch(stones, 2e-3 if quick else 1e-4)
        yield f"semicircular arch, {stones} stones: thickness over radius", MILANKOVITCH, least
    thick = ring(31 if quick else 121, math.pi / 2, 1.0, 0.3, friction=0.5)
    need = stability(thick, friction_margin=True).factors[0]
    yield "thick semicircular arch: friction that it needs", COCCHETTI_FRICTION, 0.5 * need.upper
    thin = ring(31 if quick else 121, math.pi / 2, 1.0, 0.110 if quick else 0.108, friction=0.5)
    need = stability(thin, friction_margin=True).factors[0]
    yield "thin semicircular arch: friction that it needs", COCCHETTI_THIN[1], 0.5 * need.upper
    upright = thinnest(lambda t: cut_upright(31 if quick else 81, t), 0.09, 0.13, 1e-3 if quick else 1e-4)
    yield "semicircular arch with vertical cuts: thickness over radius", UPRIGHT, upright
    dome = thinnest(lambda t: ring(31 if quick else 61, math.pi / 2, 1.0, t, lune=True), 0.03, 0.06, 1e-4)
    yield "lune of a hemispherical dome: thickness over radius (not verified)", HEYMAN, dome
    oppenheim = ring(7, math.radians(157.5) / 2, 10.0, 1.5)
    factor = stability(oppenheim, loads=[horizontal(1)]).factors[0]
    name = "arch of 157.5 degrees, 7 stones, thickness 0.15 radii: horizontal (g; not verified)"
    yield name, OPPENHEIM, factor.lower


def times_of_a_wall(quick: bool) -> Iterator[tuple[str, float]]:
    """Of a wall of a thousand bricks: iterations of one solve with compliance by two methods, processor
    seconds of the verdict, and of the verdict with a factor."""
    blocks = wall(4, 5) if quick else wall(40, 25)
    statics = stability(blocks).statics
    for method in ("interior-point", "auto"):
        problem = statics.problem(statics.weights, law="coulomb", compliance=1e-7)
        count = problem.solve(method=method, tolerance=1e-8).iterations
        yield f"wall, {len(blocks.blocks) - 1} bricks, placed freely: iterations of {method}", count
    for loads, asked in (((), "verdict"), ((horizontal(1),), "verdict and horizontal factor")):
        start = time.process_time()  # of all cores, which other programs do not change
        found = stability(blocks, loads=loads)
        seconds = time.process_time() - start
        wide = f"wall, {len(blocks.blocks) - 1} bricks, {len(found.statics.joints)} joints"
        yield f"{wide}: {asked} (processor s)", seconds


def wall(long: int, high: int) -> Assembly:
    """Bricks of 0.4 m x 0.2 m x 0.2 m in running bond on a ground."""
    cube = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    blocks = [Block("ground", (-1, -1, -1) + cube * (0.4 * long + 2, 3, 1), FACES, fixed=True)]
    for row in range(high):
        cuts = [0.4 * k for k in range(long + 1)]
        if row % 2:
            cuts = [0.0, *(0.4 * k - 0.2 for k in range(1, long + 1)), 0.4 * long]
        for k, (a, b) in enumerate(pairwise(cuts)):
            blocks.append(Block(f"{row}.{k}", (a, 0, 0.2 * row) + cube * (b - a, 0.2, 0.2), FACES))
    return Assembly(tuple(blocks))


def _word(stands: bool | None) -> str:
    return "" if stands is None else "stands" if stands else "falls"


def _fell(time: float) -> str:
    return "stands" if math.isnan(time) else f"falls after {time:.2f} s"


def cut_upright(stones: int, thickness: float) -> Assembly:
    """A semicircular arch of radius 1 m whose joints are vertical, on two springings without sliding."""
    inner, outer = 1 - thickness / 2, 1 + thickness / 2
    cuts = np.concatenate(
        ([-outer], inner * np.sin(np.linspace(-math.pi / 2, math.pi / 2, stones - 1)), [outer])
    )

    def height(radius: float, x: float) -> float:
        return math.sqrt(max(radius**2 - x**2, 0.0))

    blocks = []
    for k, (a, b) in enumerate(pairwise(cuts.tolist())):
        corners = [(x, y, height(r, x)) for x in (a, b) for y in (0.0, 0.2) for r in (inner, outer)]
        blocks.append(_hull(str(k), np.array(corners), False))
    for name, x in (("left", -1.0), ("right", 1.0)):
        low = np.array([(x - 0.2, -0.1, -0.2), (x + 0.2, 0.3, 0.0)])
        corners = np.array([(p, q, r) for p in low[:, 0] for q in low[:, 1] for r in low[:, 2]])
        blocks.append(_hull(name, corners, True))
    return Assembly(tuple(blocks))


def _hull(name: str, corners: Array, fixed: bool) -> Block:
    hull = ConvexHull(corners)
    return Block(name, corners, hull.simplices, friction=ROUGH, fixed=fixed)


def ring(
    stones: int, half: float, radius: float, thickness: float, *, lune: bool = False, friction: float = 2.0
) -> Assembly:
    """An arch over angles (rad) up to `half` from the plumb line between two supports; lune: as wide as two
    opposite sectors of 10 degrees of a dome, with a little more so that the crown has a width."""
    step = 2 * half / stones

    def stone(name: str, start: float, end: float, fixed: bool) -> Block:
        corners = []
        for angle in (start, end):
            for side in (-1, 1):
                for r in (radius - thickness / 2, radius + thickness / 2):
                    wide = LUNE * (r * abs(math.sin(angle)) + 0.003 * radius) if lune else radius / 4
                    corners.append((r * math.sin(angle), side * wide, r * math.cos(angle)))
        return Block(name, np.array(corners), FACES, friction=friction, fixed=fixed)

    ends = (stone("left", -half - step, -half, True), stone("right", half, half + step, True))
    return Assembly(
        (*ends, *(stone(str(k), -half + k * step, -half + (k + 1) * step, False) for k in range(stones)))
    )


def thinnest(build: Any, falls: float, stands: float, within: float) -> float:
    """The least value with which forces balance the weight of `build`, by halving an interval to `within`."""
    while stands - falls > within:
        middle = (falls + stands) / 2
        balanced = stability(build(middle)).equilibrium.status == "stands"
        falls, stands = (falls, middle) if balanced else (middle, stands)
    return stands


def thinnest_arch(stones: int, within: float) -> float:
    """Thickness over mean radius of the thinnest arch of the scene that stands."""
    return thinnest(
        lambda t: amontons.scenes.arch(stones=stones, radius=1.0, thickness=t, depth=0.2, mu=1.0),
        0.08,
        0.13,
        within,
    )
