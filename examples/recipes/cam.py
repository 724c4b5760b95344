"""A cam lifts a follower, which leaves it where its spring is too weak for the speed."""

import math

import amontons
import numpy as np
from amontons import Material, ModelBuilder, Motor, Simulation, shapes

radius, offset, spring, mass = 0.04, 0.015, 900.0, 0.3  # m, m, N/m, kg


def lifted(speed: float) -> tuple[Simulation, float, float]:
    """Two turns: the simulation, the largest error of the lift (m), and the largest gap (m)."""
    builder = ModelBuilder(gravity=(0, 0, 0))
    smooth = Material(friction=0.0)
    cam = builder.add_body("cam", orientation=amontons.axis_angle((1, 0, 0), math.pi / 2))
    builder.add_geom(
        cam, shapes.Cylinder(radius, 0.01), position=(offset, 0, 0), density=7800, material=smooth
    )
    builder.add_revolute_joint(
        cam, point=(0, 0, 0), axis=(0, -1, 0), name="shaft", motor=Motor("velocity", control=speed)
    )
    top = (0, 0, radius + 0.005)
    plate = shapes.Box((0.06, 0.01, 0.005))
    follower = builder.add_body("follower", position=top, shape=plate, mass=mass, material=smooth)
    steel, brass = (0.55, 0.57, 0.6, 1), (0.77, 0.67, 0.41, 1)
    builder.add_visual(cam, shapes.Cylinder(radius, 0.01), position=(offset, 0, 0), colour=brass)
    builder.add_visual(cam, shapes.Cylinder(0.006, 0.014), colour=(0.25, 0.25, 0.28, 1))  # the shaft
    builder.add_visual(follower, plate, colour=steel)
    builder.add_visual(follower, shapes.Box((0.005, 0.005, 0.03)), position=(0, 0, 0.03), colour=steel)
    builder.add_prismatic_joint(follower, axis=(0, 0, 1), name="lift", stiffness=spring, rest=-0.03)
    simulation = Simulation(builder.build(), dt=2e-4)
    gaps = []
    for _ in range(round(4 * math.pi / speed / simulation.dt)):
        simulation.step()
        # A flat follower on an eccentric circle: its height is e sin(angle).
        gaps.append(
            simulation.kinematics.coordinate("lift")
            - offset * math.sin(simulation.kinematics.coordinate("shaft"))
        )
    return simulation, float(np.min(gaps)), float(np.max(gaps))


# It stays on the cam as long as m e w^2 is less than the force of the spring at the top.
limit = math.sqrt(spring * (0.03 + offset) / (mass * offset))
simulation, lowest, highest = lifted(0.8 * limit)
print(f"at {0.8 * limit:.0f} rad/s the follower stays within {1e6 * max(-lowest, highest):.0f} um of the cam")
assert max(-lowest, highest) < 2e-4
_, _, gap = lifted(1.5 * limit)
print(f"at {1.5 * limit:.0f} rad/s it flies by {1e3 * gap:.1f} mm")
assert gap > 1e-3
