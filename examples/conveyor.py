"""Parcels on a conveyor: a surface velocity, dry friction that brings them to speed, a ramp at the end."""

import math

from amontons import Material, ModelBuilder, Simulation, shapes

speed, mu, g = 1.0, 0.4, 9.81
builder = ModelBuilder(friction_rule="minimum")
rubber = Material(friction=mu)
builder.add_geom(None, shapes.Plane(), name="floor", material=Material(friction=0.6))
builder.add_geom(
    None, shapes.Box((2.0, 0.3, 0.05)), position=(0, 0, 0.75), name="belt", material=rubber, surface_velocity=(speed, 0, 0)
)
slope = math.radians(30)
builder.add_geom(
    None,
    shapes.Box((0.8, 0.3, 0.02)),
    position=(2.0 + 0.8 * math.cos(slope), 0, 0.8 - 0.8 * math.sin(slope) - 0.05),
    orientation=(math.cos(slope / 2), 0, math.sin(slope / 2), 0),
    name="chute",
    material=Material(friction=0.2),
)
parcels = [
    builder.add_body(
        f"parcel {i}", shape=shapes.Box((0.15, 0.1, 0.1)), density=200, position=(-1.8 + 0.6 * i, 0, 0.9)
    )
    for i in range(4)
]
simulation = Simulation(builder.build(), dt=5e-3)
state = simulation.state

caught_up = speed / (mu * g)
steps = round(caught_up / simulation.dt)
for _ in range(steps // 2):
    simulation.step()
slipping = sum(c["state"] == "slip" for c in simulation.contacts)
print(f"t = {simulation.time:.3f} s: {slipping} contacts slip, first parcel at {state.linear_velocities[0, 0]:.4f} m/s")
print(f"            mu g t = {mu * g * simulation.time:.4f} m/s")
simulation.run(caught_up)
sticking = sum(c["state"] == "stick" for c in simulation.contacts)
print(f"t = {simulation.time:.3f} s: {sticking} contacts stick, first parcel at {state.linear_velocities[0, 0]:.4f} m/s")

simulation.run(6.0)
for parcel in parcels:
    x, _, z = state.positions[parcel]
    print(f"t = {simulation.time:.1f} s: parcel {parcel} at x = {x:5.2f} m, z = {z:5.3f} m")
