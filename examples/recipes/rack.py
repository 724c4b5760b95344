"""A rack and pinion lifts a load: a coupling makes the rack move by r for each radian of the pinion."""

import math

import amontons
from amontons import ModelBuilder, Simulation, shapes

radius, mass, torque = 0.05, 4.0, 3.0  # m, kg, N m

builder = ModelBuilder()
wheel = shapes.Cylinder(radius, 0.02)
pinion = builder.add_body(
    "pinion",
    position=(radius, 0, 0),
    orientation=amontons.axis_angle((1, 0, 0), math.pi / 2),
    shape=wheel,
    density=7800,
)
rack = builder.add_body("rack", position=(-0.012, 0, -0.1), shape=shapes.Box((0.012, 0.02, 0.3)), mass=mass)
teeth = 20
tooth = shapes.Box((0.006, 0.3 * math.pi * radius / teeth, 0.02))
builder.add_visual(pinion, shapes.Cylinder(radius - 0.004, 0.02), colour=(0.77, 0.67, 0.41, 1))
builder.add_visual(rack, shapes.Box((0.009, 0.02, 0.3)), position=(-0.003, 0, 0), colour=(0.55, 0.57, 0.6, 1))
for k in range(teeth):
    angle = 2 * math.pi * (k + 0.5) / teeth
    place = (radius * math.cos(angle), radius * math.sin(angle), 0)
    turn = amontons.axis_angle((0, 0, 1), angle)
    builder.add_visual(pinion, tooth, position=place, orientation=turn, colour=(0.77, 0.67, 0.41, 1))
gap = shapes.Box((0.006, 0.02, 0.3 * math.pi * radius / teeth))
for k in range(-18, 19):
    place = (0.009, 0, 2 * math.pi * radius / teeth * k)
    builder.add_visual(rack, gap, position=place, colour=(0.55, 0.57, 0.6, 1))
builder.exclude(pinion, rack)  # the coupling is their contact
builder.add_revolute_joint(
    pinion,
    point=(radius, 0, 0),
    axis=(0, -1, 0),
    name="shaft",
    motor=amontons.Motor("effort", control=torque),
)
builder.add_prismatic_joint(rack, axis=(0, 0, 1), name="slide")
builder.add_coupling("slide", "shaft", coefficients=(0.0, -radius))
simulation = Simulation(builder.build(), dt=2e-3)

inertia = simulation.model.bodies[pinion].inertia[2][2]
simulation.set_control("shaft", -torque)
simulation.run(0.4)

# Newton's law of both: (m + I / r^2) a = T / r - m g.
expected = (torque / radius - mass * 9.81) / (mass + inertia / radius**2)
speed = simulation.kinematics.rate("slide")
print(f"the load rises with {speed:.4f} m/s after 0.4 s; the closed form says {0.4 * expected:.4f} m/s")
assert abs(speed - 0.4 * expected) < 1e-6
