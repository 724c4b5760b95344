"""Bodies that fly, tumble and swing, against their closed forms."""

import math
from dataclasses import replace

import amontons
import amontons.scenes
import numpy as np
import pytest
from amontons import Transform, shapes
from amontons.parts import Fluid, FluidBox
from measures import run, simulate
from scipy.special import ellipk


def thrown(velocity, gravity=(0, 0, -9.81)):
    b = amontons.ModelBuilder(gravity=gravity)
    b.add_body("stone", shape=shapes.Sphere(0.1), density=1000, linear_velocity=velocity)
    return b.build()


def test_free_fall_keeps_its_energy():
    # Velocities and poses are of one instant: the sum is constant to rounding. With the velocity of half a
    # step before it would swing by h/2 m g v.
    sim = amontons.Simulation(thrown((0, 0, 2.0)), dt=5e-3)
    energies = np.array([r.energy for r in run(sim, 1.0)])
    assert np.ptp(energies) < 1e-12 * np.abs(energies).max() * len(energies)


@pytest.mark.parametrize("angle", [5.0, 60.0])
def test_pendulum_period(angle):
    # T = 4 sqrt(I / (m g d)) K(sin(a/2)). The discrete period of a first-order symplectic step differs by
    # O(h^2) relative, here (w h)^2 / 24 ~ 6e-7; crossings are interpolated linearly, error below (w h)^2 /
    # 8 of a step. Two periods average that over four crossings: 1e-5 has room for both and fails for a
    # wrong inertia.
    h = 1e-3
    sim = simulate("pendulum", {"angle": angle}, dt=h)
    bar = sim.model.bodies[0]
    about_hinge = np.array(bar.inertia)[1, 1] + bar.mass * 0.5**2
    period = (
        4 * math.sqrt(about_hinge / (bar.mass * 9.81 * 0.5)) * ellipk(math.sin(math.radians(angle) / 2) ** 2)
    )
    times, x = [], []
    run(sim, 2.3 * period, lambda s, _: (times.append(s.time), x.append(s.state.positions[0, 0])))
    x = np.array(x)
    crossings = [times[i] + h * x[i] / (x[i] - x[i + 1]) for i in range(len(x) - 1) if x[i] * x[i + 1] < 0]
    measured = crossings[2] - crossings[0]
    assert measured == pytest.approx(period, rel=1e-5 + (2 * math.pi * h / period) ** 2)


@pytest.mark.parametrize("scale", [0.0, 0.3, -1.0])
def test_gravity_scale(scale):
    # Falls with scale g: v = scale g t exactly. Its energy counts its own weight.
    b = amontons.ModelBuilder()
    b.add_body(shape=shapes.Sphere(0.1), mass=2.0, gravity_scale=scale)
    sim = amontons.Simulation(b.build(), dt=1e-2)
    reports = []
    sim.run(1.0, after_step=lambda _, report: reports.append(report))
    assert sim.state.linear_velocities[0, 2] == pytest.approx(-9.81 * scale, abs=1e-12)
    energies = [r.kinetic_energy + r.potential_energy for r in reports]
    assert max(energies) - min(energies) <= 1e-9 * max(1.0, max(map(abs, energies)))


def test_drag_of_a_viscous_fluid():
    # m v' = m g - c v with c = 3 pi d viscosity: v = m g / c (1 - exp(-c t / m)); a spin decays with
    # pi d^3 viscosity / I. The wind counts. With the share z of the speed per step h, errors are those of the
    # share z / sqrt(1 + z^2), z^2 / 2, and of velocities that go on by half a step, 7 z^2 / 12: together most
    # for the spin, with z = 0.0252.
    d, viscosity, m, inertia, t = 0.2, 5.0, 0.5, 0.01, 0.2
    box = FluidBox(0, Transform(), (d, d, d))
    c, turning = 3 * math.pi * d * viscosity, math.pi * d**3 * viscosity
    errors = []
    for h in (2e-3, 1e-3):
        b = amontons.ModelBuilder()
        b.add_body(mass=m, inertia=(inertia,) * 3, angular_velocity=(0, 0, 2.0))
        fluid = Fluid(viscosity=viscosity, wind=(0.3, 0, 0))
        sim = amontons.Simulation(replace(b.build(), fluid=fluid, fluid_boxes=(box,)), dt=h)
        sim.run(t)
        fallen = -m * 9.81 / c * (1 - math.exp(-c * t / m))
        blown = 0.3 * (1 - math.exp(-c * t / m))
        exact = (blown, 0, fallen, 0, 0, 2 * math.exp(-turning * t / inertia))
        found = (*sim.state.linear_velocities[0], *sim.state.angular_velocities[0])
        errors.append(np.abs(np.subtract(found, exact)).max())
    assert errors[0] < 13 / 12 * 0.0252**2 * 2
    assert errors[1] < errors[0] / 3.5


def test_drag_of_a_thick_fluid_stops():
    # A damper of 1e4 / s against a step of 10 ms: the first kick of half a step, with z = 50, takes the share
    # z / sqrt(1 + z^2) of the speed, which keeps its sign.
    b = amontons.ModelBuilder(gravity=(0, 0, 0))
    b.add_body(mass=1.0, inertia=(1, 1, 1), linear_velocity=(1, 2, 3))
    fluid = Fluid(viscosity=1e4 / (3 * math.pi * 0.1))
    box = FluidBox(0, Transform(), (0.1, 0.1, 0.1))
    sim = amontons.Simulation(replace(b.build(), fluid=fluid, fluid_boxes=(box,)), dt=1e-2)
    sim.step()
    left = np.array([1, 2, 3]) * (1 - 50 / math.sqrt(2501))
    np.testing.assert_allclose(sim.state.linear_velocities[0], left, rtol=1e-9)
