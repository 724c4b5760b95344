"""The factor at which a growing load is no longer borne, between two certificates."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from .loads import Load, largest_factor
from .statics import Equilibrium, Statics

WITHIN = 1e-3
"""Default width of the interval, over the factor"""
PLACED_WITHIN = 0.02
"""Width, over the factor, of the search for blocks placed without stress"""
MANY = 1000
"""Joints from which that search only tries the factor below the last refuted one: a solve takes seconds"""
SHARE = "of the friction"
NO_FRICTION = 1e-4
"""Share of friction that is none"""
SOLVES = 60
"""Solves of a search; a bisection from the largest factor takes about 30"""


@dataclass(frozen=True, eq=False)
class Factor:
    """The factor of collapse of a load, between two that are proved.

    >>> from amontons.studies import horizontal, stability
    >>> factor = stability(scenes.make("arch"), loads=[horizontal(1)]).factors[0]
    >>> factor.unit, 0 < factor.lower < factor.upper
    ('g', True)
    """

    load: str
    unit: str
    lower: float
    """the largest factor that forces in the cones were found to balance"""
    upper: float
    """the smallest factor that a mechanism refutes; inf if none was found up to the largest one tried"""
    forces: Equilibrium | None
    """at the lower end; None if the blocks fall under their weight alone"""
    mechanism: Equilibrium | None
    """that refutes the upper end; None if it is inf"""
    placed: float
    """a factor at which blocks placed without stress stay by Coulomb's law, within 2 % of the largest; NaN
    where it was not searched, or where they move under their weight"""
    solves: int

    def __str__(self) -> str:
        if self.unit == SHARE:
            return f"{self.load}: needs between {self.lower:.4g} and {self.upper:.4g} {self.unit}"
        if math.isinf(self.upper):
            return f"{self.load}: stands at {self.lower:.4g} {self.unit}, the largest tried"
        return f"{self.load}: falls between {self.lower:.4g} and {self.upper:.4g} {self.unit}"


def load_factor(statics: Statics, load: Load, *, within: float = WITHIN, placed: bool = True) -> Factor:
    """Search from above: each mechanism refutes all factors down to the one at which its power is zero.

    That is Newton's method for the convex function "acceleration left over the factor". The interval closes
    when forces balance the load just below the last refuted factor.
    """
    start = statics.solve(load.at(statics, 0.0))
    solves = 1
    if start.status != "stands":
        return Factor(load.name, load.unit, 0.0, 0.0, None, start, 0.0, solves)
    lower, forces = 0.0, start
    top = largest_factor(load, statics.assembly, load.parts(statics)[1])
    upper, mechanism = top, statics.solve(load.at(statics, top))
    solves += 1
    if mechanism.status == "stands":
        kept = _placed(statics, load, top) if placed else math.nan
        return Factor(load.name, load.unit, top, math.inf, mechanism, None, kept, solves)
    upper = min(upper, load.refuted(statics, mechanism.acceleration, mechanism.power, upper))
    while upper - lower > within * upper and solves < SOLVES:
        aim = upper * (1 - within / 2) if upper > lower / (1 - within) else upper
        found = statics.solve(load.at(statics, aim))
        solves += 1
        if found.status == "falls":
            refuted = min(aim, load.refuted(statics, found.acceleration, found.power, aim))
            if upper - refuted > 0.05 * (upper - lower):
                upper, mechanism = max(refuted, lower), found
                continue
            upper, mechanism = refuted, found
        elif found.status == "stands":
            lower, forces = aim, found
            continue
        middle = (lower + upper) / 2
        found = statics.solve(load.at(statics, middle))
        solves += 1
        if found.status == "stands":
            lower, forces = middle, found
        elif found.status == "falls":
            upper = min(middle, load.refuted(statics, found.acceleration, found.power, middle))
            mechanism = found
        else:
            break
    kept = _placed(statics, load, upper) if placed else math.nan
    return Factor(load.name, load.unit, lower, upper, forces, mechanism, kept, solves)


def _placed(statics: Statics, load: Load, high: float) -> float:
    """The largest factor at which blocks placed without stress stay, from below."""

    def stays(factor: float) -> bool:
        return statics.placed(load.at(statics, factor)).status == "stands"

    near = high * (1 - PLACED_WITHIN)
    if stays(near):
        return near
    if len(statics.joints) > MANY or not stays(0.0):
        return math.nan
    low, high = 0.0, near
    while high - low > PLACED_WITHIN * high:
        middle = (low + high) / 2
        low, high = (middle, high) if stays(middle) else (low, middle)
    return low


def least_friction(statics: Statics, *, within: float = WITHIN) -> Factor:
    """The share of all coefficients of friction that the weight needs, between two certificates.

    Less friction is worse: a mechanism refutes `lower` and forces prove `upper`. `placed` is the share with
    which blocks placed without stress stay.
    """
    loads = statics.weights
    found = statics.solve(loads)
    if found.status != "stands":
        return Factor("friction", SHARE, 1.0, math.inf, None, found, math.nan, 1)
    low, high, solves = 0.0, 1.0, 2
    forces, mechanism = found, replace(statics, friction=0.0).solve(loads)
    if mechanism.status == "stands":
        return Factor("friction", SHARE, 0.0, 0.0, mechanism, None, 0.0, solves)
    while high - low > max(within * high, NO_FRICTION):
        middle = (low + high) / 2
        found = replace(statics, friction=middle).solve(loads)
        solves += 1
        if found.status == "stands":
            high, forces = middle, found
        else:
            low, mechanism = middle, found
    return Factor("friction", SHARE, low, high, forces, mechanism, _placed_friction(statics, high), solves)


def _placed_friction(statics: Statics, least: float) -> float:
    """The least share of friction with which blocks placed without stress stay, from above."""

    def stays(share: float) -> bool:
        return replace(statics, friction=share).placed(statics.weights).status == "stands"

    near = least * (1 + PLACED_WITHIN)
    if near >= 1 or not stays(1.0):
        return 1.0 if near >= 1 and stays(1.0) else math.nan
    if stays(near):
        return near
    if len(statics.joints) > MANY:
        return math.nan
    low, high = near, 1.0
    while high - low > PLACED_WITHIN * high:
        middle = (low + high) / 2
        low, high = (low, middle) if stays(middle) else (middle, high)
    return high
