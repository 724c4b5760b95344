"""What files are left when processes are killed, disks are full, and names are taken."""

import errno
import os
import signal
import stat
import subprocess
import sys
import time

import amontons
import h5py
import numpy as np
import pytest
from amontons import scenes
from waiting import LONGEST

BEGIN = (
    "import os, sys, time, amontons\nfrom amontons import scenes\n"
    "sim = amontons.Simulation(scenes.make('stack', boxes=2), on_failure='ignore')\n"
)


def simulation(boxes=2):
    return amontons.Simulation(scenes.make("stack", boxes=boxes), dt=5e-3, on_failure="ignore")


def hidden(folder):
    return [p.name for p in folder.iterdir() if p.name.startswith(".")]


def start(program, folder):
    return subprocess.Popen(
        [sys.executable, "-c", BEGIN + program], cwd=folder, stdout=subprocess.PIPE, text=True
    )


def last_step(path):
    """Of a recording that is being written."""
    with amontons.read_recording(path) as recording:
        return int(recording.steps[-1])


RECORDS = (
    "r = amontons.record('a.h5', sim)\nwhile True:\n    r.add(sim.step())\n    print(sim.steps, flush=True)\n"
)


# Breaks when a recording is lost with its process, has another name until it is closed, or is left with what
# another program does not open: killed at moments that come to lie between writes and within them. A frame
# that was read back before must be there.
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM])
def test_killed(tmp_path, end):
    for pause in (0.2, 0.6) if end == signal.SIGKILL else (0.4,):
        process = start(RECORDS, tmp_path)
        process.stdout.readline()
        time.sleep(pause)
        older = int(process.stdout.readline())
        deadline = time.monotonic() + LONGEST  # a second, where no other programs run
        while (seen := last_step(tmp_path / "a.h5")) < older and time.monotonic() < deadline:
            time.sleep(0.05)
        process.send_signal(end)
        process.communicate()
        assert os.listdir(tmp_path) == ["a.h5"]
        with amontons.read_recording(tmp_path / "a.h5") as recording:
            assert not recording.complete
            assert recording.steps[-1] >= seen >= older
            assert recording.steps.tolist() == list(range(len(recording)))
            assert len(recording.positions) == len(recording)
            assert len(recording.contacts(-1)) == 8
        (tmp_path / "a.h5").unlink()


# Breaks when a kill within a write of a recording makes it unreadable, or rows of one frame pass for those of
# another: the process ends between any two calls of HDF5 that add rows.
def test_killed_within_a_write(tmp_path):
    program = (
        "import h5py\n"
        "count, last = 0, int(sys.argv[1])\n"
        "old = h5py.Dataset.flush\n"
        "def flush(self):\n"
        "    global count\n"
        "    old(self)\n"
        "    count += 1\n"
        "    if count == last: os.kill(os.getpid(), 9)\n"
        "h5py.Dataset.flush = flush\n"
        "with amontons.record('a.h5', sim) as r:\n"
        "    for _ in range(5): r.add(sim.step())\n"
    )
    for last in (12, 14, 17):  # the frame of the start takes nine
        command = [sys.executable, "-c", BEGIN + program, str(last)]
        assert subprocess.run(command, cwd=tmp_path, check=False).returncode == -signal.SIGKILL
        with amontons.read_recording(tmp_path / "a.h5") as recording:
            assert recording.steps.tolist() in ([0], [0, 1, 2, 3, 4, 5])
            assert recording.times == pytest.approx(5e-3 * recording.steps)
            assert recording.positions[:].shape == (len(recording), 2, 3)
            assert len(recording.contacts(0)) == 0
        (tmp_path / "a.h5").unlink()


# Breaks when a recording cannot be watched while it is written, by us or by h5py alone.
def test_readable_while_it_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr("amontons.io.recordings.recorder.DELAY", 0.01)
    sim = simulation()
    with amontons.record(tmp_path / "a.h5", sim) as recorder:
        for expected in (3, 6):
            for _ in range(3):
                recorder.add(sim.step())
            deadline = time.monotonic() + LONGEST
            seen = 0
            while seen < 1 + expected and time.monotonic() < deadline:
                with amontons.read_recording(tmp_path / "a.h5") as recording:
                    seen = len(recording)
            assert seen == 1 + expected
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["complete"][0] == 1


# Breaks when a recorder that nobody closes loses what it has, or keeps the process from ending.
def test_forgotten_recorder(tmp_path):
    process = start("r = amontons.record('a.h5', sim)\nfor _ in range(3): r.add(sim.step())\n", tmp_path)
    assert process.wait(timeout=LONGEST) == 0
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        assert len(recording) == 4
        assert not recording.complete


# Breaks when an output that is there is lost without the caller's wish, when the wish is not granted, or
# widens the mode of the file.
def test_output_that_exists(tmp_path):
    path = tmp_path / "a.h5"
    path.write_text("precious")
    path.chmod(0o640)
    with pytest.raises(amontons.FileError, match=r"a\.h5: exists; give another name"):
        amontons.record(path, simulation())
    assert path.read_text() == "precious"
    with amontons.record(path, simulation(), overwrite=True):
        pass
    assert amontons.read_recording(path).complete
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert hidden(tmp_path) == []


# Breaks when two recorders write one file, in one process or in two, or the second harms what the first
# wrote.
def test_two_writers(tmp_path):
    path = tmp_path / "a.h5"
    first = simulation()
    with amontons.record(path, first) as recorder:
        recorder.add(first.step())
        with pytest.raises(amontons.FileError, match="exists"):
            amontons.record(path, simulation())
        with pytest.raises(amontons.FileError, match="is being recorded"):
            amontons.record(path, simulation(), overwrite=True)
        other = start(
            "try: amontons.record('a.h5', sim, overwrite=True)\n"
            "except amontons.FileError as error: print(error)\n",
            tmp_path,
        )
        assert "is being recorded by another program" in other.communicate()[0]
        recorder.add(first.step())
    with amontons.read_recording(path) as recording:
        assert len(recording) == 3
        assert recording.complete
    assert hidden(tmp_path) == []


# Breaks when a recording whose file was taken away goes on into nothing without a word.
def test_file_taken_away(tmp_path, monkeypatch):
    monkeypatch.setattr("amontons.io.recordings.recorder.DELAY", 0.01)
    sim = simulation()
    recorder = amontons.record(tmp_path / "a.h5", sim)
    (tmp_path / "a.h5").unlink()
    recorder.add(sim.step())
    with pytest.raises(amontons.FileError, match="removed or replaced"):
        recorder.close()
    with pytest.raises(amontons.InputError, match="is closed"):
        recorder.add(sim.step())
    assert os.listdir(tmp_path) == []


SMALL_DISK = (
    "import resource\n"
    "def limit(size): resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))\n"
)


# Breaks when a disk that fills up within a recording is no clear error, takes what was recorded before, or
# ends the process by a signal (HDF5 tries to write until the end). The limit of the size of files stands for
# the disk: both fail in `write` with an error of the system, at any byte.
def test_full_disk_within_a_recording(tmp_path):
    for room in (1_000, 200_000):
        program = SMALL_DISK + (
            f"r = amontons.record('a.h5', sim)\nlimit(os.stat('a.h5').st_size + {room})\n"
            "try:\n"
            "    for _ in range(20000): r.add(sim.step())\n"
            "    r.close()\n"
            "except amontons.FileError as error: print(error)\n"
        )
        process = start(program, tmp_path)
        said, _ = process.communicate(timeout=LONGEST)
        assert process.returncode == 0
        assert said.startswith("a.h5: cannot be written any further (")
        assert os.listdir(tmp_path) == ["a.h5"]
        with amontons.read_recording(tmp_path / "a.h5") as recording:
            assert recording.steps.tolist() == list(range(len(recording)))
            assert not recording.complete
        with h5py.File(tmp_path / "a.h5"):  # no trace of a write that was broken off
            pass
        (tmp_path / "a.h5").unlink()


WAYS = {
    "amontons.record('a.h5', sim)": "a.h5",
    "amontons.record('a.h5', sim, overwrite=True)": "a.h5",
    "sim.save('a.h5')": "a.h5",
    "sim.problem().write('a.hdf5')": "a.hdf5",
    "sim.problem().write('a.npz')": "a.npz",
    "sim.problem().write('a.mtx')": "a.mtx",
    "run_summary.write_reports(reports, Path('a.csv'))": "a.csv",
    "run_summary.run_figure(reports, Path('a.png'), title='', tolerance=1e-6)": "a.png",
}
REPORTING = (
    "from pathlib import Path\nfrom amontons.report import run_summary\n"
    "from amontons.simulation.step_report import reports_array\nreports = reports_array([sim.step()] * 9)\n"
)


# Breaks when a file that does not fit the disk is left in part, takes the one that was there, or is no error.
@pytest.mark.parametrize(("way", "size"), [*((way, 700) for way in WAYS), ("sim.save('a.h5')", 0)])
def test_full_disk(tmp_path, way, size):
    name = WAYS[way]
    old = "overwrite" in way or "record" not in way
    if old:
        (tmp_path / name).write_text("precious")
    program = (
        SMALL_DISK
        + (REPORTING if "summary" in way else "")
        + (
            f"sim.step()\nlimit({size})\n"
            f"try: {way}\n"
            "except amontons.FileError as error: os.write(1, str(error).encode())\n"
        )
    )
    process = start(program, tmp_path)
    said, _ = process.communicate(timeout=LONGEST)
    assert process.returncode == 0
    assert f"{name}: cannot be written (" in said or "a.npz: cannot be written (" in said
    assert os.listdir(tmp_path) == ([name] if old else [])
    assert not old or (tmp_path / name).read_text() == "precious"


# Breaks when what is no regular file is replaced by one, which root may do even to /dev/null.
def test_only_regular_files_are_replaced(tmp_path):
    sim = simulation()
    os.mkfifo(tmp_path / "pipe.h5")
    (tmp_path / "dangling.h5").symlink_to(tmp_path / "gone.h5")
    for name, message in (("pipe.h5", "is no regular file"), ("dangling.h5", "is a link to .*gone.h5")):
        for write in (sim.save, lambda path: amontons.record(path, sim, overwrite=True)):
            with pytest.raises(amontons.FileError, match=message):
                write(tmp_path / name)
    with pytest.raises(amontons.FileError, match="is no regular file"):
        sim.save("/dev/null")
    assert stat.S_ISFIFO((tmp_path / "pipe.h5").stat().st_mode)
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    assert sorted(os.listdir(tmp_path)) == ["dangling.h5", "pipe.h5"]


# Breaks when saving changes the mode of the file that it replaces, gives a new one another than the user
# wants, or puts a file in the place of a link.
def test_mode_and_links_are_kept(tmp_path):
    sim = simulation()
    real, link = tmp_path / "real.h5", tmp_path / "link.h5"
    before = os.umask(0o027)
    try:
        sim.save(real)
    finally:
        os.umask(before)
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
    real.chmod(0o600)
    link.symlink_to("real.h5")
    sim.run(0.01)
    sim.save(link)
    assert link.is_symlink()
    assert stat.S_IMODE(real.stat().st_mode) == 0o600
    assert amontons.Simulation.load(real).steps == 2
    assert hidden(tmp_path) == []


# Breaks when a folder or file that cannot be written is noticed after the work, or named badly. To root
# nothing is forbidden, so the answer of the system is put in.
def test_read_only(tmp_path, monkeypatch):
    sim = simulation()
    (tmp_path / "old.h5").write_text("precious")

    def access(path, mode, **_):
        return not str(path).endswith(("old.h5", "folder"))

    monkeypatch.setattr(os, "access", access)
    (tmp_path / "folder").mkdir()
    with pytest.raises(amontons.FileError, match="old.h5: is read-only"):
        sim.save(tmp_path / "old.h5")
    with pytest.raises(amontons.FileError, match="folder .*folder is read-only for you"):
        amontons.record(tmp_path / "folder" / "a.h5", sim)
    monkeypatch.undo()

    def refuse(*_, **__):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(amontons.FileError, match=r"new.h5: cannot be written \(Read-only file system\)"):
        sim.save(tmp_path / "new.h5")
    monkeypatch.undo()
    assert (tmp_path / "old.h5").read_text() == "precious"


# Breaks when a file system without nameless files leaves a hidden one, or cannot be written.
def test_without_nameless_files(tmp_path, monkeypatch):
    monkeypatch.delattr(os, "O_TMPFILE")
    sim = simulation()
    sim.save(tmp_path / "a.h5")
    with amontons.record(tmp_path / "b.h5", sim):
        pass
    assert sorted(os.listdir(tmp_path)) == ["a.h5", "b.h5"]


# Breaks when names that cannot be files end in an error of the system.
@pytest.mark.parametrize("name", ["x" * 300 + ".h5", "a\0b.h5", "no/such/folder.h5"])
def test_names_that_cannot_be(tmp_path, name):
    for write in (simulation().save, lambda path: amontons.record(path, simulation())):
        with pytest.raises(amontons.FileError):
            write(f"{tmp_path}/{name}")
    assert os.listdir(tmp_path) == []


# Breaks when a forked child writes into, closes or harms the recording of its parent, or waits for a thread
# that it does not have.
def test_fork_within_a_recording(tmp_path):
    sim = simulation()
    with amontons.record(tmp_path / "a.h5", sim) as recorder:
        recorder.add(sim.step())
        child = os.fork()
        if child == 0:
            code = 1
            try:
                recorder.close()
                try:
                    recorder.add(sim.step())
                except amontons.InputError as error:
                    code = 0 if "by the process that began it" in str(error) else 2
            finally:
                os._exit(code)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
        recorder.add(sim.step())
    with amontons.read_recording(tmp_path / "a.h5") as recording:
        assert len(recording) == 3
        assert recording.complete
        assert np.isfinite(recording.positions[:]).all()
