"""Links, pipes and devices at names that somebody else may have prepared in a folder."""

import os
import subprocess
import sys
import threading

import amontons
import pytest
from amontons import cli, scenes
from typer.testing import CliRunner
from waiting import LONGEST

STUDY = 'run = "arch"\n[grid]\nmu = [0.5]\n[fixed]\nstones = 3\nduration = 0.01\n'


def run(*arguments):
    return CliRunner().invoke(cli.app, [*map(str, arguments)])


@pytest.fixture
def victim(tmp_path):
    """A file of a user that no command names."""
    path = tmp_path / "private" / "notes.txt"
    path.parent.mkdir()
    path.write_text("irreplaceable")
    return path


@pytest.fixture
def study(tmp_path):
    pytest.importorskip("pyarrow")
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


def refuse(result, *words):
    text = " ".join(result.output.split())
    assert result.exit_code == 2, text
    assert all(word in text for word in words), text


# Breaks when the lock of a study empties or locks what a link leads to, or makes what it leads to.
@pytest.mark.parametrize("kind", ["link", "dangling", "hard"])
def test_lock_is_a_link(study, victim, tmp_path, kind):
    out, lock = tmp_path / "rows.parquet", tmp_path / ".rows.parquet.lock"
    if kind == "hard":
        os.link(victim, lock)
    else:
        lock.symlink_to(victim if kind == "link" else tmp_path / "private" / "new")
    refuse(run("sweep", study, "-o", out, "--processes", 0), str(lock), "remove it")
    assert victim.read_text() == "irreplaceable"
    assert os.listdir(victim.parent) == ["notes.txt"]
    assert not out.exists()


# Breaks when a pipe under the name of a lock blocks for ever (the command runs in a process that is killed
# then), or a file that is no lock is taken for one and removed.
def test_lock_is_a_pipe_or_a_file(study, tmp_path):
    out, lock = tmp_path / "rows.parquet", tmp_path / ".rows.parquet.lock"
    os.mkfifo(lock)
    command = [sys.executable, "-m", "amontons", "sweep", study, "-o", out, "--processes", "0"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST)
    assert result.returncode == 2
    assert str(lock) in " ".join(result.stderr.split())
    lock.unlink()
    lock.write_text("mine")
    refuse(run("sweep", study, "-o", out, "--processes", 0), "is no lock of a study")
    assert lock.read_text() == "mine"


# Breaks when the lock that a killed study left behind keeps the next one away, or a lock stays behind.
def test_lock_left_behind(study, tmp_path):
    lock = tmp_path / ".rows.parquet.lock"
    lock.touch()
    result = run("sweep", study, "-o", tmp_path / "rows.parquet", "--processes", 0)
    assert result.exit_code == 0, result.output
    assert not lock.exists()


# Breaks when a study goes through a link at the name that its file gives, or the command does not where the
# user gives it.
def test_out_of_a_study_is_a_link(study, victim, tmp_path):
    (tmp_path / "study.parquet").symlink_to(victim)
    refuse(run("sweep", study, "--processes", 0), "study.parquet: is a link to", "remove it")
    real = tmp_path / "real.parquet"
    first = run("sweep", study, "-o", real, "--processes", 0)
    assert first.exit_code == 0, first.output
    (tmp_path / "named.parquet").symlink_to(real)
    again = run("sweep", study, "-o", tmp_path / "named.parquet", "--processes", 0)
    assert again.exit_code == 0, again.output
    assert victim.read_text() == "irreplaceable"


# Breaks when a report replaces what links in its folder lead to: the names in it are those of amontons.
@pytest.mark.parametrize("name", ["steps.csv", "report.png", "snapshots.png"])
def test_report_through_a_link(victim, tmp_path, name):
    folder = tmp_path / "report"
    folder.mkdir()
    (folder / name).symlink_to(victim)
    result = run("run", "stack", "--set", "boxes=2", "--duration", 0.02, "--report", folder)
    refuse(result, f"{name}: is a link to", "remove it")
    assert victim.read_text() == "irreplaceable"


# Breaks when what is written beside a named file goes through a link: the archive of a matrix, the tables of
# a comparison.
def test_companions_through_a_link(victim, tmp_path, root):
    problem = amontons.vi.read_problem(root / "examples/problems/wall_impact.hdf5")
    (tmp_path / "text.npz").symlink_to(victim)
    with pytest.raises(amontons.FileError, match=r"text\.npz: is a link to"):
        problem.write(tmp_path / "text.mtx")
    assert not (tmp_path / "text.mtx").exists()
    folder = tmp_path / "compared"
    folder.mkdir()
    (folder / "summary.csv").symlink_to(victim)
    file = root / "examples/problems/wall_impact.hdf5"
    result = run("compare", file, "--out", folder, "--methods", "apgd")
    refuse(result, "summary.csv: is a link to")
    assert victim.read_text() == "irreplaceable"


# Breaks when a recording that may replace a file waits for a pipe, or writes into a device, that has taken
# its name between the check and the opening.
def test_recording_over_what_became_a_pipe(tmp_path, monkeypatch):
    from amontons.io.recordings import growing

    path = tmp_path / "a.h5"
    path.write_text("old")
    real = growing.writable

    def slow(name, **options):
        checked = real(name, **options)
        path.unlink()
        os.mkfifo(path)
        return checked

    monkeypatch.setattr(growing, "writable", slow)
    sim = amontons.Simulation(scenes.make("stack", boxes=1))
    errors = []

    def record():
        try:
            amontons.record(path, sim, overwrite=True)
        except amontons.FileError as error:
            errors.append(str(error))

    thread = threading.Thread(target=record, daemon=True)
    thread.start()
    thread.join(LONGEST)
    assert not thread.is_alive()
    assert errors
    assert "no regular file" in errors[0]
