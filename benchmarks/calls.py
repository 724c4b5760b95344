"""Processor time of calls from Python: a step beside that of the compiled module, tables, values, imports.

    python benchmarks/calls.py [--quick] [--out FOLDER]

An arm of seven hinges with servos, which swings, and a box on a floor; of robots on a floor (the quadruped of
examples, MuJoCo's humanoid of the data folder) derivatives alone. Rows: model, call, microseconds: the least
mean of seven parts; steps: in steps from the state of the derivative, which is taken back before each. "step,
compiled" is the call of the compiled module, which `Simulation.step` makes. Imports have the start of a new
Python in them, and are the least of 20.
"""

from __future__ import annotations

import resource
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import process_time

import amontons
from amontons.shapes import Box, Capsule
from common import ROOT, Row, arguments, begin, fill

PARTS, CALLS, QUICK = 7, 400, 40
STEP = "the same step again"
FEWER = 40
"""times as many calls of others as derivatives"""


def arm(hinges: int = 7) -> amontons.Model:
    builder = amontons.ModelBuilder()
    above: int | None = None
    for k in range(hinges):
        place = (0.2 * k + 0.1, 0.0, 0.0)
        body = builder.add_body(f"link {k}", shape=Capsule(0.03, 0.07), mass=1.0, position=place)
        axis = (0, 1, 0) if k % 2 else (0, 0, 1)
        motor = amontons.Motor("position", kp=100.0, kd=10.0, max_effort=50.0)
        builder.add_revolute_joint(
            body, above, point=(0.2 * k, 0, 0), axis=axis, motor=motor, name=f"joint {k}"
        )
        above = body
    return builder.build()


def box() -> amontons.Model:
    builder = amontons.ModelBuilder()
    builder.add_floor()
    builder.add_body("box", shape=Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.1))
    return builder.build()


def calls(simulation: amontons.Simulation) -> dict[str, Callable[[], object]]:
    core, model = simulation._core, simulation.model

    def contacts() -> object:
        simulation._contacts = None  # made again, as after a step
        return simulation.contacts

    link = model.link_names[-1]
    given: dict[str, Callable[[], object]] = {
        "step, compiled": core.step,
        "step": simulation.step,
        "contacts": contacts,
        "links": lambda: simulation.kinematics.links,
        "link(name)": lambda: simulation.kinematics.link(link),
        "jacobian(name)": lambda: simulation.kinematics.jacobian(link),
        "jacobians()": simulation.kinematics.jacobians,
        "q": lambda: simulation.q,
    }
    if model.joints:
        joint = model.joint_names[-1]
        given |= {
            "efforts()": simulation.forces.efforts,
            "joint_efforts": lambda: simulation.forces.joint_efforts,
            "effort(name)": lambda: simulation.forces.effort(joint),
            "joint_reactions": lambda: simulation.forces.joint_reactions,
            "reaction(name)": lambda: simulation.forces.reaction(joint),
            "set_control(name)": lambda: simulation.set_control(joint, 0.1),
        }
    return given


def robots(data: Path) -> dict[str, amontons.Model]:
    paths = {
        "quadruped": ROOT / "examples" / "models" / "quadruped.xml",
        "humanoid": data / "robots" / "mujoco" / "humanoid" / "humanoid.xml",
    }
    return {name: amontons.load_model(path) for name, path in paths.items() if path.is_file()}


def derivatives(simulation: amontons.Simulation) -> dict[str, Callable[[], object]]:
    """Of one step, on one core, and that step. The way back has a loss over q alone."""
    slope = [1.0] * simulation.model.nq
    before, again = simulation._core.copy(), simulation._core.copy()
    before.restore_last()

    def step() -> None:
        again.assign(before)
        again.step()

    return {
        STEP: step,
        "derivative()": lambda: simulation.derivative(threads=1),
        'derivative(inputs="none")': lambda: simulation.derivative(threads=1, inputs="none"),
        "vjp(q)": lambda: simulation.vjp(slope, threads=1),
        "derivative, with the mass of a body": lambda: simulation.derivative(
            parameters=[f"mass:{simulation.model.body_names[-1]}"], inputs="none", threads=1
        ),
    }


def least_times(functions: dict[str, Callable[[], object]], count: int) -> dict[str, float]:
    """Of one call each (s); they take turns, as the state changes."""
    least = dict.fromkeys(functions, float("inf"))
    for _ in range(PARTS):
        for name, function in functions.items():
            start = process_time()
            for _ in range(count):
                function()
            least[name] = min(least[name], (process_time() - start) / count)
    return least


def import_time(module: str, runs: int = 20) -> float:
    """Of a Python that imports a module (s)."""

    def spent() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    times = []
    for _ in range(runs):
        before = spent()
        subprocess.run([sys.executable, "-c", f"import {module}"], check=True)
        times.append(spent() - before)
    return min(times)


def main() -> None:
    options = begin(arguments(__doc__).parse_args())
    count, walking = QUICK if options.quick else CALLS, robots(options.data)

    def rows(item: tuple[str, amontons.Model | None]) -> list[Row]:
        name, model = item
        if model is None:
            return [{"model": "", "call": f"import {name}", "microseconds": 1e6 * import_time(name)}]
        simulation = amontons.Simulation(replace(model, trees="auto"), dt=2e-3)
        for _ in range(150):
            simulation.step()
        seconds = least_times(derivatives(simulation), max(1, count // FEWER))
        step = seconds[STEP]
        if name not in walking:
            seconds |= least_times(calls(simulation), count)
        return [{"model": name, "call": call, "microseconds": 1e6 * time, "steps": time / step}
                for call, time in seconds.items()]  # fmt: skip

    models = {"arm of 7 hinges": arm(), "box on a floor": box(), **walking}
    items = [*models.items(), ("numpy", None), ("amontons", None)]
    fill(options.out / "calls.csv", items, rows, "model call microseconds steps")


if __name__ == "__main__":
    main()
