"""A jointed figure that starts deep inside a deck comes out of it without being thrown."""

import amontons
import pytest
from amontons import Material, ModelBuilder, Motor, shapes


def rider(depth):
    """A torso on two legs of thigh, shin and foot with stiff motors, its feet `depth` (m) inside a deck."""
    b = ModelBuilder()
    grip = Material(friction=1.0)
    b.add_geom(None, shapes.Box((2, 1, 0.2)), position=(0, 0, -0.2), material=grip)
    z = -depth
    torso = b.add_body(position=(0, 0, z + 1.25), shape=shapes.Box((0.1, 0.15, 0.25)), mass=30.0)
    for side in (-0.1, 0.1):
        above, joint = torso, z + 0.98
        for half, size in ((0.2, 0.05), (0.2, 0.04)):
            part = b.add_body(
                position=(0, side, joint - half), shape=shapes.Capsule(size, half - size), mass=4.0
            )
            motor = Motor("position", 0.0, kp=300.0, kd=20.0)
            b.add_revolute_joint(part, above, point=(0, side, joint), axis=(0, 1, 0), motor=motor)
            above, joint = part, joint - 2 * half
        foot = b.add_body(position=(0.05, side, z + 0.03), shape=shapes.Box((0.12, 0.04, 0.03)), mass=1.0)
        motor = Motor("position", 0.0, kp=100.0, kd=10.0)
        b.add_revolute_joint(foot, above, point=(0, side, z + 0.06), axis=(0, 1, 0), motor=motor)
    return b.build()


@pytest.mark.parametrize("depth", [0.05, 0.14])
def test_a_deep_start_gives_no_energy_and_is_over_in_half_a_second(depth):
    # Lifting the figure takes m g depth at most; the motors hold a pose that they have. Kinetic energy above
    # m g depth is energy of the overlap. Breaks when a correction gives velocities, or leaves the overlap.
    sim = amontons.Simulation(rider(depth), on_failure="ignore")
    weight = sim.model.total_mass * 9.81
    reports = [sim.step() for _ in range(400)]
    assert sum(not r.converged for r in reports) <= 4
    assert max(r.penetration for r in reports[100:]) < 1e-3
    assert max(r.kinetic_energy for r in reports) < weight * depth
