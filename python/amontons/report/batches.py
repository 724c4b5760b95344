"""A model as batches: many instances of one surface, each fixed to a body."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from ..model.model import Model
from ..model.parts import WORLD, Geom
from ..model.turns import product, rotate
from ..model.visuals import Visual
from .colours import FIXED, colour_of
from .surfaces import Surface, form_of, surface_of

Row = tuple[int, int, Geom | Visual, Array, float]
"""Index, body, what it is, colour (3,) and opacity"""


@dataclass(frozen=True)
class Batch:
    """n instances of a surface."""

    surface: Surface
    items: NDArray[np.int32]
    """(n,) index of each geom or visual in the model"""
    bodies: NDArray[np.int32]
    """(n,), WORLD for what does not move"""
    positions: Array
    """(n, 3) in the body frame (m)"""
    rotations: Array
    """(n, 4) w, x, y, z in the body frame"""
    scales: Array
    """(n, 3)"""
    colours: NDArray[np.uint8]
    """(n, 3)"""
    opacity: float
    moves: bool

    def placed(self, positions: Array, orientations: Array) -> tuple[Array, Array]:
        """Positions (n, 3) and rotations (n, 4) in the world of instances that move, at poses of the
        bodies."""
        q = orientations[self.bodies]
        return positions[self.bodies] + rotate(q, self.positions), product(q, self.rotations)


def shapes_of(model: Model) -> list[Batch]:
    """The collision geometry but for planes, in colours by the kind of shape."""
    rows: list[Row] = []
    for index, geom in enumerate(model.geoms):
        rows.append((index, geom.body, geom, _colour(model, geom, index), 1.0))
    return _batches(model, rows)


def visuals_of(model: Model) -> list[Batch]:
    """The drawn parts of the model: its visuals, and the geoms of the bodies and links without any."""
    seen = {(visual.body, visual.link) for visual in model.visuals}
    if not seen:
        return shapes_of(model)
    rows: list[Row] = []
    for k, visual in enumerate(model.visuals):
        if visual.colour is None:
            rows.append((k, visual.body, visual, _colour(model, visual, k), 1.0))
        elif visual.colour[3] > 0:
            rows.append((k, visual.body, visual, np.array(visual.colour[:3]), visual.colour[3]))
    left: list[Row] = [
        (k, geom.body, geom, _colour(model, geom, k), 1.0)
        for k, geom in enumerate(model.geoms)
        if (geom.body, geom.link) not in seen and (geom.category or geom.mask)
    ]
    return _batches(model, rows) + _batches(model, left)


def _batches(model: Model, rows: Sequence[Row]) -> list[Batch]:
    """One per surface, opacity, and whether it moves."""
    groups: dict[Hashable, list[tuple[Row, tuple[float, float, float]]]] = {}
    for row in rows:
        form = form_of(row[2].shape)
        if form is not None:
            key = (form.key, round(row[4], 2), _moves(model, row[1]))
            groups.setdefault(key, []).append((row, form.scale))
    return [_batch(model, group) for group in groups.values()]


def _batch(model: Model, group: list[tuple[Row, tuple[float, float, float]]]) -> Batch:
    _, body, first, _, opacity = group[0][0]
    moves = _moves(model, body)
    bodies = np.array([row[1] for row, _ in group], dtype=np.int32)
    positions = np.array([row[2].frame.position for row, _ in group])
    rotations = np.array([row[2].frame.rotation for row, _ in group])
    if not moves:  # in the world, at once and for all
        poses = [model.bodies[b].pose if b != WORLD else None for b in bodies]
        base = np.array([p.position if p else (0.0, 0.0, 0.0) for p in poses])
        q = np.array([p.rotation if p else (1.0, 0.0, 0.0, 0.0) for p in poses])
        positions, rotations = base + rotate(q, positions), product(q, rotations)
    return Batch(
        surface=surface_of(first.shape, len(group)),
        items=np.array([row[0] for row, _ in group], dtype=np.int32),
        bodies=bodies,
        positions=positions,
        rotations=rotations,
        scales=np.array([scale for _, scale in group]),
        colours=np.array([np.round(255 * row[3]) for row, _ in group]).astype(np.uint8),
        opacity=opacity,
        moves=moves,
    )


def _colour(model: Model, thing: Geom | Visual, index: int) -> Array:
    return colour_of(type(thing.shape).__name__, index) if _moves(model, thing.body) else FIXED


def _moves(model: Model, body: int) -> bool:
    return body != WORLD and model.bodies[body].motion != "static"
