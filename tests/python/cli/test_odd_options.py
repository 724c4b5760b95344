"""Options that are texts of a form of their own, with what nobody means."""

import amontons
import numpy as np
import pytest
from amontons import cli, scenes
from typer.testing import CliRunner

LONG = "9" * 5000
ODD = ["", "nan", "²", "1²3x4", LONG, f"{LONG}x9", "1x2x3", "٣", "cuda:²", f"opencl:{LONG}", ","]
OPTIONS = [
    "run stack --duration 0.01 --device",
    "run stack --duration 0.01 --set",
    "export run.h5 --gif a.gif --size",
    "export run.h5 --png a.png --times",
    "export run.h5 --png a.png --target",
    "solve p.npz --device",
]


# Breaks when the text of an option ends a command with an error of Python.
@pytest.mark.parametrize("option", OPTIONS)
def test_texts(option, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sim = amontons.Simulation(scenes.make("stack", boxes=1))
    with amontons.record("run.h5", sim) as recorder:
        recorder.add(sim.step())
    amontons.vi.Problem(np.eye(3), [-1.0, 0.1, 0.2], "friction", mu=0.3).write("p.npz")
    for text in ODD:
        result = CliRunner().invoke(cli.app, [*option.split(), text])
        assert isinstance(result.exception, SystemExit | None), (text[:20], result.exception)
        assert result.exit_code in (0, 1, 2), text[:20]


# Breaks when a device that is no name, or whose number no computer has, is not refused by name.
@pytest.mark.parametrize(
    "device", [None, 0, np.array(["cpu", "cpu"]), [], "cuda:²", "opencl:" + "9" * 5000, "cuda:-1", "numpy:0"]
)
def test_devices(device):
    with pytest.raises(amontons.InputError, match="device"):
        amontons.vi.solve(np.eye(3), [-1.0, 0.1, 0.2], "friction", mu=0.3, device=device)
    with pytest.raises(amontons.InputError, match="device"):
        amontons.Simulation(scenes.make("stack", boxes=1), device=device)
