"""Where the forces are not unique: the least and the largest force of a joint among all equilibria."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...checks import Array
from .statics import Statics

PUSHES = (1e-3, 1e-5)
"""Velocities, over that of the weights, by which a joint is pushed; the limit zero is extrapolated"""
UNBOUNDED = 1e4
"""Force over the weight of all blocks from which a range has no end: the blocks can be wedged"""


class Range(NamedTuple):
    """Bounds of a force among all equilibria (N)."""

    least: float
    largest: float

    @property
    def unique(self) -> bool:
        """Whether equilibrium alone determines it, within a thousandth."""
        return self.largest - self.least <= 1e-3 * max(abs(self.least), abs(self.largest))


def force_range(statics: Statics, loads: Array, joint: int, along: Array) -> Range:
    """The least and the largest component `along` (3,) of the force on block a of a joint.

    A joint whose sides are pushed together by a small velocity e takes the largest force that equilibrium
    allows. A support that settles takes the least. The problem minimises 1/2 v' M v + e x, and two values of
    e give the limit. Both ends may be infinite where blocks can be wedged.
    """
    owner = statics.corners[1]
    frame = np.array([statics.joints[joint].normal, *statics.joints[joint].axes])
    weight = float(np.linalg.norm(loads[:, :3], axis=1).sum())
    speed = float(np.abs(statics.jacobian @ (statics.mobility @ loads.ravel())).max(initial=0.0))
    ends = []
    for sign in (1.0, -1.0):
        found = []
        for push in PUSHES:
            bias = np.zeros(statics.operator.shape[0])
            bias[: 3 * len(owner)].reshape(-1, 3)[owner == joint] = sign * push * speed * (frame @ along)
            solution = statics.problem(loads, bias=bias).solve(method="interior-point", tolerance=1e-10)
            x = (solution.x - statics.shift)[: 3 * len(owner)].reshape(-1, 3)
            found.append(float(np.sum(x[owner == joint] @ (frame @ along))))
            if solution.status == "infeasible" or abs(found[-1]) > UNBOUNDED * weight:
                found.append(-sign * math.inf)
                break
        value = found[-1]
        if math.isfinite(value):
            ratio = PUSHES[1] / PUSHES[0]
            value = (found[1] - ratio * found[0]) / (1 - ratio)
        ends.append(value)
    return Range(*ends)
