"""Loads that grow by a factor: where they act, in which unit, and which factor a mechanism refutes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...checks import Array, entries, point, vector3
from ...errors import InputError
from ...model.assembly import Assembly
from .statics import Statics

Builder = Callable[[Statics], tuple[Array, Array]]


@dataclass(frozen=True)
class Load:
    """A load that grows beside the weight; made by `horizontal`, `tilt` or `point_load`.

    >>> from amontons.studies import tilt
    >>> tilt(1).unit
    'deg'
    """

    name: str
    unit: str
    """of the factor"""
    parts: Builder
    """(weight, growing load) of a Statics, (n, 6) each (N, N m)"""
    turns: bool = False
    """whether the factor is an angle, by which weight turns into load"""
    largest: float = 1e3
    """factor up to which collapse is looked for"""

    def at(self, statics: Statics, factor: float) -> Array:
        """The loads (n, 6) at a factor."""
        dead, live = self.parts(statics)
        if self.turns:
            angle = math.radians(factor)
            return math.cos(angle) * dead + math.sin(angle) * live
        return dead + factor * live

    def refuted(self, statics: Statics, velocity: Array, power: float, factor: float) -> float:
        """The least factor at which the mechanism `velocity` (n, 6), with `power` > 0 at `factor`, is proof.

        The power is linear in the factor, or a sum of sine and cosine, which Newton's method takes to zero
        from above.
        """
        dead, live = self.parts(statics)
        still, grows = float(np.sum(dead * velocity)), float(np.sum(live * velocity))
        if not self.turns:
            return factor - power / grows if grows > 0 else -math.inf
        resists = math.cos(math.radians(factor)) * still + math.sin(math.radians(factor)) * grows - power
        size = math.hypot(still, grows)
        return math.degrees(math.asin(min(1.0, resists / size)) - math.atan2(still, grows))


def horizontal(x: float, y: float = 0.0) -> Load:
    """An acceleration of the ground along (-x, -y): each block is pushed along (x, y) by a share of its
    weight. The factor is in g.

    >>> from amontons.studies import horizontal
    >>> horizontal(1).name
    'horizontal (1, 0)'
    """
    along = _direction(x, y)
    return Load(f"horizontal ({along[0]:g}, {along[1]:g})", "g", lambda s: (s.weights, _pushed(s, along)))


def tilt(x: float, y: float = 0.0) -> Load:
    """The ground tilts until the side towards (x, y) is the lower one by this angle. The factor is in deg.

    >>> from amontons.studies import tilt
    >>> tilt(0, 1).name
    'tilt (0, 1)'
    """
    along = _direction(x, y)
    name = f"tilt ({along[0]:g}, {along[1]:g})"
    return Load(name, "deg", lambda s: (s.weights, _pushed(s, along)), turns=True, largest=90.0)


def point_load(
    block: str, force: tuple[float, float, float], at: tuple[float, float, float] | None = None
) -> Load:
    """A force (N, world axes) on a block at a point of the world (m), its centre of mass if None.

    The factor multiplies the force.

    >>> from amontons.studies import point_load
    >>> point_load("stone 7", (0, 0, -100)).unit
    'of the force'
    """
    push = np.array(vector3("point load: force", force))
    if not np.any(push):
        raise InputError("point load: the force is zero; give its components in N")
    place = None if at is None else np.array(point("point load: at", at))

    def parts(s: Statics) -> tuple[Array, Array]:
        index = s.assembly.index(block)
        if index not in s.free:
            raise InputError(f"point load: block {block!r} is a support, which bears any load; name another")
        k = s.free.index(index)
        live = np.zeros_like(s.weights)
        live[k, :3] = push
        if place is not None:
            live[k, 3:] = np.cross(place - np.array(s.assembly.blocks[index].mass.centre_of_mass), push)
        return s.weights, live

    return Load(f"point load on {block}", "of the force", parts, largest=math.inf)


def _direction(x: float, y: float) -> tuple[float, float]:
    x, y = entries("direction", (x, y), 2)
    size = math.hypot(x, y)
    if not size > 0:
        raise InputError("direction is (0, 0); give the horizontal direction in which the load pushes")
    return x / size, y / size


def _pushed(statics: Statics, along: tuple[float, float]) -> Array:
    live = np.zeros_like(statics.weights)
    g = float(np.linalg.norm(statics.assembly.gravity))
    for k, i in enumerate(statics.free):
        live[k, :2] = g * statics.assembly.blocks[i].mass.mass * np.array(along)
    return live


def largest_factor(load: Load, assembly: Assembly, live: Array) -> float:
    """The factor up to which collapse is looked for: of forces a thousand times the weight of the blocks."""
    if math.isfinite(load.largest):
        return load.largest
    weight = sum(block.mass.mass for block in assembly.blocks if not block.fixed)
    g = float(np.linalg.norm(assembly.gravity))
    return 1e3 * weight * g / float(np.linalg.norm(live[:, :3]))
