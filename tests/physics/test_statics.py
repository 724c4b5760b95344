"""Structures that must stand, with the forces that statics says; and those that must fall."""

import math

import numpy as np
import pytest
from measures import force_on, run, simulate, stand, weights


def test_stack_carries_its_weight():
    # The contacts under box k carry the weight of the boxes from k up.
    result = stand(simulate("stack", {"boxes": 10}), 2.0)
    assert result.force_error < 1e-5
    assert result.drift < 1e-8


@pytest.mark.parametrize("heavy_first", [False, True])
@pytest.mark.parametrize("ratio", [1.0, 1e2, 1e4])
def test_plates_stand(ratio, heavy_first):
    # B3 at h = 10 ms: every level's contact force within 1e-4 of the weight above, drift below 1 um.
    # First-order methods that stop early let light plates under heavy ones sink or shoot out. At 1e-8,
    # because auto may end anywhere below the tolerance, and forces are off by it times the mass ratio. (The
    # full 10 s: benchmarks.)
    scene = simulate("plates", {"ratio": ratio, "heavy_first": heavy_first}, dt=1e-2, tolerance=1e-8)
    result = stand(scene, 3.0)
    assert result.force_error < 1e-4
    assert result.drift < 1e-6


def test_forces_of_a_resting_scene_balance_its_weight():
    # contact_forces() sums per body: in rest each sum is its weight, and the world's side is all of it.
    sim = simulate("stack", {"boxes": 5})
    run(sim, 1.0)
    each = weights(sim)
    np.testing.assert_allclose(sim.forces.contact_forces()[0][:, 2], each, rtol=1e-5)
    np.testing.assert_allclose(force_on(sim, 0, {-1})[2], each.sum(), rtol=1e-5)


def test_arch_stands():
    # t / R = 0.2 is well above Milankovitch's 0.1075. The vertical reaction of each springing is half the
    # weight.
    sim = simulate("arch", {"thickness": 0.4})
    run(sim, 1.0)
    start = np.array(sim.state.positions)
    run(sim, 2.0)
    assert np.abs(sim.state.positions - start).max() < 1e-6
    feet = [force_on(sim, foot, {-1})[2] for foot in (0, len(start) - 1)]
    weight = weights(sim).sum()
    assert sum(feet) == pytest.approx(weight, rel=1e-5)
    assert feet[0] == pytest.approx(weight / 2, rel=0.1)


def test_thin_arch_falls():
    # t / R = 0.08 is below what any line of thrust needs: the crown must come down.
    sim = simulate("arch", {"thickness": 0.16})
    crown = len(sim.model.bodies) // 2
    start = sim.state.positions[crown, 2]
    run(sim, 3.0)
    assert sim.state.positions[crown, 2] < start - 0.3


def test_card_house_stands():
    # Three storeys at 20 degrees need friction of at most tan 20 = 0.36 < 0.7. No card may creep by 10 um
    # in 2 s after it has settled (gaps of the construction: none).
    sim = simulate("card_house")
    run(sim, 1.0)
    start = np.array(sim.state.positions)
    run(sim, 2.0)
    assert np.abs(sim.state.positions - start).max() < 1e-5


def test_card_house_falls_on_a_slippery_table():
    # With mu = 0.1 < tan(20) / 2 not even a single unloaded pair stands.
    sim = simulate("card_house", {"mu": 0.1, "levels": 1})
    top = sim.state.positions[:, 2].max()
    run(sim, 1.0)
    assert sim.state.positions[:, 2].max() < 0.5 * top


@pytest.mark.parametrize(("share", "slips"), [(0.85, False), (1.15, True)])
def test_capstan(share, slips):
    # Euler and Eytelwein: a belt over half a turn holds while T2 / T1 < e^(mu pi). Two dozen links deviate by
    # O(mu step^2) < 2 %, their own weight (8 kg against 50 kg) by less than the rest of 15 %.
    mu = 0.3
    sim = simulate("capstan", {"mu": mu, "load_ratio": share * math.exp(mu * math.pi)})
    heavy = sim.model.body_index("heavy")
    run(sim, 0.3)
    start = sim.state.positions[heavy, 2]
    run(sim, 0.7)
    sunk = start - sim.state.positions[heavy, 2]
    if slips:
        assert sunk > 0.01
    else:
        # Every link may give way by the error of position that is left as it is.
        assert abs(sunk) < 25 * 1e-4 * sim.model.length
