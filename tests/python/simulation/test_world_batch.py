"""Worlds that stay in memory between steps: WorldBatch."""

import amontons
import numpy as np
import pytest
from amontons import ModelBuilder, Simulation, WorldBatch, shapes

DT = 2e-3


def hopper():
    """A ball on a leg with a servo, above a floor."""
    builder = ModelBuilder()
    builder.add_floor()
    builder.add_body("body", shape=shapes.Sphere(0.1), density=1000, position=(0, 0, 0.5))
    builder.add_body("foot", shape=shapes.Sphere(0.05), density=2000, position=(0, 0, 0.1))
    builder.add_prismatic_joint("foot", "body", axis=(0, 0, 1), name="leg", stiffness=200)
    builder.add_actuator("jump", joint="leg", gain=(50, 0, 0), control_limits=(-1, 1))
    return builder.build()


@pytest.fixture(scope="module")
def model():
    return hopper()


# Breaks when a world has other bits than a simulation by itself, its neighbour's controls, or another model.
@pytest.mark.parametrize("threads", [1, 2])
def test_bits_of_worlds_alone(model, threads):
    variants = [model.with_(mass_scale={"foot": factor}) for factor in (1.0, 1.5, 2.0)]
    batch = WorldBatch(variants, dt=DT, threads=threads)
    alone = [Simulation(variant, dt=DT) for variant in variants]
    held = batch.q
    random = np.random.default_rng(5)
    for _ in range(40):
        controls = random.uniform(-2, 2, (3, 1))
        batch.step(controls, repeat=2)
        for world, row in zip(alone, controls, strict=True):
            world.controls = row
            residual = max(world.step().residual for _ in range(2))
        assert batch.residual[2] == residual
    assert batch.q is held
    np.testing.assert_array_equal(batch.q, [world.q for world in alone])
    np.testing.assert_array_equal(batch.qd, [world.qd for world in alone])
    np.testing.assert_array_equal(batch.time, [world.time for world in alone])
    assert np.ptp(batch.q[:, 2]) > 1e-3


# Breaks when a reset goes to other worlds than those of the mask, or leaves their arrays; when worlds that do
# not go on are stepped.
def test_some_worlds(model):
    batch = WorldBatch(model, 4, dt=DT)
    batch.step(np.zeros(1), repeat=20)
    before = batch.q.copy()
    start = Simulation(model).q
    lifted = start + np.array([0, 0, 0.3, 0, 0, 0, 0, 0])
    batch.reset(np.array([False, True, False, True]), q=[lifted, start])
    np.testing.assert_array_equal(batch.q[[0, 2]], before[[0, 2]])
    assert batch.q[[1, 3], 2] == pytest.approx([lifted[2], start[2]])
    assert batch.time == pytest.approx([20 * DT, 0, 20 * DT, 0])
    now = batch.q.copy()
    out = np.zeros((4, model.nq + model.nv))
    batch.step(worlds=[1], out=out)
    np.testing.assert_array_equal(batch.q[[0, 2, 3]], now[[0, 2, 3]])
    assert batch.q[1, 2] != now[1, 2]
    np.testing.assert_array_equal(out, np.concatenate([batch.q, batch.qd], axis=1))


# Breaks when one world that is not finite ends the others, or goes on before its reset.
def test_a_world_that_fails(model):
    batch = WorldBatch(model, 2, dt=DT)
    forces = np.zeros((2, model.nv))
    forces[0, 0] = 1e25
    batch.step(joint_forces=forces)
    assert batch.failures[0]
    assert not batch.failures[1]
    time = batch.time.copy()
    batch.step(joint_forces=np.zeros(model.nv))
    assert batch.time - time == pytest.approx([0, DT])
    batch.reset([0])
    batch.step()
    assert batch.failures == ["", ""]


class Lent:
    """Memory that speaks DLPack and nothing else, of the protocol with a flag for reading or without."""

    def __init__(self, values, versioned=True):
        self.values, self.versioned = values, versioned

    def __dlpack__(self, **asked):
        return self.values.__dlpack__(**asked if self.versioned else {})

    def __dlpack_device__(self):
        return self.values.__dlpack_device__()


# Breaks when tensors of other packages, which speak DLPack, cannot be read or written, or the state cannot be
# seen without a copy: the memory that is lent has the state after a step.
def test_memory_that_is_lent(model):
    batch, plain = WorldBatch(model, 2, dt=DT), WorldBatch(model, 2, dt=DT)
    seen = np.from_dlpack(batch.q)
    controls, out = np.array([[0.3], [-0.2]]), np.zeros((2, model.nq + model.nv))
    batch.step(Lent(controls), joint_forces=Lent(np.zeros(model.nv)), out=Lent(out))
    plain.step(controls)
    assert np.shares_memory(seen, batch.q)
    np.testing.assert_array_equal(seen, plain.q)
    np.testing.assert_array_equal(out, np.concatenate([plain.q, plain.qd], axis=1))
    turned = np.zeros((model.nq + model.nv, 2))
    batch.step(out=Lent(turned.T))  # whose rows are not in a row
    np.testing.assert_array_equal(turned.T, np.concatenate([batch.q, batch.qd], axis=1))


# Breaks when a tensor of PyTorch is copied on its way in or out.
def test_tensors_of_pytorch(model):
    torch = pytest.importorskip("torch", reason="needs PyTorch: pip install torch")
    batch = WorldBatch(model, 2, dt=DT)
    q = torch.from_dlpack(batch.q)
    out = torch.zeros((2, model.nq + model.nv), dtype=torch.float64)
    batch.step(torch.zeros((2, 1), dtype=torch.float64), out=out.numpy())
    np.testing.assert_array_equal(q.numpy(), batch.q)
    np.testing.assert_array_equal(out.numpy()[:, : model.nq], batch.q)


# Breaks when an array of JAX cannot be read, or is written although JAX takes it for constant.
def test_arrays_of_jax(model):
    jax = pytest.importorskip("jax", reason="needs JAX: pip install jax")
    with jax.enable_x64():
        controls, out = jax.numpy.array([[0.3], [-0.2]]), jax.numpy.zeros((2, model.nq + model.nv))
    batch, plain = WorldBatch(model, 2, dt=DT), WorldBatch(model, 2, dt=DT)
    batch.step(controls)
    plain.step(np.asarray(controls))
    np.testing.assert_array_equal(batch.q, plain.q)
    with pytest.raises(amontons.InputError, match="its owner lends it for reading"):
        batch.step(out=out)


WRONG = {
    "controls": (lambda b: b.step(np.zeros((3, 1))), "controls has the shape (3, 1)"),
    "nan": (lambda b: b.step(np.full((2, 1), np.nan)), "controls of world 0 is not finite"),
    "mask": (lambda b: b.reset(np.zeros(3, dtype=bool)), "worlds is a mask of the shape (3,)"),
    "world": (lambda b: b.step(worlds=[2]), "worlds must be indices from 0 to 1"),
    "twice": (lambda b: b.step(worlds=[1, 1]), "worlds has a world twice"),
    "out": (lambda b: b.step(out=np.zeros(3)), "out must be an array of float64"),
    "kind": (lambda b: b.step(out=[1.0]), "out must be an array of float64"),
    "lent": (lambda b: b.step(out=Lent(np.zeros((2, 15)), versioned=False)), "lends it for reading"),
    "q": (lambda b: b.reset([0], q=np.zeros(3)), "q has the shape (3,)"),
}


# Breaks when a slip is taken or the message does not name it.
@pytest.mark.parametrize("case", WRONG)
def test_wrong(model, case):
    call, message = WRONG[case]
    with pytest.raises(amontons.InputError) as error:
        call(WorldBatch(model, 2, dt=DT))
    assert message in str(error.value)
    with pytest.raises(amontons.InputError, match="2 models for 3 worlds"):
        WorldBatch([model, model], 3)
