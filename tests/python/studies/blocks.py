"""Blocks for the tests of verdicts."""

import itertools

import numpy as np
from amontons.studies import Assembly, Block

CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])


def box(name, low, size, **options):
    return Block(name, np.array(low) + CORNERS * np.array(size), TRIANGLES, **options)


def ground(**options):
    return box("ground", (-50, -50, -1), (100, 100, 1), fixed=True, **options)


def column(width, height, mu=0.7):
    """One block on the ground."""
    return Assembly((ground(friction=mu), box("block", (0, 0, 0), (width, 0.6, height), friction=mu)))


def wall(long, high, mu=0.6):
    """A wall of bricks 0.4 m x 0.2 m x 0.2 m in running bond, on the ground."""
    blocks = [ground(friction=mu)]
    for row in range(high):
        cuts = [0.4 * i for i in range(long + 1)]
        if row % 2:
            cuts = [0.0, *(0.4 * i - 0.2 for i in range(1, long + 1)), 0.4 * long]
        for k, (a, b) in enumerate(itertools.pairwise(cuts)):
            blocks.append(box(f"{row}.{k}", (a, 0, 0.2 * row), (b - a, 0.2, 0.2), friction=mu))
    return Assembly(tuple(blocks))
