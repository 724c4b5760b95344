"""A mug hangs on a peg by its handle, swings, and comes to rest with its weight below the peg."""

import math

import amontons
import numpy as np
from amontons import Material, ModelBuilder, Simulation, shapes
from solids import mug

builder = ModelBuilder()
china = Material(friction=0.4, torsional_friction=2e-3, rolling_friction=1e-3)
across = amontons.axis_angle((1, 0, 0), math.pi / 2)
rod = shapes.Capsule(0.006, 0.05)
builder.add_geom(None, rod, position=(0.057, 0, 0.06), orientation=across, material=china, name="peg")
cup = mug(builder, (0, 0, 0), china)
simulation = Simulation(builder.build(), dt=2e-3)
simulation.run(8.0)

state, body = simulation.state, simulation.model.bodies[cup]
centre = amontons.Transform(state.positions[cup], state.orientations[cup])(body.centre_of_mass)
force = simulation.contacts["force"].sum(axis=0)  # on the mug, which touches the peg alone
beside = centre[0] - 0.057
print(f"the peg carries {force[2]:.4f} N; the weight hangs {1e3 * beside:+.2f} mm beside its axis")
assert np.linalg.norm(state.angular_velocities[cup]) < 1e-3
assert abs(force[2] - 9.81 * body.mass) < 1e-3 * body.mass * 9.81
assert abs(beside) < 0.006 + 1e-3  # the peg's radius, and the length of rolling friction
