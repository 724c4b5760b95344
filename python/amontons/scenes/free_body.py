"""One body in free motion, and one on a hinge."""

from __future__ import annotations

import math

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.shapes import Box
from .geometry import Y, about, require, rotate
from .registry import scene


@scene(dt=1e-3, duration=10.0)
def free_body(
    *,
    size: tuple[float, float, float] = (0.3, 0.2, 0.1),
    angular_velocity: tuple[float, float, float] = (0.05, 5.0, 0.02),
) -> Model:
    """An asymmetric body that tumbles without gravity about its unstable middle axis (Dzhanibekov).

    A box of edge lengths `size` m, density 1000 kg/m^3; angular velocity in rad/s. Angular momentum is
    constant, and so is the energy but for the integrator's error.
    """
    b = ModelBuilder(gravity=(0, 0, 0))
    half = (size[0] / 2, size[1] / 2, size[2] / 2)
    b.add_body("body", shape=Box(half), density=1000, angular_velocity=angular_velocity)
    return b.build()


@scene(dt=1e-3, duration=10.0)
def pendulum(*, length: float = 1.0, angle: float = 20.0, thickness: float = 0.05) -> Model:
    """A bar on a hinge with horizontal axis y through its upper end, released at `angle` degrees.

    The period for small angles is 2 pi sqrt(I / (m g l/2)), with I about the hinge. Lengths in m, 1000
    kg/m^3.
    """
    require(length > thickness > 0, "pendulum", "length must be greater than thickness")
    b = ModelBuilder()
    tilt = about(Y, -math.radians(angle))
    bar = b.add_body(
        "bar",
        position=rotate(tilt, (0, 0, -length / 2)),
        orientation=tilt,
        shape=Box((thickness / 2, thickness / 2, length / 2)),
        density=1000,
    )
    b.add_revolute_joint(bar, None, point=(0, 0, 0), axis=Y, name="hinge")
    return b.build()
