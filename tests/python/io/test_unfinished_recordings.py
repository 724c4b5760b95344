"""Recordings whose process was killed within a write; the soak damages them."""

import os
import subprocess
import sys

import amontons
import pytest
from amontons import cli
from amontons.io.recordings import is_recording
from amontons.io.recordings.unfinished import lookup3
from typer.testing import CliRunner

KILLED = """
import os, h5py, amontons
from amontons import scenes
sim = amontons.Simulation(scenes.make('stack', boxes=2), on_failure='ignore')
count, old = 0, h5py.Dataset.flush
def flush(self):
    global count
    old(self)
    count += 1
    if count == 12: os._exit(9)
h5py.Dataset.flush = flush
with amontons.record('run.h5', sim) as r:
    for _ in range(20): r.add(sim.step())
"""


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """What a process that ended within a write left behind."""
    folder = tmp_path_factory.mktemp("killed")
    assert subprocess.run([sys.executable, "-c", KILLED], cwd=folder).returncode == 9
    path = folder / "run.h5"
    assert path.read_bytes()[11] != 0  # HDF5's mark of a writer
    return path


# Breaks when what `read_recording` reads of a killed process is no recording to the commands, or the other
# way round.
def test_the_same_files_for_all(killed, tmp_path):
    with amontons.read_recording(killed) as recording:
        assert len(recording) >= 1
        assert not recording.complete
    assert is_recording(killed)
    result = CliRunner().invoke(cli.app, ["export", str(killed), "--csv", str(tmp_path / "run.csv")])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "run.csv").read_text().startswith("step,")
    from amontons.cli.view import Choices, _open

    shown, title = _open(str(killed), Choices())
    with shown:
        assert (title, len(shown)) == ("run", len(recording))


# Breaks when the commands wait for a pipe, or fall over what is no file, while they look for a recording.
def test_what_is_no_recording(tmp_path):
    os.mkfifo(tmp_path / "pipe.h5")
    assert not is_recording(tmp_path / "pipe.h5")
    assert not is_recording(tmp_path)
    assert not is_recording(tmp_path / "nothing.h5")


# Breaks when the checksum is another one than Jenkins': the value is that of his own test.
def test_checksum():
    assert lookup3(b"Four score and seven years ago") == 0x17770551
    assert lookup3(b"") == 0xDEADBEEF
