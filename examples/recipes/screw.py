"""A screw lifts a platform: a cylindrical joint whose slide follows its turn by the lead."""

import math

from amontons import ModelBuilder, Motor, Simulation, shapes

lead, mass = 0.008, 60.0  # m per turn, kg

builder = ModelBuilder()
spindle = builder.add_body("spindle", shape=shapes.Cylinder(0.015, 0.3), density=7800)
builder.add_visual(spindle, shapes.Cylinder(0.012, 0.3))
for k in range(-18, 19):
    builder.add_visual(spindle, shapes.Cylinder(0.017, 0.003), position=(0, 0, 2 * lead * k))
table = builder.add_body("table", position=(0.15, 0, -0.1), shape=shapes.Box((0.3, 0.2, 0.02)), mass=mass)
builder.add_visual(table, shapes.Box((0.3, 0.2, 0.02)), colour=(0.62, 0.68, 0.75, 1))
builder.add_visual(table, shapes.Cylinder(0.04, 0.035), position=(-0.15, 0, 0), colour=(0.77, 0.67, 0.41, 1))
builder.exclude(spindle, table)
turn = Motor("velocity", control=4 * math.pi)  # two turns per second
builder.add_revolute_joint(spindle, point=(0, 0, 0), axis=(0, 0, 1), name="turn", motor=turn)
builder.add_prismatic_joint(table, axis=(0, 0, 1), name="lift")
builder.add_coupling("lift", "turn", coefficients=(0.0, lead / (2 * math.pi)))
simulation = Simulation(builder.build(), dt=2e-3)
simulation.run(1.0)

height = simulation.kinematics.coordinate("lift")
torque = simulation.forces.effort("turn").motor
print(f"two turns lift by {1e3 * height:.3f} mm; holding {mass:g} kg takes {torque:.4f} N m")
assert abs(height - 2 * lead) < 1e-6
assert abs(torque - mass * 9.81 * lead / (2 * math.pi)) < 1e-4  # the work of a turn is m g lead
