"""B4: a masonry wall and a wrecking ball."""

from __future__ import annotations

import math

import numpy as np

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Box, Capsule, Plane, Sphere
from .geometry import STEEL, X, about, add_part, from_z, require, rotate
from .registry import scene

_WRECKER = 2
"""Collision category of the ball and its chain: they touch bricks (category 1), not each other."""


@scene(dt=5e-3, duration=3.0)
def wall(
    *,
    columns: int = 37,
    rows: int = 20,
    brick: tuple[float, float, float] = (0.396, 0.2, 0.2),
    joint: float = 0.004,
    mu: float = 0.4,
    ball: bool = True,
    links: int = 8,
    angle: float = 35.0,
    speed: float = 8.0,
) -> Model:
    """B4: a wall of 750 bricks in running bond, hit by a wrecking ball that hangs from a jointed chain.

    `rows` courses of `columns` bricks (length, depth, height in m, 1800 kg/m^3, 28.5 kg each) are laid dry;
    every second course is shifted by half a brick and ends in half bricks. Head joints are `joint` m wide,
    and 8692 contacts carry the wall at rest. It lies along x and faces y. A steel ball hangs from a chain of
    `links` capsules joined by ball joints, sized by the wall's height (3.6 t, radius 0.48 m); it starts
    `angle` degrees before the plumb line and strikes at half height with about `speed` m/s after 0.4 s.
    """
    require(columns >= 1 and rows >= 1, "wall", "columns and rows must be at least 1")
    b = ModelBuilder()
    material = Material(friction=mu)
    b.add_geom(None, Plane(), material=material, name="ground")
    for row in range(rows):
        for i, (x, length) in enumerate(_course(row, columns, brick[0], joint)):
            b.add_body(
                f"brick {row} {i}",
                position=(x, 0, (row + 0.5) * brick[2]),
                shape=Box((length / 2, brick[1] / 2, brick[2] / 2)),
                density=1800,
                material=material,
            )
    if ball:
        _wrecking_ball(b, rows * brick[2], brick[1] / 2, links, math.radians(angle), speed, material)
    return b.build()


@scene(dt=5e-3, duration=5.0)
def wall_at_rest(*, columns: int = 37, rows: int = 20, mu: float = 0.4) -> Model:
    """B4 without the ball: 750 bricks at rest with 8692 contacts, none of which may move."""
    return wall(columns=columns, rows=rows, mu=mu, ball=False)


def _course(row: int, columns: int, length: float, joint: float) -> list[tuple[float, float]]:
    """Centre x and length of the bricks of a course; the wall is centred at x = 0."""
    pitch = length + joint
    if row % 2 == 0:
        return [((i - (columns - 1) / 2) * pitch, length) for i in range(columns)]
    half = (length - joint) / 2
    end = columns * pitch / 2 - joint / 2 - half / 2
    inner = [((i - (columns - 2) / 2) * pitch, length) for i in range(columns - 1)]
    return [(-end, half), *inner, (end, half)]


def _wrecking_ball(
    b: ModelBuilder, height: float, face: float, links: int, angle: float, speed: float, material: Material
) -> None:
    """Ball and chain, straight, `angle` before the plumb line, turning as a rigid pendulum about the
    anchor."""
    require(links >= 1, "wall", "links must be at least 1")
    radius = 0.12 * height
    length = 1.2 * height  # from the anchor to the centre of the ball
    # The ball grazes the wall's face in the plumb line of the anchor, at half the wall's height.
    anchor = np.array([0, -(face + radius), height / 2 + length])
    down = rotate(about(X, -angle), (0, 0, -1))
    # Energy: v^2 = v_0^2 + 2 g L (1 - cos angle).
    squared = speed**2 - 2 * 9.81 * length * (1 - math.cos(angle))
    require(squared >= 0, "wall", "speed is below that of the free fall from angle: lower the angle")
    spin = np.array([math.sqrt(squared) / length, 0, 0])
    link = (length - radius) / links
    thickness = 0.1 * radius
    above = None
    for i in range(links):
        middle = anchor + (i + 0.5) * link * down
        body = add_part(
            b,
            f"link {i}",
            Capsule(thickness, link / 2 - thickness),
            density=STEEL,
            position=middle,
            orientation=from_z(down),
            linear_velocity=np.cross(spin, middle - anchor),
            angular_velocity=spin,
            material=material,
            category=_WRECKER,
        )
        b.add_ball_joint(body, above, point=anchor + i * link * down, name=f"chain {i}")
        above = body
    centre = anchor + length * down
    ball = add_part(
        b,
        "ball",
        Sphere(radius),
        density=STEEL,
        position=centre,
        linear_velocity=np.cross(spin, centre - anchor),
        angular_velocity=spin,
        material=material,
        category=_WRECKER,
    )
    b.add_ball_joint(ball, above, point=centre - radius * down, name="chain end")
