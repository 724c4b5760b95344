"""Parcels on a conveyor: a surface velocity, friction that brings them to speed, a chute at the end."""

import math

import numpy as np
from amontons import Material, ModelBuilder, Simulation, shapes

speed, mu, g = 1.0, 0.4, 9.81
builder = ModelBuilder(friction_rule="minimum")
builder.add_geom(None, shapes.Plane(), name="floor", material=Material(friction=0.6))
builder.add_geom(
    None,
    shapes.Box((2.0, 0.3, 0.05)),
    position=(0, 0, 0.75),
    surface_velocity=(speed, 0, 0),  # of the surface over the body, m/s
    material=Material(friction=mu),
    name="belt",
)
slope = math.radians(30)
builder.add_geom(
    None,
    shapes.Box((0.8, 0.3, 0.02)),
    position=(2.0 + 0.8 * math.cos(slope), 0, 0.75 - 0.8 * math.sin(slope)),
    orientation=(math.cos(slope / 2), 0, math.sin(slope / 2), 0),
    material=Material(friction=0.2),
    name="chute",
)
for i in range(4):
    parcel = shapes.Box((0.15, 0.1, 0.1))
    builder.add_body(f"parcel {i}", shape=parcel, density=200, position=(0.6 * i - 1.8, 0, 0.9))
model = builder.build()
simulation = Simulation(model, dt=5e-3)
velocities = simulation.state.linear_velocities  # a view: it shows every step

for what, until in (("being accelerated", 0.1), ("riding", 0.5)):
    simulation.run(until - simulation.time)
    states, counts = np.unique(simulation.contacts["state"], return_counts=True)
    expected = min(speed, mu * g * simulation.time)
    print(f"{what}: {velocities[0, 0]:.4f} of {expected:.4f} m/s, {states.tolist()} {counts.tolist()}")

belt = model.geom_index("belt")
pull = simulation.contacts[simulation.contacts["geom_b"] == belt]["force"][:, 0].sum()
print(f"the belt pulls with {pull:.1e} N at constant speed")

report = simulation.run(6.0)
for i, (x, _, z) in enumerate(simulation.state.positions):
    print(f"parcel {i} lies at x = {x:.2f} m, {z:.3f} m high")
print(f"kinetic energy {report.kinetic_energy:.1e} J, residual {report.residual:.1e}")
