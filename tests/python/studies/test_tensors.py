"""Rollouts in PyTorch and JAX: their gradients beside central differences, and each other's shapes."""

import amontons
import numpy as np
import pytest
from amontons import Material, ModelBuilder, shapes

DT = {"dt": 2e-3, "tolerance": 1e-12, "warm_start": False}


@pytest.fixture(scope="module")
def puck():
    """A ball that slips and rolls on the floor, and one pushed along a rail: quaternions, and an actuator."""
    builder = ModelBuilder()
    builder.add_floor(material=Material(friction=0.3))
    builder.add_body("ball", shape=shapes.Sphere(0.1), mass=1.0, position=(0, 0, 0.1),
                     linear_velocity=(2.0, 0.3, 0), material=Material(friction=0.3))  # fmt: skip
    builder.add_body("hand", shape=shapes.Sphere(0.03), mass=0.5, position=(0, 2, 1))
    builder.add_prismatic_joint("hand", axis=(1, 0, 0), name="rail", damping=2.0)
    builder.add_actuator("push", joint="rail")
    return builder.build()


def numbers(model):
    sim = amontons.Simulation(model, **DT)
    rng = np.random.default_rng(1)
    q, qd = np.array([sim.q, sim.q]), np.array([sim.qd, 0.9 * sim.qd])
    controls = rng.uniform(-1, 1, (2, 10, 1))
    return q, qd, controls, rng.normal(size=(2, 10, model.nq)), rng.normal(size=(2, 10, model.nv))


def loss(model, q, qd, controls, friction, damping, weights):
    models = [model.with_(friction={"*": friction}, damping={"rail": d}) for d in damping]
    run = amontons.rollout(models, np.concatenate([q, qd], axis=1), controls, **DT)
    return float((run.q * weights[0]).sum() + (run.qd * weights[1]).sum())


def expected(model, q, qd, controls, weights):
    """Derivatives over a velocity, a control, the friction of both worlds and the damping of the second."""
    first = {"q": q, "qd": qd, "controls": controls, "friction": 0.3, "damping": [2.0, 2.5]}

    def slope(name, change, by):
        ends = [
            loss(model, **{**first, name: first[name] + sign * by * change}, weights=weights)
            for sign in (1, -1)
        ]
        return (ends[0] - ends[1]) / (2 * by)

    one, row, world = np.zeros_like(qd), np.zeros_like(controls), np.array([0.0, 1.0])
    one[1, 0], row[0, 4, 0] = 1, 1
    first["damping"] = np.array(first["damping"])
    return [slope("qd", one, 1e-5), slope("controls", row, 1e-3), slope("friction", 1.0, 1e-5),
            slope("damping", world, 1e-4)]  # fmt: skip


# Breaks when a gradient belongs to another argument, or one number for all worlds does not get the sum.
def test_torch(puck):
    torch = pytest.importorskip("torch", reason="needs PyTorch: pip install torch")
    import amontons.torch

    q, qd, controls, *weights = numbers(puck)
    start = (q, qd, controls, 0.3, [2.0, 2.5])
    given = [torch.tensor(v, dtype=torch.float64, requires_grad=True) for v in start]
    parameters = {"friction:*": given[3], "damping:rail": given[4]}
    after, rates = amontons.torch.rollout(puck, *given[:3], parameters=parameters, **DT)
    assert after.shape == (2, 10, puck.nq)
    ((after * torch.tensor(weights[0])).sum() + (rates * torch.tensor(weights[1])).sum()).backward()
    found = [given[1].grad[1, 0], given[2].grad[0, 4, 0], given[3].grad, given[4].grad[1]]
    assert [float(f) for f in found] == pytest.approx(expected(puck, q, qd, controls, weights), rel=1e-5)
    assert amontons.torch.rollout(puck, given[0], given[1], steps=3)[0].shape == (2, 3, puck.nq)
    with pytest.raises(amontons.InputError, match=r"friction:\* has the shape"):
        amontons.torch.rollout(puck, *given[:2], parameters={"friction:*": torch.ones(3)}, steps=1)
    assert torch.autograd.gradcheck(
        lambda speed, force: amontons.torch.rollout(puck, given[0].detach(), speed, force, **DT)[1],
        (given[1], given[2][:, :3].detach().requires_grad_()),
        eps=1e-5,
        atol=1e-5,
    )


# Breaks as the one of PyTorch does, and when a rollout cannot be compiled with what is around it.
def test_jax(puck):
    jax = pytest.importorskip("jax", reason="needs JAX: pip install jax")
    jax.config.update("jax_enable_x64", True)
    import amontons.jax

    q, qd, controls, *weights = numbers(puck)

    def total(qd, controls, friction, damping):
        parameters = {"friction:*": friction, "damping:rail": damping}
        after, rates = amontons.jax.rollout(puck, q, qd, controls, parameters=parameters, **DT)
        return (after * weights[0]).sum() + (rates * weights[1]).sum()

    by = jax.jit(jax.grad(total, argnums=(0, 1, 2, 3)))(qd, controls, 0.3, np.array([2.0, 2.5]))
    found = [by[0][1, 0], by[1][0, 4, 0], by[2], by[3][1]]
    assert [float(f) for f in found] == pytest.approx(expected(puck, q, qd, controls, weights), rel=1e-5)
    assert amontons.jax.rollout(puck, q, qd, steps=3)[0].shape == (2, 3, puck.nq)
    with pytest.raises(amontons.InputError, match="needs controls"):
        amontons.jax.rollout(puck, q, qd)
