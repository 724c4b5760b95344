"""Which devices there are, and what is said of those that cannot be used."""

import sys
import types

import amontons
import numpy as np
import pytest
from amontons.device import backend, cuda, found, opencl
from device_problems import open_groups, pocl, problems
from typer.testing import CliRunner


def solve(device):
    return problems()["wall"].solve(method="apgd", device=device, max_iterations=2)


@pytest.fixture
def nothing(monkeypatch):
    """Neither pyopencl nor CuPy."""
    monkeypatch.setitem(sys.modules, "pyopencl", None)
    monkeypatch.setitem(sys.modules, "cupy", None)
    monkeypatch.setattr(found, "_opened", {})


# Breaks when a missing package is not named, or importing amontons asks for one.
def test_packages_are_named(nothing):
    assert amontons.devices() == ()
    for device, package in (("opencl", "amontons[opencl]"), ("cuda:1", "amontons[cuda]")):
        with pytest.raises(amontons.InputError) as caught:
            solve(device)
        assert package in str(caught.value)
    with pytest.raises(
        amontons.InputError, match="no GPU with double precision.*CuPy.*pyopencl.*found: none"
    ):
        solve("gpu")


# Breaks when a name that means nothing is not refused with those that do.
@pytest.mark.parametrize("name", ["GPU", "opencl:x", "", None, 3, "cuda:-1"])
def test_unknown_names(name):
    with pytest.raises(amontons.InputError, match='"gpu".*"opencl"'):
        solve(name)
    with pytest.raises(amontons.InputError, match='"gpu".*"opencl"'):
        amontons.Simulation(amontons.scenes.make("stack"), device=name)


class FakeError(Exception):
    pass


def fake_cupy(count, memory=2e9):
    """A CuPy that sees so many devices."""

    def devices():
        if count < 0:
            raise FakeError("no driver")
        return count

    runtime = types.SimpleNamespace(
        CUDARuntimeError=FakeError,
        getDeviceCount=devices,
        driverGetVersion=lambda: 12040,
        getDeviceProperties=lambda i: {"name": b"Card %d" % i, "totalGlobalMem": memory},
    )
    return types.SimpleNamespace(cuda=types.SimpleNamespace(runtime=runtime))


# Breaks when a driver that is missing is taken for a fault of the package, or a card is described wrongly.
def test_cards_and_drivers(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyopencl", None)
    monkeypatch.setitem(sys.modules, "cupy", fake_cupy(-1))
    with pytest.raises(amontons.InputError, match="needs the driver of NVIDIA"):
        solve("cuda")
    monkeypatch.setitem(sys.modules, "cupy", fake_cupy(2))
    first, second = amontons.devices()
    assert (first.name, first.hardware, first.kind) == ("cuda:0", "Card 0", "gpu")
    assert (second.driver, second.memory, second.doubles) == ("CUDA 12.4", 2e9, True)
    assert found.chosen_device("gpu") == first
    assert found.chosen_device("cuda:1") == second
    with pytest.raises(amontons.InputError, match=r'"cuda:2" is absent; found are cuda:0 \(Card 0, gpu\)'):
        solve("cuda:2")


# Breaks when a device without double precision is used, or the message does not say which one it is.
def test_double_precision_is_needed(monkeypatch):
    device = backend.Device("opencl:0", "Old card", "gpu", "Driver 1", 10**9, False)
    monkeypatch.setattr(opencl, "devices", lambda: [device])
    monkeypatch.setattr(cuda, "devices", list)
    with pytest.raises(amontons.InputError, match="Old card, Driver 1.*no double precision"):
        solve("opencl")
    with pytest.raises(amontons.InputError, match="no GPU with double precision.*Old card"):
        solve("gpu")


# Breaks when a problem that is too large for a device is found out by the driver only.
def test_memory_is_needed(monkeypatch):
    name = pocl().name
    opened = open_groups(64)
    small = backend.Device("opencl:0", "Small card", "gpu", "", 100_000, True)
    monkeypatch.setattr(opened, "device", small)
    monkeypatch.setattr(found, "_opened", {name: opened})
    with pytest.raises(amontons.InputError, match="Small card.*has 0.0001 GB of memory"):
        solve(name)


# Breaks when a problem that the passes do not know is solved wrongly, or on the CPU in silence.
def test_other_problems_are_refused():
    sparse = amontons.vi.Problem(np.eye(3), np.ones(3), "friction", mu=0.5)
    with pytest.raises(amontons.InputError, match="passes know bodies"):
        sparse.solve(method="apgd", device="numpy")
    assert sparse.solve(method="gauss-seidel", device="numpy").device == "cpu"
    A = amontons.vi.Contacts(
        [1.0], np.eye(3)[None], [0], [-1], [[0, 0, -1]], [[0, 0, 0]], [[0, 0, 1]], rows=4
    )
    rolling = amontons.vi.Problem(A, -np.ones(4), [amontons.vi.EllipticFriction(0.5, torsion=0.1)])
    with pytest.raises(amontons.InputError, match="passes know bodies"):
        rolling.solve(device="numpy")


# Breaks when the commands do not pass --device on, or doctor leaves devices out.
def test_commands(tmp_path, monkeypatch):
    from amontons import cli

    monkeypatch.chdir(tmp_path)
    problems()["wall"].write("wall.npz")
    runner = CliRunner()
    solved = runner.invoke(cli.app, ["solve", "wall.npz", "--method", "apgd", "--device", "numpy", "--json"])
    assert '"device": "numpy"' in solved.output
    refused = runner.invoke(cli.app, ["run", "stack", "--device", "tpu"])
    assert (refused.exit_code, "unknown device" in refused.output) == (2, True)
    assert runner.invoke(cli.app, ["run", "stack", "--duration", "0.01", "--device", "numpy"]).exit_code == 0
    lines = runner.invoke(cli.app, ["doctor"]).output.splitlines()
    assert sum(line.startswith(("cuda", "opencl")) for line in lines) == 2
