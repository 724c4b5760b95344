"""What users expect of any command: JSON, a doctor, completion, a log, hints at what was meant."""

import json
import logging
import os
import re
import subprocess
import sys
from dataclasses import replace

import amontons
import numpy as np
import pytest
from amontons import cli
from problems import EXAMPLES
from typer.testing import CliRunner

PLATES = str(EXAMPLES / "plates.hdf5")


def run(*arguments):
    return CliRunner().invoke(cli.app, [str(a) for a in arguments])


# Breaks when a command has no --json, mixes other output into it, or its exit code differs from that without.
@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["doctor"], 0),
        (["scenes"], 0),
        (["scenes", "wall"], 0),
        (["info", PLATES], 0),
        (["solve", PLATES], 0),
        (["compare", PLATES, "--methods", "apgd,cg", "--out", "compared"], 0),
        (
            ["run", "arch", "--duration", "0.02", "--record", "a.h5", "--report", "report", "--save", "s.h5"],
            0,
        ),
        (["run", "wall_at_rest", "--set", "columns=3", "--duration", "0.02", "--max-iterations", "1"], 1),
        (["export", "arch", "--step", "2", "-o", "problem.npz"], 0),
        (["fmu", "arch", "--fmi", "2.0", "--outputs", "body.*", "-o", "arch.fmu"], 0),
    ],
    ids=lambda value: " ".join(value[:2]) if isinstance(value, list) else "",
)
def test_json_everywhere(tmp_path, monkeypatch, arguments, code):
    monkeypatch.chdir(tmp_path)
    result = run(*arguments, "--json")
    assert result.exit_code == code, result.output
    told = json.loads(result.stdout, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert told
    for file in told.get("files", []) if isinstance(told, dict) else []:
        assert (tmp_path / file).exists()


def commands():
    """Name and command of the framework, of all commands."""
    import typer

    return typer.main.get_command(cli.app).commands.items()


# Breaks when a command is added without --json.
def test_no_command_is_left_out():
    without = {name for name, command in commands() if not any("--json" in p.opts for p in command.params)}
    assert without <= {"view"}  # which shows a page


# Breaks when an option has no help, when its help does not begin with what it sets, or when brackets
# of a text are taken for markup.
def test_help_says_what_each_option_sets():
    for name, command in commands():
        for parameter in command.params:
            told = getattr(parameter, "help", "")
            assert told, f"{name}: {parameter.name}"
            assert not re.match("(Of|What|Whether|Where|A|The) ", told), f"{name}: {told}"
            assert told.endswith("."), f"{name}: {told}"
    printed = CliRunner().invoke(cli.app, ["view", "--help"]).output
    assert "pip install 'amontons[view]'" in " ".join(printed.split())


# Breaks when the numbers of a run are not those of its steps.
def test_json_of_a_run():
    told = json.loads(run("run", "arch", "--duration", "0.05", "--json").stdout)
    simulation = amontons.Simulation(amontons.scenes.arch(), dt=5e-3)
    reports = [simulation.step() for _ in range(10)]
    assert told["steps"] == 10
    assert told["missed"] == 0
    assert told["worst_residual"] == max(report.residual for report in reports)
    assert told["contacts_max"] == max(report.contacts for report in reports)
    assert told["energy_last"] == reports[-1].energy
    assert told["ended_early"] is None


# Breaks when the doctor lacks what a report of a fault needs, or does not see a build that computes nonsense.
def test_doctor(monkeypatch):
    told = json.loads(run("doctor", "--json").stdout)
    assert told["passed"] is True
    assert {"amontons", "python", "numpy", "compiler"} <= set(told["versions"])
    assert told["machine"]["instruction_set"] in ("baseline", "avx2", "avx512")
    assert told["machine"]["cores"] >= 1
    assert {"models", "gym", "studies"} <= set(told["parts"])
    assert len(told["tests"]) >= 4
    shown = run("doctor").stdout
    assert shown.count("passed") == len(told["tests"])
    monkeypatch.setattr(np, "array_equal", lambda a, b: False)
    failed = run("doctor")
    assert failed.exit_code == 1
    assert failed.stdout.count("FAILED") == 1


# Breaks when a part that is missing is not told, or without the way to get it.
def test_doctor_tells_what_is_missing(monkeypatch):
    from amontons.report import health

    monkeypatch.setattr(health, "find_spec", lambda name: None)
    parts = health.parts()
    assert parts["studies"]["installed"] is False
    assert parts["studies"]["remedy"] == 'pip install "amontons[studies]"'
    assert 'missing: pip install "amontons[models]"' in run("doctor").stdout


# Breaks when a shell offers nothing for scenes, methods, files or commands. The variables are what the
# scripts of `--show-completion` set.
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("amontons swe", {"sweep"}),
        ("amontons run wal", {"wall", "wall_at_rest"}),
        ("amontons scenes four", {"four_bar"}),
        ("amontons run wall --meth", {"--method"}),
        ("amontons run wall --method ap", {"apgd"}),
        ("amontons solve x --law c", {"convex", "coulomb"}),
        (f"amontons info {EXAMPLES.parent}/prob", {f"{EXAMPLES}/"}),
        (f"amontons info {EXAMPLES}/pla", {PLATES}),
        (f"amontons sweep {EXAMPLES.parent}/studies/a", {f"{EXAMPLES.parent}/studies/arch.toml"}),
    ],
)
@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(shell, line, expected):
    if shell == "bash":
        given = {"COMP_WORDS": line, "COMP_CWORD": str(len(line.split()) - 1)}
    else:
        given = {"_TYPER_COMPLETE_ARGS": line, "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    result = CliRunner().invoke(
        cli.app, env={"_AMONTONS_COMPLETE": f"complete_{shell}", **given}, prog_name="amontons"
    )
    if shell == "zsh":
        assert all(f'"{name}"' in result.stdout for name in expected)
    else:
        assert {text.split("\t")[0] for text in result.stdout.splitlines()} == expected


# Breaks when the library prints by itself, has a handler, or -v shows nothing.
def test_logging(caplog, tmp_path):
    assert logging.getLogger("amontons").handlers == []
    with caplog.at_level(logging.DEBUG, "amontons"):
        simulation = amontons.Simulation(amontons.scenes.stack(), dt=5e-3)
        simulation.step()
        simulation.problem().write(tmp_path / "p.npz")
        amontons.vi.read_problem(tmp_path / "p.npz").solve()
    text = "\n".join(caplog.messages)
    assert "t = 0.005 s: converged, residual" in text
    assert f"wrote {tmp_path / 'p.npz'}" in text
    assert f"reading {tmp_path / 'p.npz'}" in text
    assert all(record.name.startswith("amontons.") for record in caplog.records)
    command = [sys.executable, "-m", "amontons", "-vv", "run", "free_body", "--duration", "0.002"]
    loud = subprocess.run(command, capture_output=True, text=True, check=True)
    assert loud.stderr.count("converged, residual") == 2
    quiet = subprocess.run([c for c in command if c != "-vv"], capture_output=True, text=True, check=True)
    assert quiet.stderr == ""


# Breaks when a slip of the finger gets a list of names without the one that was meant.
@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["rnu", "wall"], "run"),
        (["run", "wlal"], "wall"),
        (["scenes", "wal"], "wall"),
        (["run", "wall", "--durtion", "1"], "--duration"),
        (["run", "wall", "--set", "colums=3"], "columns"),
        (["run", "wall", "--method", "apgb"], "apgd"),
        (["run", "wall", "--law", "coulom"], "coulomb"),
        (["solve", PLATES, "--method", "newten"], "newton"),
        (["export", "wall", "--touch", "bal", "-o", "x.npz"], "ball"),
    ],
)
def test_what_was_meant(tmp_path, monkeypatch, arguments, meant):
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert result.exit_code == 2
    assert meant in " ".join(result.stderr.split())
    assert "Traceback" not in result.output


# Breaks when names in Python are not suggested.
def test_what_was_meant_in_python():
    model = amontons.scenes.four_bar()
    name = model.joints[0].name
    with pytest.raises(amontons.InputError, match=rf"\(did you mean '{name}'\?\)"):
        model.joint_index(name[:-1] + "x" if len(name) > 3 else name + "x")
    with pytest.raises(amontons.InputError, match=r"did you mean 'coulomb'\?"):
        amontons.Simulation(model, law="colomb")


# Breaks when a renamed name is only missing, or the sensors that there are stay untold.
def test_names_of_others():
    with pytest.raises(ImportError, match="amontons.Free is now amontons.vi.Bilateral"):
        amontons.Free  # noqa: B018
    with pytest.raises(amontons.InputError, match=r"'pgs' \(here it is called 'gauss-seidel'\)"):
        amontons.Simulation(amontons.scenes.stack(), method="pgs")
    simulation = amontons.Simulation(amontons.scenes.stack())
    with pytest.raises(amontons.InputError, match=r"'tol'.*called 'tolerance'"):
        simulation.change_options(tol=1e-3)
    with pytest.raises(KeyError, match="unknown sensor 'nope'; known are none"):
        simulation.sensors["nope"]
    builder = amontons.ModelBuilder()
    builder.add_body("ball", shape=amontons.shapes.Sphere(0.1), density=1000)
    model = replace(builder.build(), sensors=(amontons.parts.Sensor("height", "framepos", body=0),))
    sensors = amontons.Simulation(model).sensors
    with pytest.raises(amontons.InputError, match=r"'hight' \(did you mean 'height'\?\); known are height"):
        sensors["hight"]
    assert "nope" not in sensors
    assert sensors.get("nope") is None


# Breaks when a bar or colours are written where nobody sees them: into a file or a pipe.
def test_no_bar_without_a_terminal(tmp_path):
    environment = {k: v for k, v in os.environ.items() if k not in ("FORCE_COLOR", "TTY_COMPATIBLE")}
    command = [sys.executable, "-m", "amontons", "run", "arch", "--duration", "0.3"]
    result = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert result.stderr == ""
    assert "\x1b" not in result.stdout
