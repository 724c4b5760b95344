"""A vibrating trough feeds parts uphill: it shakes along a line that is steeper than the trough."""

import math

import amontons
from amontons import Material, ModelBuilder, Motor, Simulation, shapes

shake, rate, steep, slope = 6e-4, 2 * math.pi * 30, math.radians(25), math.radians(3)  # m, rad/s

builder = ModelBuilder()
steel = Material(friction=0.5)
tilt = amontons.axis_angle((0, 1, 0), -slope)
trough = builder.add_body("trough", orientation=tilt, mass=50, inertia=(5, 5, 5))
for half, place in (((0.5, 0.08, 0.005), (0, 0, -0.005)), ((0.5, 0.005, 0.03), (0, 0.085, 0.02)),
                    ((0.5, 0.005, 0.03), (0, -0.085, 0.02))):  # fmt: skip
    builder.add_geom(trough, shapes.Box(half), position=place, material=steel)
line = (math.cos(slope + steep), 0, math.sin(slope + steep))
builder.add_prismatic_joint(trough, axis=line, name="shaker", motor=Motor("velocity", control=0.0))
parts = []
for k in range(12):
    x, y = -0.45 + 0.06 * (k // 3), 0.05 * (k % 3 - 1)
    place = (x * math.cos(slope), y, x * math.sin(slope) + 0.011)
    parts.append(builder.add_body(position=place, orientation=tilt, shape=shapes.Box((0.015, 0.01, 0.01)),
                                  density=7800, material=steel))  # fmt: skip
    builder.add_visual(parts[-1], shapes.Box((0.015, 0.01, 0.01)), colour=(0.3, 0.5, 0.75, 1))
simulation = Simulation(builder.build(), dt=5e-4)


def vibrate(sim: Simulation) -> None:
    sim.set_control("shaker", shake * rate * math.cos(rate * (sim.time + sim.dt / 2)))


simulation.before_step.append(vibrate)
simulation.run(0.2)
start, time = simulation.state.positions[parts].copy(), simulation.time
simulation.run(2.0)
speeds = (simulation.state.positions[parts] - start)[:, 0] / (simulation.time - time)
fastest = shake * rate * math.cos(steep)
print(f"the parts climb with {1e3 * speeds.mean():.1f} mm/s; the trough reaches {1e3 * fastest:.1f} mm/s")
assert speeds.min() > 0.1 * fastest
assert speeds.max() < fastest  # nothing overtakes what carries it
