"""The scenes that other engines get from benchmarks/engines.py are ours, and so is what judges them."""

import sys
from dataclasses import replace
from pathlib import Path

import amontons.scenes
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
engines = pytest.importorskip("engines", reason="the benchmarks need more packages than the tests")
from beside import cases, in_mujoco, judge  # noqa: E402
from beside.engine import Motion, Subject, Unsupported, trees  # noqa: E402

mujoco = pytest.importorskip("mujoco")


# Breaks when MuJoCo gets other masses, inertias, poses, shapes or coefficients than our model has.
@pytest.mark.parametrize("name", ["stack", "plates", "incline", "spheres_in_box"])
def test_mujoco_has_the_same_bodies(name):
    model = amontons.scenes.get(name).make()
    m = mujoco.MjModel.from_xml_string(in_mujoco.mjcf(model, 5e-3, in_mujoco.Settings()))
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    assert m.ngeom == len(model.geoms)
    assert m.opt.timestep == 5e-3
    np.testing.assert_allclose(m.opt.gravity, model.gravity)
    for i, body in enumerate(model.bodies):
        k = m.body(f"b{i}").id
        np.testing.assert_allclose(d.xpos[k], body.pose.position, atol=1e-12)
        np.testing.assert_allclose(m.body_mass[k], body.mass, rtol=1e-12)
        principal = np.sort(np.linalg.eigvalsh(np.asarray(body.inertia)))
        np.testing.assert_allclose(np.sort(m.body_inertia[k]), principal, rtol=1e-9)
    assert set(m.geom_friction[:, 0]) == {g.material.friction for g in model.geoms}


# Breaks when an engine starts a scene with joints elsewhere than we do, or with other velocities: poses and
# velocities in joint coordinates, told back for every body, are those of the model up to single rounding
# errors times the chain's length (PyBullet's file of poses has six digits less).
@pytest.mark.parametrize("name", ["chain", "four_bar", "wall"])
def test_all_engines_start_with_our_state(name):
    small = {"chain": {"links": 6, "end_mass_ratio": 10.0}, "four_bar": {"driven": False}}
    parameters = small.get(name, {"columns": 2, "rows": 2, "links": 3})
    subject = Subject(amontons.scenes.get(name).make(**parameters))
    wanted = Motion.start(subject.model)
    for engine in engines.engines():
        try:
            running = engine.start(subject, 1e-3)
        except Unsupported:
            continue
        found = running.motion()
        running.close()
        np.testing.assert_allclose(found.positions, wanted.positions, atol=1e-6, err_msg=engine.name)
        turned = np.abs((found.orientations * wanted.orientations).sum(axis=1))
        np.testing.assert_allclose(turned, 1.0, atol=1e-9, err_msg=engine.name)
        np.testing.assert_allclose(found.linear, wanted.linear, atol=1e-6, err_msg=engine.name)
        np.testing.assert_allclose(found.angular, wanted.angular, atol=1e-6, err_msg=engine.name)


# Breaks when a chain is not a tree, or the last hinge of a closed linkage is taken for a carrier.
def test_joints_become_trees_and_loops():
    links, loops = trees(amontons.scenes.get("chain").make(links=4))
    assert [link.parent for link in links] == [-1, 0, 1, 2, 3]
    assert not loops
    links, loops = trees(amontons.scenes.get("four_bar").make(driven=False))
    assert len(links) == 3
    assert [joint.name for joint in loops] == ["rocker pivot"]


# Breaks when the bridge is built with open pins or with planks or a ball inside each other.
def test_the_bridge_is_closed():
    model = cases.bridge(planks=8)
    start = Motion.start(model)
    assert judge.joint_gap(model, start) < 1e-9
    assert judge.overlap(model, start) < 1e-9


# Breaks when the judge of poses does not see an overlap, or sees one where there is none.
def test_overlaps_are_those_of_the_poses():
    model = amontons.scenes.get("stack").make()
    start = Motion.start(model)
    assert judge.overlap(model, start) < 1e-12
    start.positions[3:, 2] -= 2e-3
    assert judge.overlap(model, start) == pytest.approx(2e-3, rel=1e-6)


# Breaks when a gap is measured elsewhere than at the joint: a body moved by 3 and 4 mm opens its two joints
# by 5 mm, and one of them alone where the next body moves along.
def test_gaps_of_joints_are_those_of_the_poses():
    model = amontons.scenes.get("chain").make(links=3)
    start = Motion.start(model)
    assert judge.joint_gap(model, start) < 1e-12
    start.positions[1:] += (3e-3, 0, 4e-3)
    assert judge.joint_gap(model, start) == pytest.approx(5e-3, rel=1e-9)


# Breaks when the judge's energy is another than that of the simulation, which adds it up in C++; they
# differ by how far bodies turn and joints are drawn together at the end of a step, after it told its energy.
@pytest.mark.parametrize("name", ["chain", "four_bar", "card_house"])
def test_energies_are_those_of_the_simulation(name):
    model = amontons.scenes.get(name).make()
    simulation = amontons.Simulation(model, dt=1e-3, on_failure="ignore")
    report = simulation.run(0.02)
    state = simulation.state
    motion = Motion(state.positions, state.orientations, state.linear_velocities, state.angular_velocities)
    case = replace(cases.CASES[0], make=lambda: model)
    total, kinetic = judge.Judge(case, model, 2).energy(motion)
    assert kinetic == pytest.approx(report.kinetic_energy, rel=2e-3)
    assert total - kinetic == pytest.approx(report.potential_energy, rel=2e-3, abs=1e-3)


# Breaks when an engine moves the box otherwise than down the slope: 0.1 s at 1.01 of the angle are 0.2 mm in
# the closed form, and settling into soft contacts is below a millimetre (Drake's first millimetres: five).
def test_engines_make_steps_of_the_scene():
    case = next(c for c in cases.CASES if c.name.startswith("incline, 1.01"))
    subject = case.subject()
    for engine in engines.engines():
        running = engine.start(subject, case.dt)
        running.advance(20)
        moved = np.linalg.norm(running.motion().positions - Motion.start(subject.model).positions)
        running.close()
        assert moved < (1.5e-2 if engine.name.startswith("Drake") else 2e-3), engine.name


def rows(ours, case="stack"):
    return [
        {"case": case, "engine": "amontons, 1e-6", "ratio": ours},
        {"case": case, "engine": "MuJoCo", "ratio": 1.0},
    ]


# Breaks when a scene that became slower beside MuJoCo passes the check of CI, or one that did not fails.
def test_check_compares_ratios():
    assert engines.slower(rows(3.0), rows("1.5")) == {}
    assert engines.slower(rows(3.1), rows("1.5")) == {"stack": "stack: 3.1 times MuJoCo's time, it was 1.5"}
    assert engines.slower(rows(3.1), []) == {}


# Breaks when a scene that was slow once, and is not when run again, fails the check; or when one that stays
# slow passes it.
def test_check_runs_suspects_again(monkeypatch, capsys):
    case = replace(cases.CASES[0], name="stack")
    monkeypatch.setattr(engines, "compete", lambda *_: rows(1.6))
    assert engines.checked(rows(9.0), rows("1.5"), [case], 1.0) == 0
    monkeypatch.setattr(engines, "compete", lambda *_: rows(4.0))
    assert engines.checked(rows(9.0), rows("1.5"), [case], 1.0) == 1
    assert "4 times MuJoCo's time, it was 1.5" in capsys.readouterr().out


# Breaks when the ratio is one of sums, which a single disturbed part would spoil.
def test_ratios_are_medians_of_parts():
    case = cases.CASES[0]
    (engine,) = [e for e in engines.engines() if e.name == engines.OURS]
    (entry,) = engines.enter(case, [engine])
    entry.times = [2.0, 2.0, 2.0, 90.0, 2.0]
    entry.judge.look(entry.running.motion())
    assert engines.row(case, entry, 1, [1.0, 1.0, 1.0, 1.0, 1.0])["ratio"] == 2.0


# Breaks when an exponent is another than the slope of a power law.
def test_exponents_are_slopes():
    import growth

    law = [{"size": n, "step": 3e-6 * n**1.5} for n in (10, 20, 80)]
    assert growth.exponent(law) == pytest.approx(1.5, rel=1e-9)
