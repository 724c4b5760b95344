"""Sizes that nobody waits for are refused at once and by name; forged tables, matrices and states, too."""

import copy
import itertools
import json
import os
import pickle
import subprocess
import sys
import tracemalloc

import amontons
import h5py
import numpy as np
import pytest
import scipy.sparse as sp
from amontons import Simulation, cli, scenes
from typer.testing import CliRunner
from waiting import LONGEST, processor_time

AT_ONCE = 5.0
"""Seconds of the processor."""


def refused(arguments, message, cwd=None):
    """Of a command in a process of its own, which is killed when it does not end."""
    command = [sys.executable, "-m", "amontons", *map(str, arguments)]
    with processor_time() as spent:
        result = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, cwd=cwd)
    said = " ".join(result.stderr.split())
    assert result.returncode == 2, said
    assert message in said, said
    assert "Traceback" not in said
    assert spent.seconds < AT_ONCE + 5  # that of Python's start


# Breaks when a size that takes all memory or for ever is begun with, or refused without its name.
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("run stack --set boxes=1e11", "--set boxes=1e11"),
        ("run stack --set boxes=100000000000", "boxes = 100000000000; a scene has at most"),
        ("run wall --set rows=10000 --set columns=10000", "rows = 10000"),
        ("run hopper --set count=1000000001", "count = 1000000001"),
        ("run stack --duration 1e300", "duration = 1e+300"),
        ("run stack --duration 1e12", "duration = 1e+12"),
        ("export stack --step 99999999999999999999 -o x.npz", "step = 1e+20"),
        ("export stack --time 1e30 -o x.npz", "time = 1e+30"),
    ],
)
def test_sizes_of_runs(arguments, message, tmp_path):
    refused(arguments.split(), message, tmp_path)


# Breaks when a study is spread out before it is counted: ranges, products of ranges, seeds, values without
# end, tables within tables.
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('run = "arch"\n[grid]\nmu = {from = 0, to = 1, count = 1000000000}', "grid.mu.count = 1000000000"),
        (
            'run = "mine.py:run"\n[grid]\n'
            + "".join(f"{x} = {{from = 0, to = 1, count = 100}}\n" for x in "abcdef"),
            "makes 1e+12 runs (a 100 x b 100",
        ),
        ('run = "mine.py:drawn"\nseeds = 1000000000\n[grid]\nx = [1, 2]', "makes 2e+09 runs (2 points"),
        ('run = "arch"\nx = ' + "[" * 5000 + "]" * 5000, "within each other"),
        ('run = "arch"\n[grid]\nmu = ' + "{a = " * 5000 + "1" + "}" * 5000, "within each other"),
    ],
)
def test_sizes_of_studies(text, message, tmp_path):
    pytest.importorskip("pyarrow")
    (tmp_path / "s.toml").write_text(text)
    (tmp_path / "mine.py").write_text("def run(a, b, c, d, e, f): ...\ndef drawn(x, seed): ...\n")
    refused(["sweep", "s.toml"], message, tmp_path)


# Breaks when a grid in Python without an end is not refused, or an honest one is.
def test_grids_without_end():
    from amontons.studies.points import points

    with pytest.raises(amontons.InputError, match="mu has more values"):
        points({"mu": itertools.count()}, None, seeded=False)
    assert len(points({"a": range(100), "b": range(100)}, 3, seeded=True)) == 30_000


# Breaks when a scene's numbers that are no counts are taken for some.
def test_what_is_no_count():
    assert scenes.make("stack", boxes=2, size=3).bodies
    assert scenes.make("hopper", count=10, seed=123456789).bodies
    assert scenes.make("plates", count=2, ratio=10**7).bodies


def forged(table):
    """Tables that no study wrote, by name."""
    import pyarrow as pa

    rows, meta = table.num_rows, dict(table.schema.metadata)
    about = json.loads(meta[b"amontons"])

    def told(**changes):
        return table.replace_schema_metadata({b"amontons": json.dumps(about | changes).encode()})

    def column(name, values):
        return table.set_column(table.column_names.index(name), name, values)

    yield "no metadata", table.replace_schema_metadata({})
    yield "metadata is a list", table.replace_schema_metadata({b"amontons": b"[1]"})
    yield "metadata is a number", table.replace_schema_metadata({b"amontons": b"7"})
    yield "metadata is no text", table.replace_schema_metadata({b"amontons": b"\xff\xfe"})
    yield "metadata is deep", table.replace_schema_metadata({b"amontons": b"[" * 100_000})
    yield "no run", table.replace_schema_metadata({b"amontons": b'{"parameters": []}'})
    yield "parameters are none", told(parameters=3)
    yield "parameters are numbers", told(parameters=[1])
    yield "parameters are missing", told(parameters=[*about["parameters"], "gone"])
    yield "no key", table.drop_columns(["key"])
    yield "no status", table.drop_columns(["status"])
    yield "keys are numbers", column("key", pa.array(range(rows)))
    yield "keys are null", column("key", pa.array([None] * rows, pa.string()))
    yield "keys are equal", column("key", pa.array(["a"] * rows))
    yield "statuses are numbers", column("status", pa.array(range(rows)))
    yield "statuses are unknown", column("status", pa.array(["\x1b[2J"] * rows))
    yield "statuses are null", column("status", pa.array([None] * rows, pa.string()))
    yield "attempts are texts", column("attempts", pa.array(["x"] * rows))
    yield "wall is a list", column("wall", pa.array([[1.0]] * rows))
    yield "started is a number", column("started", pa.array([1.0] * rows))
    yield "started is beyond times", column("started", pa.array([2**62] * rows, pa.timestamp("us", "UTC")))
    yield "a parameter is a record", column(about["parameters"][0], pa.array([{"a": 1}] * rows))
    yield "a parameter is bytes", column(about["parameters"][0], pa.array([b"\xff"] * rows))


# Breaks when a table that no study wrote ends in anything but a FileError that names it, or is gone on with.
def test_forged_tables(tmp_path):
    pq = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "rows.parquet"
    grid = {"mu": [0.3, 0.5], "stones": [3], "duration": [0.01]}
    amontons.sweep("arch", grid, out=path, executor=0, progress=False)
    table = pq.read_table(path)
    data = path.read_bytes()
    kinds = dict(forged(table))
    for name, made in kinds.items():
        pq.write_table(made, path)
        with pytest.raises(amontons.FileError) as caught:
            amontons.sweep("arch", grid, out=path, executor=0, progress=False)
        assert str(caught.value).startswith(str(path)), name
    path.write_bytes(data)
    assert len(amontons.sweep("arch", grid, out=path, executor=0, progress=False)) == 2


def matrix(kind):
    """A of four rows whose pointers or indices are no longer what SciPy saw when it was made."""
    A = sp.csr_array(np.eye(4) + np.ones((4, 4)))
    A = {"csr": A, "csc": A.tocsc(), "bsr": sp.bsr_array(A.tobsr((2, 2)))}[kind]
    A.indptr, A.indices = A.indptr.copy(), A.indices.copy()
    return A


# Breaks when pointers or indices of a sparse matrix that lead out of its arrays are followed, or are refused
# by anything but an InputError.
@pytest.mark.parametrize("kind", ["csr", "csc", "bsr"])
def test_pointers_of_sparse_matrices(kind):
    def last(A):
        A.indptr[-1] = 10**9

    def first(A):
        A.indptr[0] = 1

    def down(A):
        A.indptr[1] = A.indptr[-1] + 1

    def negative(A):
        A.indptr[1] = -5

    def index(A):
        A.indices[0] = 10**9

    def below(A):
        A.indices[-1] = -1

    def short(A):
        A.indptr = A.indptr[:-1]

    def data(A):
        A.data = A.data[:-1]

    def reals(A):
        A.indices = A.indices.astype(float) + 0.5

    b, cones = -np.ones(4), [amontons.vi.NonNegative(4)]
    assert amontons.vi.Problem(matrix(kind), b, cones).solve().converged
    for damage in (last, first, down, negative, index, below, short, data, reals):
        A = matrix(kind)
        damage(A)
        with pytest.raises(amontons.InputError, match=r"A\.ind(ptr|ices)"):
            amontons.vi.Problem(A, b, cones)


@pytest.fixture
def saved(tmp_path):
    sim = Simulation(scenes.make("stack", boxes=2))
    sim.run(0.05)
    sim.save(tmp_path / "a.h5")
    return tmp_path / "a.h5"


def edit(path, name, value):
    with h5py.File(path, "r+") as file:
        del file[name]
        file[name] = value


# Breaks when a version that never was, or a part of a step, is taken for what a simulation has.
@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("version", np.array([0], np.int32), "version 0 "),
        ("version", np.array([-1], np.int32), "version -1 "),
        ("state/steps", np.float64(2.5), "whole number"),
    ],
)
def test_versions_and_counts_of_states(saved, name, value, message):
    edit(saved, name, value)
    with pytest.raises(amontons.FileError, match=message):
        Simulation.load(saved)


# Breaks when versions that never were are taken by readers of recordings.
def test_versions_of_recordings(tmp_path):
    with amontons.record(tmp_path / "r.h5", Simulation(scenes.make("stack", boxes=1))):
        pass
    edit(tmp_path / "r.h5", "version", np.array([0], np.int32))
    with pytest.raises(amontons.FileError, match="version 0 "):
        amontons.read_recording(tmp_path / "r.h5")


# Breaks when the state of another model is gone on with because its arrays have the same shapes; or when a
# file of version 0.1.0, which has no checksum, is refused.
def test_state_of_another_model(saved, tmp_path):
    other = Simulation(scenes.make("stack", boxes=2, size=0.3))
    other.save(tmp_path / "b.h5")
    with h5py.File(tmp_path / "b.h5", "r+") as file, h5py.File(saved) as source:
        del file["state"]
        source.copy("state", file)
    with pytest.raises(amontons.FileError, match="is that of another model"):
        Simulation.load(tmp_path / "b.h5")
    with h5py.File(tmp_path / "b.h5", "r+") as file:
        del file["state/model_sha256"]
    assert Simulation.load(tmp_path / "b.h5").steps == 10


# Breaks when a state cannot be copied or pickled, when the copy is a view of the simulation, or differs.
def test_states_are_copied():
    sim = Simulation(scenes.make("four_bar"))
    sim.run(0.1)
    copies = [copy.copy(sim.state), copy.deepcopy(sim.state), pickle.loads(pickle.dumps(sim.state))]
    names = sim.state.__slots__
    before = {name: getattr(sim.state, name).copy() for name in names}
    sim.run(0.1)
    for state in copies:
        assert type(state) is type(sim.state)
        assert repr(state) == repr(sim.state)
        for name in names:
            assert np.array_equal(getattr(state, name), before[name]), name
        state.positions = 0.0
        with pytest.raises(amontons.InputError, match="follow from the poses"):
            state.joint_coordinates = 0.0
    assert not np.array_equal(sim.state.positions, before["positions"])
    assert np.abs(sim.state.positions).max() > 0
    sim.state.positions = before["positions"]  # copies of arrays go back as arrays
    twice = copy.deepcopy([sim.state, sim.state])
    assert twice[0] is twice[1]


# Breaks when a function of before_step makes a step of its own simulation, within which it is called: without
# an end, or with loads of another step. A copy may go ahead, and afterwards all goes on.
@pytest.mark.parametrize("how", [lambda sim: sim.step(), lambda sim: sim.run(0.01)])
def test_no_step_within_a_callback(how):
    sim = Simulation(scenes.make("stack", boxes=2))
    ahead = []

    def callback(owner):
        other = owner.copy()
        other.before_step.clear()
        ahead.append(other.step().time)
        how(owner)

    sim.before_step.append(callback)
    with pytest.raises(amontons.InputError, match="make no step of their own simulation"):
        sim.step()
    assert sim.steps == 0
    assert ahead == [sim.dt]
    sim.before_step[:] = [lambda owner: owner.before_step.clear() or owner.run(0.01)]
    with pytest.raises(amontons.InputError, match="make no step of their own simulation"):
        sim.step()
    sim.run(0.01)
    assert sim.steps == 2
    assert pickle.loads(pickle.dumps(sim)).step().time == pytest.approx(3 * sim.dt)


FULL = """
import os, resource, sys, amontons
from amontons import scenes
from amontons.io.recordings import growing
sim = amontons.Simulation(scenes.make('stack', boxes=2))
real = growing._create
def create(path, image, overwrite):
    handle = real(path, image, overwrite)
    resource.setrlimit(resource.RLIMIT_FSIZE, (os.stat(path).st_size, resource.RLIM_INFINITY))
    return handle
growing._create = create
try: amontons.record('a.h5', sim)
except amontons.FileError as error: print(error)
"""


# Breaks when the message of a disk that is full before the first frame says that something was recorded, or a
# file without a frame is left.
def test_full_disk_before_the_first_frame(tmp_path):
    said = subprocess.run([sys.executable, "-c", FULL], cwd=tmp_path, capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    assert said.stdout.startswith("a.h5: cannot be begun (File too large)")
    assert "nothing was recorded" in said.stdout
    assert os.listdir(tmp_path) == []


# Breaks when what refuses a study takes the memory that the study would.
def test_refusals_are_small(tmp_path):
    pytest.importorskip("pyarrow")
    (tmp_path / "s.toml").write_text('run = "arch"\n[grid]\nmu = {from = 0, to = 1, count = 1000000000}')
    tracemalloc.start()
    result = CliRunner().invoke(cli.app, ["sweep", str(tmp_path / "s.toml")])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert result.exit_code == 2
    assert peak < 100e6
