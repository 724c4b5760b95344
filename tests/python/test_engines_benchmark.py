"""The scenes that other engines get from benchmarks/engines.py are ours."""

import sys
from pathlib import Path

import amontons.scenes
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
engines = pytest.importorskip("engines", reason="the benchmarks need more packages than the tests")
mujoco = pytest.importorskip("mujoco")


# Breaks when MuJoCo gets other masses, inertias, poses, shapes or coefficients than our model has.
@pytest.mark.parametrize("name", ["stack", "plates", "incline", "spheres_in_box"])
def test_mujoco_has_the_same_bodies(name):
    model = amontons.scenes.get(name).make()
    m = mujoco.MjModel.from_xml_string(engines.mjcf(model, 5e-3, engines.Settings()))
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


# Breaks when the judge of poses does not see an overlap, or sees one where there is none.
def test_overlaps_are_those_of_the_poses():
    model = amontons.scenes.get("stack").make()
    positions = np.array([body.pose.position for body in model.bodies])
    orientations = np.array([body.pose.rotation for body in model.bodies])
    assert engines.overlap(model, engines.Poses(positions, orientations)) < 1e-12
    positions[3:, 2] -= 2e-3
    assert engines.overlap(model, engines.Poses(positions, orientations)) == pytest.approx(2e-3, rel=1e-6)


# Breaks when an engine moves the box otherwise than down the slope: 0.1 s at 1.01 of the angle are 0.2 mm in
# the closed form, and settling into soft contacts is below a millimetre.
def test_engines_make_steps_of_the_scene():
    case = next(c for c in engines.CASES if c.name.startswith("incline, 1.01"))
    model = amontons.scenes.get(case.scene).make(**case.parameters)
    for name, make in engines.engines().items():
        advance, poses = make(model, case.dt)
        for _ in range(20):
            advance()
        assert np.linalg.norm(poses().positions - [b.pose.position for b in model.bodies]) < 2e-3, name


# Breaks when a scene that became slower beside MuJoCo passes the check of CI, or a slower machine fails.
def test_check_compares_ratios():
    def rows(ours, theirs):
        return [
            {"case": "stack", "engine": "amontons, 1e-6", "step": ours},
            {"case": "stack", "engine": "MuJoCo", "step": theirs},
        ]

    assert engines.slower(rows(30e-6, 10e-6), rows("15e-6", "10e-6")) == []
    assert engines.slower(rows(90e-6, 30e-6), rows("15e-6", "10e-6")) == []
    found = engines.slower(rows(31e-6, 10e-6), rows("15e-6", "10e-6"))
    assert found == ["stack: 3.1 times MuJoCo's time, it was 1.5"]
    assert engines.slower(rows(31e-6, 10e-6), []) == []
