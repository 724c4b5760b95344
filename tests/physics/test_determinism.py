"""The same in other units, in another run, after a restart, on other numbers of threads."""

import amontons
import amontons.scenes
import numpy as np
import pytest
from amontons import Material, Motor, shapes
from measures import run, simulate


def machine(length, mass):
    """Contacts, joints, a motor and a spring, in units in which a metre is `length` and a kilogram `mass`."""
    b = amontons.ModelBuilder(gravity=(0, 0, -9.81 * length))
    density = 1000 * mass / length**3
    force = mass * length
    b.add_geom(None, shapes.Plane(), material=Material(friction=0.5))
    for i, (x, y) in enumerate([(0, 0), (0.02, 0.01), (-0.01, 0.03)]):
        b.add_body(
            f"box {i}",
            position=(x * length, y * length, (0.11 + 0.21 * i) * length),
            shape=shapes.Box((0.1 * length,) * 3),
            density=density,
            linear_velocity=(0.3 * length, 0, 0),
        )
    ball = b.add_body(
        "ball",
        position=(1.0 * length, 0, 0.1 * length),
        shape=shapes.Sphere(0.1 * length),
        density=density,
        linear_velocity=(-2 * length, 0, 0),
    )
    arm = b.add_body(
        "arm",
        position=(0, 1.0 * length, 0.5 * length),
        shape=shapes.Capsule(0.03 * length, 0.2 * length),
        density=density,
    )
    b.add_revolute_joint(
        arm,
        None,
        point=(0, 1.0 * length, 0.7 * length),
        axis=(0, 1, 0),
        motor=Motor(kind="speed", target=3.0, max_effort=50 * force * length),
        name="drive",
    )
    b.add_prismatic_joint(
        b.add_body(
            "cart",
            position=(1 * length, 1 * length, 1 * length),
            shape=shapes.Box((0.1 * length,) * 3),
            density=density,
        ),
        None,
        axis=(0, 0, 1),
        stiffness=2000 * mass,
        damping=30 * mass,
        name="spring",
    )
    assert ball
    return b.build()


def ratio_of_motion(length, mass, **options):
    """Largest difference, in metres and m/s, between the machine in SI units and in others after half a
    second."""
    reference = amontons.Simulation(machine(1.0, 1.0), dt=5e-3, **options)
    other = amontons.Simulation(machine(length, mass), dt=5e-3, **options)
    run(reference, 0.5)
    run(other, 0.5)
    return max(
        np.abs(other.state.positions / length - reference.state.positions).max(),
        np.abs(other.state.orientations - reference.state.orientations).max(),
        np.abs(other.state.linear_velocities / length - reference.state.linear_velocities).max(),
    )


@pytest.mark.parametrize(("length", "mass"), [(1024, 1), (1, 1024), (1024, 1024), (1 / 1024, 1 / 64)])
def test_units_by_powers_of_two_change_no_bit(length, mass):
    # Scaling by powers of two commutes with rounding: any difference at all is a constant that carries a
    # dimension, in collision, assembly, stabilisation or a solver's default.
    assert ratio_of_motion(float(length), float(mass)) == 0


@pytest.mark.parametrize(("unit", "factor"), [("mm-g", 1e3), ("km-t", 1e-3)])
def test_units_do_not_matter(unit, factor):
    # mm-g and km-t as m-kg, to rounding: where the solver stops, tolerance 1e-12, half a second of sliding
    # and rolling accumulates 100 steps of at most 1e-12 of the velocities.
    assert ratio_of_motion(factor, factor, tolerance=1e-12) < 1e-9


SCENES = {
    "wall": {"columns": 6, "rows": 6, "speed": 4.0},
    "hopper": {"count": 60},
    "chain": {"links": 20},
    "card_house": {"levels": 2},
    "tracked_vehicle": {"slabs": 3},
}
"""Contacts, joints and both, small enough to run a few hundred steps."""


def bits(sim):
    state = sim.state
    parts = (state.positions, state.orientations, state.linear_velocities, state.angular_velocities)
    return b"".join(np.ascontiguousarray(p).tobytes() for p in parts)


@pytest.mark.parametrize("name", SCENES)
def test_repeats_and_threads_are_bit_identical(name):
    # Any dependence on addresses, hashing, thread count or timing shows within a few dozen chaotic steps.
    duration = 60 * simulate(name, SCENES[name]).dt
    results = []
    for threads in (1, 1, 2):
        sim = simulate(name, SCENES[name], threads=threads)
        run(sim, duration)
        results.append(bits(sim))
    assert results[0] == results[1]
    assert results[0] == results[2]


@pytest.mark.parametrize("name", SCENES)
def test_restart_is_bit_identical(name, tmp_path):
    # What warm start needs is part of the state: a missing piece changes the last bits of the next step.
    sim = simulate(name, SCENES[name])
    run(sim, 20 * sim.dt)
    sim.save(tmp_path / "state.h5")
    run(sim, 20 * sim.dt)
    again = amontons.Simulation.load(tmp_path / "state.h5")
    run(again, 20 * sim.dt)
    assert again.time == sim.time
    assert bits(again) == bits(sim)
