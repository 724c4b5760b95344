"""Motor efforts, controls, reactions and sensors as columns: in recordings, tables, reports and figures."""

import csv
import json
import sys
from dataclasses import replace

import amontons
import h5py
import numpy as np
import pytest
from amontons import ModelBuilder, Motor, Simulation, shapes
from amontons.cli import app
from amontons.simulation.signals import Signals, state_units
from PIL import Image
from typer.testing import CliRunner

ARM = "examples/models/arm.xml"
MASS, ARM_LENGTH, GRAVITY = 3.0, 0.4, 9.81


def call(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def press():
    """A plate that a motor holds on a vertical screw, and a bracket that carries a mass at its end."""
    builder = ModelBuilder()
    builder.add_body("plate", shape=shapes.Box((0.1, 0.1, 0.02)), mass=MASS, position=(0, 0, 1))
    builder.add_prismatic_joint("plate", None, axis=(0, 0, 1), name="screw", motor=Motor("position", 0.0))
    builder.add_body("bracket", shape=shapes.Sphere(0.05), mass=MASS, position=(2 + ARM_LENGTH, 0, 1))
    builder.add_fixed_joint("bracket", None, point=(2, 0, 1), name="foot")
    return builder.build()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("signals") / "press.h5"
    sim = Simulation(press(), dt=5e-3, tolerance=1e-13)
    with amontons.record(path, sim, source="press") as recorder:
        for _ in range(10):
            recorder.add(sim.step())
    return path


# Breaks when an effort or a reaction is recorded under another name, sign, unit or frame: a motor that holds
# a plate pushes with its weight, a foot carries weight and moment (about y: r x F with r along x).
def test_columns_of_statics(recorded):
    weight = MASS * GRAVITY
    with amontons.read_recording(recorded) as recording:
        units = recording.columns
        assert list(units)[:2] == ["screw.motor", "screw.control"]
        assert (units["screw.motor"], units["screw.control"], units["foot.fz"], units["foot.ty"]) == (
            "N", "m", "N", "N m",
        )  # fmt: skip
        motor = recording.column("screw.motor")
        assert motor.times.tolist() == recording.times.tolist()
        assert motor.values[0] == 0  # before the first step
        assert motor.values[4:] == pytest.approx(weight, rel=1e-6)
        expected = {"fx": 0, "fy": 0, "fz": weight, "tx": 0, "ty": -weight * ARM_LENGTH, "tz": 0}
        for part, value in expected.items():
            values = recording.column(f"foot.{part}").values[4:]  # a joint gives way by 1e-9 m at first
            assert values == pytest.approx(value, abs=1e-6 * weight)
        assert recording.column("plate.z").values == pytest.approx(1, abs=1e-9)
        assert recording.column("energy").values.tolist() == [
            row["kinetic_energy"] + row["potential_energy"] + row["spring_energy"]
            for row in recording.reports
        ]


# Breaks when a column holds another number than the simulation shows after that step: actuators, controls,
# links and sensors of a model file, which reads them by other functions.
def test_columns_are_those_of_the_simulation(root, tmp_path):
    model = amontons.load_model(root / ARM)
    site = amontons.parts.Site("palm", model.body_index("forearm"))
    at = amontons.parts.Sensor("at", "framepos", body=site.body)
    angle = amontons.parts.Sensor("elbow", "jointpos", source="elbow")
    sim = Simulation(replace(model, sites=(*model.sites, site), sensors=(at, angle)), dt=2e-3)
    seen = []
    with amontons.record(tmp_path / "a.h5", sim, every=2) as recorder:
        for step in range(1, 9):
            sim.set_control("elbow", -0.1 * step)
            recorder.add(sim.step())
            if step % 2 == 0:
                efforts, drives = sim.forces.joint_efforts["motor"], sim.forces.actuator_efforts
                link = sim.forces.link_reactions[0]
                held = sim.forces.joint_reactions[1]
                seen.append([efforts[1], drives["control"][1], drives["effort"][0], link["force"][2],
                             link["torque"][0], held["force"][0], held["torque"][1],
                             sim.sensors["at"][2], sim.sensors["elbow"][0]])  # fmt: skip
    names = ("elbow.motor", "elbow.control", "shoulder.effort", "hand.fz", "hand.tx", "elbow.fx", "elbow.ty",
             "at.z", "elbow.sensor")  # fmt: skip
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        found = np.stack([recording.column(name).values[1:] for name in names], axis=1)
        assert recording.columns["at.z"] == "m"
    np.testing.assert_array_equal(found, seen)


# Breaks when two columns have one name, of which one could not be had, or what has no name has no column.
def test_names_are_unique():
    builder = ModelBuilder()
    builder.add_body("foot", shape=shapes.Sphere(0.1), mass=1.0)
    builder.add_prismatic_joint("foot", None, axis=(0, 0, 1), name="foot", motor=Motor("effort"))
    builder.add_actuator("foot", joint="foot")
    model = builder.build()
    unnamed = replace(model.joints[0], name="")
    sensors = tuple(amontons.parts.Sensor(name, "framepos", body=0) for name in ("foot", "foot.sensor"))
    model = replace(model, joints=(model.joints[0], unnamed), sensors=sensors)
    units = Signals(model).units
    assert len(units) == 4 + 2 + 2 * 6 + 2 * 3
    assert len(state_units(model)) == 13 + 2
    assert not set(units) & set(state_units(model))
    assert {"foot.motor", "foot.control", "joint 1.motor", "joint 1.fx", "foot.sensor.x"} <= set(units)


# Breaks when a recording without signals, of the caller's wish or of an older version, cannot be read.
def test_without_signals(tmp_path):
    sim = Simulation(press())
    with amontons.record(tmp_path / "a.h5", sim, signals=False) as recorder:
        recorder.add(sim.step())
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        assert file["signals/values"].shape == (2, 0)
    for older in (False, True):
        if older:
            with h5py.File(tmp_path / "a.h5", "r+") as file:
                del file["signals"]
        with amontons.read_recording(tmp_path / "a.h5") as recording:
            assert recording.signal_units == {}
            assert recording.column("screw").values == pytest.approx(np.zeros(2), abs=1e-12)
    with pytest.raises(amontons.InputError, match="signals"):
        amontons.record(tmp_path / "b.h5", sim, signals="no")


# Breaks when names and numbers of a damaged file do not fit together and something else is handed out.
def test_damaged(recorded, tmp_path):
    path = tmp_path / "a.h5"
    for units in ('{"screw.motor": "N"}', "[1, 2]", "{"):
        path.write_bytes(recorded.read_bytes())
        with h5py.File(path, "r+") as file:
            del file["signals/units"]
            file["signals/units"] = np.bytes_(units)
        with amontons.read_recording(path) as recording, pytest.raises(amontons.FileError, match="a.h5: "):
            recording.column("screw.motor")


# Breaks when tables lack the signals, or have them under the name of others.
def test_tables(root, recorded, tmp_path):
    assert call("export", recorded, "--csv", tmp_path / "a.csv").exit_code == 0
    with (tmp_path / "a.csv").open() as file:
        rows = list(csv.DictReader(file))
    with amontons.read_recording(recorded) as recording:
        for name in ("screw.motor", "foot.fz", "plate.z", "screw"):
            assert [float(row[name]) for row in rows] == recording.column(name).values.tolist()
    done = call("run", root / ARM, "--duration", "0.05", "--report", tmp_path / "arm", "--snapshots", "0")
    assert done.exit_code == 0, done.output
    with (tmp_path / "arm" / "steps.csv").open() as file:
        rows = list(csv.DictReader(file))
    sim = Simulation(amontons.load_model(root / ARM))
    for row in rows:
        sim.step()
        assert float(row["elbow.motor"]) == sim.forces.joint_efforts["motor"][1]
        assert float(row["hand.fz"]) == sim.forces.link_reactions["force"][0, 2]
    assert len(rows) == 10


# Breaks when a report of very many numbers takes all memory instead of saying what it leaves out.
def test_report_of_too_much(root, tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules["amontons.cli.run"], "MOST_READINGS", 10)
    done = call("run", root / ARM, "--duration", "0.05", "--report", tmp_path / "arm", "--snapshots", "0")
    assert done.exit_code == 0
    assert "note: the report leaves out" in done.output
    assert "--record FILE.h5" in done.output
    assert "elbow.motor" not in (tmp_path / "arm" / "steps.csv").read_text()


# Breaks when a figure is not drawn, not in the format of its name, or lacks a panel for each unit.
def test_plot(recorded, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = call("plot", recorded, "screw.motor")
    assert done.exit_code == 0, done.output
    assert done.output.strip() == "press.png"
    done = call("plot", recorded, "screw.motor", "foot.*", "energy", "--output", "b.png")
    assert done.exit_code == 0, done.output
    one, three = Image.open("press.png").size, Image.open("b.png").size
    assert three[1] > 2 * one[1]  # N, N m, J
    for name, start in (("c.svg", b"<?xml"), ("d.pdf", b"%PDF")):
        done = call("plot", recorded, "foot.f[xyz]", "-o", name, "--json")
        assert json.loads(done.stdout) == {"files": [name]}
        assert (tmp_path / name).read_bytes().startswith(start)


# Breaks when somebody who does not know the names is not told them.
def test_plot_tells_names(recorded, tmp_path):
    listed = call("plot", recorded)
    assert listed.exit_code == 0
    assert [line.split() for line in listed.stdout.splitlines()][:2] == [
        ["screw.motor", "N"],
        ["screw.control", "m"],
    ]
    columns = json.loads(call("plot", recorded, "--json").stdout)["columns"]
    with amontons.read_recording(recorded) as recording:
        assert columns == recording.columns
    for wrong, said in (
        ("screw.moter", "(did you mean 'screw.motor'?); known are screw.motor, screw.control, "),
        ("hip*", 'there is no column "hip*"; known are screw.motor, '),
    ):
        done = call("plot", recorded, wrong, "--output", tmp_path / "a.png")
        assert done.exit_code == 2
        assert said in done.output
    assert not (tmp_path / "a.png").exists()


# Breaks when what is no recording, or a name of no figure, is a traceback or is found out late.
def test_plot_refuses(root, recorded, tmp_path):
    for arguments, said in (
        ([root / ARM, "elbow.motor"], "is no recording; make one with amontons run"),
        ([tmp_path / "none.h5", "elbow.motor"], "no such file"),
        ([recorded, "foot.fx", "--output", "a.jpg"], ".png or .pdf or .svg"),
        ([recorded, "foot.fx", "--output", tmp_path / "no" / "a.png"], "does not exist"),
    ):
        done = call("plot", *arguments)
        assert done.exit_code == 2, done.output
        assert said in done.output
