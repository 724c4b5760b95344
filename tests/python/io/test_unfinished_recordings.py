"""Recordings whose process was killed within a write, whole and damaged: read, or refused, at once."""

import os
import subprocess
import sys

import amontons
import numpy as np
import pytest
from amontons import cli
from amontons.io.recordings import is_recording
from amontons.io.recordings.unfinished import lookup3
from typer.testing import CliRunner
from waiting import LONGEST

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
READS = """
import sys, time, amontons
for path in sys.argv[1:]:
    start = time.monotonic()
    try:
        with amontons.read_recording(path) as recording:
            recording.model
            recording.positions[...]
            recording.contacts(0)
        told = 'read'
    except amontons.FileError as error:
        assert str(error).startswith(path), error
        told = 'refused'
    print(told, time.monotonic() - start, flush=True)
"""


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """What a process that ended within a write left behind."""
    folder = tmp_path_factory.mktemp("killed")
    assert subprocess.run([sys.executable, "-c", KILLED], cwd=folder).returncode == 9
    path = folder / "run.h5"
    assert path.read_bytes()[11] != 0  # HDF5's mark of a writer
    return path


# Breaks when a damaged file with the mark of a writer is read for ever: cut, with bits turned, with pages of
# zeros, with a damaged superblock. The reading process is killed after a minute; each file may take 2 s.
def test_damaged_within_a_write(killed, tmp_path):
    data, rng = killed.read_bytes(), np.random.default_rng(3)
    paths = []
    for k in range(40):
        changed = bytearray(data)
        at = int(rng.integers(12 if k % 4 == 3 else 48, len(data) - 4096))
        if k % 4 == 0:
            changed = changed[:at]
        elif k % 4 == 1:
            for place in rng.integers(48, len(data) // 8, 20):
                changed[place] ^= 1 << int(rng.integers(8))
        elif k % 4 == 2:
            changed[at : at + 4096] = bytes(4096)
        else:
            changed[12 + k % 36] ^= 4
        paths.append(tmp_path / f"{k}.h5")
        paths[-1].write_bytes(changed)
    command = [sys.executable, "-c", READS, *map(str, paths)]
    told = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST)
    assert told.returncode == 0, told.stderr
    lines = [line.split() for line in told.stdout.splitlines()]
    assert len(lines) == len(paths)
    assert max(float(seconds) for _, seconds in lines) < 2
    outcomes = [outcome for outcome, _ in lines]
    assert outcomes[3::4] == ["refused"] * 10  # superblocks have a checksum
    assert {*outcomes} == {"read", "refused"}


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
