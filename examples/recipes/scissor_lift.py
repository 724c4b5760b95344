"""A scissor lift of three stages, with closed loops: the force of its ram is that of virtual work."""

import math

import amontons
from amontons import ModelBuilder, Motor, Simulation, shapes

stages, length, mass, load = 3, 0.5, 0.8, 20.0  # m and kg of a bar, kg on top
angle = math.radians(20)
width, rise = length * math.cos(angle), length * math.sin(angle)

builder = ModelBuilder()
beam = shapes.Box((length / 2, 0.012, 0.008))
bars = {}
for k in range(stages):
    for side, y in ((1, -0.015), (-1, 0.015)):
        bars[k, side] = builder.add_body(
            f"bar {k} {'up' if side > 0 else 'down'}", position=(width / 2, y, (k + 0.5) * rise),
            orientation=amontons.axis_angle((0, 1, 0), -side * angle), mass=mass,
            inertia=(mass * length**2 / 12,) * 3,
        )  # fmt: skip
        builder.add_visual(bars[k, side], beam)
top = builder.add_body("top", position=(width / 2, 0, stages * rise + 0.02), mass=load, inertia=(1, 1, 1))
builder.add_visual(top, shapes.Box((0.3, 0.2, 0.02)), colour=(0.62, 0.68, 0.75, 1))


def hinge(a: int, b: int | None, x: float, z: float) -> None:
    builder.add_revolute_joint(a, b, point=(x, 0, z), axis=(0, 1, 0))


for k in range(stages):
    hinge(bars[k, 1], bars[k, -1], width / 2, (k + 0.5) * rise)
    if k:  # ends of one stage on those of the next; the loop needs each
        hinge(bars[k, 1], bars[k - 1, -1], 0, k * rise)
        hinge(bars[k, -1], bars[k - 1, 1], width, k * rise)
hinge(bars[0, 1], None, 0, 0)
ram = Motor("velocity", control=-0.1)
block = builder.add_body("block", position=(width, 0, 0), shape=shapes.Box((0.03, 0.03, 0.02)), mass=0.5)
builder.add_prismatic_joint(block, axis=(1, 0, 0), name="ram", motor=ram)
hinge(bars[0, -1], block, width, 0)
hinge(top, bars[stages - 1, -1], 0, stages * rise)
builder.add_point_on_line_joint(bars[stages - 1, 1], top, point=(width, 0, stages * rise), axis=(1, 0, 0))
simulation = Simulation(builder.build(), dt=2e-3)
simulation.run(0.8)

moved = width + simulation.kinematics.coordinate("ram")
height = simulation.state.positions[top, 2] - 0.02
assert abs(height - stages * math.sqrt(length**2 - moved**2)) < 1e-5
# V = g h (load + bars / 2), h = stages sqrt(l^2 - x^2): the ram holds dV/dx, and what accelerates all of it.
still = Simulation(simulation.model, dt=2e-3)
still.set_control("ram", 0.0)
still.run(0.2)
weight = 9.81 * (load + 2 * stages * mass / 2)
force = still.forces.effort("ram").motor
print(f"raised to {height:.3f} m; at the start the ram holds {-force:.1f} N")
assert abs(force + weight * stages * width / rise) < 1e-2
