"""Newton's cradle."""

from __future__ import annotations

import math

import numpy as np

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Sphere
from .geometry import STEEL, Y, about, require, rotate
from .registry import scene


@scene(dt=1e-3, duration=5.0)
def newtons_cradle(
    *,
    balls: int = 5,
    raised: int = 1,
    angle: float = 40.0,
    restitution: float = 1.0,
    radius: float = 0.05,
    length: float = 0.5,
    gap: float = 0.0,
) -> Model:
    """Steel balls in a row, each on a V of two strings; the first ones are let go.

    `raised` balls start at `angle` degrees. With `restitution` 1 as many balls leave at the far end. Balls of
    `radius` m hang `length` m below the supports, `gap` m apart at rest.
    """
    require(0 <= raised <= balls and balls >= 1, "newtons_cradle", "raised must be in [0, balls]")
    b = ModelBuilder()
    material = Material(friction=0, restitution=restitution)
    spread = 0.5 * length
    tilt = about(Y, math.radians(angle))
    for i in range(balls):
        support = np.array([i * (2 * radius + gap), 0, 0])
        hang = np.array([0, 0, -length])
        centre = support + (rotate(tilt, hang) if i < raised else hang)
        ball = b.add_body(
            f"ball {i}", position=centre, shape=Sphere(radius), density=STEEL, material=material
        )
        for side in (-1, 1):
            anchor = support + (0, side * spread, 0)
            b.add_distance_joint(
                ball, None, point_a=centre, point_b=anchor, name=f"string {i} {'-+'[side > 0]}"
            )
    return b.build()
