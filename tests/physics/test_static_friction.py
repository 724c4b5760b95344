"""Static unlike kinetic friction, and Stribeck's curve, of contacts and joints, beside closed forms."""

import numpy as np
import pytest
from amontons import Dof, InputError, Joint, Material, ModelBuilder, Motor, Simulation, Transform, shapes
from amontons.model.compiled import Parts
from middle import energies_in_the_middle

G = 10.0


def block(material, *, belt=0.0, stiffness=0.0, mass=2.0, **options):
    """A block on a plane that it cannot leave sideways or tilt on; `belt`: speed of the plane (m/s)."""
    builder = ModelBuilder(gravity=(0, 0, -G))
    builder.add_geom(None, shapes.Plane(), material=material, surface_velocity=(belt, 0, 0))
    body = builder.add_body(
        "block", shape=shapes.Box((0.1, 0.1, 0.1)), mass=mass, position=(0, 0, 0.1), material=material
    )
    slides = (Dof("slide", (1, 0, 0), stiffness=stiffness), Dof("slide", (0, 0, 1)))
    builder.add_joint(Joint("rail", body_a=body, dofs=slides, frame_b=Transform((0, 0, 0.1))))
    return Simulation(builder.build(), tolerance=1e-13, **options)


# Breaks if the coefficient of a stuck contact is not the static one, or if a contact that slips keeps it.
def test_break_away_at_the_static_coefficient():
    law = Material(friction=0.3, friction_static=0.45)
    limit = 0.45 * 2 * G
    for force, slips in [(limit * (1 - 1e-9), False), (limit * (1 + 1e-9), True)]:
        simulation = block(law, dt=1e-3)
        simulation.state.forces[0] = (force, 0, 0)
        simulation.run(0.1)
        speed = simulation.state.linear_velocities[0, 0]
        if not slips:
            assert abs(speed) < 1e-12
            continue
        # The first kick, half a step, has the static coefficient; all others accelerate by (F - mu m g) / m.
        expected = (force - limit) / 2 * 5e-4 + (force - 0.3 * 2 * G) / 2 * 0.0995
        assert speed == pytest.approx(expected, rel=1e-9)
        assert simulation.contacts["friction"] == pytest.approx(0.3)


# A block on a moving belt, held by a spring: it sticks until the spring pulls with mu_s N, slips through a
# part of a cosine about mu_k N / k, and sticks again. Breaks if a contact takes the static coefficient while
# it slips, or does not regain it.
def test_stick_slip_on_a_belt():
    mass, k, speed, static, kinetic = 2.0, 200.0, 0.1, 0.5, 0.3
    law = Material(friction=kinetic, friction_static=static)
    dt = 2e-4
    simulation = block(law, belt=speed, stiffness=k, mass=mass, dt=dt)
    x = []
    for _ in range(round(4.0 / dt)):
        simulation.step()
        x.append(simulation.state.positions[0, 0])
    x = np.array(x)
    omega = np.sqrt(k / mass)
    drop = (static - kinetic) * mass * G / k
    phase = np.arctan(speed / (omega * drop))
    period = 2 * drop / speed + (np.pi + 2 * phase) / omega
    amplitude = np.hypot(drop, speed / omega)
    middle = kinetic * mass * G / k
    late = x[round(1.0 / dt) :]
    crossings = np.flatnonzero((late[:-1] < middle) & (late[1:] >= middle))
    assert np.diff(crossings).mean() * dt == pytest.approx(period, rel=0.01)
    assert late.max() - middle == pytest.approx(amplitude, rel=0.01)
    assert late.min() - middle == pytest.approx(-amplitude, rel=0.01)


# Breaks if Stribeck's curve, its speed or the rate of a dof is wrong; the reference is the formula.
def test_stribeck_curve_of_a_joint():
    for rate in (0.05, 0.2, 0.5, 1.0, 5.0):
        builder = ModelBuilder(gravity=(0, 0, 0))
        body = builder.add_body("wheel", mass=1, inertia=(1, 1, 1))
        builder.add_revolute_joint(
            body, point=(0, 0, 0), axis=(0, 0, 1), friction=1.0, friction_static=2.0, stribeck_speed=0.5,
            motor=Motor("velocity", control=rate),
        )  # fmt: skip
        simulation = Simulation(builder.build(), dt=1e-3, tolerance=1e-13)
        simulation.run(0.01)
        expected = -(1 + np.exp(-((rate / 0.5) ** 2)))
        assert simulation.forces.joint_efforts["friction"][0] == pytest.approx(expected, rel=1e-9)


# The same limit of a joint at rest. Breaks if a dof that never slipped begins with the kinetic value.
def test_joint_breaks_away_at_the_static_friction():
    for torque, slips in [(2 * (1 - 1e-9), False), (2 * (1 + 1e-9), True)]:
        builder = ModelBuilder(gravity=(0, 0, 0))
        body = builder.add_body("wheel", mass=1, inertia=(1, 1, 1))
        builder.add_revolute_joint(
            body, point=(0, 0, 0), axis=(0, 0, 1), friction=1.0, friction_static=2.0,
            motor=Motor("effort", control=torque),
        )  # fmt: skip
        simulation = Simulation(builder.build(), dt=1e-3, tolerance=1e-13)
        simulation.run(0.1)
        rate = simulation.state.angular_velocities[0, 2]
        assert rate == pytest.approx((torque - 2) * 5e-4 + (torque - 1) * 0.0995 if slips else 0, abs=1e-11)


# Breaks if a coefficient that changes between steps lets friction do positive work.
def test_no_energy_is_gained():
    rng = np.random.default_rng(3)
    law = Material(friction=0.2, friction_static=0.8, stribeck_speed=0.05)
    builder = ModelBuilder()
    builder.add_geom(None, shapes.Plane(), material=law)
    for k in range(6):
        builder.add_body(
            shape=shapes.Box((0.1, 0.1, 0.1)), density=1000, position=(0, 0, 0.15 + 0.25 * k), material=law,
            linear_velocity=rng.uniform(-1, 1, 3), angular_velocity=rng.uniform(-2, 2, 3),
        )  # fmt: skip
    simulation = Simulation(builder.build(), dt=2e-3, tolerance=1e-9)
    energies = []  # in the middles of steps, as blocks strike
    for _ in range(500):
        simulation.step()
        energies.append(sum(energies_in_the_middle(simulation)))
    assert np.diff(energies).max() < 1e-6 * energies[0]


# Breaks if the law costs a bit where it is off, or where both coefficients agree.
def test_equal_coefficients_give_the_same_bits():
    def run(law):
        simulation = block(law, belt=0.3, stiffness=100, dt=1e-3)
        simulation.run(0.3)
        return simulation.state.positions.tobytes() + simulation.state.linear_velocities.tobytes()

    assert run(Material(friction=0.4)) == run(Material(friction=0.4, friction_static=0.4, stribeck_speed=0.1))


# Breaks if a state forgets which contacts and joints slip.
def test_a_saved_state_goes_on_bit_for_bit(tmp_path):
    law = Material(friction=0.3, friction_static=0.5, stribeck_speed=0.2)
    whole = block(law, belt=0.1, stiffness=200, dt=1e-3)
    whole.run(0.6)  # in the middle of a slip
    assert (whole.contacts["state"] == "slip").all()
    whole.save(tmp_path / "half.h5")
    copied = whole.copy()
    again = Simulation.load(tmp_path / "half.h5")
    for simulation in (whole, again, copied):
        simulation.run(0.1)
    ends = [simulation.state.positions.tobytes() for simulation in (whole, again, copied)]
    assert ends[0] == ends[1] == ends[2]


# Each message names the value and the remedy; without them a model would get friction that gains energy.
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Material(friction=0.5, friction_static=0.4), "less than the friction 0.5; swap them"),
        (lambda: Material(stribeck_speed=-1), "stribeck_speed is -1; it must not be negative"),
        (lambda: Dof(friction=2, friction_static=1), "less than the friction 2; swap them"),
        (lambda: Dof(stribeck_speed=-1), "stribeck_speed is -1; it must not be negative"),
    ],
)
def test_wrong_coefficients(make, message):
    with pytest.raises(InputError, match=message):
        make()


# Breaks if a pair does not combine static coefficients as kinetic ones.
def test_pairs_combine_static_coefficients():
    builder = ModelBuilder(friction_rule="maximum")
    builder.add_geom(None, shapes.Plane(), material=Material(friction=0.2, friction_static=0.9))
    builder.add_body(
        "a", shape=shapes.Sphere(0.1), density=1, position=(0, 0, 0.1), material=Material(friction=0.4)
    )
    material = builder.build().core.material(0, 1, Parts().make)
    assert (material.friction, material.friction_static) == (0.4, 0.9)
