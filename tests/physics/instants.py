"""Motions by which the order of a step is measured, for the tests and benchmarks/orders.py."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import amontons
import numpy as np
from amontons import Material, ModelBuilder, Simulation, Transform, shapes
from amontons.parts import Fluid, FluidBox

G = 9.81


def pendulum(h: float, trees: str = "none", links: int = 1, angle: float = 1.0, **joint: float) -> Simulation:
    """Rods of 1 m and 1 kg on hinges, released from rest at an angle from the vertical."""
    b = ModelBuilder(trees=trees)
    way = np.array([math.sin(angle), 0, -math.cos(angle)])
    half = [math.cos(angle / 2), 0, -math.sin(angle / 2), 0]
    before = None
    for i in range(links):
        link = b.add_body(
            shape=shapes.Box((0.02, 0.02, 0.5)), mass=1, position=tuple((i + 0.5) * way), orientation=half
        )
        b.add_revolute_joint(link, before, point=tuple(i * way), axis=(0, 1, 0), **joint)
        before = link
    return Simulation(b.build(), dt=h)


def four_bar(h: float, trees: str = "none") -> Simulation:
    """A four-bar linkage that falls."""
    b = ModelBuilder(trees=trees)
    b.add_model(amontons.scenes.four_bar(driven=False))
    return Simulation(b.build(), dt=h)


def top(h: float, trees: str = "none") -> Simulation:
    """A disc that spins fast about its axis, on a ball joint at the foot of the axis, and precesses."""
    b = ModelBuilder(trees=trees)
    tilt = 0.4
    axis = np.array([math.sin(tilt), 0, math.cos(tilt)])
    disc = b.add_body(
        shape=shapes.Cylinder(0.05, 0.005),
        mass=0.5,
        position=tuple(0.08 * axis),
        orientation=[math.cos(tilt / 2), 0, math.sin(tilt / 2), 0],
        angular_velocity=tuple(30 * axis),
        linear_velocity=(0, 0, 0),
    )
    b.add_ball_joint(disc, None, point=(0, 0, 0))
    return Simulation(b.build(), dt=h)


def rolling_ball(h: float, trees: str = "none") -> Simulation:
    """A ball that rolls down a slope."""
    slope = 0.3
    b = ModelBuilder(gravity=(G * math.sin(slope), 0, -G * math.cos(slope)), trees=trees)
    b.add_geom(None, shapes.Plane(), material=Material(friction=0.8))
    b.add_body(
        shape=shapes.Sphere(0.1),
        mass=1,
        position=(0, 0, 0.1),
        material=Material(friction=0.8),
        linear_velocity=(0, 0.5, 0),
        angular_velocity=(-5, 0, 0),
    )
    return Simulation(b.build(), dt=h)


def spring(h: float, trees: str = "none", damping: float = 0.4) -> Simulation:
    """A mass on a spring and damper, stretched by 0.1 m, without gravity."""
    b = ModelBuilder(gravity=(0, 0, 0), trees=trees)
    mass = b.add_body(shape=shapes.Sphere(0.1), mass=1, position=(0.1, 0, 0))
    b.add_prismatic_joint(mass, None, axis=(1, 0, 0), stiffness=100, damping=damping, rest=-0.1)
    return Simulation(b.build(), dt=h)


def swinging_arm(h: float, trees: str = "none") -> Simulation:
    """An arm of 1 kg that swings from the horizontal on a base of 50 kg, which stands on the ground."""
    b = ModelBuilder(trees=trees)
    b.add_geom(None, shapes.Plane(), material=Material(friction=1))
    base = b.add_body(
        "base",
        shape=shapes.Box((0.4, 0.4, 0.1)),
        mass=50,
        position=(0, 0, 0.1),
        material=Material(friction=1),
    )
    arm = b.add_body("arm", shape=shapes.Box((0.25, 0.02, 0.02)), mass=1, position=(0.25, 0.5, 1.0))
    b.add_revolute_joint(arm, base, point=(0, 0.5, 1.0), axis=(0, 1, 0))
    return Simulation(b.build(), dt=h)


def servo(h: float, trees: str = "none", law: str = "position") -> Simulation:
    """Two rods that actuators of a law move from rest against gravity."""
    b = ModelBuilder(trees=trees)
    b.add_model(pendulum(h, trees, links=2).model)
    gains = {"position": {"kp": 30, "kd": 4}, "velocity": {"kd": 10}}[law]
    for joint in range(2):
        b.add_actuator(joint=joint, law=law, control=1.5, **gains)
    return Simulation(b.build(), dt=h)


def drag(h: float, trees: str = "none") -> Simulation:
    """Two rods that swing through a thick fluid."""
    model = pendulum(h, trees, links=2).model
    boxes = tuple(FluidBox(i, Transform(), (0.2, 0.2, 1)) for i in range(2))
    return Simulation(replace(model, fluid=Fluid(density=20, viscosity=0.2), fluid_boxes=boxes), dt=h)


def compliant(h: float, trees: str = "none", damping: float = 0.02) -> Simulation:
    """A ball that is pressed into a compliant floor by 20 mm and moves there, without leaving it."""
    soft = Material(friction=0, compliance=2e-3, relaxation_time=damping)
    b = ModelBuilder(trees=trees)
    b.add_geom(None, shapes.Plane(), material=soft)
    b.add_body(shape=shapes.Sphere(0.1), mass=1, position=(0, 0, 0.09), material=soft)
    return Simulation(b.build(), dt=h)


MOTIONS: dict[str, tuple[Callable[..., Simulation], float, float]] = {
    "pendulum": (pendulum, 1.0, 0.02),
    "double pendulum": (lambda h, trees="none": pendulum(h, trees, links=2), 1.0, 0.01),
    "four-bar": (four_bar, 0.3, 0.02),
    "spinning top": (top, 0.2, 0.002),
    "rolling ball": (rolling_ball, 1.0, 0.02),
    "spring with damper": (spring, 1.0, 0.02),
    "arm on a standing base": (swinging_arm, 1.0, 0.02),
    "position servos": (servo, 0.6, 0.01),
    "velocity servos": (lambda h, trees="none": servo(h, trees, "velocity"), 0.6, 0.01),
    "drag of a fluid": (drag, 1.0, 0.01),
    "compliant contact": (compliant, 0.2, 0.004),
}
"""Scene, duration (s) and the longest of four steps (s), by name."""
FIRST_ORDER = ("compliant contact",)


def end_of(
    make: Callable[..., Simulation], duration: float, h: float, trees: str
) -> tuple[np.ndarray, np.ndarray]:
    """Positions of all bodies and their velocities, linear and angular."""
    sim = make(h, trees)
    for _ in range(round(duration / h)):
        sim.step()
    s = sim.state
    return np.array(s.positions), np.concatenate([s.linear_velocities, s.angular_velocities])


def errors(name: str, trees: str = "none", steps: int = 4) -> np.ndarray:
    """The largest error of a position (m) and of a velocity for each of the halved steps, (steps, 2).

    Against the limit of the two shortest of them by extrapolation, which assumes nothing but order two.
    """
    make, duration, h = MOTIONS[name]
    ends = [end_of(make, duration, h / 2**k, trees) for k in range(steps + 2)]
    best = [last + (last - before) / 3 for before, last in zip(*ends[-2:], strict=True)]
    return np.array([[np.abs(x - y).max() for x, y in zip(end, best, strict=True)] for end in ends[:steps]])
