"""One model file beside MuJoCo, in a process of its own: the worker of robots.py.

    PYTHONPATH=benchmarks python -m robot.run FILE --duration 2 --dt 5e-3 --limit 60 [--trees both]

Prints a JSON object per stage, each with all that is known so far, so that a stall or a crash leaves what
came before it. With --trees both there is one stage, that of robot/forms.py.
"""

from __future__ import annotations

import argparse
import json
import math
import warnings
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from statistics import median
from time import perf_counter, thread_time
from typing import Any

import amontons
import mujoco

from robot.energy import Energy
from robot.forms import compare
from robot.loading import beside, our_model
from robot.motion import Ends, free_motion
from robot.trials import driven, keyframes, worst_of

START = 0.2  # s, after which overlaps of the initial pose should be gone


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--duration", type=float, default=2.0)
    parser.add_argument("--dt", type=float)
    parser.add_argument("--limit", type=float, default=60.0)
    parser.add_argument("--trees", choices=("none", "auto", "both"), default="auto")
    parser.add_argument("--urdf", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore", amontons.StepWarning)
    row: dict[str, Any] = {}
    for facts in stages(options):
        row |= facts
        print(json.dumps(row), flush=True)


def stages(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """What is known after each stage; one that runs out of its share of the limit leaves the rest theirs."""
    if options.trees == "both":
        yield compare(options)
        return
    start = perf_counter()
    model, facts = our_model(options.file, options.trees)
    yield {**facts, "load_time": perf_counter() - start}
    model, theirs, facts = beside(model, options.file, options.urdf)
    yield facts
    if theirs is not None:
        yield their_run(theirs, options.duration)
    if model is None:
        return
    dt = {} if options.dt is None else {"dt": options.dt}
    simulation = amontons.Simulation(model, on_failure="ignore", **dt)
    times: list[float] = []
    yield from our_run(simulation, options.duration, start + 0.5 * options.limit, times)
    yield our_speed(simulation, options.duration, start + 0.6 * options.limit, times)
    yield keyframes(model, theirs, start + 0.65 * options.limit)
    yield driven(model, start + 0.75 * options.limit)
    yield {"finished": True, "compared": theirs is None}
    if theirs is None:
        return
    ends = Ends.of(model, theirs)
    yield free_motion(model, theirs, ends, start + 0.85 * options.limit)
    yield {"compared": True}


def their_run(m: Any, duration: float) -> dict[str, Any]:
    """Contacts and speed of MuJoCo with the file's own step and integrator."""
    data, most, steps = mujoco.MjData(m), 0, math.ceil(duration / m.opt.timestep)
    before = thread_time()
    for _ in range(steps):
        mujoco.mj_step(m, data)
        most = max(most, data.ncon)
    rate = steps / max(thread_time() - before, 1e-9)
    return {"mujoco_contacts": most, "mujoco_steps_per_second": rate}


def our_speed(
    simulation: amontons.Simulation, duration: float, until: float, times: list[float]
) -> dict[str, Any]:
    """The same run again in a loop like MuJoCo's: what is measured and read between steps would slow them. Of
    each step the shorter of its two times counts, as machines have pauses of their own."""
    simulation.reset()
    wanted = max(1, math.ceil(duration / simulation.dt - 1e-9))
    ends = [perf_counter()]
    before = thread_time()
    while len(ends) <= wanted and ends[-1] < until:
        simulation.step()
        ends.append(perf_counter())
    again = [end - begin for begin, end in pairwise(ends)]
    speed = {"steps_per_second": len(again) / max(thread_time() - before, 1e-9)}
    if not again or len(again) < len(times):
        return speed
    longest = {"longest": max(times), "longest_again": max(again)}
    return speed | longest | of_steps([min(two) for two in zip(times, again, strict=False)])


def of_steps(times: list[float]) -> dict[str, Any]:
    return {"step_median": median(times), "longest_in_medians": max(times) / median(times)}


def our_run(
    simulation: amontons.Simulation, duration: float, until: float, times: list[float]
) -> Iterator[dict[str, Any]]:
    """A run as a user has it. Times are of the processor, so that what else runs does not count."""
    steps = max(1, math.ceil(duration / simulation.dt - 1e-9))
    energy, said, length = Energy(simulation), perf_counter(), simulation.model.length
    reports: list[amontons.Report] = []
    for k in range(1, steps + 1):
        before = thread_time()
        try:
            reports.append(simulation.step())
        except amontons.SimulationError as error:
            yield {"stopped": str(error)[:300], "steps": k - 1}
            return
        times.append(thread_time() - before)
        energy.add(reports[-1])
        if k == steps or perf_counter() > said + 1.0 or perf_counter() > until:
            said = perf_counter()
            settled = [r for r in reports if r.time > START]
            missed, apart = worst_of(reports, length)["missed"], worst_of(settled, length)["joint_error"]
            yield {
                "missed": missed, "residual": max(r.residual for r in reports),
                "contacts": max(r.contacts for r in reports),
                "penetration_start": max(r.penetration for r in reports[: k - len(settled)]),
                "penetration": max((r.penetration for r in settled), default=0.0),
                "joint_error": apart, "joint_error_relative": apart / length, **energy.facts(), "steps": k,
                "wanted_steps": steps, "simulated": simulation.time, "missed_percent": 100 * missed / k,
                **of_steps(times), "steps_per_second": k / sum(times),
            }  # fmt: skip
        if perf_counter() > until:
            return


if __name__ == "__main__":
    main()
