"""What Windows and macOS do otherwise, played here: `amontons.io.system` has what differs.

The branches of Windows run with stand-ins for its modules; tools/wheels_test.py runs the package itself under
wine and qemu.
"""

import os
import subprocess
import sys
from pathlib import Path, PureWindowsPath

import amontons
import amontons.io.files as files
import amontons.io.recordings.growing as growing
import pytest
from amontons import ModelBuilder, shapes
from amontons.io import system
from waiting import LONGEST


@pytest.fixture
def windows(monkeypatch):
    """A system that neither replaces nor removes open files, with locks of another kind."""
    fcntl = pytest.importorskip("fcntl")

    def lock(handle: int) -> bool:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True

    def refuse_open(name: str):
        real = getattr(os, name)

        def call(path, *rest, **options):
            for there in (path, *(r for r in rest if isinstance(r, (str, Path)))):
                assert not _is_held_open(there), f"{name}: {there} is open, which Windows does not allow"
            return real(path, *rest, **options)

        return call

    monkeypatch.setattr(system, "WINDOWS", True)
    monkeypatch.setattr(system, "_lock_windows", lock)
    for name in ("replace", "unlink", "remove"):
        monkeypatch.setattr(os, name, refuse_open(name))
    monkeypatch.setattr(os, "rename", _rename_as_windows)
    for name in ("fchown", "fchmod", "O_TMPFILE", "posix_fallocate", "memfd_create"):
        monkeypatch.delattr(os, name, raising=False)


def _is_held_open(path) -> bool:
    """Whether this process has the file open."""
    path = os.path.realpath(path)
    handles = Path("/proc/self/fd")
    return handles.is_dir() and any(os.path.realpath(handle) == path for handle in handles.iterdir())


def _rename_as_windows(source, target):
    if os.path.lexists(target):
        raise FileExistsError(17, "File exists")
    os.link(source, target)
    os.unlink(source)


# Fails if a file is written as text (every \n would become \r\n), by names that Windows lacks, or if what is
# there is replaced although it must be new.
def test_whole_files_on_windows(windows, tmp_path):
    path = tmp_path / "münze\u2028.bin"
    files.write_whole({path: b"one\n"}, new=True)
    assert path.read_bytes() == b"one\n"
    with pytest.raises(amontons.FileError, match="exists"):
        files.write_whole({path: b"two"}, new=True)
    files.write_whole({path: b"two"})
    assert path.read_bytes() == b"two"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


# Fails if a file that a scanner has open for a moment ends a run, or if there is no end to the waiting.
def test_a_busy_file_is_waited_for_on_windows(windows, tmp_path, monkeypatch):
    source, target = tmp_path / "a", tmp_path / "b"
    source.write_bytes(b"new")
    target.write_bytes(b"old")
    real, tries = os.replace, []

    def busy(*paths):
        tries.append(paths)
        if len(tries) < 4 or real is busy:
            raise PermissionError(13, "Access is denied")
        real(*paths)

    monkeypatch.setattr(os, "replace", busy)
    system.replace(source, target)
    assert target.read_bytes() == b"new"
    assert len(tries) == 4
    monkeypatch.setattr(system, "PATIENCE", 0.05)
    tries.clear()
    real = busy  # which is never done
    with pytest.raises(PermissionError):
        system.replace(target, source)


# Fails if two processes write one file, or if the lock is removed while it is open.
def test_locks_on_windows(windows, tmp_path):
    path = tmp_path / "rows.csv"
    busy = pytest.raises(amontons.FileError, match="is busy")
    with files.locked(path, "is busy"), busy, files.locked(path, "is busy"):
        pass
    assert not list(tmp_path.iterdir())
    with files.locked(path, "is busy"):
        pass


# Fails if a recording is replaced while its own lock has it open, or is recorded twice at once.
def test_recordings_on_windows(windows, tmp_path):
    path = tmp_path / "r.h5"
    for _ in range(2):
        sim = amontons.Simulation(amontons.scenes.get("stack").make(), dt=0.005)
        with amontons.record(path, sim, overwrite=True) as recorder:
            recorder.add(sim.step())
            with pytest.raises(amontons.FileError, match="is being recorded"):
                amontons.record(path, sim, overwrite=True)
    with amontons.read_recording(path) as recording:
        assert len(recording) == 2


# Fails if flags that only Linux and macOS have are asked of a system without them.
def test_flags_exist_everywhere():
    assert getattr(os, "O_BINARY", 0) == system.BINARY
    assert growing.system is files.system is system
    source = "".join(p.read_text(encoding="utf-8") for p in Path(amontons.__file__).parent.rglob("*.py"))
    for name in ("os.O_NOFOLLOW", "os.O_NONBLOCK", "os.O_CLOEXEC", "os.fork", "signal.SIGKILL", "os.killpg"):
        assert name not in source, f"{name} is not on every system: see io/system.py"


# Fails if a text of the package is read in the encoding of the system: Windows takes one of 256 letters.
def test_texts_are_utf8_whatever_the_system_says():
    code = "import amontons, amontons.cli, amontons.studies, amontons.viewer.page"
    run = subprocess.run(
        [sys.executable, "-X", "warn_default_encoding", "-W", "error::EncodingWarning:amontons", "-c", code],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr


# Fails if a letter that a console lacks ends the command, as cp1252 does with the names of a scene.
@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
def test_consoles_without_the_letters(tmp_path, encoding):
    model = tmp_path / "м.json"
    built = ModelBuilder()
    built.add_floor()
    built.add_body("тело", shape=shapes.Sphere(0.1), mass=1.0)
    amontons.write_model(built.build(), model)
    run = subprocess.run(
        [sys.executable, "-m", "amontons", "run", model, "--duration", "0.01"],
        capture_output=True, check=False, env={**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"},
    )  # fmt: skip
    assert run.returncode == 0, run.stderr


# Fails if a child of a study outlives the process that was killed.
def test_a_worker_ends_with_its_study():
    code = "import sys; from amontons.io import system; system.end_with(int(sys.argv[1])); print('ended')"
    starts_it = (
        "import os, subprocess, sys; subprocess.Popen([sys.executable, '-c', sys.argv[1], str(os.getpid())])"
    )
    run = subprocess.run(
        [sys.executable, "-c", starts_it, code], capture_output=True, text=True, check=False, timeout=LONGEST
    )
    assert run.stdout.strip() == "ended", run.stderr


# Fails if a mesh is not found because the file that names it was written on Windows, or if text with the line
# ends of Windows is read otherwise.
def test_files_written_on_windows(tmp_path):
    pytest.importorskip("mujoco")
    (tmp_path / "parts").mkdir()
    corner = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    (tmp_path / "parts" / "corner.obj").write_bytes(corner.replace("\n", "\r\n").encode())
    name = str(PureWindowsPath("parts") / "corner.obj")
    text = f"""<mujoco>
  <asset><mesh name="m" file="{name}"/></asset>
  <worldbody><body><freejoint/><geom type="mesh" mesh="m"/></body></worldbody>
</mujoco>
"""
    (tmp_path / "m.xml").write_bytes(text.replace("\n", "\r\n").encode())
    model = amontons.load_model(tmp_path / "m.xml")
    assert model.total_mass == pytest.approx(1000 / 6)
    built = tmp_path / "m.json"
    amontons.write_model(model, built)
    built.write_bytes(built.read_bytes().replace(b"\n", b"\r\n"))
    assert amontons.load_model(built).total_mass == model.total_mass


# Fails if a study starts its workers by fork, which Windows and threads forbid.
def test_studies_do_not_fork():
    pytest.importorskip("loky")
    from amontons.studies.executors import _nothing, _process

    def forked(*_):
        raise AssertionError("a worker was forked")

    pool = _process()
    try:
        pool.submit(_nothing).result(timeout=LONGEST)
        assert pool._context.get_start_method() != "fork"
    finally:
        pool.shutdown(kill_workers=True)
