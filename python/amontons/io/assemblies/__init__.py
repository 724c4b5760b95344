"""Assemblies of blocks from drawings: OBJ, STL, glTF, COMPAS JSON, IFC."""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from os import PathLike
from pathlib import Path

import numpy as np

from ...checks import Array, chosen, nonnegative_number, positive
from ...errors import FileError, ModelWarning
from ...model.assembly import DENSITY, FRICTION, Assembly, Block
from ..files import existing
from .compas import read_compas
from .gltf import read_gltf
from .ifc import read_ifc
from .obj import read_obj
from .shells import Shell
from .stl import read_stl

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Metres per unit of a file"""
UP = {
    "z": np.eye(3),
    "y": np.array([(1, 0, 0), (0, 0, -1), (0, 1, 0)]),
    "x": np.array([(0, 0, 1), (0, 1, 0), (-1, 0, 0)]).astype(float),
}
"""Rotations that turn an axis of the file upwards"""
READERS: dict[str, tuple[Callable[[Path], list[Shell]], str, str]] = {
    ".obj": (read_obj, "m", "z"),
    ".stl": (read_stl, "m", "z"),
    ".gltf": (read_gltf, "m", "y"),
    ".glb": (read_gltf, "m", "y"),
    ".json": (read_compas, "m", "z"),
    ".ifc": (read_ifc, "m", "z"),
}
"""For each suffix the reader, and what unit and upward axis the format has or usually has"""
LARGE = 20.0
"""m, median size of the blocks from which the unit of a file is in doubt"""
SMALL = 2e-3
SUPPORT = re.compile(r"(^|[^a-z])(support|ground|foundation|footing|abutment|pad)s?([^a-z]|$)", re.IGNORECASE)
"""Names of blocks that are supports where a file marks none"""


def read_assembly(
    path: str | PathLike[str],
    *,
    unit: str | None = None,
    up: str | None = None,
    supports: str | Iterable[str | int] | None = None,
    density: float | None = None,
    friction: float | None = None,
) -> Assembly:
    """Blocks of a drawing: .obj, .stl, .gltf, .glb (by trimesh), COMPAS .json, .ifc (by ifcopenshell).

    One block per closed shell; objects, groups, solids, nodes and products name them.
    unit: of the file, m, dm, cm, mm, in or ft; None for m, and for what an IFC file says.
    up: the axis of the file that points up, "x", "y" or "z"; None for "y" in glTF and "z" in the others.
    supports: names of blocks, "lowest" or "ground", see `Assembly.with_supports`; None for those that the
        file marks or whose name says so (support, ground, foundation, footing, abutment, pad).
    density: of all blocks (kg/m^3), friction: of all faces; None for those of the file, or 2400 and 0.6.

    `Assembly.notes` has all that was assumed. A ModelWarning says that sizes look like millimetres.
    Raises FileNotFoundError, FileError for what is no such file, InputError that names the bad block.

    >>> import amontons.studies as studies
    >>> arch = studies.read_assembly(examples.path("arch.obj"))
    >>> studies.stability(arch).verdict
    'stands'
    """
    path = existing(path, "an assembly")
    if path.suffix.lower() not in READERS:
        raise FileError(
            f"{path}: is no {', '.join(READERS)} file; export the blocks as .obj, one object each"
        )
    read, usual_unit, usual_up = READERS[path.suffix.lower()]
    scale = UNITS[chosen_key("unit", unit or usual_unit, UNITS)]
    turned = UP[chosen_key("up", up or usual_up, UP)]
    shells = read(path)
    if not shells:
        raise FileError(f"{path}: has no blocks; export each block as a closed mesh")
    marked = any(shell.fixed for shell in shells)
    by_name = supports is None and not marked
    blocks = []
    for name, shell in zip(_names(shells), shells, strict=True):
        dense = density if density is not None else shell.density
        rough = friction if friction is not None else shell.friction
        block = Block(
            name,
            scale * shell.vertices @ turned.T,
            shell.triangles,
            density=DENSITY if dense is None else positive("density", dense),
            friction=FRICTION if rough is None else nonnegative_number("friction", rough),
            fixed=bool(SUPPORT.search(shell.name)) if by_name else shell.fixed,
        )
        blocks.append(block)
    assembly = Assembly(tuple(blocks))
    if supports is not None:
        assembly = assembly.with_supports(supports)
    if unit is None:
        _warn_of_unit(path, assembly)
    assumed = {"unit": unit is None, "up": up is None, "supports": by_name}
    assumed["density"] = density is None and all(shell.density is None for shell in shells)
    assumed["friction"] = friction is None and all(shell.friction is None for shell in shells)
    return Assembly(assembly.blocks, assembly.gravity, tuple(_notes(path, assembly, assumed)))


def _notes(path: Path, assembly: Assembly, assumed: dict[str, bool]) -> Iterator[str]:
    """A sentence for each thing that neither the caller nor the file said."""
    kind = path.suffix.lower()
    if assumed["unit"] and kind in (".obj", ".stl", ".json"):
        yield "unit: metres, since the file says none"
    if assumed["up"] and kind in (".obj", ".stl"):
        yield "up: z, since the file says none"
    if assumed["density"]:
        yield f"the file gives no density: blocks have {DENSITY:g} kg/m^3"
    if assumed["friction"]:
        yield f"the file gives no friction: faces have {FRICTION:g}"
    if assumed["supports"] and assembly.supports:
        yield f"supports, by their names: {', '.join(assembly.supports[:5])}"


def chosen_key(what: str, key: object, known: dict[str, float] | dict[str, Array]) -> str:
    """The key, if it is one of `known`; InputError names those."""
    chosen(what, key, dict.fromkeys(known, True))
    return str(key)


def _names(shells: list[Shell]) -> list[str]:
    """A name of its own for each shell: repeated ones get a number."""
    counts = Counter(shell.name for shell in shells)
    given: Counter[str] = Counter()
    taken = set(counts)
    names = []
    for k, shell in enumerate(shells):
        base = shell.name or "block"
        name = base
        if not shell.name or counts[shell.name] > 1:
            while True:
                given[base] += 1
                name = f"{base} {given[base]}"
                if name not in taken:
                    break
        taken.add(name)
        names.append(name or f"block {k}")
    return names


def _warn_of_unit(path: Path, assembly: Assembly) -> None:
    size = float(np.median([block.size for block in assembly.blocks]))
    if size > LARGE or size < SMALL:
        meant = "mm" if size > LARGE else "another unit"
        warnings.warn(
            f"{path}: the median block is {size:.4g} m long, as if the file were in {meant}; "
            'give unit="mm", or unit="m" if it is right',
            ModelWarning,
            stacklevel=3,
        )
