"""A hammer on a hinge falls against a block: knock.cpp in Python, to the same digits."""

import amontons
from amontons import Dof, Joint, Material, ModelBuilder, Simulation, Transform, shapes

rubber = Material(friction=0.4)
builder = ModelBuilder()
builder.add_geom(None, shapes.Plane(), material=rubber, name="floor")
builder.add_body(
    "block", shape=shapes.Box((0.1, 0.1, 0.1)), density=500, position=(0.21, 0, 0.1), material=rubber
)
hammer = builder.add_body(
    "hammer", shape=shapes.Box((0.5, 0.05, 0.05)), density=2000, position=(-0.5, 0, 1.1), material=rubber
)
builder.add_joint(
    Joint(
        name="hinge",
        body_a=hammer,
        frame_a=Transform((0.5, 0, 0)),
        frame_b=Transform((0, 0, 1.1)),
        dofs=(Dof(axis=(0, 1, 0)),),
    )
)
simulation = Simulation(builder.build(), dt=2e-3)


def show(sim: Simulation, report: amontons.Report) -> None:
    if sim.steps % 100 == 0:
        x, _, z = sim.state.positions[0]
        print(f"t {report.time:.1f} s  block {x:.17g} {z:.17g}  energy {report.kinetic_energy:.17g}", end="")
        print(f"  contacts {report.contacts}")


simulation.run(2.0, show)
