"""Studies on one core and two: runs per second of one study in processes and on a local Dask cluster.

    python benchmarks/studies.py [--quick] [--out FOLDER]

The study of examples/arch_friction.py, in smaller steps. Writes studies.csv. The rows of all executors must
be the same but for times. A study starts its own processes and ends them, which is part of its time; a Dask
cluster is there before and has met the function.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from functools import partial
from time import perf_counter
from typing import Any

import amontons
import numpy as np
from amontons import Simulation, scenes
from common import arguments, with_folders, write_csv

TIMES = ["wall", "started", "attempts"]


def run(mu: float, stones: int) -> dict[str, float]:
    """Half a second of an arch; how far its stones went (m)."""
    simulation = Simulation(scenes.arch(mu=mu, stones=stones), dt=5e-3, tolerance=1e-5)
    start = simulation.state.positions.copy()
    simulation.run(0.5)
    return {"moved": float(np.linalg.norm(simulation.state.positions - start, axis=1).max())}


def executors(stack: ExitStack) -> Iterator[tuple[str, int, Any]]:
    """Name, processes and what sweep takes; closed by the stack."""
    counts = [n for n in (1, 2, 4, 8, 16, 32, 64) if n <= (os.cpu_count() or 1)]
    yield "in this process", 0, 0
    for count in counts:
        yield "processes", count, count
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        print("studies: no Dask cluster, distributed is not installed")
        return
    stack.enter_context(
        dask.config.set({"temporary-directory": stack.enter_context(tempfile.TemporaryDirectory())})
    )
    for count in counts:
        cluster = LocalCluster(n_workers=count, threads_per_worker=1, processes=True, dashboard_address=":0")
        yield "Dask", count, stack.enter_context(closing(Client(stack.enter_context(closing(cluster)))))


def timed(study: Callable[[], Any]) -> tuple[float, Any]:
    start = perf_counter()
    table = study()
    return perf_counter() - start, table.drop_columns(TIMES)


def main() -> None:
    options = with_folders(arguments(__doc__).parse_args())
    grid = {"stones": [7, 11, 15], "mu": np.linspace(0.26, 0.35, 5 if options.quick else 40).round(4)}
    rows: list[dict[str, Any]] = []
    with ExitStack() as stack:
        expected = None
        for name, processes, executor in executors(stack):
            study = partial(amontons.sweep, run, grid, executor=executor)
            if name == "Dask":
                timed(study)
            wall, table = timed(study)
            expected = expected or table
            if not table.equals(expected):
                raise SystemExit(f"studies: {name}, {processes}: other rows than in this process")
            row = {"executor": name, "processes": processes, "runs": table.num_rows, "wall": wall}
            rows.append(row | {"speed": rows[0]["wall"] / wall if rows else 1.0})
            speed = f"{table.num_rows / wall:.1f} runs/s, {rows[-1]['speed']:.2f} of the first"
            print(f"studies: {name}, {processes or 1}: {speed}")
    write_csv(options.out / "studies.csv", rows)


if __name__ == "__main__":
    main()
