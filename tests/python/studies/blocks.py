"""Blocks for the tests of verdicts."""

import itertools
import math

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


def ring(stones, half, radius, thickness, *, width=lambda r, angle: 0.1, mu=2.0):
    """Voussoirs over angles (rad) up to `half` from the plumb line; width: half of it, at a corner."""
    step = 2 * half / stones

    def stone(name, start, end, fixed):
        corners = [
            (r * math.sin(angle), side * width(r, angle), r * math.cos(angle))
            for angle in (start, end)
            for side in (-1, 1)
            for r in (radius - thickness / 2, radius + thickness / 2)
        ]
        return Block(name, np.array(corners), TRIANGLES, friction=mu, fixed=fixed)

    ends = (stone("left", -half - step, -half, True), stone("right", half, half + step, True))
    between = [stone(str(k), -half + k * step, -half + (k + 1) * step, False) for k in range(stones)]
    return Assembly((*ends, *between))
