"""Random scenes: every shape, joint, motor, size, mass, friction and step, often several extremes at once.

A scene is made of parts: bodies first, then joints.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from amontons import Material, ModelBuilder, Motor, shapes

from .family import Case

BODIES = 24
JOINTS = 12
WIDE = 12
"""From the middle to the walls, and their height, in sizes of the scene."""

Rng = np.random.Generator


def log_uniform(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def turned(rng: Rng) -> tuple[float, ...]:
    q = rng.standard_normal(4)
    return tuple(q / np.linalg.norm(q))


def axis(rng: Rng) -> tuple[float, ...]:
    v = rng.standard_normal(3)
    return tuple(v / np.linalg.norm(v))


def shape(rng: Rng, size: float) -> shapes.Shape:
    """One that moves, of about this half extent."""
    a, b, c = (size * float(s) for s in rng.uniform(0.4, 1.0, 3))
    kind = rng.integers(6)
    if kind == 0:
        return shapes.Sphere(a)
    if kind == 1:
        return shapes.Box((a, b, c))
    if kind == 2:
        return shapes.Capsule(a, b)
    if kind == 3:
        return shapes.Cylinder(a, b)
    if kind == 4:
        return shapes.Ellipsoid((a, b, c))
    return shapes.Hull(size * rng.uniform(-1, 1, (int(rng.integers(6, 20)), 3)))


def material(rng: Rng) -> Material:
    friction = float(rng.choice([0.0, 0.2, 0.5, 1.0, 4.0, 10.0, 100.0]))
    values: dict[str, float] = {"friction": friction}
    if rng.random() < 0.2:
        values["restitution"] = float(rng.uniform(0, 1))
    if rng.random() < 0.15:
        values["torsional_friction"] = 0.01 * float(rng.random())
        values["rolling_friction"] = 0.01 * float(rng.random())
    return Material(**values)


class Scene:
    """A random scene: its model, the options of its simulation, and what a judge needs to know of it."""

    def __init__(self, case: Case) -> None:
        rng = case.rng()
        self.size = log_uniform(rng, 1e-4, 10.0)
        self.masses = float(rng.choice([1.0, 1.0, 1e4, 1e16]))
        """largest over smallest"""
        self.overlap = bool(rng.random() < 0.3)
        self.driven = bool(rng.random() < 0.4)
        self.common = material(rng) if rng.random() < 0.5 else None
        gravity = 9.81 * float(rng.choice([1.0, 1.0, 0.1]))
        self.dt = log_uniform(rng, 1e-3, 2e-2) * min(1.0, np.sqrt(self.size / 0.1))
        self.dt = float(self.dt)
        self.options: dict[str, Any] = dict(
            dt=self.dt,
            law=str(rng.choice(["coulomb", "coulomb", "coulomb", "associated"])),
            tolerance=float(rng.choice([1e-3, 1e-6])),
            recovery=str(rng.choice(["projection", "projection", "velocity"])),
            max_substeps=int(rng.choice([1, 1, 4])),
            threads=int(rng.integers(1, 4)),
            on_failure="ignore",
        )
        builder = ModelBuilder(gravity=(0, 0, -gravity))
        self.floor(builder, rng)
        self.extents: list[float] = []
        self.bodies: list[int] = []
        self.places: dict[int, np.ndarray[Any, Any]] = {}
        for part in range(int(rng.integers(1, BODIES + 1))):
            if case.kept(part):
                self.body(builder, case.rng(part))
        for part in range(BODIES, BODIES + int(rng.integers(0, JOINTS + 1))):
            if case.kept(part) and self.bodies:
                self.joint(builder, case.rng(part))
        self.model = builder.build()

    def floor(self, builder: ModelBuilder, rng: Rng) -> None:
        """Its height is zero; walls keep what rolls."""
        of = material(rng) if self.common is None else self.common
        kind, wide = rng.integers(3), WIDE * self.size
        self.endless = bool(kind == 0)
        if kind == 0:
            builder.add_geom(None, shapes.Plane(), material=of)
        elif kind == 1:
            half = (wide, wide, self.size)
            builder.add_geom(None, shapes.Box(half), position=(0, 0, -self.size), material=of)
        else:
            n = int(rng.integers(3, 9))
            heights = -0.2 * self.size * rng.random((n, n))
            builder.add_geom(None, shapes.HeightField(heights, 2 * wide, 2 * wide), material=of)
        for side in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            half = tuple(0.2 * wide if s else wide for s in side) + (wide,)
            at = tuple(1.2 * wide * s for s in side) + (0,)
            builder.add_geom(None, shapes.Box(half), position=at, material=of)

    def body(self, builder: ModelBuilder, rng: Rng) -> None:
        size = self.size * float(rng.uniform(0.5, 1.0))
        count = len(self.bodies)
        room = (0.8 if self.overlap else 2.2) * self.size
        place = np.array([count % 3 - 1, count // 3 % 3 - 1, 0.6 + count // 9]) * room
        place[2] += 0 if self.overlap else self.size
        place += rng.uniform(-0.1, 0.1, 3) * self.size
        density = 1000 * self.masses ** float(rng.uniform(-0.5, 0.5))
        fast = rng.random() < 0.3
        speed = np.sqrt(9.81 * self.size)
        self.bodies.append(
            builder.add_body(
                shape=shape(rng, size),
                density=density,
                position=tuple(place),
                orientation=turned(rng),
                linear_velocity=tuple(3 * speed * rng.standard_normal(3)) if fast else (0, 0, 0),
                angular_velocity=tuple(3 * speed / self.size * rng.standard_normal(3)) if fast else (0, 0, 0),
                material=self.common or material(rng),
            )
        )
        self.places[self.bodies[-1]] = place
        self.extents.append(1.8 * size)  # of a hull the corner of the cube

    def joint(self, builder: ModelBuilder, rng: Rng) -> None:
        """Between two bodies or a body and the world, at a point near the first."""
        a = int(rng.choice(self.bodies))
        others = [None, *(b for b in self.bodies if b != a)]
        b = others[int(rng.integers(len(others)))]
        place = self.places[a]
        point = tuple(np.array(place) + rng.uniform(-1, 1, 3) * self.size)
        # Whatever the bodies weigh: a motor may drive the lightest of them to any speed.
        weight = 1000 * (2 * self.size) ** 3 * 9.81
        options: dict[str, Any] = {}
        if rng.random() < 0.3:
            options["damping"] = log_uniform(rng, 1e-3, 10) * weight * self.size
        if rng.random() < 0.3:
            options["friction"] = log_uniform(rng, 1e-3, 10) * weight * self.size
        if rng.random() < 0.3:
            options["stiffness"] = log_uniform(rng, 1e-2, 1e4) * weight * self.size
        turning = dict(options)
        if rng.random() < 0.3:
            turning["limits"] = (-float(rng.uniform(0.1, 2)), float(rng.uniform(0.1, 2)))
        if self.driven and rng.random() < 0.5:
            kind = str(rng.choice(["effort", "velocity", "position"]))
            gain = log_uniform(rng, 1, 1e4) * weight * self.size if kind == "position" else 0.0
            turning["motor"] = (
                Motor(
                    kind,
                    control=float(rng.uniform(-3, 3)),
                    max_effort=log_uniform(rng, 0.1, 100) * weight * self.size,
                    kp=gain,
                )
                if kind != "effort"
                else Motor(kind, control=float(rng.uniform(-3, 3)) * weight * self.size)
            )
        kind = rng.integers(8)
        if kind == 0:
            builder.add_ball_joint(a, b, point=point)
        elif kind == 1:
            builder.add_fixed_joint(a, b)
        elif kind == 2:
            builder.add_revolute_joint(a, b, point=point, axis=axis(rng), **turning)
        elif kind == 3:
            builder.add_prismatic_joint(a, b, axis=axis(rng), **options)
        elif kind == 4:
            builder.add_cylindrical_joint(a, b, point=point, axis=axis(rng))
        elif kind == 5:
            one = axis(rng)
            two = np.cross(one, axis(rng))
            builder.add_universal_joint(
                a, b, point=point, axis_1=one, axis_2=tuple(two / np.linalg.norm(two))
            )
        elif kind == 6:
            builder.add_planar_joint(a, b, normal=axis(rng))
        else:
            other = (0.0, 0.0, 3 * self.size) if b is None else self.places[b]
            builder.add_distance_joint(a, b, point_a=tuple(place), point_b=tuple(other))
