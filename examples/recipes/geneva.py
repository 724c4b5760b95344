"""A Geneva drive of four slots: a turn of the driver turns the wheel by a quarter, and it rests between."""

import math

import numpy as np
from amontons import Material, ModelBuilder, Motor, Simulation, shapes

reach, pin, slot = 0.05, 0.004, 0.0043  # m: crank, radius of the pin, half width of a slot
centre = reach * math.sqrt(2)  # of the wheel: the pin enters along the slot
outer = 0.052  # m, of the wheel
bottom = centre - reach - 0.006  # m, of the slots
speed = 4.0  # rad/s


def plate(outline: list[tuple[float, float]]) -> shapes.Hull:
    """A convex outline (radius, angle) as a plate of 10 mm about z = 0."""
    return shapes.Hull([(r * math.cos(a), r * math.sin(a), z) for r, a in outline for z in (-0.005, 0.005)])


def wheel() -> list[shapes.Hull]:
    """The part in the middle, and a part between each two slots, with an arc of the rim."""
    parts, middle = [], []
    edge = math.asin(slot / outer)
    for k in range(4):
        turn = math.radians(45 + 90 * k)
        rim = np.linspace(turn + edge, turn + math.pi / 2 - edge, 7)
        # The inner corners: one beside this slot, one beside the next.
        corner, side = math.hypot(bottom, slot), math.atan2(slot, bottom)
        ends = [(corner, turn + side), (corner, turn + math.pi / 2 - side)]
        parts.append(plate([*ends, *((outer, angle) for angle in rim)]))
        middle += ends
    return [plate(middle), *parts]


builder = ModelBuilder(gravity=(0, 0, 0))
smooth = Material(friction=0.05)
driver = builder.add_body("driver")
builder.add_geom(driver, shapes.Cylinder(pin, 0.006), position=(0, -reach, 0), density=7800, material=smooth)
arm = shapes.Box((0.006, reach / 2, 0.003))
builder.add_geom(driver, arm, position=(0, -reach / 2, -0.014), density=7800, category=0, mask=0)
steel, brass = (0.55, 0.57, 0.6, 1), (0.77, 0.67, 0.41, 1)
builder.add_visual(driver, shapes.Cylinder(pin, 0.008), position=(0, -reach, -0.004), colour=steel)
builder.add_visual(driver, shapes.Cylinder(reach + 0.008, 0.002), position=(0, 0, -0.013), colour=steel)
builder.add_revolute_joint(driver, point=(0, 0, 0), axis=(0, 0, 1), name="crank",
                           motor=Motor("velocity", control=speed))  # fmt: skip
star = builder.add_body("wheel", position=(centre, 0, 0))
for hull in wheel():
    builder.add_geom(star, hull, density=7800, material=smooth)
    builder.add_visual(star, hull, colour=brass)
# Dry friction holds the wheel while no pin does, in place of the arc of a lock.
builder.add_revolute_joint(star, point=(centre, 0, 0), axis=(0, 0, 1), name="wheel", friction=0.02)
simulation = Simulation(builder.build(), dt=1e-3)
simulation.run(2 * math.pi / speed)

turned = -math.degrees(simulation.kinematics.coordinate("wheel"))
clearance = math.degrees(2 * (slot - pin) / (centre - reach))
print(f"a turn of the driver turns the wheel by {turned:.2f} degrees")
assert abs(turned - 90) < clearance
