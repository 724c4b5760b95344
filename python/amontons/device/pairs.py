"""The pairs of overlapping boxes on a device: pairs.cl by a backend, two reads per search."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import Array
from .backend import Backend, Memory, no_room
from .methods import tiles

WIDTH, NODE = 8, 56
"""children and floats of a node, as pairs.cl has them"""
MOST_PAIRS = 1 << 31
"""whose places a kernel can count"""


def level_sizes(leaves: int) -> list[int]:
    """Nodes of each level of the tree, from that of the leaves to its one root."""
    sizes = [leaves // WIDTH]
    while sizes[-1] > 1:
        sizes.append(-(-sizes[-1] // WIDTH))
    return sizes


@dataclass
class Held:
    """Buffers of a search, and the numbers of what they hold: the searches of a step share poses, those of
    many steps an order."""

    memory: Memory
    order: int = 0
    placed: int = 0
    apart: NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, np.uint32))
    """boxes that have no ball"""


class PairFinder:
    """Finds pairs on a device. Searches at a time take buffers of their own, which stay for later ones."""

    def __init__(self, backend: Backend) -> None:
        self._backend = backend
        self._idle: list[Held] = []

    @contextmanager
    def _held(self) -> Iterator[Held]:
        try:
            held = self._idle.pop()
        except IndexError:
            held = Held(Memory(self._backend))
        yield held  # what a search that fails leaves is given up
        self._idle.append(held)

    def find(
        self, leaves: NDArray[np.int32], number: int, boxes: Array, balls: Array, placed: int, travels: Array,
        fixed: NDArray[np.uint8], origin: Array,
    ) -> tuple[int, NDArray[np.int32]]:  # fmt: skip
        """Nodes and leaves that were visited, and the pairs, (n, 2).

        leaves: (m,), the box of each leaf or -1, m a multiple of eight; equal numbers: equal leaves. boxes:
        (k, 6), lower and upper corner (m). balls: (k, 4), centre and radius, infinite where a box has none;
        equal numbers `placed` other than 0: equal balls. travels: (k, 3), of the centres (m). fixed: (k,);
        two fixed boxes are no pair. origin: (3,).
        """
        if not len(leaves):
            return 0, np.empty((0, 2), np.int32)
        with self._held() as held:
            self._place(held, balls, placed)
            if held.order != number:
                held.memory.filled("order", leaves.view(np.uint32))
                held.order = number
            held.memory.filled("fixed", fixed)
            self._reach_out(held, boxes, travels)
            return self._found(held.memory, len(leaves), origin)

    def _place(self, held: Held, balls: Array, placed: int) -> None:
        if placed and held.placed == placed:
            return
        held.memory.filled("balls", balls)
        held.apart = np.flatnonzero(np.isinf(balls[:, 3])).astype(np.uint32)
        held.memory.filled("apart", held.apart)
        held.placed = placed

    def _reach_out(self, held: Held, boxes: Array, travels: Array) -> None:
        """Boxes of balls are made on the device, the others sent."""
        memory, count, apart = held.memory, len(boxes), len(held.apart)
        there = memory.buffer("boxes", boxes.nbytes)
        balls, moves = memory.buffer("balls", 32 * count), memory.buffer("travels", travels.nbytes)
        if apart < count:
            memory.upload(moves, travels)
            self._backend.launch("boxes_of_balls", tiles(count), balls, moves, np.uint32(count), there)
        if apart:
            given = memory.filled("given", boxes[held.apart])
            which = memory.buffer("apart", held.apart.nbytes)
            self._backend.launch("put_boxes", tiles(apart), which, given, np.uint32(apart), there)

    def _found(self, memory: Memory, leaves: int, origin: Array) -> tuple[int, NDArray[np.int32]]:
        launch, groups = self._backend.launch, tiles(leaves)
        sizes = level_sizes(leaves)
        first = np.cumsum([0, *sizes[:-1]]).astype(np.uint32)
        nodes = memory.buffer("nodes", 4 * NODE * sum(sizes))
        there: tuple[Any, ...] = tuple(
            memory.buffer(name, 0) for name in ("order", "boxes", "balls", "travels", "fixed")
        )
        tree = (*there, nodes, memory.filled("first", first), np.uint32(len(sizes) - 1), np.uint32(leaves))
        launch("fit_leaves", groups, *tree, *(np.float64(x) for x in origin))
        for below, size in enumerate(sizes[:-1]):
            launch("fit_nodes", tiles(WIDTH * sizes[below + 1]), nodes, first[below], np.uint32(size),
                   first[below + 1])  # fmt: skip
        counts, sums = memory.buffer("counts", 4 * leaves), memory.buffer("sums", 16 * groups)
        launch("count_pairs", groups, *tree, counts, sums)
        of_tiles, visits = self._backend.download(sums, 0, 2 * groups).reshape(2, groups)
        ends = np.cumsum(of_tiles)
        total = int(ends[-1])
        if total >= MOST_PAIRS:
            raise no_room(self._backend.device, 8 * total)
        if total:
            pairs = memory.buffer("pairs", 8 * total)
            launch("write_pairs", groups, *tree, counts, memory.filled("begins", ends - of_tiles), pairs)
            found = self._backend.download(pairs, 0, total).view(np.int32).reshape(total, 2)
        else:
            found = np.empty((0, 2), np.int32)
        return int(visits.sum()), found
