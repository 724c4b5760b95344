"""A gripper lifts a mug: it holds as long as 2 mu F exceeds the weight, and not with less."""

from amontons import Material, ModelBuilder, Motor, Simulation, shapes
from solids import mug

friction, height = 0.5, 0.1  # m


def lifted(force: float) -> tuple[Simulation, float]:
    """Closes with a force of each finger (N), then lifts: how far the mug rises (m)."""
    builder = ModelBuilder(friction_rule="maximum")
    builder.add_floor(material=Material(friction=0.0))
    mug(builder, (0, 0, 0), Material(friction=0.0))
    palm = builder.add_body("palm", position=(0, 0, 0.2), shape=shapes.Box((0.02, 0.09, 0.015)), density=2700)
    builder.add_visual(palm, shapes.Box((0.02, 0.09, 0.015)), colour=(0.62, 0.68, 0.75, 1))
    lift = Motor("velocity", control=0.0)
    builder.add_prismatic_joint(palm, axis=(0, 0, 1), name="lift", motor=lift)
    for name, side in (("left", -1), ("right", 1)):
        place = (0, side * 0.06, 0.1)
        rubber = Material(friction=friction, compliance=1e-5, relaxation_time=0.02)
        finger = builder.add_body(
            name, position=place, shape=shapes.Box((0.015, 0.008, 0.08)), mass=0.1, material=rubber
        )
        builder.add_visual(finger, shapes.Box((0.015, 0.008, 0.08)), colour=(0.3, 0.3, 0.33, 1))
        motor = Motor("effort", control=force)
        builder.add_prismatic_joint(finger, palm, axis=(0, -side, 0), name=name, motor=motor, damping=5.0)
    simulation = Simulation(builder.build(), dt=2e-3)
    simulation.run(0.6)  # it closes
    simulation.set_control("lift", height / 2)  # m/s
    simulation.run(2.0)
    simulation.set_control("lift", 0.0)
    simulation.run(0.5)
    return simulation, float(simulation.state.positions[0, 2])


simulation, _ = lifted(0.0)
enough = 9.81 * simulation.model.bodies[0].mass / (2 * friction)
for share in (0.85, 1.15):
    simulation, rise = lifted(share * enough)
    print(f"with {share * enough:.2f} N of each finger the mug rises by {1e3 * rise:.1f} mm")
    assert (rise > 0.95 * height) == (share > 1)
