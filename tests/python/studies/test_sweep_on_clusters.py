"""Studies on a local Dask cluster: the same rows, workers that die, a study that is killed."""

import io
import signal
import subprocess
import sys
import time
from pathlib import Path

import amontons
import pytest
import studied

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


# Breaks when a worker of the cluster that is killed takes the study with it, or is tried for ever.
def test_killed_worker(client, tmp_path):
    table = amontons.sweep(
        studied.dies_first, {"folder": [str(tmp_path)], "k": [0, 1, 2, 99, 3]}, executor=client, retries=2
    )
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
    amontons.sweep(studied.marked, {{"folder": [{folder!r}], "k": range(12), "seconds": [0.3]}},
                   out={out!r}, executor=client)
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
    grid = {"folder": [str(tmp_path)], "k": range(12), "seconds": [0.3]}
    table = amontons.sweep(studied.marked, grid, out=out, executor=client)
    assert table["square"].to_pylist() == [k * k for k in range(12)]
    for k in before:
        assert (tmp_path / str(k)).read_text() == "called\n"
