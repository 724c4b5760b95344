"""Linear models of a step against closed forms: a pendulum, a cart-pole, a floating body, activations."""

import amontons
import numpy as np
import pytest
from amontons import ModelBuilder, Motor, Simulation, shapes
from scipy.linalg import expm, solve_discrete_are

GRAVITY, LENGTH, MASS, CART = 9.81, 0.6, 0.3, 1.2


def pendulum():
    """A point on a rod, as far as a small ball is one: its inertia about its centre is given."""
    builder = ModelBuilder()
    builder.add_body("bob", shape=shapes.Sphere(0.02), mass=MASS, inertia=np.eye(3) * 1e-3 * MASS,
                     position=(0, 0, -LENGTH))  # fmt: skip
    builder.add_revolute_joint("bob", None, axis=(0, 1, 0), point=(0, 0, 0), name="hinge",
                               motor=Motor("effort"))  # fmt: skip
    return builder.build()


def cart_pole():
    """The pole stands upright on the cart; a positive angle about y turns it towards +x."""
    builder = ModelBuilder()
    builder.add_body("cart", shape=shapes.Box((0.1, 0.1, 0.05)), mass=CART, position=(0, 0, 0))
    builder.add_prismatic_joint("cart", None, axis=(1, 0, 0), name="rail", motor=Motor("effort"))
    builder.add_body("pole", shape=shapes.Sphere(0.02), mass=MASS, inertia=np.eye(3) * 1e-3 * MASS,
                     position=(0, 0, LENGTH))  # fmt: skip
    builder.add_revolute_joint("pole", "cart", axis=(0, 1, 0), point=(0, 0, 0), name="pin")
    return builder.build()


def continuous(matrix, drive, dt):
    """The exact step of x' = A x + B u with u held."""
    n, m = drive.shape
    both = expm(dt * np.block([[matrix, drive], [np.zeros((m, n + m))]]))
    return both[:n, :n], both[:n, n:]


# Breaks when A or B have other signs, units or an order than they say: about an angle q the pendulum has
# I q'' = -m g l sin q + u, so that A is that of q'' = -(m g l / I) cos(q) dq. The step is of first order in
# dt: the difference is at most that of dt^2 w^2, and falls with dt^2.
@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi])
def test_pendulum(angle):
    inertia = MASS * (LENGTH**2 + 1e-3)
    stiffness = MASS * GRAVITY * LENGTH * np.cos(angle) / inertia
    errors = []
    for dt in (2e-3, 1e-3):
        sim = Simulation(pendulum(), dt=dt)
        sim.q = [angle]
        before = sim.q
        found = sim.linearise()
        a, b = continuous(np.array([[0, 1], [-stiffness, 0]]), np.array([[0], [1 / inertia]]), dt)
        errors.append(max(np.abs(found.A - a).max() / abs(stiffness), np.abs(found.B - b).max() * inertia))
        assert errors[-1] <= 2 * dt**2
        np.testing.assert_array_equal(sim.q, before)
        assert sim.steps == 0
        assert (found.states, found.inputs) == (("hinge.change", "hinge.rate"), ("hinge.control",))
        assert found.dt == dt
        by_force = sim.linearise(inputs="joint_forces")  # of an effort motor, which is that force
        assert by_force.inputs == ("hinge.force",)
        assert pytest.approx(found.B, abs=1e-9 / inertia) == by_force.B
        assert found.residual <= 1e-9
        fall = -dt * MASS * GRAVITY * LENGTH * np.sin(angle) / inertia
        assert found.drift == pytest.approx([dt * fall, fall], abs=abs(fall) * 10 * dt + 1e-12)
    assert errors[1] < 0.3 * errors[0]


# Breaks when couplings between coordinates are lost: the cart-pole upright, with a point of mass m at l and
# an inertia i about it, from [M + m, m l; m l, m l^2 + i] (x'', q'') = (u, m g l q). A controller made of A
# and B holds the pole.
def test_cart_pole():
    dt, inertia = 1e-3, MASS * 1e-3
    mass = np.array([[CART + MASS, MASS * LENGTH], [MASS * LENGTH, MASS * LENGTH**2 + inertia]])
    inverse = np.linalg.inv(mass)
    matrix, drive = np.zeros((4, 4)), np.zeros((4, 1))
    matrix[:2, 2:] = np.eye(2)
    matrix[2:, 1] = inverse @ [0, MASS * GRAVITY * LENGTH]
    drive[2:, 0] = inverse @ [1, 0]
    sim = Simulation(cart_pole(), dt=dt)
    found = sim.linearise()
    a, b = continuous(matrix, drive, dt)
    rate = np.abs(matrix).max()
    assert pytest.approx(a, abs=2 * rate * dt**2) == found.A
    np.testing.assert_allclose(found.B, b, rtol=0, atol=2 * np.abs(drive).max() * dt**2)
    assert found.states == ("rail.change", "pin.change", "rail.rate", "pin.rate")
    cost = solve_discrete_are(found.A, found.B, np.eye(4), 0.01 * np.eye(1))
    gain = np.linalg.solve(0.01 * np.eye(1) + found.B.T @ cost @ found.B, found.B.T @ cost @ found.A)
    sim.set_q({"pin": 0.2})
    for _ in range(8000):
        sim.set_control("rail", float(-(gain @ np.concatenate([sim.q, sim.qd]))[0]))
        sim.step()
    assert np.abs(sim.q).max() < 1e-3


# Breaks when orientations are changed in other axes than those of qd, or one step is not that of the model:
# a free body without gravity goes on as it does, with Euler's equations about its axes.
def test_free_body():
    builder = ModelBuilder(gravity=(0, 0, 0))
    builder.add_body("body", shape=shapes.Box((0.1, 0.2, 0.3)), mass=2)
    dt = 1e-3
    sim = Simulation(builder.build(), dt=dt)
    sim.q = [0, 0, 0, *np.array([0.5, -0.5, 0.1, 0.7]) / np.linalg.norm([0.5, -0.5, 0.1, 0.7])]
    spin = np.array([1.0, -2.0, 0.5])
    sim.qd = [1, 2, 3, *spin]
    moments = 2 / 3 * np.array([0.2**2 + 0.3**2, 0.1**2 + 0.3**2, 0.1**2 + 0.2**2])

    def cross(v):
        return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])

    matrix = np.zeros((12, 12))
    matrix[:3, 6:9] = matrix[3:6, 9:] = np.eye(3)
    # A turn d in body axes against one that goes on with the spin w: d' = dw - w x d, but d is measured from
    # the pose before the step, and so only grows with dw.
    matrix[9:, 9:] = np.linalg.inv(np.diag(moments)) @ (
        cross(moments * spin) - cross(spin) @ np.diag(moments)
    )
    found = sim.linearise()
    exact = expm(dt * matrix)
    scale = np.abs(matrix).max()
    # The rows of turns are of first order: the change of axes within the step is of the order of w dt.
    assert found.A[:3] == pytest.approx(exact[:3], abs=1e-9)
    assert found.A[6:] == pytest.approx(exact[6:], abs=4 * scale**2 * dt**2)
    assert found.A[3:6] == pytest.approx(exact[3:6], abs=2 * np.linalg.norm(spin) * dt)
    assert found.B.shape == (12, 0)


# Breaks when activations are no part of the state, or a control at its limit has half of its effect.
def test_activations_and_limits():
    builder = ModelBuilder(gravity=(0, 0, 0))
    builder.add_body("slider", shape=shapes.Box((0.1, 0.1, 0.1)), mass=2)
    builder.add_prismatic_joint("slider", None, axis=(1, 0, 0), name="rail")
    builder.add_actuator("slow", joint="rail", dynamics="filter", time_constant=0.1)
    builder.add_actuator("fast", joint="rail", control=1.0, control_limits=(-1, 1))
    dt = 1e-3
    found = Simulation(builder.build(), dt=dt).linearise()
    assert found.states == ("rail.change", "rail.rate", "slow.activation")
    assert found.inputs == ("slow.control", "fast.control")
    assert found.A[2, 2] == pytest.approx(np.exp(-dt / 0.1), rel=1e-4)
    assert found.A[1, 2] == pytest.approx(dt / 2, rel=1e-6)
    assert found.B[1, 1] == pytest.approx(dt / 2, rel=1e-6)
    assert found.B[2, 0] == pytest.approx(dt / 0.1, rel=1e-2)


# Breaks when the number of threads changes a bit, or the simulation.
def test_threads(root):
    sim = Simulation(amontons.load_model(root / "examples/models/quadruped.xml"))
    sim.run(0.05)
    one, two = (sim.linearise(threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.A, two.A)
    np.testing.assert_array_equal(one.B, two.B)
    nv = sim.model.nv
    assert one.A.shape == (2 * nv, 2 * nv)
    assert one.B.shape == (2 * nv, len(sim.model.actuators))
    assert np.isfinite(one.A).all()
    for bad in ({"threads": 0}, {"tolerance": -1.0}, {"inputs": "targets"}):
        with pytest.raises(amontons.InputError, match=next(iter(bad))):
            sim.linearise(**bad)
