"""`sweep`: rows, keys and seeds, what goes wrong in a run, and where it is carried out."""

import concurrent.futures
import contextlib
import functools
import io
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import amontons
import numpy as np
import pytest
import studied
from waiting import LONGEST, until

pq = pytest.importorskip("pyarrow.parquet")
pytest.importorskip("loky")
SUPPORT = Path(studied.__file__).parent


def stable(table):
    """The columns that do not depend on when, where and how fast."""
    return table.drop_columns(["wall", "started", "attempts"])


# Breaks when a row loses a parameter, a result or what every study tells, or rows come in another order than
# that of the grid; against the closed form of each run.
def test_rows(tmp_path):
    out = tmp_path / "slide.parquet"
    table = amontons.sweep(
        studied.slide, {"mu": [0.5, 0.25], "speed": np.array([1.0, 2.0, 3.0])}, out=out, executor=2
    )
    expected = [(mu, v, v * v / (2 * 9.81 * mu)) for mu in (0.5, 0.25) for v in (1.0, 2.0, 3.0)]
    rows = table.to_pylist()
    assert [(r["mu"], r["speed"], r["way"]) for r in rows] == expected
    for row in rows:
        assert row["status"] == "done"
        assert row["error"] is None
        assert (row["steps"], row["missed"], row["attempts"]) == (2, 0, 1)
        assert row["worst_residual"] <= 1e-6
        assert row["wall"] > 0
        assert row["amontons"] == amontons.__version__
        assert row["numpy"] == np.__version__
        assert row["python"].startswith("3.")
        assert row["host"]
        assert row["seed"] % 1000 == row["seeded"]
    assert pq.read_table(out).equals(table)
    assert list(tmp_path.iterdir()) == [out]  # neither lock nor temporary file


# Breaks when a seed or a key depends on the order or form of the grid, on the type of an equal number, or
# changes from one version to the next: studies on file could no longer be continued.
def test_seeds_follow_from_the_parameters():
    def seeds(grid, **options):
        table = amontons.sweep(studied.slide, grid, executor=0, **options)
        return {(r["mu"], r["speed"], r["repetition"] if options else 0): (r["seed"], r["key"])
                for r in table.to_pylist()}  # fmt: skip

    one = seeds({"mu": [0.5, 1], "speed": [1.0, 2.0]})
    assert one == seeds({"speed": [2, 1], "mu": np.array([1.0, 0.5])})
    assert one == seeds([{"speed": s, "mu": m} for m in (1, 0.5) for s in (1, 2)])
    assert len({seed for seed, _ in one.values()}) == 4
    # SHA-256 of {"parameters":{"mu":1,"speed":2},"repetition":null,"seed":null}
    import hashlib

    digest = hashlib.sha256(b'{"parameters":{"mu":1,"speed":2},"repetition":null,"seed":null}').digest()
    assert one[1, 2, 0] == (int.from_bytes(digest[8:16], "big") // 2, digest[:8].hex())
    repeated = seeds({"mu": [0.5], "speed": [1.0]}, seeds=3)
    assert len({seed for seed, _ in repeated.values()}) == 3
    assert seeds({"mu": [0.5], "speed": [1.0]}, seeds=2).items() <= repeated.items()


# Breaks when seeds that are given are changed.
def test_given_seeds():
    table = amontons.sweep(studied.slide, {"mu": [0.5]}, seeds=[7, 1], executor=0)
    assert table["seeded"].to_pylist() == table["seed"].to_pylist() == [7, 1]


# Breaks when results depend on who carries the runs out.
@pytest.mark.parametrize("workers", [1, 2, "threads", "pool"])
def test_executors_agree(workers):
    grid = {"mu": [0.5, 0.25, 0.125, 0.1]}
    expected = stable(amontons.sweep(studied.slide, grid, executor=0))
    with contextlib.ExitStack() as stack:
        if workers == "threads":
            workers = stack.enter_context(concurrent.futures.ThreadPoolExecutor(3))
        elif workers == "pool":
            import multiprocessing

            context = multiprocessing.get_context("spawn")
            workers = stack.enter_context(concurrent.futures.ProcessPoolExecutor(1, context))
        assert stable(amontons.sweep(studied.slide, grid, executor=workers)).equals(expected)


# Breaks when one run that fails ends the study, or its row does not say why. A result of another kind than in
# the other rows must not keep the file from being written.
def test_trouble_is_a_row(tmp_path):
    out = tmp_path / "t.parquet"
    table = amontons.sweep(studied.troubled, {"k": range(7)}, out=out, executor=0)
    rows = pq.read_table(out).to_pylist()
    assert [row["status"] for row in rows] == ["done", *["failed"] * 5, "done"]
    assert rows[1]["error"] == "ValueError: no such thing"
    assert "in troubled" in rows[1]["traceback"]
    assert "task.py" not in rows[1]["traceback"]
    for k, part in {
        2: "returned a int",
        3: "result 'object' is a object",
        4: "'status'",
        5: "is a text",
    }.items():
        assert part in rows[k]["error"], rows[k]
    assert [row["value"] for row in rows] == [0, None, None, None, None, None, 6]
    assert table.num_rows == 7


# Breaks when failed runs are done again unasked, or not when asked.
def test_redo(tmp_path):
    def run(k):
        return studied.marked(tmp_path, k) if k else 1 / 0

    out = tmp_path / "t.parquet"
    for redo, calls in (((), 1), ((), 1), (("done",), 2), (("failed",), 2)):
        amontons.sweep(run, {"k": [0, 1]}, out=out, executor=0, redo=redo)
        assert (tmp_path / "1").read_text().count("called") == calls


# Breaks when a grid that has grown runs again what is on file, or a smaller one loses rows of the file.
def test_grid_grows(tmp_path):
    out = tmp_path / "t.parquet"
    run = functools.partial(studied.marked, folder=str(tmp_path))
    amontons.sweep(run, {"k": [2, 1]}, out=out, executor=0)
    grown = amontons.sweep(run, {"k": [1, 3, 2]}, out=out, executor=0)
    assert grown["square"].to_pylist() == [1, 9, 4]
    assert amontons.sweep(run, {"k": [3]}, out=out, executor=0)["square"].to_pylist() == [9]
    assert pq.read_table(out).num_rows == 3
    assert all((tmp_path / f"{k}").read_text() == "called\n" for k in (1, 2, 3))


# Breaks when the death of a worker ends the study, costs a neighbour an attempt, or is tried for ever.
def test_killed_worker(tmp_path, caplog):
    table = amontons.sweep(
        studied.dies_first, {"folder": [str(tmp_path)], "k": [0, 1, 2, 99, 3]}, executor=2, retries=1
    )
    rows = {row["k"]: row for row in table.to_pylist()}
    assert [rows[k]["square"] for k in (0, 1, 2, 3)] == [0, 1, 4, 9]
    assert {k: row["attempts"] for k, row in rows.items()} == {0: 1, 1: 2, 2: 1, 99: 2, 3: 1}
    assert rows[99]["status"] == "died"
    assert "SIGKILL" in rows[99]["error"]
    assert any("died, attempt 1" in message for message in caplog.messages)


# Breaks when a run that takes too long holds up the study: one that comes to steps ends between two of them,
# one that never does is killed with its process.
@pytest.mark.parametrize("stepping", [True, False])
def test_timeout(stepping):
    table = amontons.sweep(studied.forever, {"k": [1, 0], "stepping": [stepping]}, executor=1, timeout=2)
    rows = table.to_pylist()
    assert [row["status"] for row in rows] == ["timeout", "done"]
    assert rows[0]["error"] == "not done after 2 s"
    assert rows[0]["wall"] >= 2
    assert (rows[0]["steps"] is not None) == stepping


STUDY = """
import signal
import amontons, studied
signal.signal(signal.SIGINT, signal.default_int_handler)  # what a shell runs in the background ignores it
amontons.sweep(studied.held, {{"folder": [{folder!r}], "k": range(12)}}, out={out!r}, executor=2)
"""


# Breaks when a study that was stopped, by Ctrl-C or by its death, does runs again that were on file, leaves a
# file that cannot be read, or leaves workers behind.
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL, signal.SIGTERM])
def test_stopped_study_goes_on(tmp_path, number):
    out = tmp_path / "s.parquet"
    source = STUDY.format(folder=str(tmp_path), out=str(out))
    process = subprocess.Popen(
        [sys.executable, "-c", source], cwd=SUPPORT, stderr=subprocess.PIPE, start_new_session=True
    )
    # From one copy: a path is opened twice, and between the file is replaced.
    while not out.exists() or pq.read_table(io.BytesIO(out.read_bytes())).num_rows < 4:
        time.sleep(0.02)
        assert process.poll() is None
    process.send_signal(number)
    process.communicate(timeout=LONGEST)
    assert process.returncode != 0
    before = {row["k"] for row in pq.read_table(out).to_pylist()}
    assert 4 <= len(before) < 12
    # The session that the study began: its workers are in it.
    assert until(lambda: not _in_group(process.pid)), "workers go on"
    (tmp_path / "go").touch()
    table = amontons.sweep(studied.held, {"folder": [str(tmp_path)], "k": range(12)}, out=out, executor=0)
    assert table["square"].to_pylist() == [k * k for k in range(12)]
    for k in before:
        assert (tmp_path / str(k)).read_text() == "called\n"
    assert sorted(p.name for p in tmp_path.iterdir() if p.name.startswith(".")) == []


def _in_group(group):
    """Processes that are alive in this process group."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            fields = stat.read_text().rpartition(")")[2].split()
            if int(fields[2]) == group and fields[0] != "Z":
                found.append(int(stat.parent.name))
    return found


# Breaks when two studies write to one file and lose each other's rows.
def test_two_studies_on_one_file(tmp_path):
    from amontons.studies.rows import alone

    out = tmp_path / "s.parquet"
    with alone(out), pytest.raises(amontons.FileError, match="another study is writing"):
        amontons.sweep(studied.slide, {"mu": [1]}, out=out, executor=0)
    assert not (tmp_path / ".s.parquet.lock").exists()


# Breaks when a file that is no study, or another one, is overwritten.
def test_other_files_stay(tmp_path):
    out = tmp_path / "s.parquet"
    for content in (b"something", None):
        if content is None:
            import pyarrow

            pq.write_table(pyarrow.table({"x": [1]}), out)
        else:
            out.write_bytes(content)
        before = out.read_bytes()
        with pytest.raises(amontons.FileError, match="give another out"):
            amontons.sweep(studied.slide, {"mu": [1]}, out=out, executor=0)
        assert out.read_bytes() == before
    out.unlink()
    amontons.sweep(studied.slide, {"mu": [1]}, out=out, executor=0)
    with pytest.raises(amontons.InputError, match="of the parameters .*'mu'.*, not .*'speed'"):
        amontons.sweep(studied.slide, {"mu": [1], "speed": [2]}, out=out, executor=0)
    with pytest.raises(amontons.InputError, match="of the run slide, not"):
        amontons.sweep(lambda mu: None, {"mu": [1]}, out=out, executor=0)


# Breaks when bad input is found out after hours of runs, or by a message that does not say what to do.
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"run": 5}, "run is a int; give a function"),
        ({"run": "archh"}, r"no scene or model file 'archh' \(did you mean 'arch'\?\)"),
        ({"run": studied.troubled}, "troubled takes no argument 'mu'; its arguments: k"),
        ({"grid": {"speed": [1]}}, "slide needs the argument 'mu'; the grid lacks it"),
        ({"grid": {"mu": 1}}, r"grid\['mu'\] is 1; give a list of values"),
        ({"grid": {"mu": "abc"}}, r"grid\['mu'\] is 'abc'"),
        ({"grid": {"mu": []}}, "is empty"),
        ({"grid": {"mu": [1, "a"]}}, "mu is text in one run, number in another"),
        ({"grid": {"mu": [object()]}}, "is a object; a table holds numbers"),
        ({"grid": {"mu": [float("nan")]}}, "mu is NaN"),
        ({"grid": {"mu": [2**70]}}, "must fit in 64 bits"),
        ({"grid": {"mu": [1, 1.0]}}, "mu = 1.0 stands in it twice"),
        ({"grid": {"mu": [1], "seed": [1]}}, "seeds of a study are given apart"),
        ({"grid": [{"mu": 1}, {"speed": 1}]}, r"grid\[1\] and grid\[0\] do not both have"),
        ({"grid": [{"mu": 1}, 5]}, "grid must be a mapping"),
        ({"out": "rows.csv"}, "ends in .parquet"),
        ({"out": "nowhere/rows.parquet"}, "the folder nowhere does not exist"),
        ({"retries": -1}, "retries = -1"),
        ({"timeout": 0}, "timeout = 0"),
        ({"seeds": 0}, "seeds = 0"),
        ({"redo": ["broken"]}, "unknown status 'broken'"),
        ({"executor": "two"}, "executor is a str; give a number of processes"),
        ({"executor": -1}, "executor = -1"),
    ],
)
def test_bad_input(tmp_path, monkeypatch, change, message):
    monkeypatch.chdir(tmp_path)
    given = {"run": studied.slide, "grid": {"mu": [1.0]}, "executor": 0} | change
    with pytest.raises(amontons.InputError, match=message):
        amontons.sweep(given.pop("run"), given.pop("grid"), **given)
    assert list(tmp_path.iterdir()) == []


# Breaks when a run that cannot be sent away, or an executor that was shut down, gives a traceback of theirs.
def test_executor_that_cannot(tmp_path):
    lock = __import__("threading").Lock()
    with pytest.raises(amontons.InputError, match="cannot be sent to another process"):
        amontons.sweep(lambda k: lock.locked(), {"k": [1]}, executor=1)
    pool = concurrent.futures.ThreadPoolExecutor(1)
    pool.shutdown()
    with pytest.raises(amontons.InputError, match="takes no work"):
        amontons.sweep(studied.troubled, {"k": [1]}, executor=pool)


# Breaks when a missing optional part is an ImportError without a remedy.
def test_missing_parts(monkeypatch):
    for module in ("pyarrow", "loky"):
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, module, None)
            with pytest.raises(
                amontons.InputError, match=rf"need {module}.*pip install \"amontons\[studies\]\""
            ):
                amontons.sweep(studied.troubled, {"k": [1]}, executor=1)


# Breaks when a scene of the grid is not the scene of the library, against the same by hand.
def test_scene_by_name():
    from amontons import scenes

    table = amontons.sweep("arch", {"mu": [0.2], "stones": [5], "duration": [0.3], "dt": [1e-2]}, executor=0)
    (row,) = table.to_pylist()
    simulation = amontons.Simulation(scenes.arch(mu=0.2, stones=5), dt=1e-2)
    start = simulation.state.positions.copy()
    report = simulation.run(0.3)
    assert row["moved"] == np.linalg.norm(simulation.state.positions - start, axis=1).max() > 0.01
    assert row["energy"] == report.energy
    assert row["steps"] == 30
    assert row["time"] == simulation.time


# Breaks when steps that miss their tolerance are not counted, or warn from every worker.
@pytest.mark.filterwarnings("error")
def test_missed_steps_are_counted():
    def run(k):
        from amontons import scenes

        simulation = amontons.Simulation(
            scenes.stack(), dt=5e-3, method="jacobi", max_iterations=1, tolerance=1e-12
        )
        simulation.run(0.02)

    (row,) = amontons.sweep(run, {"k": [1]}, executor=0).to_pylist()
    assert row["steps"] == row["missed"] == 4
    assert row["worst_residual"] > 1e-12
    assert json.dumps(row["status"]) == '"done"'
