"""Two spur gears mesh by contact of their teeth: each tooth is a convex piece with involute flanks."""

import math

import numpy as np
from amontons import Material, ModelBuilder, Motor, Simulation, shapes

module, pressure = 0.004, math.radians(20)
teeth = {"pinion": 20, "wheel": 30}
speed, brake = 10.0, 2.0  # rad/s, N m


def tooth(count: int) -> np.ndarray:
    """Corners (n, 2) of a tooth about the x axis, from below its base circle to its tip."""
    pitch = module * count / 2
    base = pitch * math.cos(pressure)
    turn = math.tan(pressure) - pressure  # of the involute at the pitch circle
    half = math.pi / (2 * count) - 0.004  # half the tooth at the pitch circle, less the backlash
    corners = [(0.93 * base, half + turn)]
    for r in np.linspace(base, pitch + module, 12):
        a = math.acos(min(base / r, 1.0))
        corners.append((r, half + turn - (math.tan(a) - a)))
    return np.array([(r * math.cos(s * a), r * math.sin(s * a)) for r, a in corners for s in (-1, 1)])


builder = ModelBuilder(gravity=(0, 0, 0))
steel = Material(friction=0.1)
far = module * sum(teeth.values()) / 2
for name, count in teeth.items():
    place = (0.0 if name == "pinion" else far, 0, 0)
    gear = builder.add_body(name, position=place)
    radius = 0.95 * module * count / 2 * math.cos(pressure)
    builder.add_geom(gear, shapes.Cylinder(radius, 0.006), density=7800, category=0, mask=0)
    shift = 0.0 if name == "pinion" else math.pi / count + math.pi  # its gap faces a tooth
    for k in range(count):
        a = 2 * math.pi * k / count + shift
        turn = np.array([[math.cos(a), math.sin(a)], [-math.sin(a), math.cos(a)]])
        points = [(*xy, z) for xy in tooth(count) @ turn for z in (-0.006, 0.006)]
        builder.add_geom(gear, shapes.Hull(points), density=7800, material=steel)
    builder.add_revolute_joint(
        gear, point=place, axis=(0, 0, 1), name=name, friction=brake * (name == "wheel")
    )
builder.set_motor("pinion", Motor("velocity", control=speed))
simulation = Simulation(builder.build(), dt=5e-4)

simulation.run(0.1)
start, rates = simulation.q, []
for _ in range(800):
    simulation.step()
    rates.append(simulation.kinematics.rate("wheel"))
turned = simulation.q - start
ratio = turned[1] / turned[0]
print(f"the ratio is {ratio:.5f}; the wheel turns with {np.mean(rates):.3f} rad/s, from {min(rates):.3f} to "
      f"{max(rates):.3f}")  # fmt: skip
assert abs(ratio + 20 / 30) < 1e-3  # an involute passes on a constant ratio
assert np.ptp(rates) < 0.05 * speed
