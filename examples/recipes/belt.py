"""A belt between two pulleys, which slips beyond its largest force and then runs without slip."""

import math

import amontons
from amontons import ModelBuilder, Motor, Simulation, shapes

small, large, grip = 0.04, 0.1, 20.0  # m, m, N that the belt carries before it slips
speed = 30.0  # rad/s of the small pulley

builder = ModelBuilder(gravity=(0, 0, 0))
across = amontons.axis_angle((1, 0, 0), math.pi / 2)
for name, radius, x in (("motor", small, 0.0), ("fan", large, 0.4)):
    pulley = shapes.Cylinder(radius, 0.015)
    builder.add_body(name, position=(x, 0, 0), orientation=across, shape=pulley, density=2700)
    builder.add_revolute_joint(name, point=(x, 0, 0), axis=(0, 1, 0), name=f"{name}_shaft")
    builder.add_visual(name, pulley, colour=(0.3, 0.4, 0.5, 1))
    builder.add_visual(name, shapes.Box((0.8 * radius, 0.1 * radius, 0.016)), colour=(0.9, 0.6, 0.2, 1))
lean = math.asin((large - small) / 0.4)  # of the belt's straight parts, which touch both pulleys
for side in (1, -1):
    ends = [(x - r * math.sin(lean), side * r * math.cos(lean)) for r, x in ((small, 0.0), (large, 0.4))]
    (x0, z0), (x1, z1) = ends
    strand = shapes.Box((0.2 * math.cos(lean), 0.012, 0.002))
    turn = amontons.axis_angle((0, 1, 0), -side * lean)
    place = ((x0 + x1) / 2, 0, (z0 + z1) / 2)
    builder.add_visual(None, strand, position=place, orientation=turn, colour=(0.2, 0.2, 0.2, 1))
builder.set_motor("motor_shaft", Motor("velocity", control=speed))
# The length of the belt between them; dry friction along it is the belt's grip.
builder.add_tendon("belt", joints={"motor_shaft": small, "fan_shaft": -large}, friction=grip)
simulation = Simulation(builder.build(), dt=1e-3)

inertia = simulation.model.bodies[1].inertia[2][2]
rise = speed * small / large * inertia / (grip * large)  # s of slip: I w = F r t
simulation.run(0.5 * rise)
slipping, expected = simulation.kinematics.rate("fan_shaft"), grip * large * simulation.time / inertia
simulation.run(rise)
driven = simulation.kinematics.rate("fan_shaft")
print(f"the belt slips for {1e3 * rise:.1f} ms; then the fan turns with {driven:.4f} rad/s")
assert abs(slipping - expected) < 1e-4 * expected
assert abs(driven - speed * small / large) < 1e-3
