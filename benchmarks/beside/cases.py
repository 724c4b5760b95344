"""The scenes that all engines get, and what should come of each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import amontons
import amontons.scenes
import numpy as np
from amontons.model.builder import ModelBuilder
from amontons.model.shapes import Box, Sphere
from common import DATA, ROOT

from .engine import Subject

ANGLE = math.degrees(math.atan(0.5))  # of friction, for mu 0.5


@dataclass(frozen=True)
class Case:
    """A scene, or a model file, and what should come of it."""

    name: str
    make: Callable[[], amontons.Model]
    dt: float
    duration: float  # s
    rests: bool = False
    """whether the bodies should stay where they are"""
    slides: float | None = None
    """how far the first body should come (m)"""
    conserves: bool = False
    """whether energy should stay what it is"""
    quick: bool = False
    """whether it is part of the quick run, and of the check of CI"""
    path: Path | None = field(default=None, compare=False)

    def subject(self) -> Subject:
        """Raises OSError or InputError for a file that is not there or not read."""
        if self.path is None:
            return Subject(self.make())
        from robot_run import our_model, with_floor

        model, facts = our_model(self.path)
        if model is None:
            raise amontons.InputError(facts["what"])
        floor = None
        if self.path.suffix == ".urdf":
            model, floor = with_floor(model)
        return Subject(model, self.path, floor)


def bridge(*, planks: int = 30, ratio: float = 1000.0, sag: float = 0.5) -> amontons.Model:
    """A bridge of `planks` hinged planks of 2 kg between two anchors 6 m apart, hanging on a circle that is
    `sag` m deep, and a ball `ratio` times as heavy as a plank that lies in its middle."""
    b = ModelBuilder()
    half = 3.0
    radius = (half**2 + sag**2) / (2 * sag)
    reach = math.asin(half / radius)
    angles = np.linspace(-reach, reach, planks + 1)
    pins = radius * np.column_stack([np.sin(angles), np.zeros(planks + 1), 1 - np.cos(angles)])
    material = amontons.Material(friction=0.5)
    thickness, below = 0.02, None
    for i in range(planks):
        along = pins[i + 1] - pins[i]
        length = float(np.linalg.norm(along))
        tilt = -math.atan2(along[2], along[0])
        size = (0.45 * length, 0.4, thickness)
        plank = b.add_body(
            f"plank {i}",
            position=tuple((pins[i] + pins[i + 1]) / 2),
            orientation=(math.cos(tilt / 2), 0.0, math.sin(tilt / 2), 0.0),
            shape=Box(size),
            density=2.0 / (8 * size[0] * size[1] * size[2]),
            material=material,
        )
        b.add_revolute_joint(plank, below, point=tuple(pins[i]), axis=(0, 1, 0), name=f"pin {i}")
        below = plank
    b.add_revolute_joint(below, None, point=tuple(pins[-1]), axis=(0, 1, 0), name="end")
    ball = 0.4
    # With an even number of planks the ball lies on the two in the middle, which it touches in their faces.
    lowest = pins[:, 2].min() + thickness + ball + 2e-3
    b.add_body(
        "ball",
        position=(0.0, 0.0, lowest),
        shape=Sphere(ball),
        density=2.0 * ratio / (4 / 3 * math.pi * ball**3),
        material=material,
    )
    return b.build()


def slid(angle: float, mu: float, duration: float, dt: float, gravity: float = 9.81) -> float:
    """Way of a box down a slope in semi-implicit steps, which all engines make: h^2 a n (n + 1) / 2 (m)."""
    a = gravity * (math.sin(math.radians(angle)) - mu * math.cos(math.radians(angle)))
    n = round(duration / dt)
    return a * dt**2 * n * (n + 1) / 2


def _scene(scene: str, **parameters: Any) -> Callable[[], amontons.Model]:
    return lambda: amontons.scenes.get(scene).make(**parameters)


STEEP = {"angle": 1.01 * ANGLE, "mu": 0.5}
CASES = (
    Case("incline, 0.99 of the angle", _scene("incline", angle=0.99 * ANGLE, mu=0.5), 5e-3, 2.0,
         rests=True, quick=True),
    Case("incline, 1.01 of the angle", _scene("incline", **STEEP), 5e-3, 2.0,
         slides=slid(**STEEP, duration=2.0, dt=5e-3), quick=True),
    Case("stack of 10", _scene("stack", boxes=10), 5e-3, 2.0, rests=True, quick=True),
    Case("plates 1:100", _scene("plates", ratio=1e2), 1e-2, 2.0, rests=True, quick=True),
    Case("plates 1:1000", _scene("plates", ratio=1e3), 1e-2, 2.0, rests=True, quick=True),
    Case("chain 1000:1", _scene("chain", links=40), 5e-3, 2.0, conserves=True, quick=True),
    Case("bridge 1000:1", bridge, 5e-3, 2.0, quick=True),
    Case("four-bar", _scene("four_bar", driven=False), 2e-3, 2.0, conserves=True, quick=True),
    Case("wall at rest", _scene("wall_at_rest"), 5e-3, 0.5, rests=True),
    Case("wall, hit", _scene("wall"), 5e-3, 0.6),
    Case("1000 spheres", _scene("spheres_in_box", count=1000, mu=0.5), 5e-3, 1.0),
)  # fmt: skip

ROBOTS = (
    ("quadruped", ROOT / "examples" / "models" / "quadruped.xml"),
    ("dog (URDF)", ROOT / "examples" / "models" / "dog.urdf"),
    ("humanoid of Gymnasium", DATA / "robots" / "gymnasium" / "humanoid.xml"),
    ("Unitree Go1", DATA / "robots" / "unitree_go1" / "scene.xml"),
    ("KUKA iiwa (URDF)", DATA / "robots" / "bullet3" / "kuka_iiwa" / "model.urdf"),
)


def robots() -> Iterator[Case]:
    """Those whose files are here, without controls."""
    for name, path in ROBOTS:
        if path.exists():
            yield Case(
                name,
                lambda path=path: amontons.load_model(path),  # type: ignore[misc]
                2e-3,
                2.0,
                quick=path.is_relative_to(ROOT),
                path=path,
            )
