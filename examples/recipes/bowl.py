"""A bowl that slides on a table and holds balls: its mesh collides as convex parts, with its hollow."""

import numpy as np
from amontons import Material, ModelBuilder, Simulation, shapes
from solids import turned

# Outside and inside of a wall of 1 cm: a spherical cup of 10 cm with a flat foot.
angles = np.radians(np.linspace(15, 80, 4))
outside = [(0.11 * np.sin(a), 0.11 * (1 - np.cos(a))) for a in angles]
inside = [(0.10 * np.sin(a), 0.11 - 0.10 * np.cos(a)) for a in angles[::-1]]
mesh = turned([(0.0, 0.004), *outside, *inside, (0.0, 0.012)], 12)
parts = shapes.decompose(mesh, error=0.006)
print(f"{len(parts.hulls)} parts, which reach outside of the mesh by {1e3 * parts.deviation:.1f} mm")

builder = ModelBuilder()
builder.add_floor(material=Material(friction=0.4))
glazed = Material(friction=0.2)
bowl = builder.add_body("bowl", position=(0, 0, 0.001), linear_velocity=(0.5, 0, 0))
for hull in parts.hulls:
    builder.add_geom(bowl, hull, density=2000, material=glazed)
for k in range(7):
    place = (0.03 * np.cos(k), 0.03 * np.sin(k), 0.08 + 0.03 * k)
    builder.add_body(f"ball {k}", shape=shapes.Sphere(0.014), density=2500, position=place, material=glazed)
simulation = Simulation(builder.build(), dt=4e-3)
simulation.run(1.5)

held = simulation.state.positions[1:] - simulation.state.positions[0]
print(f"the bowl slid by {100 * simulation.state.positions[0, 0]:.1f} cm; the balls lie within "
      f"{100 * np.hypot(*held[:, :2].T).max():.1f} cm of its axis")  # fmt: skip
assert np.hypot(*held[:, :2].T).max() < 0.09  # all balls are in the bowl
assert held[:, 2].min() > 0.014  # and none has fallen through its foot
