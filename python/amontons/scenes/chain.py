"""Chains: one that swings with a heavy end, and one that lies over a drum."""

from __future__ import annotations

import math

import numpy as np

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Material
from ..model.shapes import Box, Capsule, Cylinder, Sphere
from .geometry import X, Y, about, add_part, from_z, require, rotate
from .registry import scene

_DRUM, _CHAIN = 1, 2
"""Collision categories: links touch the drum, not each other."""


@scene(dt=5e-3, duration=5.0)
def chain(
    *, links: int = 100, end_mass_ratio: float = 1000.0, angle: float = 45.0, link_length: float = 0.1
) -> Model:
    """A chain of 100 links with a ball at its end that weighs 1000 times a link, released at an angle.

    Capsules of `link_length` m and 1 cm radius joined by ball joints, straight at first, `angle` degrees from
    the plumb line. Iterative methods need thousands of products here, and joints must stay closed.
    """
    require(links >= 1, "chain", "links must be at least 1")
    require(end_mass_ratio > 0, "chain", "end_mass_ratio must be positive")
    b = ModelBuilder()
    radius = 0.1 * link_length
    shape = Capsule(radius, link_length / 2 - radius)
    density = 7800.0
    down = rotate(about(Y, -math.radians(angle)), (0, 0, -1))
    above: int | None = None
    for i in range(links):
        body = add_part(
            b,
            f"link {i}",
            shape,
            density=density,
            position=(i + 0.5) * link_length * down,
            orientation=from_z(down),
            mask=0,
            category=0,
        )
        b.add_ball_joint(body, above, point=i * link_length * down, name=f"joint {i}")
        above = body
    mass = end_mass_ratio * shape.mass_properties(density).mass
    size = (mass / density * 3 / (4 * math.pi)) ** (1 / 3)
    end = links * link_length * down
    ball = add_part(b, "ball", Sphere(size), density=density, position=end + size * down, mask=0, category=0)
    b.add_ball_joint(ball, above, point=end, name="end")
    return b.build()


@scene(dt=5e-3, duration=2.0)
def capstan(*, load_ratio: float = 2.0, mu: float = 0.3, links: int = 24, radius: float = 0.5) -> Model:
    """A chain over a fixed drum with unequal loads: it holds up to Euler's and Eytelwein's e^(mu pi).

    `links` short bars, joined by hinges, wrap half of a drum of `radius` m (friction `mu`); two blocks hang
    from hinged straps, 50 kg at the end at -x, `load_ratio` times as much at +x.
    """
    require(links >= 6, "capstan", "links must be at least 6")
    require(load_ratio > 0, "capstan", "load_ratio must be positive")
    b = ModelBuilder(friction_rule="maximum")
    drum = about(X, math.pi / 2)
    b.add_geom(
        None,
        Cylinder(radius, 0.1),
        orientation=drum,
        material=Material(friction=mu),
        category=_DRUM,
        mask=_CHAIN,
        name="drum",
    )
    half_thickness = 0.01 * radius
    # Every link is tangent at its middle: the pins lie on a polygon around the drum.
    step = math.pi / links
    pins = (radius + half_thickness) / math.cos(step / 2)
    length = 2 * pins * math.sin(step / 2)
    bar = Box((0.4 * length, 0.05, half_thickness))

    def pin(k: int) -> np.ndarray:  # from -x over the top to +x
        return pins * np.array([-math.cos(k * step), 0, math.sin(k * step)])

    previous: int | None = None
    bodies = []
    for k in range(links):
        middle = (pin(k) + pin(k + 1)) / 2
        body = add_part(
            b,
            f"link {k}",
            bar,
            density=1000,
            position=middle,
            orientation=about(Y, (k + 0.5) * step - math.pi / 2),
            material=Material(friction=mu),
            category=_CHAIN,
            mask=0,
        )
        if previous is not None:
            b.add_revolute_joint(body, previous, point=pin(k), axis=Y, name=f"pin {k}")
        previous = body
        bodies.append(body)
    for name, end, side, mass in (
        ("light", bodies[0], -1, 50.0),
        ("heavy", bodies[-1], 1, 50.0 * load_ratio),
    ):
        top = np.array([side * pins, 0, 0])
        size = 0.5 * radius
        load = b.add_body(
            name,
            position=top - (0, 0, radius),
            mass=mass,
            inertia=(mass * size**2 / 6,) * 3,
        )
        b.add_revolute_joint(load, end, point=top, axis=Y, name=f"strap {name}")
    return b.build()
