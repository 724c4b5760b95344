"""Single blocks and a ball on a plane: the closed forms of dry friction; and a stack of them."""

from __future__ import annotations

import math

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Box, Plane, Sphere
from .geometry import Y, about, require, rotate
from .registry import scene


@scene(dt=1e-2, duration=10.0)
def incline(*, angle: float = 10.0, mu: float = 0.5, size: float = 0.2) -> Model:
    """A block on a ramp: it sticks while tan(angle) < mu, else slides with g (sin - mu cos).

    A cube of `size` m and density 1000 kg/m^3 at rest on a plane inclined by `angle` degrees about y;
    downhill is -x turned by the ramp.
    """
    require(0 <= angle < 90, "incline", "angle (degrees) must be in [0, 90)")
    b = ModelBuilder(friction_rule="maximum")
    ramp = about(Y, -math.radians(angle))
    b.add_geom(None, Plane(), orientation=ramp, material=Material(friction=mu), name="ramp")
    position = rotate(ramp, (0, 0, size / 2))
    b.add_body(
        "block",
        position=position,
        orientation=ramp,
        shape=Box((size / 2,) * 3),
        density=1000,
        material=Material(friction=mu),
    )
    return b.build()


@scene(dt=5e-3, duration=5.0)
def sliding_cube(*, speed: float = 6.0, mu: float = 0.5, size: float = 0.2) -> Model:
    """A cube launched along a plane: it stops after v^2 / (2 mu g) and, under `coulomb`, never lifts off.

    Under `associated` the first step keeps u_n = mu |u_t|: it hops to (mu v / (1 + mu^2))^2 / (2 g).
    Cube of `size` m, density 1000 kg/m^3, `speed` m/s along x. Its centre of mass lies low enough not to
    tip.
    """
    b = ModelBuilder(friction_rule="maximum")
    b.add_geom(None, Plane(), material=Material(friction=mu), name="floor")
    b.add_body(
        "cube",
        position=(0, 0, size / 2),
        shape=Box((size / 2,) * 3),
        density=1000,
        linear_velocity=(speed, 0, 0),
        material=Material(friction=mu),
    )
    return b.build()


@scene(dt=1e-3, duration=2.0)
def rolling_sphere(*, speed: float = 5.0, mu: float = 0.3, radius: float = 0.1) -> Model:
    """A ball that starts skidding without spin: it rolls after 2 v / (7 mu g), with 5/7 of its speed.

    Steel ball of `radius` m, `speed` m/s along x, on a plane.
    """
    b = ModelBuilder(friction_rule="maximum")
    b.add_geom(None, Plane(), material=Material(friction=mu), name="floor")
    b.add_body(
        "ball",
        position=(0, 0, radius),
        shape=Sphere(radius),
        density=7800,
        linear_velocity=(speed, 0, 0),
        material=Material(friction=mu),
    )
    return b.build()


@scene(dt=5e-3, duration=2.0)
def rolling_balls(
    *, balls: int = 6, angle: float = 5.0, radius: float = 0.1, mu: float = 0.5, coefficients: float = 2.0
) -> Model:
    """Balls on a ramp, each with more rolling friction mu_r: from mu_r = radius tan(angle) on they stay.

    The others roll with 5/7 g (sin - mu_r / radius cos), downhill along x turned by the ramp. mu_r grows
    evenly from 0 to `coefficients` times the critical one. Steel balls of `radius` m, `angle` in degrees
    about y.
    """
    require(balls >= 2, "rolling_balls", "balls must be at least 2")
    require(0 < angle < 90, "rolling_balls", "angle (degrees) must be in (0, 90)")
    b = ModelBuilder(friction_rule="maximum")
    ramp = about(Y, math.radians(angle))
    b.add_geom(None, Plane(), orientation=ramp, material=Material(friction=mu), name="ramp")
    critical = radius * math.tan(math.radians(angle))
    for i in range(balls):
        rolling = coefficients * critical * i / (balls - 1)
        b.add_body(
            f"ball {i}",
            position=rotate(ramp, (0, 3 * radius * i, radius)),
            shape=Sphere(radius),
            density=7800,
            material=Material(friction=mu, rolling_friction=rolling),
        )
    return b.build()


@scene(dt=5e-3, duration=2.0)
def tipping_box(*, angle: float = 20.0, width: float = 0.2, height: float = 0.5, mu: float = 2.0) -> Model:
    """A slender box on a ramp that is too rough to slide on: it tips over beyond tan(angle) = width / height.

    Lengths in m, `angle` in degrees about y.
    """
    b = ModelBuilder(friction_rule="maximum")
    ramp = about(Y, -math.radians(angle))
    b.add_geom(None, Plane(), orientation=ramp, material=Material(friction=mu), name="ramp")
    b.add_body(
        "box",
        position=rotate(ramp, (0, 0, height / 2)),
        orientation=ramp,
        shape=Box((width / 2, width / 2, height / 2)),
        density=1000,
        material=Material(friction=mu),
    )
    return b.build()


@scene(dt=5e-3, duration=5.0)
def stack(*, boxes: int = 10, size: float = 0.2, mu: float = 0.5) -> Model:
    """A vertical stack of equal cubes: the contacts at level k carry the weight above.

    Cubes of `size` m, density 1000 kg/m^3.
    """
    require(boxes >= 1, "stack", "boxes must be at least 1")
    b = ModelBuilder()
    b.add_geom(None, Plane(), material=Material(friction=mu), name="floor")
    for i in range(boxes):
        b.add_body(
            f"box {i}",
            position=(0, 0, (i + 0.5) * size),
            shape=Box((size / 2,) * 3),
            density=1000,
            material=Material(friction=mu),
        )
    return b.build()
