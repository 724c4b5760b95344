"""Environment steps per second in one world and in 16, with both ways to take errors of position back.

    python benchmarks/environments.py [--quick] [--out FOLDER]

Random actions. The variants take turns in one run, and each row is the best of its turns. Writes
environments.csv.
"""

from __future__ import annotations

from time import perf_counter, process_time
from typing import Any

import numpy as np
from amontons.gym import Ant, HalfCheetah, Quadruped, Task, VectorEnvironment
from amontons.simulation.rollout import usable_cores
from common import arguments, with_folders, write_csv

RECOVERIES = {"projection": {"recovery": "projection"}, "velocity": dict(Task.options)}


def variants(task: type[Task]) -> list[tuple[dict[str, Any], VectorEnvironment]]:
    found = []
    for recovery, options in RECOVERIES.items():
        chosen = type(task.__name__, (task,), {"options": options})
        for worlds, threads in [(1, 1), (16, 1), (16, usable_cores())]:
            row = {"task": task.__name__, "recovery": recovery, "worlds": worlds, "threads": threads}
            vector = VectorEnvironment(chosen(), worlds, threads=threads, max_episode_steps=1000)
            vector.reset(seed=0)
            found.append((row | {"steps_per_second": 0.0, "processor_per_step": np.inf}, vector))
    return found


def turn(row: dict[str, Any], vector: VectorEnvironment, random: np.random.Generator) -> None:
    count = max(1, 160 // vector.num_envs)
    actions = random.uniform(-1, 1, (count, *vector.action_space.shape))
    wall, processor = perf_counter(), process_time()
    for action in actions:
        vector.step(action)
    wall, processor = perf_counter() - wall, process_time() - processor
    steps = count * vector.num_envs
    row["steps_per_second"] = max(row["steps_per_second"], steps / wall)
    row["processor_per_step"] = min(row["processor_per_step"], processor / steps)


def main() -> None:
    options = with_folders(arguments(__doc__).parse_args())
    rows = []
    for task in (Quadruped, Ant, HalfCheetah):
        pairs, random = variants(task), np.random.default_rng(seed=1)
        for _ in range(3 if options.quick else 10):
            for row, vector in pairs:
                turn(row, vector, random)
        rows += [row for row, _ in pairs]
    write_csv(options.out / "environments.csv", rows)
    for row in rows:
        who = f"{row['task']}, {row['recovery']}, worlds {row['worlds']}, threads {row['threads']}"
        processor = f"{1e6 * row['processor_per_step']:.0f} us of processor time each"
        print(f"{who}: {row['steps_per_second']:.0f} environment steps per second, {processor}")


if __name__ == "__main__":
    main()
