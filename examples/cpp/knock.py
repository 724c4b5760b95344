"""A hammer on a hinge falls against a block: knock.cpp in Python, to the same digits."""

import amontons
from amontons import Material, ModelBuilder, Simulation, shapes

rubber = Material(friction=0.4)
builder = ModelBuilder()
builder.add_floor(material=rubber)
builder.add_body(
    "block", shape=shapes.Box((0.1, 0.1, 0.1)), density=500, position=(0.21, 0, 0.1), material=rubber
)
builder.add_body(
    "hammer", shape=shapes.Box((0.5, 0.05, 0.05)), density=2000, position=(-0.5, 0, 1.1), material=rubber
)
builder.add_revolute_joint("hammer", point=(0, 0, 1.1), axis=(0, 1, 0), name="hinge")
simulation = Simulation(builder.build(), dt=2e-3)


def show(sim: Simulation, report: amontons.Report) -> None:
    if sim.steps % 100 == 0:
        x, _, z = sim.state.positions[0]
        print(f"t {report.time:.1f} s  block {x:.17g} {z:.17g}  energy {report.kinetic_energy:.17g}", end="")
        print(f"  contacts {report.contacts}")


simulation.run(2.0, after_step=show)
