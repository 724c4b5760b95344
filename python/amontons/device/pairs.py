"""The pairs of overlapping boxes on a device: pairs.cl by a backend, two reads per search."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

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


class PairFinder:
    """Finds pairs on a device. Searches at a time take buffers of their own, which stay for later ones."""

    def __init__(self, backend: Backend) -> None:
        self._backend = backend
        self._idle: list[Memory] = []

    @contextmanager
    def _memory(self) -> Iterator[Memory]:
        try:
            memory = self._idle.pop()
        except IndexError:
            memory = Memory(self._backend)
        yield memory  # what a search that fails leaves is given up
        self._idle.append(memory)

    def find(
        self, leaves: NDArray[np.int32], boxes: Array, balls: Array, fixed: NDArray[np.uint8], origin: Array
    ) -> tuple[int, NDArray[np.int32]]:
        """Nodes and leaves that were visited, and the pairs, (n, 2).

        leaves: (m,), the box of each leaf or -1, m a multiple of eight. boxes: (k, 6), lower and upper corner
        (m). balls: (k, 4), centre and radius. fixed: (k,); two fixed boxes are no pair. origin: (3,).
        """
        if not len(leaves):
            return 0, np.empty((0, 2), np.int32)
        with self._memory() as memory:
            return self._found(memory, leaves, boxes, balls, fixed, origin)

    def _found(
        self,
        memory: Memory,
        leaves: NDArray[np.int32],
        boxes: Array,
        balls: Array,
        fixed: NDArray[np.uint8],
        origin: Array,
    ) -> tuple[int, NDArray[np.int32]]:
        launch, groups = self._backend.launch, tiles(len(leaves))
        sizes = level_sizes(len(leaves))
        first = np.cumsum([0, *sizes[:-1]]).astype(np.uint32)
        nodes = memory.buffer("nodes", 4 * NODE * sum(sizes))
        tree = (
            memory.filled("order", leaves.view(np.uint32)), memory.filled("boxes", boxes),
            memory.filled("balls", balls), memory.filled("fixed", fixed), nodes,
            memory.filled("first", first), np.uint32(len(sizes) - 1), np.uint32(len(leaves)),
        )  # fmt: skip
        launch("fit_leaves", groups, *tree, *(np.float64(x) for x in origin))
        for below, size in enumerate(sizes[:-1]):
            launch("fit_nodes", tiles(WIDTH * sizes[below + 1]), nodes, first[below], np.uint32(size),
                   first[below + 1])  # fmt: skip
        counts, sums = memory.buffer("counts", 4 * len(leaves)), memory.buffer("sums", 16 * groups)
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
