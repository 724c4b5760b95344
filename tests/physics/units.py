"""A machine in any units, to see that none of its motion depends on them."""

from __future__ import annotations

from typing import Any

import amontons
import amontons.scenes
import numpy as np
from amontons import Material, Motor, shapes
from measures import run


def machine(length: float, mass: float) -> amontons.Model:
    """Contacts, joints, a motor and a spring, in units in which a metre is `length` and a kilogram `mass`."""
    b = amontons.ModelBuilder(gravity=(0, 0, -9.81 * length))
    density = 1000 * mass / length**3
    force = mass * length
    b.add_geom(None, shapes.Plane(), material=Material(friction=0.5))
    for i, (x, y) in enumerate([(0, 0), (0.02, 0.01), (-0.01, 0.03)]):
        b.add_body(
            f"box {i}",
            position=(x * length, y * length, (0.11 + 0.21 * i) * length),
            shape=shapes.Box((0.1 * length,) * 3),
            density=density,
            linear_velocity=(0.3 * length, 0, 0),
        )
    b.add_body(
        "ball",
        position=(1.0 * length, 0, 0.1 * length),
        shape=shapes.Sphere(0.1 * length),
        density=density,
        linear_velocity=(-2 * length, 0, 0),
    )
    arm = b.add_body(
        "arm",
        position=(0, 1.0 * length, 0.5 * length),
        shape=shapes.Capsule(0.03 * length, 0.2 * length),
        density=density,
    )
    b.add_revolute_joint(
        arm,
        None,
        point=(0, 1.0 * length, 0.7 * length),
        axis=(0, 1, 0),
        motor=Motor(kind="velocity", control=3.0, max_effort=50 * force * length),
        name="drive",
    )
    b.add_prismatic_joint(
        b.add_body(
            "cart",
            position=(1 * length, 1 * length, 1 * length),
            shape=shapes.Box((0.1 * length,) * 3),
            density=density,
        ),
        None,
        axis=(0, 0, 1),
        stiffness=2000 * mass,
        damping=30 * mass,
        name="spring",
    )
    return b.build()


def ratio_of_motion(length: float, mass: float, **options: Any) -> float:
    """Largest difference, in metres and m/s, between the machine in SI units and in others after half a
    second."""
    reference = amontons.Simulation(machine(1.0, 1.0), dt=5e-3, **options)
    other = amontons.Simulation(machine(length, mass), dt=5e-3, **options)
    run(reference, 0.5)
    run(other, 0.5)
    return max(
        np.abs(other.state.positions / length - reference.state.positions).max(),
        np.abs(other.state.orientations - reference.state.orientations).max(),
        np.abs(other.state.linear_velocities / length - reference.state.linear_velocities).max(),
    )
