"""amontons run, scenes and export: files, tables, exit codes, bad input, Ctrl-C."""

import csv
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace

import amontons
import numpy as np
import pytest
from amontons import cli, scenes
from amontons.simulation.step_report import REPORTS
from PIL import Image
from typer.testing import CliRunner
from waiting import LONGEST, until


def run(*arguments):
    return CliRunner().invoke(cli.app, [str(a) for a in arguments])


# Breaks when a run leaves out a file that was asked for, steps too few or too often, or does other steps than
# the library would: the recording must hold the states of a Simulation with the same options, bit for bit.
def test_run_writes_everything(tmp_path):
    report, record, saved = tmp_path / "report", tmp_path / "a.h5", tmp_path / "end.h5"
    result = run(
        "run", "stack", "--set", "boxes=3", "--set", "mu=0.4", "--duration", "0.1", "--dt", "0.004",
        "--record", record, "--record-every", "5", "--report", report, "--snapshots", "2", "--save", saved,
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    for word in ("stack boxes=3 mu=0.4", "in 25 steps of 0.004 s", "all 25 steps", "penetration", "solve"):
        assert word in result.stdout
    sim = amontons.Simulation(scenes.make("stack", boxes=3, mu=0.4), dt=0.004)
    sim.run(0.1)
    with amontons.read_recording(record) as recording:
        assert recording.steps.tolist() == [0, 5, 10, 15, 20, 25]
        assert recording.complete
        np.testing.assert_array_equal(recording.positions[-1], sim.state.positions)
        np.testing.assert_array_equal(recording.contacts(-1), sim.contacts)
    with open(report / "steps.csv") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 25
    assert set(rows[0]) == set(REPORTS.names)
    assert float(rows[-1]["time"]) == pytest.approx(0.1)
    for name in ("report.png", "snapshots.png"):
        assert (report / name).read_bytes().startswith(b"\x89PNG")
        assert str(report / name) in result.stdout
    again = amontons.Simulation.load(saved)
    np.testing.assert_array_equal(again.state.positions, sim.state.positions)


# Breaks when a saved simulation does not go on from where it was, with the options it had and the new ones.
def test_run_from_a_saved_state(tmp_path):
    run("run", "pendulum", "--duration", "0.05", "--save", tmp_path / "half.h5")
    result = run("run", tmp_path / "half.h5", "--duration", "0.05", "--record", tmp_path / "a.h5")
    assert result.exit_code == 0, result.output
    sim = amontons.Simulation(scenes.make("pendulum"), dt=scenes.get("pendulum").dt)
    sim.run(0.1)
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        assert recording.times[0] == pytest.approx(0.05)
        np.testing.assert_array_equal(recording.orientations[-1], sim.state.orientations)


# Breaks when a model file does not run, or an error in one loses its line. The box falls 0.4 m.
def test_run_a_model_file(tmp_path):
    pytest.importorskip("mujoco")
    good, bad = tmp_path / "box.xml", tmp_path / "bad.xml"
    good.write_text(
        '<mujoco><worldbody><geom type="plane" size="5 5 .1"/><body name="b" pos="0 0 .5"><freejoint/>'
        '<geom type="box" size=".1 .1 .1"/></body></worldbody></mujoco>'
    )
    result = run("run", good, "--duration", "1", "--record", tmp_path / "a.h5")
    assert result.exit_code == 0, result.output
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        assert recording.model.body_names == ("b",)
        assert recording.positions[-1, 0, 2] == pytest.approx(0.1, abs=1e-3)
    bad.write_text("<mujoco>\n<bad/></mujoco>")
    result = run("run", bad)
    assert result.exit_code == 2
    assert result.stderr.startswith(f"error: {bad}:2: <bad>")
    assert len(result.stderr.strip().splitlines()) == 1


# Breaks when steps that did not converge go unsaid, or count as success.
def test_steps_that_do_not_converge(tmp_path):
    result = run("run", "stack", "--duration", "0.05", "--method", "jacobi", "--tolerance", "1e-14",
                 "--budget", "1e-5")  # fmt: skip
    assert result.exit_code == 1
    assert "did not (10 deadline), the first at t = 0.005 s" in result.stdout


# Breaks when the options of load_model do not reach it from the command, or --set and --keyframe do something
# else than the library would.
def test_run_a_model(tmp_path, root):
    pytest.importorskip("mujoco")
    path, saved = root / "examples" / "models" / "arm.xml", tmp_path / "end.h5"
    result = run(
        "run", path, "--keyframe", "bent", "--set", "elbow=-0.4", "--set", "gravity=0,0,-1",
        "--set", "q.elbow=0.2", "--strict",
        "--duration", "0.05", "--save", saved,
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "elbow=-0.4 gravity=0,0,-1" in result.stdout
    sim = amontons.Simulation(replace(amontons.load_model(path), gravity=(0, 0, -1)))
    sim.apply_keyframe("bent")
    sim.set_control("elbow", -0.4)
    sim.set_q({"elbow": 0.2})
    sim.run(0.05)
    np.testing.assert_array_equal(amontons.Simulation.load(saved).state.positions, sim.state.positions)
    urdf = tmp_path / "r.urdf"
    urdf.write_text(
        '<robot name="r"><wing/><link name="base"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    for option, motion in (("--fixed-base", "static"), ("--floating-base", "dynamic")):
        run("run", urdf, option, "--duration", "0.01", "--save", saved)
        assert amontons.Simulation.load(saved).model.bodies[0].motion == motion
    assert amontons.Simulation.load(saved).model.unread[0].element == "<wing>"
    for options, message in (
        (["--strict"], "error: .*r.urdf: 1 thing is not supported"),
        (["--set", "elbow=1"], "error: --set elbow=1: the model has gravity, q.base to set"),
        (["--keyframe", "bent"], 'error: there is no keyframe "bent"'),
    ):
        result = run("run", urdf, *options)
        assert result.exit_code == 2
        assert re.search(message, result.stderr)


# Breaks when an error is more than one line, has a traceback, names nothing, or comes after the run.
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "fortress"], "there is no scene or file 'fortress'; scenes are arch, "),
        (["run", "gone.xml"], "gone.xml: no such file"),
        (["run", "gone.h5"], "gone.h5: no such file"),
        (["run", "text.h5"], "text.h5: is no HDF5 file"),
        (["run", "text.txt"], "text.txt: unknown kind of file; known suffixes are .xml"),
        (["run", "text.h5", "--set", "a=1"], "text.h5: only scenes and models have parameters"),
        (["run", "text.h5", "--strict"], "text.h5: --strict is for model files"),
        (["run", "stack", "--fixed-base"], "stack: --floating-base is for model files"),
        (["run", "stack", "--keyframe", "k"], "stack: --keyframe is for model files"),
        (["run", "stack", "--set", "boxes"], "--set boxes: write KEY=VALUE"),
        (["run", "stack", "--set", "bricks=3"], "--set bricks=3: scene 'stack' has the parameters boxes, "),
        (["run", "stack", "--set", "boxes=many"], "the value must be a whole number, like the default, 10"),
        (["run", "stack", "--set", "boxes=2.5"], "--set boxes=2.5: the value must be a whole number"),
        (["run", "stack", "--set", "boxes=-1"], "scene 'stack'"),
        (["run", "stack", "--duration", "-1"], "duration = -1; it must be positive and finite"),
        (["run", "stack", "--duration", "nan"], "duration = nan; it must be positive and finite"),
        (["run", "stack", "--dt", "0"], "dt = 0.0; it must be positive"),
        (["run", "stack", "--law", "hooke"], "unknown law 'hooke'; known are associated, coulomb"),
        (["run", "stack", "--method", "simplex"], "unknown method 'simplex'; known are auto"),
        (["run", "stack", "--budget", "-1"], "budget = -1.0; it must be positive"),
        (["run", "stack", "--record", "gone/a.h5"], "gone/a.h5: the folder gone does not exist"),
        (["run", "stack", "--record", "."], ".: is a directory"),
        (["run", "stack", "--record", "a.h5", "--record-every", "0"], "every = 0; it must be an integer"),
        (["run", "stack", "--report", "text.h5"], "text.h5: cannot be made"),
        (["run", "stack", "--report", "r", "--snapshots", "-2"], "snapshots = -2; it must be zero"),
        (["run", "stack", "--save", "gone/a.h5"], "gone/a.h5: the folder gone does not exist"),
        (["scenes", "fortress"], "there is no scene 'fortress'"),
        (["export", "fortress", "--step", "1", "-o", "a.hdf5"], "there is no scene or file 'fortress'"),
        (["export", "stack", "-o", "a.hdf5"], "give one of --step, --time and --touch"),
        (["export", "stack", "--step", "1", "--time", "1", "-o", "a.hdf5"], "give one of --step, --time and"),
        (["export", "stack", "--touch", "moon", "-o", "a.hdf5"], 'there is no body "moon"'),
        (["export", "free_body", "--touch", "0", "-o", "a.hdf5"], 'there is no body "0"'),
        (["export", "stack", "--step", "0", "-o", "a.hdf5"], "step = 0; the first is 1"),
        (["export", "stack", "--time", "-1", "-o", "a.hdf5"], "time = -1; it must be after the start"),
        (["export", "stack", "--step", "2", "--every", "3", "-o", "a.hdf5"], "every = 3; it must be from 1"),
        (["export", "stack", "--step", "1", "-o", "a.txt"], "a.txt: unknown kind of file"),
        (["export", "stack", "--step", "1", "-o", "gone/a.hdf5"], "gone/a.hdf5: the folder gone does not"),
    ],
)  # fmt: skip
def test_one_line_errors(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.h5").write_text("no HDF5")
    (tmp_path / "text.txt").write_text("")
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert message in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert "Traceback" not in result.output
    assert sorted(p.name for p in tmp_path.iterdir() if p.is_file()) == ["text.h5", "text.txt"]


# Breaks when velocities that are not finite end in a traceback, or lose the recording of the steps before.
def test_step_that_fails(tmp_path, monkeypatch):
    record = tmp_path / "a.h5"
    step = amontons.Simulation.step

    def fails_later(self):
        if self.steps == 3:
            raise amontons.SimulationError("the velocities at t = 0.015 s came out not finite")
        return step(self)

    monkeypatch.setattr(amontons.Simulation, "step", fails_later)
    result = run("run", "stack", "--duration", "0.1", "--record", record)
    assert result.exit_code == 1
    assert "error: the velocities at t = 0.015 s" in result.stderr
    assert "all 3 steps" in result.stdout
    with amontons.read_recording(record) as recording:
        assert len(recording) == 4
        assert not recording.complete


# Breaks when Ctrl-C loses the recording, leaves a hidden file, prints a traceback or counts as success.
def test_interrupt(tmp_path):
    record = tmp_path / "a.h5"
    command = [sys.executable, "-m", "amontons", "run", "stack", "--duration", "1e5", "--record", record]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert until(lambda: list(tmp_path.iterdir()))
    time.sleep(0.5)  # a few steps
    process.send_signal(signal.SIGINT)
    output, error = process.communicate(timeout=LONGEST)
    assert process.returncode == 1, error
    assert "error: interrupted at t = " in error
    assert "Traceback" not in error
    assert "converged" in output
    assert [p.name for p in tmp_path.iterdir()] == ["a.h5"]
    with amontons.read_recording(record) as recording:
        assert len(recording) == 1 + len(recording.reports)
        assert not recording.complete


# Breaks when a scene is missing in the list, or its parameters are not shown.
def test_scenes():
    result = run("scenes")
    assert result.exit_code == 0
    assert all(f" {name} " in result.stdout for name in scenes.names())
    one = run("scenes", "wall").stdout
    assert all(name in one for name in scenes.get("wall").parameters)


# Breaks when the file holds another step than asked for, loses the solution, or `compare` cannot use it. Both
# ways to name a step must agree; the stored solution must solve the problem that was stored.
def test_export_one_step(tmp_path):
    by_step, by_time = tmp_path / "step.hdf5", tmp_path / "time.hdf5"
    scene = ("stack", "--set", "boxes=2", "--dt", "0.004")
    assert run("export", *scene, "--step", "5", "-o", by_step).exit_code == 0
    assert run("export", *scene, "--time", "0.02", "-o", by_time).exit_code == 0
    sim = amontons.Simulation(scenes.make("stack", boxes=2), dt=0.004)
    sim.run(0.02)
    for path in (by_step, by_time):
        problem = amontons.vi.read_problem(path)
        assert "step 5" in problem.name
        assert problem.contacts == len(sim.contacts) == 8
        np.testing.assert_allclose(problem.b, sim.problem().b, atol=1e-14)
        assert problem.residual(problem.guesses[0]) <= 1.1e-6
    result = run("compare", by_step, "--methods", "p-spg-fb,newton", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output


# Breaks when --touch stops at the wrong step: a ball falls 0.1 m, which takes sqrt(2 h / g) = 0.143 s.
def test_export_when_touched(tmp_path):
    builder = amontons.ModelBuilder()
    builder.add_geom(None, amontons.shapes.Plane())
    builder.add_body("ball", shape=amontons.shapes.Sphere(0.1), density=1000, position=(0, 0, 0.2))
    sim = amontons.Simulation(builder.build(), dt=0.01)
    sim.save(tmp_path / "s.h5")
    result = run("export", tmp_path / "s.h5", "--touch", "ball", "-o", tmp_path / "a.hdf5")
    assert result.exit_code == 0, result.output
    assert "t = 0.14 s" in result.stdout or "t = 0.15 s" in result.stdout
    assert amontons.vi.read_problem(tmp_path / "a.hdf5").contacts == 1
    sim.state.positions[0, 2] = 1000
    sim.save(tmp_path / "high.h5")
    result = run("export", tmp_path / "high.h5", "--touch", "ball", "-o", tmp_path / "b.hdf5")
    assert result.exit_code == 2
    assert "no contact pushes 'ball' in the first 5 s" in result.stderr


# Breaks when --every misses the last step, or names do not sort as the steps do.
def test_export_several_steps(tmp_path):
    result = run(
        "export", "stack", "--set", "boxes=1", "--step", "6", "--every", "2", "-o", tmp_path / "a.hdf5"
    )
    assert result.exit_code == 0, result.output
    names = sorted(p.name for p in tmp_path.iterdir())
    assert names == ["a-000002.hdf5", "a-000004.hdf5", "a-000006.hdf5"]


# Breaks when the step after a saved state is not the one that the simulation would have made next.
def test_export_from_a_saved_state(tmp_path):
    saved, direct, later = (tmp_path / name for name in ("s.h5", "direct.hdf5", "later.hdf5"))
    run("run", "stack", "--set", "boxes=2", "--duration", "0.02", "--save", saved)
    assert run("export", saved, "--step", "1", "-o", later).exit_code == 0
    assert run("export", "stack", "--set", "boxes=2", "--step", "5", "-o", direct).exit_code == 0
    np.testing.assert_array_equal(amontons.vi.read_problem(later).b, amontons.vi.read_problem(direct).b)


# Breaks when a step that FCLIB cannot hold (limits of a joint) ends in a traceback, or .npz cannot hold it.
def test_export_of_joint_limits(tmp_path):
    builder = amontons.ModelBuilder()
    body = builder.add_body("bar", mass=1, inertia=(1, 1, 1), position=(0, 0, -1))
    builder.add_revolute_joint(body, None, point=(0, 0, 0), axis=(0, 1, 0), limits=(-0.1, 0.0))
    sim = amontons.Simulation(builder.build(), dt=0.01)
    sim.save(tmp_path / "s.h5")
    result = run("export", tmp_path / "s.h5", "--step", "1", "-o", tmp_path / "a.hdf5")
    assert result.exit_code == 2
    assert "write the problem as .npz" in result.stderr
    assert run("export", tmp_path / "s.h5", "--step", "1", "-o", tmp_path / "a.npz").exit_code == 0
    assert amontons.vi.read_problem(tmp_path / "a.npz").rows > 5


# Breaks when the command refuses a kind of model file that load_model reads.
def test_all_kinds_of_models(tmp_path):
    from amontons.cli.completion import MODELS
    from amontons.io.models import KNOWN

    assert set(MODELS) == set(KNOWN)


# Breaks when --count is no parameter of the scene, or a film is not that of the run.
def test_a_film_of_so_many_grains(tmp_path):
    film, record = tmp_path / "pile.gif", tmp_path / "pile.h5"
    words = ["run", "pile", "--count", "12", "--duration", "0.2", "--tolerance", "1e-3", "--film", film]
    result = run(*words)
    assert result.exit_code == 0, result.stderr
    assert film.read_bytes().startswith(b"GIF")
    assert list(tmp_path.iterdir()) == [film]  # what the film was made of is gone
    with Image.open(film) as image:
        assert image.n_frames == 6  # 0.2 s, 25 pictures a second
    result = run(*words, "--record", record, "--record-every", "20")
    assert result.exit_code == 0, result.stderr
    with amontons.read_recording(record) as recording:
        assert len(recording) == 3
        assert sum(body.motion == "dynamic" for body in recording.model.bodies) == 12


# Breaks when a film that cannot be drawn, or a count that nothing has, is only found after the run.
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["run", "pile", "--film", "a.avi"], "--film a.avi: give a name that ends in .gif, .webp or .mp4"),
        (["run", "pile", "--film", "gone/a.gif"], "the folder gone does not exist"),
        (["run", "stack", "--count", "3"], "scene 'stack' has the parameters"),
        (["run", "model.xml", "--count", "3"], "model.xml: --count is for scenes"),
    ],
)
def test_films_and_counts_that_are_refused(words, said):
    result = run(*words)
    assert result.exit_code == 2
    assert said in result.stderr
