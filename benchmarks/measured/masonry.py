"""Assemblies of dry blocks, and the thinnest semicircular arch: do they stand?

An assembly stands if no block moves by more than a hundredth of its size within the time that it is watched.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import amontons
import amontons.scenes
import numpy as np
from amontons.shapes import Hull, Mesh, decompose
from scipy.spatial import ConvexHull

Array = np.ndarray[Any, Any]
FRICTION = 0.84
"""Of the authors' programs, where they give no other."""
FRICTIONS = {"shelf": 0.9, "shelf-stable": 0.9, "shelf-s1": 0.9, "bridge": 0.9, "snake": 0.7}
SUPPORTS = {name: ("0", "1") for name in ("A", "H", "bridge", "type-a", "type-b")}
"""Fixed blocks, where they are others than block 0."""
VERDICTS = {"shelf-stable": True, "shelf": False}
"""Of the authors' limit analysis, as far as the data tell it."""
SECONDS, STEP = 2.0, 5e-3
DENT = 0.01
"""Depth of dents that parts of a block may fill, over the size of the block."""
MOVES = 0.01
"""Displacement over the size of a block from which it has fallen."""
EXACT = 0.1074
"""Thickness of the thinnest semicircular arch over its mean radius."""


@dataclass(frozen=True)
class Block:
    name: str
    vertices: Array
    faces: list[list[int]]

    def triangles(self) -> Array:
        """Of its faces, as fans."""
        return np.array(
            [[face[0], face[k], face[k + 1]] for face in self.faces for k in range(1, len(face) - 1)]
        )

    def size(self) -> float:
        return float(np.ptp(self.vertices, axis=0).max())

    def is_convex(self) -> bool:
        a, b, c = (self.vertices[column] for column in self.triangles().T)
        volume = abs(np.sum(a * np.cross(b, c)) / 6)
        return volume > (1 - 1e-3) * ConvexHull(self.vertices).volume


def read_assembly(path: Path) -> list[Block]:
    """The blocks of an assembly of COMPAS."""
    data = json.loads(path.read_text())["data"]
    blocks = []
    for name, node in data["graph"]["data"]["node"].items():
        mesh = node["block"]["data"]
        place = {key: k for k, key in enumerate(mesh["vertex"])}
        vertices = np.array([[v[axis] for axis in "xyz"] for v in mesh["vertex"].values()])
        faces = [[place[str(v)] for v in face] for face in mesh["face"].values()]
        blocks.append(Block(name, vertices, faces))
    return sorted(blocks, key=lambda block: int(block.name))


def parts(block: Block, inside: Array) -> tuple[Hull, ...]:
    """The block as convex shapes; `inside` are its corners from its middle."""
    if block.is_convex():
        return (Hull(inside),)
    return decompose(Mesh(inside, block.triangles()), error=DENT * block.size()).hulls


def assembly(name: str, blocks: list[Block]) -> amontons.Model:
    """Supports are fixed; the others are hulls, those that are not convex in parts."""
    builder = amontons.ModelBuilder(gravity=(0, 0, -9.81))
    material = amontons.Material(friction=FRICTIONS.get(name, FRICTION))
    for block in blocks:
        middle = block.vertices.mean(axis=0)
        inside = block.vertices - middle
        if block.name in SUPPORTS.get(name, ("0",)):
            shape = Hull(inside) if block.is_convex() else Mesh(inside, block.triangles())
            builder.add_geom(None, shape, position=middle, material=material, name=f"support {block.name}")
        else:
            body = builder.add_body(f"block {block.name}", position=middle)
            for shape in parts(block, inside):
                builder.add_geom(body, shape, density=1.0, material=material)
    return builder.build()


def watch(model: amontons.Model, sizes: Array, seconds: float) -> tuple[float, float]:
    """Largest displacement over the size of a block, and when it passed MOVES (s; NaN if it did not)."""
    simulation = amontons.Simulation(model, dt=STEP)
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
        name, blocks = path.stem, read_assembly(path)
        row: dict[str, Any] = {"assembly": name, "blocks": len(blocks), "quantity": "stands"}
        row |= {"friction": FRICTIONS.get(name, FRICTION), "theirs": _word(VERDICTS.get(name))}
        model = assembly(name, blocks)
        sizes = np.array([b.size() for b in blocks if b.name not in SUPPORTS.get(name, ("0",))])
        moved, fell = watch(model, sizes, 0.2 if quick else SECONDS)
        note = "" if np.isnan(fell) else f"moved after {fell:.2f} s"
        yield row | {"ours": _word(np.isnan(fell)), "moved": moved, "note": note}
    for stones in (16, 31) if quick else (16, 31, 61):
        thinnest = thinnest_arch(stones, 2e-3 if quick else 2e-4)
        yield {
            "assembly": f"semicircular arch, {stones} stones", "blocks": stones,
            "quantity": "thinnest over radius", "friction": 1.0, "theirs": EXACT, "ours": thinnest,
            "moved": "", "note": "",
        }  # fmt: skip


def _word(stands: bool | np.bool_ | None) -> str:
    return "" if stands is None else "stands" if stands else "falls"


def thinnest_arch(stones: int, within: float) -> float:
    """Thickness over mean radius, by halving an interval until it is no longer than `within`."""
    falls, stands = 0.08, 0.13
    while stands - falls > within:
        middle = (falls + stands) / 2
        model = amontons.scenes.arch(stones=stones, radius=1.0, thickness=middle, depth=0.2, mu=1.0)
        _, fell = watch(model, np.full(stones, middle), SECONDS)
        falls, stands = (falls, middle) if np.isnan(fell) else (middle, stands)
    return stands
