"""The first hour of a mechanical engineer: torque and bearing forces of a slider-crank, and closed forms."""

import math

import numpy as np
from amontons import ModelBuilder, Motor, Simulation, shapes

CRANK, ROD, PISTON, SPEED = 0.05, 0.15, 0.8, 60.0  # m, m, kg, rad/s
PRESSURE = 500.0  # N on the piston, against its way out

builder = ModelBuilder(gravity=(0, 0, 0))
light = 1e-4  # kg: crank and rod without inertia, as in the textbook
for name, at, half in (("crank", 0.5 * CRANK, 0.5 * CRANK), ("rod", CRANK + 0.5 * ROD, 0.5 * ROD)):
    builder.add_body(name, shape=shapes.Box((half, 2e-3, 2e-3)), mass=light, position=(at, 0, 0))
builder.add_body("piston", shape=shapes.Box((0.02, 0.02, 0.02)), mass=PISTON, position=(CRANK + ROD, 0, 0))
axis = (0, -1, 0)  # positive angles lift the pin
builder.add_revolute_joint("crank", point=(0, 0, 0), axis=axis, name="main bearing", motor=Motor("velocity"))
builder.add_revolute_joint("rod", "crank", point=(CRANK, 0, 0), axis=axis, name="crank pin")
builder.add_revolute_joint("piston", "rod", point=(CRANK + ROD, 0, 0), axis=axis, name="wrist pin")
builder.add_prismatic_joint("piston", axis=(1, 0, 0), name="cylinder")
engine = Simulation(builder.build(), dt=1e-4)
engine.set_qd({"main bearing": SPEED})
engine.set_control("main bearing", SPEED)
engine.state.forces[2] = (-PRESSURE, 0, 0)


def place(angle: float) -> float:
    """The position of the piston (m)."""
    return CRANK * math.cos(angle) + math.sqrt(ROD**2 - (CRANK * math.sin(angle)) ** 2)


def expected(angle: float, h: float = 1e-4) -> tuple[float, float]:
    """Torque of the motor (N m), by the work of the piston, and side force on the cylinder (N)."""
    slope = (place(angle + h) - place(angle - h)) / (2 * h)
    bend = (place(angle + h) - 2 * place(angle) + place(angle - h)) / h**2
    force = PISTON * SPEED**2 * bend + PRESSURE
    return slope * force, force * CRANK * math.sin(angle) / math.sqrt(ROD**2 - (CRANK * math.sin(angle)) ** 2)


rows = []


def measure(engine: Simulation, _: object) -> None:
    torque = engine.forces.effort("main bearing")  # with the angle to which it belongs
    side = engine.forces.reaction("cylinder").force[2]
    rows.append((torque.coordinate, torque.motor, side, *expected(torque.coordinate)))


engine.run(4 * math.pi / SPEED, after_step=measure)
angle, torque, side, torque_expected, side_expected = np.array(rows[len(rows) // 2 :]).T
for k in range(0, len(angle), len(angle) // 8):
    print(f"{math.degrees(angle[k]) % 360:5.0f} deg  {torque[k]:8.2f} N m  side force {side[k]:8.1f} N")
assert abs(torque - torque_expected).max() < 2e-3 * abs(torque_expected).max()
assert abs(side - side_expected).max() < 2e-3 * abs(side_expected).max()
