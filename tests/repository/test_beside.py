"""The scenes that other engines get from benchmarks/beside are ours, and so is what measures them."""

import csv
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import amontons.scenes
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
pytest.importorskip("matplotlib", reason="the benchmarks need more packages than the tests")
from beside import compete, engine, in_mujoco, law, measure, pieces, plain, rows, scenes, solvers
from beside.plain import Variant

mujoco = pytest.importorskip("mujoco")


@pytest.fixture(autouse=True, scope="module")
def processes():
    yield
    engine.stop()


def scene(name, **parameters):
    return scenes.plain(amontons.scenes.get(name).make(**parameters))


# Breaks when MuJoCo gets other masses, inertias, poses, shapes or coefficients than our model has.
@pytest.mark.parametrize("name", ["stack", "plates", "incline", "spheres_in_box"])
def test_mujoco_has_the_same_bodies(name):
    model = amontons.scenes.get(name).make()
    m = mujoco.MjModel.from_xml_string(in_mujoco.mjcf(scenes.plain(model), 5e-3, {}))
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


# Breaks when a scene loses something on its way to the process of an engine.
def test_scenes_survive_json():
    for name in ("wall", "arch", "four_bar"):
        parameters = {"driven": False} if name == "four_bar" else {}
        given = scene(name, **parameters)
        found = plain.Scene.from_dict(given.as_dict())
        assert found == given


# Breaks when an engine starts a scene with joints elsewhere than we do, or with other velocities: poses and
# velocities in joint coordinates, told back for every body, are those of the model up to single rounding
# errors times the chain's length (PyBullet's file of poses has six digits less, Rapier and Newton compute in
# single precision: 1e-6).
@pytest.mark.parametrize("name", ["chain", "four_bar", "wall", "arch"])
def test_all_engines_start_with_our_state(name):
    small = {"chain": {"links": 6, "end_mass_ratio": 10.0}, "four_bar": {"driven": False}, "arch": {}}
    model = amontons.scenes.get(name).make(**small.get(name, {"columns": 2, "rows": 2, "links": 3}))
    given, wanted = scenes.plain(model), measure.start_of(model)
    for one in engine.engines():
        if one.tuned:
            continue
        try:
            running = one.start(given, 1e-3)
            found = running.motion()
        except plain.Unsupported:
            continue
        running.close()
        rounding = 1e-5 if one.key in ("rapier", "newton") else 1e-6
        np.testing.assert_allclose(found.positions, wanted.positions, atol=rounding, err_msg=one.name)
        turned = np.abs((found.orientations * wanted.orientations).sum(axis=1))
        np.testing.assert_allclose(turned, 1.0, atol=rounding, err_msg=one.name)
        np.testing.assert_allclose(found.linear, wanted.linear, atol=10 * rounding, err_msg=one.name)
        np.testing.assert_allclose(found.angular, wanted.angular, atol=10 * rounding, err_msg=one.name)


# Breaks when a chain is not a tree, or the last hinge of a closed linkage is taken for a carrier.
def test_joints_become_trees_and_loops():
    links, loops = scene("chain", links=4).trees()
    assert [link.parent for link in links] == [-1, 0, 1, 2, 3]
    assert not loops
    links, loops = scene("four_bar", driven=False).trees()
    assert len(links) == 3
    assert [joint.name for joint in loops] == ["rocker pivot"]


# Breaks when a scene of the suite is built with open joints, or with bodies inside each other.
@pytest.mark.parametrize(
    "make", [lambda: scenes.bridge(planks=8), scenes.frame_of_hinges, scenes.rod, scenes.tongs]
)
def test_scenes_begin_closed(make):
    model = make()
    start = measure.start_of(model)
    assert measure.joint_gap(scenes.plain(model), start) < 1e-9
    assert measure.overlap(model, start) < 1e-9


# Breaks when the tongs are built other than their closed form says: (g / 2) / N with the pressure on the
# lower edge of the pads is 0.611, on the upper one 0.5. Above both the cube holds, below both it slides out.
@pytest.mark.parametrize(("mu", "holds"), [(0.63, True), (0.48, False)])
def test_tongs_hold_from_their_threshold_on(mu, holds):
    simulation = amontons.Simulation(scenes.tongs(mu=mu), dt=5e-3)
    simulation.run(0.5)
    assert (simulation.state.positions[0, 2] > -1e-3) == holds


# Breaks when the spinning disc is built other than its closed form says: it stops after w^2 R / (4 mu g) =
# 2.548 rad. An implicit step of h loses w h / 2 of that: 0.0025 rad at 0.5 ms.
def test_disc_stops_at_its_closed_form():
    simulation = amontons.Simulation(scenes.spun_disc(), dt=5e-4, tolerance=1e-8)
    simulation.run(0.6)
    turned = 2 * np.arccos(abs(simulation.state.orientations[0, 0]))
    assert turned == pytest.approx(scenes.spun_down(), abs=0.003)
    assert abs(simulation.state.angular_velocities).max() < 1e-6


# Breaks when pieces begin elsewhere than the reference says, end at another time, or the reference is not the
# motion that another engine finds: a free body by Runge and Kutta at 5 ms, whose error is of fifth order in
# 0.03 rad a step. Ours is of second order: a quarter of the step leaves a sixteenth.
def test_pieces_agree_with_another_engine():
    case = next(c for c in scenes.CASES if c.key == "ellipsoid")
    given = case.scene(case.make())
    found = {e.name: [pieces.deviation(e, given, case, n) for n in (1, 4)]
             for e in engine.engines("amontons", "mujoco")}  # fmt: skip
    assert found["MuJoCo, RK4"][0] < 1e-7
    coarse, fine = found["amontons, 1e-6"]
    assert coarse / fine == pytest.approx(16, rel=0.2)


# Breaks when bodies of a piece keep their old velocity, or a turn alone is taken for no deviation: 0.1 rad
# about z moves a point at 0.1 m by 2 sin(0.05) 0.1 m.
def test_pieces_begin_with_all_of_a_motion():
    given = scene("stack", boxes=3)
    motion = plain.Motion.start(given)
    motion.linear[1, 0], motion.angular[2, 1], motion.positions[1, 2] = 3.0, 4.0, 5.0
    again = plain.Motion.start(pieces.moved(given, motion))
    for key in ("positions", "orientations", "linear", "angular"):
        np.testing.assert_array_equal(getattr(again, key), getattr(motion, key))
    again.orientations[2] = (np.cos(0.05), 0, 0, np.sin(0.05))
    assert pieces.apart(motion, again) == pytest.approx(0.2 * np.sin(0.05))


# Breaks when two threads are not what the engine gets, or change a bit of our motion.
def test_two_threads_repeat_one():
    one = next(engine.engines("amontons"))
    given = scene("stack", boxes=4)
    motions = []
    for threads in (1, 2):
        running = one.start(given, 5e-3, threads=threads)
        running.advance(20)
        motions.append(running.motion())
        running.close()
    np.testing.assert_array_equal(motions[0].positions, motions[1].positions)


# Breaks when a robot does not begin at its keyframe, or the engines begin apart.
def test_robots_begin_at_their_keyframe():
    case = next((c for c in scenes.cases() if c.keyframe), None)
    if case is None:
        pytest.skip("the robot's file is not in the data folder")
    model = case.make()
    found = []
    for one in engine.engines("amontons", "mujoco"):
        if not one.tuned:
            running = one.start(case.scene(model), case.dt)
            found.append(running.motion())
            running.close()
    np.testing.assert_allclose(found[0].positions, found[1].positions, atol=1e-9)
    assert found[0].positions[0, 2] == pytest.approx(0.27)


# Breaks when the cubes begin elsewhere than the measured ones, or a sample is taken for another: a cube in
# free flight is a few millimetres from its first sample after one period.
def test_tosses_are_the_measured_ones():
    case = next((c for c in scenes.cases() if c.key == "tosses"), None)
    if case is None:
        pytest.skip("the tosses are not in the data folder")
    samples = case.follows()
    assert samples.shape == (scenes.SAMPLES, scenes.TOSSES, 3)
    simulation = amontons.Simulation(case.make(), dt=case.dt)
    simulation.step()
    missed = np.linalg.norm(simulation.state.positions - samples[0], axis=1)
    assert missed.max() < 5e-3


# Breaks when the measure of poses does not see an overlap, or sees one where there is none.
def test_overlaps_are_those_of_the_poses():
    model = amontons.scenes.get("stack").make()
    start = measure.start_of(model)
    assert measure.overlap(model, start) < 1e-12
    start.positions[3:, 2] -= 2e-3
    assert measure.overlap(model, start) == pytest.approx(2e-3, rel=1e-6)


# Breaks when a gap is measured elsewhere than at the joint: a body moved by 3 and 4 mm opens its two joints
# by 5 mm, and one of them alone where the next body moves along.
def test_gaps_of_joints_are_those_of_the_poses():
    model = amontons.scenes.get("chain").make(links=3)
    start, given = measure.start_of(model), scenes.plain(model)
    assert measure.joint_gap(given, start) < 1e-12
    start.positions[1:] += (3e-3, 0, 4e-3)
    assert measure.joint_gap(given, start) == pytest.approx(5e-3, rel=1e-9)


# Breaks when the measured energy is another than that of the simulation, which adds it up in C++; they
# differ by how far bodies turn and joints are drawn together at the end of a step, after it told its energy.
@pytest.mark.parametrize("name", ["chain", "four_bar", "card_house"])
def test_energies_are_those_of_the_simulation(name):
    model = amontons.scenes.get(name).make()
    simulation = amontons.Simulation(model, dt=1e-3, on_failure="ignore")
    report = simulation.run(0.02)
    state = simulation.state
    motion = plain.Motion(
        state.positions, state.orientations, state.linear_velocities, state.angular_velocities
    )
    watch = measure.Measure(scenes.CASES[0], model, plain.Scene(), 2)
    total, kinetic = watch.energy(motion)
    assert kinetic == pytest.approx(report.kinetic_energy, rel=2e-3)
    assert total - kinetic == pytest.approx(report.potential_energy, rel=2e-3, abs=1e-3)


# Breaks when the angular momentum is not that of a rigid body in its turned axes: 1 kg m^2 about z at 3
# rad/s, seen after a quarter turn about x, and 2 kg at 1 m from the origin with 5 m/s across.
def test_angular_momentum_is_that_of_turned_bodies():
    b = amontons.ModelBuilder()
    b.add_body(mass=2.0, inertia=(0.6, 0.7, 1.0))
    watch = measure.Measure(scenes.CASES[0], b.build(), plain.Scene(), 2)
    quarter = np.array([[np.sqrt(0.5), np.sqrt(0.5), 0, 0]])
    motion = plain.Motion(np.array([[1.0, 0, 0]]), quarter, np.array([[0, 5.0, 0]]), np.array([[0, -3.0, 0]]))
    np.testing.assert_allclose(watch.angular_momentum(motion), (0, -3.0, 10.0), atol=1e-12)


def one_contact(velocity, force, gap=0.0):
    """The residual of a cube of weight 1 N on a floor of mu 0.5, with speeds over that of a step of fall."""
    cube = plain.Body("", True, 1 / 9.81, np.eye(3), (0, 0, 0), plain.Frame(), (0, 0, 0), (0, 0, 0))
    floor = plain.Geom(-1, "plane", (), plain.Frame(), 0.5, 0.0, 1, 1)
    motion = plain.Motion.empty(1)
    motion.linear[0] = velocity
    contact = np.array([[0, -1, 0, 0, 0, 0, 0, 1.0, *force, gap]])
    return law.law_left(plain.Scene(bodies=(cube,), geoms=(floor,)), motion, contact, dt=0.1, unit=1.0)


# Breaks when the residual of Coulomb's law is not zero where the law holds (stick, slide, open, a gap that
# closes in the step), or is not the closed form where it does not: a creep v leaves v sqrt(1 + mu^2), a rise
# under force its speed, a force outside its cone the way to the cone.
@pytest.mark.parametrize(
    ("velocity", "force", "gap", "left"),
    [
        ((0, 0, 0), (0.4, 0.0, 1.0), 0.0, 0.0),
        ((3.0, 4.0, 0), (-0.3, -0.4, 1.0), 0.0, 0.0),
        ((1.0, 0, 0.5), (0, 0, 0), 0.0, 0.0),
        ((0, 0, -2.0), (0, 0, 0), 0.2, 0.0),
        ((0.1, 0, 0), (0, 0, 1.0), 0.0, 0.1 * np.sqrt(1.25)),
        ((0, 0, 0.2), (0, 0, 1.0), 0.0, 0.2),
        ((0, 0, 0), (1.0, 0, 1.0), 0.0, 0.5 / np.sqrt(1.25)),
    ],
)
def test_residual_of_the_law_is_that_of_closed_forms(velocity, force, gap, left):
    assert one_contact(velocity, force, gap) == pytest.approx(left, abs=1e-12)


# Breaks when an engine tells forces on the other body, in other axes or units: those of a cube that rests on
# a slope for 0.1 s carry its weight. Soft contacts still settle then, by less than 1 %.
def test_forces_carry_the_weight():
    given = scene("incline", angle=10.0, mu=0.5)
    weight = given.bodies[0].mass * 9.81
    for one in engine.engines("amontons", "mujoco", "dart", "pybullet"):
        running = one.start(given, 2e-3)
        running.advance(50)
        try:
            found = running.contacts()
        except plain.Unsupported:
            continue
        running.close()
        sign = np.where(found[:, 0] == 0, 1.0, -1.0)
        np.testing.assert_allclose(
            (sign[:, None] * found[:, 8:11]).sum(axis=0), (0, 0, weight), atol=0.01 * weight, err_msg=one.name
        )


# Breaks when an engine moves the box otherwise than down the slope: 0.1 s at 1.01 of the angle are 0.2 mm in
# the closed form, and settling into soft contacts is below a millimetre (Drake's first millimetres: five).
def test_engines_make_steps_of_the_scene():
    case = next(c for c in scenes.CASES if c.key == "incline-1.01")
    model = case.make()
    for one in engine.engines():
        try:
            running = one.start(case.scene(model), case.dt)
            running.advance(20)
        except plain.Unsupported:
            continue
        moved = np.linalg.norm(running.motion().positions - measure.start_of(model).positions)
        running.close()
        assert moved < (1.5e-2 if one.key == "drake" else 3e-3), one.name


# Breaks when the command does not run from end to end with what is installed everywhere: our engine and
# MuJoCo's default, the residual of the law, the origin of the table and the figure. A cube that sticks does
# not move: its errors are those of rounding.
def test_comparison_runs(tmp_path):
    words = ["-m", "beside", "--engines", "amontons", "--scenes", "incline-0.99", "--steps", "1", "--out"]
    run = subprocess.run(
        [sys.executable, *words, str(tmp_path)], cwd=Path(engine.HERE).parent, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stdout + run.stderr
    with (tmp_path / "beside.csv").open() as table:
        found = {row["method"]: row for row in csv.DictReader(table)}
    assert list(found) == ["amontons, 1e-6", "amontons, 1e-3", "MuJoCo"]
    ours = found["amontons, 1e-6"]
    assert ours["complete"] == "True"
    assert float(ours["error"]) < 1e-9
    assert float(ours["law"]) < 1e-6
    assert float(ours["restored"]) == 0
    assert ours["version"]
    assert "python -m beside --engines amontons" in (tmp_path / "tables.csv").read_text()
    assert (tmp_path / "beside_profile.png").stat().st_size > 0


# Breaks when an error is not the distance of its scene: a stack that sank by 2 mm and rests, a disc that
# turned 0.1 rad too far at 0.2 m, a rod that gained 3 J at a weight of 9.81 N, a free body whose angular
# momentum turned by 0.01 rad, and a falling robot, which has no answer.
@pytest.mark.parametrize(
    ("key", "off"),
    [
        ("stack", 2e-3),
        ("disc", 0.02),
        ("rod", 3 / 9.81),
        ("ellipsoid", 0.01 * np.sqrt(2.1 / 2)),
        ("quadruped", None),
    ],
)
def test_errors_are_what_scenes_are_about(key, off):
    case = next(c for c in scenes.cases() if c.key == key)
    model = case.make()
    watch = measure.Measure(case, model, plain.Scene(), 2)
    motion = measure.start_of(model)
    if key == "stack":
        motion.positions[:, 2] -= 2e-3
    if key == "disc":
        angle = scenes.spun_down() + 0.1
        motion.orientations[0] = np.cos(angle / 2), 0, 0, np.sin(angle / 2)
        motion.angular[:] = 0
    if key == "rod":  # upwards, to 3 J above its start
        motion.positions[0, 2] += 3 / 9.81
    if key == "ellipsoid":
        turn = np.array([np.cos(0.005), 0, 0, np.sin(0.005)])
        motion.orientations[0] = turn
        motion.angular[0] = (
            np.array([[np.cos(0.01), -np.sin(0.01), 0], [np.sin(0.01), np.cos(0.01), 0], [0, 0, 1]])
            @ motion.angular[0]
        )
    watch.look(motion)
    watch.look(motion)
    found = watch.verdict(1.0)["error"]
    if off is None:
        assert found == ""
    else:
        assert found == pytest.approx(off, rel=1e-3)


# Breaks when a scene that does not exist is left out without a word.
def test_unknown_scenes_are_refused(monkeypatch, capsys):
    from beside import __main__ as program

    monkeypatch.setattr(sys, "argv", ["beside", "--scenes", "stakc"])
    with pytest.raises(SystemExit):
        program.main()
    assert 'no scene begins with "stakc"' in capsys.readouterr().err


# Breaks when an engine that ends its process takes the comparison with it, or is not started again.
def test_an_engine_may_crash():
    one = engine.Engine("mujoco", Variant("MuJoCo"))
    running = one.start(scene("stack"), 5e-3)
    running.worker.process.kill()
    with pytest.raises(plain.Unsupported):
        running.advance(1)
    assert one.start(scene("stack"), 5e-3).advance(1) >= 0


def row(name, key="s", **more):
    return {
        "task": key, "family": "mujoco", "method": name, "tuned": name != "MuJoCo", "steps_per_dt": 1,
        "penetration": 1e-4, "creep": 1e-3, "lift": "", "joint_error": "", "energy_rise": 0.0,
        "energy_drift": "", **more,
    }  # fmt: skip


# Breaks when a tuned setting that does nothing is taken for one, or one that does something is refused.
def test_tuned_settings_differ_from_their_default():
    default = [row("MuJoCo"), row("MuJoCo", "t", creep=3e-3)]
    same = [row("MuJoCo, elliptic"), row("MuJoCo, elliptic", "t", creep=3e-3)]
    (complaint,) = rows.unlike_defaults([*default, *same])
    assert complaint.startswith("MuJoCo, elliptic moves bodies like MuJoCo")
    other = [row("MuJoCo, elliptic"), row("MuJoCo, elliptic", "t", creep=2e-3)]
    assert rows.unlike_defaults([*default, *other]) == []


# Breaks when a run of some engines or scenes loses the rows of the others, or keeps an old one of its own.
def test_rows_are_renewed_alone():
    first = {"task": "stack", "method": "MuJoCo", "steps_per_dt": "1", "time": "1"}
    ours = {"task": "stack", "method": "amontons, 1e-6", "steps_per_dt": "1", "time": "2"}
    gone = {"task": "stack", "method": "an engine no more", "steps_per_dt": "1", "time": "2"}
    found = rows.merged([first, ours, gone], [ours | {"steps_per_dt": 1, "time": 3}])
    assert [(r["method"], r["time"]) for r in found] == [("amontons, 1e-6", 3), ("MuJoCo", "1")]


# Breaks when new times change an error, or go to the rows of another version, step or engine.
def test_times_are_renewed_alone():
    known = {"task": "launch", "steps_per_dt": "1", "version": "1", "time": "1e-5", "error": "1.5"}
    ours, theirs = known | {"method": "amontons, 1e-6"}, known | {"method": "MuJoCo", "version": "0.1"}
    others = [theirs, known | {"method": "an engine elsewhere"}, ours | {"steps_per_dt": "4"}]
    times = dict.fromkeys(rows.TIMES, 2.0)
    new = known | times | {"steps_per_dt": 1, "error": 9.0}
    table = [dict(row) for row in (ours, *others)]
    rows.put_times(table, [new | {"method": "amontons, 1e-6"}, new | {"method": "MuJoCo"}])
    assert table == [ours | times, *others]


def pair(ours, key="stack"):
    return [
        {"task": key, "method": "amontons, 1e-6", "steps_per_dt": 1, "ratio": ours},
        {"task": key, "method": "MuJoCo", "steps_per_dt": 1, "ratio": 1.0},
    ]


# Breaks when a scene that became slower beside MuJoCo passes the check of CI, or one that did not fails.
def test_check_compares_ratios():
    assert compete.slower(pair(3.0), pair("1.5")) == {}
    assert compete.slower(pair(3.1), pair("1.5")) == {"stack": "stack: 3.1 times MuJoCo's time, it was 1.5"}
    assert compete.slower(pair(3.1), []) == {}


# Breaks when a scene that was slow once, and is not when run again, fails the check; or when one that stays
# slow passes it.
def test_check_runs_suspects_again(monkeypatch, capsys):
    case = replace(scenes.CASES[0], key="stack")
    monkeypatch.setattr(compete, "compete", lambda *_: pair(1.6))
    assert compete.checked(pair(9.0), pair("1.5"), [case], 1.0) == 0
    monkeypatch.setattr(compete, "compete", lambda *_: pair(4.0))
    assert compete.checked(pair(9.0), pair("1.5"), [case], 1.0) == 1
    assert "4 times MuJoCo's time, it was 1.5" in capsys.readouterr().out


# Breaks when the committed table holds a tuned setting that does nothing, or a row without version or manual.
def test_committed_rows_are_fair():
    from common import RESULTS, read_csv

    table = read_csv(RESULTS / "beside" / "beside.csv")
    assert rows.unlike_defaults(table) == []
    assert all(
        r["version"] and r["machine"] and r["manual"].startswith(("https://", "choosing.md")) for r in table
    )
    assert all(r["options"] for r in table if r["tuned"] == "True")


def two_contacts():
    """Two contacts that push each other: one sticks, one slides."""
    A = np.eye(6) + 0.2 * np.ones((6, 6))
    return amontons.vi.Problem(A, np.array([-1.0, 0.1, 0.0, -0.5, 2.0, 1.0]), "friction", mu=[0.5, 0.3])


# Breaks when Siconos gets another problem than we solve, or its impulses come back in another order: both
# velocities agree where the residual allows it.
def test_siconos_solves_our_problem(tmp_path):
    python = solvers.interpreter()
    if python is None:
        pytest.skip("Siconos is not installed (python3-siconos)")
    problem = two_contacts()
    siconos = solvers.Siconos(python, tmp_path)
    found = {(r["method"], r["tolerance"]): r for r in solvers.rows_of("two contacts", problem, siconos)}
    siconos.worker.end()
    assert len(found) == 3 * (1 + len(solvers.SOLVERS))
    tight = found["Siconos NSGS", 1e-8]
    assert tight["solved"]
    assert tight["error"] < 1e-6
    impulses = np.load(tmp_path / "judged.npy")
    ours = problem.solve(law="coulomb", tolerance=1e-12).x
    np.testing.assert_allclose(problem.A @ impulses, problem.A @ ours, atol=1e-5)


# Breaks when a step is exported with rows that Siconos does not take, or is another than the scene's: ten
# boxes with four contacts each.
def test_steps_are_problems_of_contacts():
    found = dict(solvers.steps(quick=True))
    stack = found["step 20 of stack"]
    assert stack.contacts == 40
    assert all(problem.rows == 3 * problem.contacts for problem in found.values())


# Breaks when a solver that takes too long is asked for more, or leaves no row.
def test_late_solvers_have_blank_rows(tmp_path):
    class Late:
        version = "1"
        asked = 0

        def read(self, problem):
            pass

        def error(self, impulses, tolerance):
            return 0.0

        def solve(self, solver, tolerance):
            self.asked += 1
            raise plain.Unsupported("answer within 5 s")

    late = Late()
    found = list(solvers.rows_of("two contacts", two_contacts(), late))
    assert late.asked == len(solvers.SOLVERS)
    assert [r["time"] for r in found[3:]] == [""] * 9
    assert all(r["solved"] for r in found[:3])


# Breaks when an exponent is another than the slope of a power law.
def test_exponents_are_slopes():
    import report

    law = [{"size": n, "time": 3e-6 * n**1.5} for n in (10, 20, 80)]
    assert report.exponent(law) == pytest.approx(1.5, rel=1e-9)
