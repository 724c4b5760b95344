"""Assemblies of blocks: closed surfaces in place, which of them are supports, and the model of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..checks import Array, finite, frozen, nonnegative_number, positive, reals, shown, text
from ..errors import InputError
from .builder import ModelBuilder
from .decomposing import decompose
from .mass import MassProperties
from .model import Model
from .parts import Material
from .shapes import Hull, Mesh

DENSITY = 2400.0
"""kg/m^3, of stone, where a file says none"""
FRICTION = 0.6
"""Coulomb's coefficient of dry stone joints, where a file says none"""
CONVEX = 1e-3
"""Share of the volume of its hull that a block may lack and still be one hull"""
NEAR = 1e-9
"""Distance, over the size of a block, below which two corners are one"""
SOFT = 1e-6
"""Compliance of a contact point, over the size of a block and its weight: that share of the size gives"""
NAMED = 5
"""Blocks that a message names"""


@dataclass(frozen=True, eq=False)
class Block:
    """A rigid block as a closed surface of triangles in world coordinates.

    Raises InputError with the name of the block: corners that are not finite, a surface that is open or has
    no volume. A surface that faces inwards, or whose triangles disagree, is turned. A support may be open.

    >>> from amontons.studies import Block
    >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    >>> faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
    >>> round(Block("wedge", corners, faces, density=6).mass.mass, 9)
    1.0
    """

    name: str
    vertices: Array
    """(n, 3) corners in the world (m)"""
    triangles: NDArray[np.int64]
    """(t, 3) indices of corners, counter-clockwise seen from outside"""
    density: float = DENSITY
    """kg/m^3"""
    friction: float = FRICTION
    """Coulomb's coefficient of its faces; that of a joint is the geometric mean of both"""
    fixed: bool = False
    """whether it is a support"""
    given_mass: MassProperties | None = field(default=None, repr=False)
    """mass, centre and inertia (kg, m, kg m^2, world axes) in place of those of the solid"""

    def __post_init__(self) -> None:
        who = f"block {shown(text('block name', self.name))}"
        points = finite(f"{who}: vertices", reals(f"{who}: vertices", self.vertices))
        if points.ndim != 2 or points.shape[1] != 3:
            raise InputError(f"{who}: vertices have shape {points.shape}; give (n, 3) corners")
        faces = np.asarray(self.triangles)
        if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu" or not len(faces):
            raise InputError(f"{who}: triangles must be (t, 3) indices of corners, at least one")
        if faces.min() < 0 or faces.max() >= len(points):
            raise InputError(f"{who}: a triangle names corner {int(faces.max())} of {len(points)}")
        points, faces = _welded(points, faces.astype(np.int64))
        if self.given_mass is None:
            faces = _outwards(who, points, faces, self.fixed)
        object.__setattr__(self, "vertices", frozen(points))
        object.__setattr__(self, "triangles", frozen(faces))
        positive(f"{who}: density", self.density)
        nonnegative_number(f"{who}: friction", self.friction)

    @cached_property
    def mass(self) -> MassProperties:
        """Mass (kg), centre of mass (m) and inertia about it (kg m^2), in world coordinates."""
        if self.given_mass is not None:
            return self.given_mass
        return Mesh(self.vertices, self.triangles.astype(np.int32)).mass_properties(self.density)

    @property
    def size(self) -> float:
        """The longest edge of its bounding box (m)."""
        return float(np.ptp(self.vertices, axis=0).max())

    @property
    def is_convex(self) -> bool:
        """Whether it is its own convex hull, within a thousandth of its volume."""
        volume = self.mass.mass / self.density
        return volume > (1 - CONVEX) * Hull(self.vertices).volume()


@dataclass(frozen=True, eq=False)
class Assembly:
    """Blocks that touch over faces, some of them supports.

    Raises InputError for two blocks of one name.

    >>> from amontons.studies import read_assembly
    >>> arch = read_assembly(examples.path("arch.obj"), unit="m", up="z")
    >>> len(arch.blocks), arch.supports == arch.with_supports("lowest").supports
    (17, True)
    """

    blocks: tuple[Block, ...]
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    """m/s^2"""
    notes: tuple[str, ...] = ()
    """what its reader assumed or changed"""

    def __post_init__(self) -> None:
        object.__setattr__(self, "blocks", tuple(self.blocks))
        if not self.blocks:
            raise InputError("an assembly needs at least one block")
        name, count = Counter(block.name for block in self.blocks).most_common(1)[0]
        if count > 1:
            raise InputError(f"{count} blocks are named {shown(name)}; give each a name of its own")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the blocks, in their order."""
        return tuple(block.name for block in self.blocks)

    @property
    def supports(self) -> tuple[str, ...]:
        """Names of the blocks that are supports."""
        return tuple(block.name for block in self.blocks if block.fixed)

    def index(self, name: str | int) -> int:
        """The index of a block by its name; InputError if there is none."""
        if str(name) not in self.names:
            near = ", ".join(map(repr, self.names[:NAMED])) + (", ..." if len(self.names) > NAMED else "")
            raise InputError(f"there is no block {shown(name)}; the assembly has {near}")
        return self.names.index(str(name))

    def with_supports(self, supports: str | Iterable[str | int]) -> Assembly:
        """The same blocks with other supports: their names, "lowest" or "ground".

        "lowest": the blocks whose lowest corner is the lowest of all, within a thousandth of their size.
        "ground": a horizontal sheet under the lowest corner, as a block named "ground".
        """
        low = np.array([block.vertices[:, 2].min() for block in self.blocks])
        if isinstance(supports, str) and supports == "ground":
            free = tuple(replace(block, fixed=False) for block in self.blocks)
            return replace(self, blocks=(*free, _ground(self.blocks)))
        if isinstance(supports, str) and supports == "lowest":
            size = np.array([block.size for block in self.blocks])
            chosen = set(np.flatnonzero(low <= low.min() + 1e-3 * size).tolist())
        else:
            chosen = {self.index(name) for name in ([supports] if isinstance(supports, str) else supports)}
        blocks = (replace(block, fixed=i in chosen) for i, block in enumerate(self.blocks))
        return replace(self, blocks=tuple(blocks))

    def model(
        self, *, dent: float = 0.01, compliance: float | None = None, moving_supports: bool = False
    ) -> Model:
        """The model whose simulation answers the same question in time.

        Blocks that are not convex are convex parts (`shapes.decompose`, needs coacd) that fill dents of up to
        `dent` times the size of the block; supports are geoms of the world.
        compliance: of a contact point (m/N), without damping; None for SOFT times the median size of a block
        over its weight. Rigid contacts (0) let the rounding of a drawing decide which forces occur.
        moving_supports: supports are kinematic bodies, which keep the velocity that the state holds.
        """
        free = [block for block in self.blocks if not block.fixed]
        if compliance is None and free:
            weight = np.median([block.mass.mass for block in free]) * np.linalg.norm(self.gravity)
            compliance = SOFT * float(np.median([block.size for block in free]) / max(weight, 1e-300))
        builder = ModelBuilder(gravity=self.gravity)
        for block in self.blocks:
            material = Material(friction=block.friction, compliance=(compliance or 0.0) / 2)
            if block.fixed:
                shape = Mesh(block.vertices, block.triangles.astype(np.int32))
                carrier = builder.add_body(block.name, motion="kinematic") if moving_supports else None
                name = None if moving_supports else block.name
                builder.add_geom(carrier, shape, material=material, name=name)
                continue
            middle = np.array(block.mass.centre_of_mass)
            inside = block.vertices - middle
            body = builder.add_body(block.name, position=tuple(middle))
            for hull in _parts(block, inside, dent):
                builder.add_geom(body, hull, density=block.density, material=material)
        return builder.build()


def _parts(block: Block, inside: Array, dent: float) -> Sequence[Hull]:
    if block.is_convex:
        return (Hull(inside),)
    return decompose(Mesh(inside, block.triangles.astype(np.int32)), error=dent * block.size).hulls


def _ground(blocks: Sequence[Block]) -> Block:
    points = np.concatenate([block.vertices for block in blocks])
    (x0, y0, z), (x1, y1, _) = points.min(axis=0), points.max(axis=0)
    wide = max(x1 - x0, y1 - y0) + max(block.size for block in blocks)
    corners = [
        (x0 - wide, y0 - wide, z),
        (x1 + wide, y0 - wide, z),
        (x1 + wide, y1 + wide, z),
        (x0 - wide, y1 + wide, z),
    ]
    friction = float(np.mean([block.friction for block in blocks]))
    return Block("ground", np.array(corners), np.array([(0, 1, 2), (0, 2, 3)]), friction=friction, fixed=True)


def _welded(points: Array, faces: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Corners of one place become one; triangles without area, and corners without a triangle, go."""
    grid = NEAR * max(float(np.ptp(points, axis=0).max()), 1e-300)
    _, first, index = np.unique(
        np.round((points - points.min(axis=0)) / grid), axis=0, return_index=True, return_inverse=True
    )
    faces = index.reshape(-1)[faces]
    distinct = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    used, faces = np.unique(faces[distinct], return_inverse=True)
    return points[first][used].copy(), faces.reshape(-1, 3).astype(np.int64)


def _outwards(who: str, points: Array, faces: NDArray[np.int64], may_be_open: bool) -> NDArray[np.int64]:
    """Triangles turned so that neighbours agree and the volume is positive; InputError if it is open."""
    if not may_be_open and _is_flat(points):
        raise InputError(f"{who}: it has no volume, its corners lie in a plane; give a solid")
    edges = np.sort(np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    place, counts = np.unique(edges, axis=0, return_counts=True)
    if np.any(counts != 2):
        if may_be_open:
            return faces
        wrong = place[counts != 2][0]
        at = ", ".join(f"{x:.4g}" for x in points[wrong].mean(axis=0))
        raise InputError(
            f"{who}: its surface is not closed: {int(np.sum(counts != 2))} edges do not belong to two "
            f"triangles, one near ({at}) m; close it where it was drawn"
        )
    faces = _agreeing(faces)
    a, b, c = (points[faces[:, k]] - points.mean(axis=0) for k in range(3))
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
    if abs(volume) < 1e-9 * float(np.ptp(points, axis=0).max()) ** 3 and not may_be_open:
        raise InputError(f"{who}: it has no volume ({volume:.2g} m^3); give a solid")
    return faces if volume > 0 else faces[:, ::-1].copy()


def _is_flat(points: Array) -> bool:
    """Whether corners lie in a plane, within 1e-9 of their extent."""
    if len(points) < 4:
        return True
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(extents[2] <= NEAR * extents[0])


def _agreeing(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Neighbouring triangles run along their common edge in opposite directions, from the first one on."""
    faces = faces.copy()
    by_edge: dict[tuple[int, int], list[int]] = {}
    for t, face in enumerate(faces.tolist()):
        for k in range(3):
            by_edge.setdefault(tuple(sorted((face[k], face[(k + 1) % 3]))), []).append(t)  # type: ignore[arg-type]
    seen = np.zeros(len(faces), dtype=bool)
    for start in range(len(faces)):
        waiting = [] if seen[start] else [start]
        seen[start] = True
        while waiting:
            t = waiting.pop()
            face = faces[t].tolist()
            for k in range(3):
                a, b = face[k], face[(k + 1) % 3]
                for other in by_edge[(min(a, b), max(a, b))]:
                    if seen[other]:
                        continue
                    near = faces[other].tolist()
                    if any((near[j], near[(j + 1) % 3]) == (a, b) for j in range(3)):
                        faces[other] = near[::-1]
                    seen[other] = True
                    waiting.append(other)
    return faces
