"""One model file beside MuJoCo, in a process of its own: the worker of robots.py.

    PYTHONPATH=benchmarks python -m robot.run FILE --duration 2 --dt 5e-3 --limit 60

Prints a JSON object per stage, each with all that is known so far, so that a stall or a crash leaves what
came before it.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import warnings
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from statistics import median
from time import perf_counter, thread_time
from typing import Any

import amontons
import mujoco

from robot.energy import Energy
from robot.motion import Ends, free_motion
from robot.trials import driven, joint_error, keyframes

START = 0.2  # s, after which overlaps of the initial pose should be gone


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--duration", type=float, default=2.0)
    parser.add_argument("--dt", type=float)
    parser.add_argument("--limit", type=float, default=60.0)
    parser.add_argument("--trees", choices=("none", "auto"), default="auto")
    parser.add_argument("--urdf", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore", amontons.StepWarning)
    row: dict[str, Any] = {}
    for facts in stages(options):
        row |= facts
        print(json.dumps(row), flush=True)


def stages(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """What is known after each stage; one that runs out of its share of the limit leaves the rest theirs."""
    start = perf_counter()
    model, facts = our_model(options.file, options.trees)
    yield {**facts, "load_time": perf_counter() - start}
    floor = None
    if model is not None and options.urdf:
        model, floor = with_floor(model)
    theirs, refusal = their_model(options.file, options.urdf, floor)
    yield {"mujoco_refuses": refusal, "floor": floor}
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


# Loading


def their_model(path: Path, urdf: bool, floor: float | None) -> tuple[Any, str]:
    """MuJoCo's model, or None with what it says; a URDF with the base, meshes and floor that ours has."""
    try:
        if urdf:
            return compiled_urdf(path, floor), ""
        return mujoco.MjModel.from_xml_path(str(path)), ""
    except (ValueError, mujoco.FatalError, amontons.InputError, OSError) as error:
        return None, " ".join(str(error).split())[:300]


def compiled_urdf(path: Path, floor: float | None) -> Any:
    """MuJoCo's own reader knows neither packages nor free bases, so the preparation is ours."""
    from amontons.io.models import compiled_model

    compiled = compiled_model(path)
    if floor is None:
        return compiled.model
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    compiled.spec.worldbody.add_geom(type=plane, size=(0, 0, 1), pos=(0, 0, floor))
    return compiled.spec.compile()


def our_model(path: Path, trees: str = "auto") -> tuple[amontons.Model | None, dict[str, Any]]:
    """The model as it loads, or None if it is refused; and what of the file was not read."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the model has the list
        try:
            model = replace(amontons.load_model(path), trees=trees)
        except (amontons.InputError, OSError) as error:
            return None, {"load": "refused", "what": " ".join(str(error).split())[:1000]}
    what = [re.sub(r"^\S*/", "", str(entry)) for entry in model.unread]  # the file without its folders
    changes = sum(entry.changes_motion for entry in model.unread)
    facts = {"load": "ok", "not_read": len(what), "changes_motion": changes, "bodies": len(model.bodies)}
    return model, {**facts, "what": "; ".join(what)[:1000]}


def with_floor(model: amontons.Model) -> tuple[amontons.Model, float | None]:
    """A robot that floats, on a plane at its lowest point, and where that is: URDF has no floors."""
    if not any(c.kind == "free" for c in model.coordinates.values()):
        return model, None
    try:
        standing = amontons.on_floor(model)
    except amontons.InputError:  # nothing that could touch it
        return model, None
    height = model.bodies[0].pose.position[2] - standing.bodies[0].pose.position[2]
    builder = amontons.ModelBuilder(
        gravity=model.gravity, friction_rule=model.friction_rule, trees=model.trees
    )
    builder.add_model(model)
    builder.add_floor(height=height, material=amontons.Material(friction=1.0))  # MuJoCo's default
    return builder.build(), height


# Runs


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
    energy, said = Energy(simulation), perf_counter()
    worst = {"missed": 0, "residual": 0.0, "contacts": 0, "penetration_start": 0.0, "penetration": 0.0}
    worst |= {"joint_error": 0.0, "joint_error_relative": 0.0}
    length = simulation.model.length
    for k in range(1, steps + 1):
        before = thread_time()
        try:
            report = simulation.step()
        except amontons.SimulationError as error:
            yield {"stopped": str(error)[:300], "steps": k - 1}
            return
        times.append(thread_time() - before)
        energy.add(report)
        worst["missed"] += not report.converged
        worst["residual"] = max(worst["residual"], report.residual)
        worst["contacts"] = max(worst["contacts"], report.contacts)
        depth = "penetration_start" if report.time <= START else "penetration"
        worst[depth] = max(worst[depth], report.penetration)
        if report.time > START:
            worst["joint_error"] = max(worst["joint_error"], joint_error(report, length))
            worst["joint_error_relative"] = worst["joint_error"] / length
        if k == steps or perf_counter() > said + 1.0 or perf_counter() > until:
            said = perf_counter()
            yield {
                **worst, **energy.facts(), "steps": k, "wanted_steps": steps, "simulated": simulation.time,
                "missed_percent": 100 * worst["missed"] / k, **of_steps(times),
                "steps_per_second": k / sum(times),
            }  # fmt: skip
        if perf_counter() > until:
            return


if __name__ == "__main__":
    main()
