"""A buggy with tyres that yield drives over bumps; at rest its springs carry what Hooke's law says."""

import math

import amontons
import numpy as np
from amontons import Material, ModelBuilder, Motor, Simulation, shapes

radius, spring, damper = 0.3, 2e4, 1.5e3  # m, N/m, N s/m
speed = 6.0  # rad/s
tyre = Material(friction=0.9, compliance=1 / 2e5, relaxation_time=0.01)

# Flat ground for the first metres, then bumps of 10 cm.
x = np.linspace(-10, 10, 201)
bumps = np.where(x > 0, 0.05 * (1 - np.cos(2 * math.pi * x / 2.5)), 0.0)
builder = ModelBuilder()
builder.add_geom(None, shapes.HeightField(np.tile(bumps, (3, 1)), 20.0, 4.0), material=Material(friction=0.9))
chassis = builder.add_body("chassis", position=(-3, 0, 0.55), shape=shapes.Box((1.0, 0.4, 0.12)), mass=300)
across = amontons.axis_angle((1, 0, 0), math.pi / 2)
for name, dx, dy in (("fl", 0.8, 0.6), ("fr", 0.8, -0.6), ("rl", -0.8, 0.6), ("rr", -0.8, -0.6)):
    place = (-3 + dx, dy, radius)
    arm = builder.add_body(f"arm {name}", position=place, mass=5, inertia=(0.1, 0.1, 0.1))
    builder.add_visual(arm, shapes.Box((0.05, 0.05, 0.05)))
    rim = shapes.Cylinder(radius, 0.1)
    builder.add_body(f"wheel {name}", position=place, orientation=across, shape=rim, mass=12, material=tyre)
    builder.add_prismatic_joint(
        arm, chassis, axis=(0, 0, 1), name=f"strut {name}", stiffness=spring, damping=damper
    )
    builder.add_revolute_joint(
        f"wheel {name}", arm, point=place, axis=(0, 1, 0), name=f"hub {name}",
        motor=Motor("velocity", control=0.0, max_effort=400.0),
    )  # fmt: skip
    builder.exclude(f"wheel {name}", chassis)
simulation = Simulation(builder.build(), dt=2e-3)
simulation.run(1.5)

sunk = simulation.kinematics.coordinate("strut fl")
print(f"at rest each strut yields {1e3 * sunk:.2f} mm")
assert abs(sunk - 300 * 9.81 / 4 / spring) < 1e-3
for name in ("fl", "fr", "rl", "rr"):
    simulation.set_control(f"hub {name}", speed)
start = simulation.state.positions[chassis, 0]
simulation.run(3.0)
driven = simulation.state.positions[chassis, 0] - start
print(f"it drives {driven:.2f} m in 3 s, of {3 * speed * radius:.2f} m without slip and on flat ground")
