"""Many worlds at once: steps per second of rollout by the number of threads, beside a loop in Python.

    python benchmarks/rollout.py [--quick] [--out FOLDER]

A quadruped of examples/models under random controls, 64 worlds. Writes rollout.csv. Where other programs run,
the wall clock tells of them too; the processor time per step does not, and stays the same where threads do
not hinder each other.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from time import perf_counter, process_time
from typing import Any

import amontons
import numpy as np
from amontons.checks import Array
from common import ROOT, arguments, with_folders, write_csv

MODEL = ROOT / "examples" / "models" / "quadruped.xml"
WORLDS, REPEAT = 64, 5
OPTIONS = {"dt": 2e-3, "on_failure": "ignore"}


def one_by_one(model: amontons.Model, states: Array, controls: Array) -> Array:
    """What rollout does, as a loop."""
    q = []
    for state, rows in zip(states, controls, strict=True):
        world = amontons.Simulation(model, **OPTIONS)
        world.reset(q=state[: model.nq], qd=state[model.nq :])
        for row in rows:
            world.controls = row
            world.run(REPEAT * world.dt)
        q.append(world.q)
    return np.array(q)


def measured(name: str, threads: int, steps: int, call: Callable[[], Array]) -> tuple[dict[str, Any], Array]:
    wall, processor = perf_counter(), process_time()
    q = call()
    wall, processor = perf_counter() - wall, process_time() - processor
    row = {
        "name": name, "threads": threads, "steps": steps, "wall": wall, "steps_per_second": steps / wall,
        "processor_per_step": processor / steps,
    }  # fmt: skip
    return row, q


def main() -> None:
    options = with_folders(arguments(__doc__).parse_args())
    model = amontons.load_model(MODEL)
    start = amontons.Simulation(model, **OPTIONS)
    start.reset("stand")
    random = np.random.default_rng(seed=1)
    states = np.tile(np.concatenate([start.q, start.qd]), (WORLDS, 1))
    controls = random.uniform(-3, 3, (WORLDS, 10 if options.quick else 60, len(model.actuators)))  # N m
    steps = controls.shape[0] * controls.shape[1] * REPEAT
    row, expected = measured("loop", 1, steps, lambda: one_by_one(model, states, controls))
    rows = [row]
    cores = os.cpu_count() or 1
    for threads in [n for n in (1, 2, 4, 8, 16, 32, 64) if n <= cores]:
        row, q = measured(
            "rollout", threads, steps,
            lambda n=threads: amontons.rollout(
                model, states, controls, repeat=REPEAT, threads=n, **OPTIONS
            ).q[:, -1],
        )  # fmt: skip
        if not np.array_equal(q, expected):
            raise SystemExit(f"rollout: with {threads} threads the bits are other ones")
        rows.append(row)
    write_csv(options.out / "rollout.csv", rows)
    for row in rows:
        who = f"rollout: {row['name']}, threads {row['threads']}"
        processor = f"{1e6 * row['processor_per_step']:.1f} us of processor time each"
        print(f"{who}: {row['steps_per_second']:.0f} steps per second, {processor}")


if __name__ == "__main__":
    main()
