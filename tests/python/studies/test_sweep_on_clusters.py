"""Studies on a local Dask cluster: the same rows, workers that die, a study that is killed."""

import io
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import amontons
import pytest
import studied
from waiting import LONGEST, until

pq = pytest.importorskip("pyarrow.parquet")
distributed = pytest.importorskip("distributed")
SUPPORT = Path(studied.__file__).parent


@pytest.fixture(scope="module", params=[1, 2])
def client(request, tmp_path_factory):
    """Of a cluster of one and of two processes."""
    import dask

    folder = str(tmp_path_factory.mktemp("dask"))
    settings = {"distributed.scheduler.allowed-failures": 0, "temporary-directory": folder}
    with (
        dask.config.set(settings),
        distributed.LocalCluster(
            n_workers=request.param, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as found,
    ):
        found.run(sys.path.insert, 0, str(SUPPORT))
        yield found


# Breaks when rows depend on who carries the runs out, or Dask takes equal calls for one.
def test_same_rows(client):
    grid = {"mu": [0.5, 0.25, 0.125]}
    drop = ["wall", "started", "attempts"]
    expected = amontons.sweep(studied.slide, grid, executor=0, seeds=2).drop_columns(drop)
    assert amontons.sweep(studied.slide, grid, executor=client, seeds=2).drop_columns(drop).equals(expected)


def kill(client, folder, ended):
    """Kills the processes whose numbers come into the folder. Dask starts a worker again only if its nanny
    knew before that it runs."""
    while not ended.wait(0.02):
        for path in folder.glob("kill-*"):
            states = client.run(lambda dask_worker: dask_worker.process.status.name, nanny=True)
            if set(states.values()) == {"running"}:
                os.kill(int(path.name.removeprefix("kill-")), signal.SIGKILL)
                path.unlink()


# Breaks when a worker of the cluster that is killed takes the study with it, or is tried for ever.
def test_killed_worker(client, tmp_path):
    grid = {"folder": [str(tmp_path)], "k": [0, 1, 2, 99, 3], "killed": [True]}
    ended = threading.Event()
    killer = threading.Thread(target=kill, args=(client, tmp_path, ended))
    killer.start()
    try:
        table = amontons.sweep(studied.dies_first, grid, executor=client, retries=2)
    finally:
        ended.set()
        killer.join()
    rows = {row["k"]: row for row in table.to_pylist()}
    assert [rows[k]["square"] for k in (0, 1, 2, 3)] == [0, 1, 4, 9]
    assert rows[99]["status"] == "died"
    assert "KilledWorker" in rows[99]["error"]
    assert rows[99]["attempts"] == 3


# Breaks when a run on a cluster, which nobody can kill, is not ended between two steps.
def test_timeout(client):
    grid = {"k": [1, 0], "stepping": [True]}
    rows = amontons.sweep(studied.forever, grid, executor=client, timeout=0.2).to_pylist()
    assert [row["status"] for row in rows] == ["timeout", "done"]


STUDY = """
import amontons, studied
from distributed import Client
with Client({address!r}) as client:
    amontons.sweep(studied.held, {{"folder": [{folder!r}], "k": range(12)}}, out={out!r}, executor=client)
"""


def rows_of(out):
    """Read at one moment: pyarrow opens a file twice, and it may be another one by then."""
    return pq.read_table(io.BytesIO(out.read_bytes()))


# Breaks when a study on a cluster that was killed in the middle does not go on where it was.
def test_killed_study_goes_on(client, tmp_path):
    out = tmp_path / "s.parquet"
    source = STUDY.format(address=client.scheduler.address, folder=str(tmp_path), out=str(out))
    process = subprocess.Popen([sys.executable, "-c", source], cwd=SUPPORT, stderr=subprocess.DEVNULL)
    while not out.exists() or rows_of(out).num_rows < 3:
        time.sleep(0.02)
        assert process.poll() is None
    process.send_signal(signal.SIGKILL)
    process.wait()
    before = {row["k"] for row in rows_of(out).to_pylist()}
    assert 3 <= len(before) < 12
    (tmp_path / "go").touch()
    grid = {"folder": [str(tmp_path)], "k": range(12)}
    table = amontons.sweep(studied.held, grid, out=out, executor=client)
    assert table["square"].to_pylist() == [k * k for k in range(12)]
    for k in before:
        assert (tmp_path / str(k)).read_text() == "called\n"


RUNS = 12


def grid_of(folder):
    return {"folder": [str(folder)], "k": range(RUNS)}


def when_held(out, act):
    """Calls `act` in a thread once rows are on file and the first run that lasts has begun; the thread."""

    def watch():
        if until((out.parent / str(studied.HELD)).exists) and until(out.exists):
            act()

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    return thread


def require_kept(out, executor):
    """A study that lost its executor has some rows, all done; it goes on with another, and repeats none."""
    before = rows_of(out).to_pylist()
    assert 1 <= len(before) < RUNS
    assert all(row["status"] == "done" for row in before)
    (out.parent / "go").touch()
    table = amontons.sweep(studied.held, grid_of(out.parent), out=out, executor=executor, patience=LONGEST)
    assert table["square"].to_pylist() == [k * k for k in range(RUNS)]
    assert all((out.parent / str(row["k"])).read_text() == "called\n" for row in before)


# Breaks when a study waits for ever for workers that are gone, loses what was done, or cannot go on; or when
# the bar does not say that none is alive.
def test_workers_are_gone(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("FORCE_COLOR", "1")  # a terminal for Rich, which can move its cursor
    monkeypatch.setenv("TERM", "xterm")
    out = tmp_path / "s.parquet"
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):

        def leave():
            cluster.scale(0)
            client.retire_workers()

        leaving = when_held(out, leave)
        with pytest.raises(amontons.InputError, match="no worker of the cluster is alive for 3 s"):
            amontons.sweep(studied.held, grid_of(tmp_path), out=out, executor=client, patience=3)
        leaving.join()
        assert "0 workers alive" in capsys.readouterr().err
        cluster.scale(1)
        client.wait_for_workers(1)
        client.run(sys.path.insert, 0, str(SUPPORT))
        require_kept(out, client)


# Breaks when a client whose scheduler is killed keeps the study waiting, or runs that it lost become rows.
def test_scheduler_is_gone(tmp_path):
    out = tmp_path / "s.parquet"
    with (
        subprocess.Popen(
            [sys.executable, "-c", SCHEDULER],
            cwd=SUPPORT,
            stdout=subprocess.PIPE,
            stdin=subprocess.PIPE,
            text=True,
        ) as process,
        distributed.Client(process.stdout.readline().strip(), timeout=LONGEST) as client,
    ):
        when_held(out, process.kill)
        with pytest.raises(amontons.InputError, match="executor: (Client|no worker).* call again"):
            amontons.sweep(studied.held, grid_of(tmp_path), out=out, executor=client, retries=0, patience=3)
    require_kept(out, 1)


SCHEDULER = """
import distributed, sys
with distributed.LocalCluster(
    n_workers=1, threads_per_worker=1, processes=False, protocol="tcp://", dashboard_address=None
) as cluster:
    print(cluster.scheduler_address, flush=True)
    sys.stdin.read()
"""


# Breaks when an executor of loky whose workers are killed keeps a study waiting, or it cannot go on.
def test_workers_of_loky_are_gone(tmp_path):
    loky = pytest.importorskip("loky")
    out = tmp_path / "s.parquet"
    pool = loky.ProcessPoolExecutor(max_workers=2)

    def end():
        for number in list(pool._processes):
            os.kill(number, signal.SIGKILL)

    when_held(out, end)
    with pytest.raises(amontons.InputError, match="executor: ProcessPoolExecutor takes no work"):
        amontons.sweep(studied.held, grid_of(tmp_path), out=out, executor=pool, patience=3)
    pool.shutdown(kill_workers=True)
    require_kept(out, 1)
