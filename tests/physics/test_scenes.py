"""Every scene builds, has the size that it promises, and steps."""

import inspect

import amontons
import amontons.scenes
import numpy as np
import pytest
from amontons import InputError, scenes
from measures import run, simulate


@pytest.mark.parametrize("name", scenes.names())
def test_scene_steps(name):
    # Default parameters, default settings, three steps: a scene that does not build, starts in deep
    # penetration or does not converge is caught here.
    sim = simulate(name)
    reports = run(sim, 3 * sim.dt)
    assert np.isfinite(sim.state.positions).all()
    assert reports[0].penetration < 1e-3 * sim.model.length
    assert reports[0].joint_error < 1e-6 * sim.model.length
    assert max(r.residual for r in reports) < 1e-2


@pytest.mark.parametrize("name", scenes.names())
def test_scene_is_documented(name):
    # A scene without a sentence for the list, or one whose parameters can be given in the wrong order.
    scene = scenes.get(name)
    assert scene.summary.endswith((".", ":")) or len(scene.summary) > 40
    assert scene.dt > 0
    assert scene.duration > 0
    assert all(p.kind is p.KEYWORD_ONLY for p in inspect.signature(scene.make).parameters.values())
    assert getattr(scenes, name) is scene.make


# Breaks when a misspelt name gives a traceback, or a message without the known ones.
def test_unknown_scene_and_parameter_are_named():
    with pytest.raises(InputError, match="there is no scene 'wal'.*wall"):
        scenes.make("wal")
    with pytest.raises(InputError, match="'wall' has no parameter 'bricks'.*columns"):
        scenes.make("wall", bricks=3)
    with pytest.raises(InputError, match="chain.*links"):
        scenes.make("chain", links=0)


def test_network_has_its_3500_constraints():
    # B1: 1000 ball joints of three rows and 500 rods of one.
    sim = simulate("network")
    report = sim.step()
    assert len(sim.model.bodies) == 1000
    assert report.joint_rows == 3500
    assert report.contacts == 0


def test_wall_has_its_contacts():
    # B4: 37 bricks on the ground, 10 x 36 and 10 x 37 head joints, 19 x 74 bed joints, four points each
    # (the paper's wall of other proportions has 8684).
    sim = simulate("wall_at_rest")
    report = sim.step()
    assert len(sim.model.bodies) == 750
    assert report.contacts == 4 * (37 + 730 + 1406)


def test_wall_is_square():
    # Half bricks close the steps at both ends of every second course; without them the top corner would tip.
    model = scenes.wall(columns=4, rows=2, ball=False)
    x = np.array([b.pose.position[0] for b in model.bodies])
    half = np.array([g.shape.half[0] for g in model.geoms if isinstance(g.shape, amontons.shapes.Box)])
    first, second = slice(0, 4), slice(4, 9)
    assert (x[first] + half[first]).max() == pytest.approx((x[second] + half[second]).max())
    assert (x[first] - half[first]).min() == pytest.approx((x[second] - half[second]).min())


def test_smooth_spheres_settle():
    # B2: after 1.5 s the spheres lie still, with 2.7 loaded contacts a sphere (a rigid frictionless packing
    # needs at most three, fewer where spheres rattle) and about 3.3 within the margin. Accelerated
    # gradients at a loose tolerance settle them in seconds; the settled state is then solved accurately.
    sim = simulate("spheres_in_box", method="apgd", tolerance=1e-3)
    reports = run(sim, 1.5)
    kinetic = reports[-1].kinetic_energy
    assert kinetic < 0.02 * max(r.kinetic_energy for r in reports)
    loaded = int((sim.contacts["state"] != "open").sum())
    assert 2400 < loaded < 3300
    assert 3000 < reports[-1].contacts < 3800
    solution = sim.problem().solve(tolerance=1e-6)
    assert solution.converged


def test_dominoes_fall_one_after_the_other():
    # A run of thirty: all end lying (height of the centre below half of standing), and the last one starts
    # after the middle one.
    sim = simulate("domino_run")
    standing = sim.state.positions[-1, 2]
    fallen = {}

    def look(s, _):
        for i in (15, 29):
            if i not in fallen and s.state.positions[i, 2] < 0.9 * standing:
                fallen[i] = s.time

    run(sim, 2.0, look)
    assert sim.state.positions[:, 2].max() < 0.9 * standing
    assert fallen[15] < fallen[29]


@pytest.mark.parametrize("mu", [0.7, 0.85, 1.0, 1.2])
def test_dominoes_that_jam_do_not_hold_a_step_up(mu):
    # Their central path has folds close to each other, round which it led until it was given up, after 150
    # factorisations in one step: a step across a fold that comes to another piece has to be taken back.
    # Searches for the contacts that act alone, of which there may be several, count as well.
    sim = simulate("domino_run", {"count": 3, "mu": mu})
    reports = [sim.step() for _ in range(500)]
    assert max(report.factorizations for report in reports) < 140
    assert all(report.converged for report in reports)


def test_hopper_empties():
    # An opening of four diameters does not jam smooth enough spheres: most lie below the outlet in the end,
    # none has left through a wall.
    sim = simulate("hopper", {"count": 150, "mu": 0.1})
    run(sim, 3.0)
    below = sim.state.positions[:, 2] < 8 * 0.05
    assert below.mean() > 0.8
    assert sim.state.positions[:, 2].min() > 0.04


def moving(sim):
    """Positions of the grains."""
    return sim.state.positions[[body.motion == "dynamic" for body in sim.model.bodies]]


# Breaks when the rough ground lets grains roll away, or the heap keeps the shape of the column.
def test_a_pile_is_a_heap():
    sim = simulate("pile", {"count": 150}, tolerance=1e-3)
    height = moving(sim)[:, 2].max()
    reports = run(sim, 1.5)
    x = moving(sim)
    from_middle = np.hypot(x[:, 0], x[:, 1])
    assert reports[-1].kinetic_energy < 0.05 * max(r.kinetic_energy for r in reports)
    assert np.median(from_middle) < 0.4
    inner, outer = x[from_middle < 0.2, 2], x[from_middle > 0.4, 2]
    assert inner.max() > 1.5 * np.median(outer)
    assert x[:, 2].max() < 0.5 * height


# Breaks when grains stay on the slope, fall through it, or leave the ground at its foot.
def test_an_avalanche_runs_down():
    sim = simulate("avalanche", {"count": 150}, tolerance=1e-3)
    started = moving(sim).copy()
    run(sim, 1.5)
    x = moving(sim)
    assert x[:, 2].mean() < 0.5 * started[:, 2].mean()
    assert (x[:, 0] > 0).mean() > 0.3
    assert x[:, 2].min() > 0.04


# Breaks when the wall of a drum does not turn, or lets grains out.
def test_a_drum_carries_grains_up():
    sim = simulate("drum", {"count": 120}, tolerance=1e-3)
    run(sim, 1.0)
    x = moving(sim)
    stave = sim.model.geoms[0].frame.position
    inner = 1.05 * np.hypot(stave[0], stave[2])
    assert x[:, 0].mean() < -0.05  # at the bottom the wall moves along -x
    assert np.hypot(x[:, 0], x[:, 2]).max() < inner
