"""A door on two hinges: a closed loop with redundant constraints, a motor, a spring and a stop."""

import math

from amontons import ModelBuilder, Motor, Simulation, shapes

width, height, mass, g = 0.8, 2.0, 20.0, 9.81
builder = ModelBuilder()
builder.add_body("door", shape=shapes.Box((width / 2, 0.02, height / 2)), mass=mass, position=(width / 2, 0, 1.0))
# Ten constraints hold five directions: each hinge alone would do. How they share the load is found, not told.
builder.add_revolute_joint(
    "door",
    point=(0, 0, 0.3),
    axis=(0, 0, 1),
    name="lower hinge",
    motor=Motor("speed", 0.0, max_effort=30.0),  # N m
    limits=(0, math.radians(100)),
)
builder.add_revolute_joint(
    "door", point=(0, 0, 1.7), axis=(0, 0, 1), name="upper hinge", stiffness=4.0, damping=2.0
)
simulation = Simulation(builder.build(), dt=5e-3)


def show(what: str) -> None:
    angle = math.degrees(simulation.coordinate("lower hinge"))
    report = simulation.step()
    motor, stop = (simulation.joint_efforts[0][key] for key in ("motor", "limit"))
    error = 1e9 * report.joint_error
    print(f"{what:24s} {angle:6.1f} deg   motor {motor:6.2f} N m   stop {stop:6.2f} N m   error {error:.2f} nm")


simulation.run(0.5)
show("shut")
for reaction in simulation.joint_reactions:
    x, _, z = reaction["force"]
    print(f"  {reaction['joint']} carries {x:7.2f} N across and {z:6.2f} N up")
print(f"  by statics {mass * g * width / 2 / 1.4:.2f} N across and {mass * g:.2f} N up in all")

simulation.set_target("lower hinge", 1.0)  # rad/s
simulation.run(1.0)
show("opening with 1 rad/s")
simulation.run(1.5)
show("against its stop")
simulation.set_target("lower hinge", -0.5)
simulation.run(4.0)
show("shut again")
