"""Loads of recordings, and the commands that show them."""

import csv
import json

import amontons
import numpy as np
import pytest
from amontons import cli
from amontons.report.loads import loads_of
from typer.testing import CliRunner


def run(*arguments):
    """Exit code and what was printed."""
    result = CliRunner().invoke(cli.app, [str(word) for word in arguments])
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def recorded(tmp_path):
    """A recording of a four-bar linkage and the loads that were collected meanwhile."""
    simulation = amontons.Simulation(amontons.scenes.four_bar(), dt=2e-3)
    path = tmp_path / "bar.h5"
    with amontons.record(path, simulation) as recorder, simulation.forces.loads() as loads:
        simulation.run(0.2, after_step=recorder)
    return path, loads


# Breaks when a recording's reactions are taken from other columns or turned by another pose than those of the
# run, or frames get other times.
def test_recorded_loads_are_those_of_the_run(recorded):
    path, loads = recorded
    with amontons.read_recording(path) as recording:
        found = loads_of(recording).joints
    live = loads.joints[: len(found)]
    assert found["joint"].tolist() == live["joint"].tolist()
    assert found["determined"].tolist() == live["determined"].tolist()
    assert set(loads.joints["component"][len(found) :]) == {"effort"}  # are not recorded
    for name in ("peak", "mean", "rms", "impulse"):
        np.testing.assert_allclose(found[name], live[name], rtol=1e-9, atol=1e-12)
    large = np.abs(live["peak"]) > 1e-3
    np.testing.assert_allclose(found["time"][large], live["time"][large], atol=1e-9)


# Breaks when --loads prints no mark, writes another table than it prints, or accepts what it cannot do.
def test_plot_loads(recorded, tmp_path):
    path, _ = recorded
    code, out, _ = run("plot", path, "--loads")
    assert code == 0
    (line,) = [line for line in out.splitlines() if line.startswith("crank pin.fz")]
    assert line.endswith("not determined")
    assert "not determined" not in next(x for x in out.splitlines() if x.startswith("crank pin.fx"))
    code, out, _ = run("plot", path, "--loads", "--json")
    listed = json.loads(out)["loads"]
    code, _, _ = run("plot", path, "--loads", "-o", tmp_path / "loads.csv")
    assert code == 0
    with (tmp_path / "loads.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(r["name"], r["component"]) for r in rows] == [(r["name"], r["component"]) for r in listed]
    assert [float(r["peak"]) for r in rows] == [r["peak"] for r in listed]
    for words, message in (
        (("crank.fx", "--loads"), "leave out crank.fx"),
        (("--loads", "-o", tmp_path / "loads.png"), "ends in .csv"),
    ):
        code, _, err = run("plot", path, *words)
        assert code == 2
        assert message in err


# Breaks when a recording without reactions, or with one frame, ends in a stack trace.
def test_recordings_without_loads(tmp_path):
    simulation = amontons.Simulation(amontons.scenes.four_bar(), dt=2e-3)
    with amontons.record(tmp_path / "bare.h5", simulation, signals=False) as recorder:
        simulation.run(0.01, after_step=recorder)
    simulation = amontons.Simulation(amontons.scenes.four_bar(), dt=2e-3)
    with amontons.record(tmp_path / "one.h5", simulation) as recorder:
        simulation.run(0.002, after_step=recorder)
    for name, message in (("bare.h5", "no reactions"), ("one.h5", "two or more")):
        with (
            amontons.read_recording(tmp_path / name) as recording,
            pytest.raises(amontons.InputError, match=message),
        ):
            loads_of(recording)


# Breaks when a report has no table of loads, or one for a model without joints and contacts.
def test_report_has_loads(tmp_path):
    code, out, _ = run("run", "four_bar", "--duration", 0.05, "--report", tmp_path / "bar")
    assert code == 0
    assert "loads.csv" in out
    with (tmp_path / "bar" / "loads.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["of"] for row in rows} == {"joint"}
    assert {row["determined"] for row in rows} == {"True", "False"}
    run("run", "free_body", "--duration", 0.05, "--report", tmp_path / "free")
    assert not (tmp_path / "free" / "loads.csv").exists()
