"""Boxes fall on a heap: build a model, step it, read contacts and forces, save and go on."""

import tempfile
from pathlib import Path

import amontons
import numpy as np
from amontons import Material, ModelBuilder, Simulation, shapes

rng = np.random.default_rng(3)
builder = ModelBuilder()  # gravity (0, 0, -9.81) m/s^2
builder.add_geom(None, shapes.Plane(), name="ground", material=Material(friction=0.5))
for i in range(12):
    q = rng.normal(size=4)
    builder.add_body(
        f"box {i}",
        shape=shapes.Box(rng.uniform(0.05, 0.15, size=3)),
        density=700,
        position=(*rng.uniform(-0.2, 0.2, size=2), 0.3 + 0.3 * i),
        orientation=q / np.linalg.norm(q),
    )
model = builder.build()
simulation = Simulation(model, dt=5e-3)

print(" time   contacts   energy (J)   penetration (mm)   residual")


def show(sim: Simulation, report: amontons.Report) -> None:
    if sim.steps % 100 == 0:
        row = (sim.time, report.contacts, report.energy, 1e3 * report.penetration, report.residual)
        print("{:5.1f} {:10d} {:12.3f} {:18.5f} {:10.1e}".format(*row))


simulation.run(3.0, after_step=show)

table = simulation.contacts
ground = table[table["body_b"] == -1]
print(f"\nthe ground carries {ground['force'][:, 2].sum():.1f} N of {9.81 * model.total_mass:.1f} N")
states, counts = np.unique(table["state"], return_counts=True)
print("contact states:", dict(zip(states.tolist(), counts.tolist(), strict=True)))

with tempfile.TemporaryDirectory() as folder:
    saved = Path(folder) / "heap.h5"
    simulation.save(saved)
    again = Simulation.load(saved)
simulation.run(0.1), again.run(0.1)
print("a saved simulation goes on bit for bit:", (simulation.state.positions == again.state.positions).all())
