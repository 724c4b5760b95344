"""A door on two hinges: a closed loop with redundant constraints, a motor, a door closer and a stop."""

import math

from amontons import ModelBuilder, Motor, Simulation, shapes

width, mass, lever = 0.8, 20.0, 1.4  # m, kg, m between the hinges
builder = ModelBuilder()
builder.add_body("door", shape=shapes.Box((width / 2, 0.02, 1.0)), mass=mass, position=(width / 2, 0, 1.0))
builder.add_revolute_joint(
    "door",
    point=(0, 0, 0.3),
    axis=(0, 0, 1),
    limits=(0, math.radians(100)),
    motor=Motor("velocity", 0.0, max_effort=30.0),  # rad/s, N m
    name="lower hinge",
)
# The second hinge adds five constraints that hold already. Springs and dampers are implicit.
builder.add_revolute_joint(
    "door", point=(0, 0, 0.3 + lever), axis=(0, 0, 1), stiffness=4.0, damping=2.0, name="upper hinge"
)
simulation = Simulation(builder.build(), dt=5e-3)


def show(what: str, duration: float) -> None:
    report = simulation.run(duration)
    lower, upper = simulation.forces.joint_efforts
    angle = math.degrees(simulation.kinematics.coordinate("lower hinge"))
    print(
        f"{what:20s} {angle:5.1f} deg   motor {lower['motor']:6.2f}   closer {upper['passive']:6.2f}"
        f"   stop {lower['limit']:6.2f} N m   error {report.joint_error:.0e} m"
    )


show("shut", 0.5)
reactions = simulation.forces.joint_reactions
for name, r in zip(simulation.model.joint_names, reactions, strict=True):
    print(f"  {name}: {r['force'][0]:6.2f} N across, {r['force'][2]:5.2f} N up, {r['torque'][1]:6.2f} N m")
# Statics says nothing about the shares of two rigid hinges, but their sum must hold the door.
moment = reactions["torque"][:, 1].sum() + lever * reactions["force"][1, 0]
print(f"  moment {moment:.3f} N m of {-mass * 9.81 * width / 2:.3f} N m")

simulation.set_control("lower hinge", 1.0)  # rad/s
show("opens with 1 rad/s", 1.0)
show("against its stop", 1.5)
simulation.set_control("lower hinge", -0.5)
show("shuts", 2.0)
show("against the frame", 2.0)
