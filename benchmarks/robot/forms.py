"""One model file with joints as rows, with trees, and in MuJoCo: robot/run.py --trees both.

All three have the same step and the same constant random controls, and take turns of 50 steps, so that what
else runs on the machine slows all of them alike.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from statistics import fmean, median
from time import perf_counter, thread_time_ns
from typing import Any

import amontons
import mujoco
import numpy as np
from common import random_controls

from robot.loading import beside, our_model
from robot.motion import mujoco_actuator
from robot.trials import worst_of

TURN = 50
"""Steps of one program before the next one has its turn."""
WARM = 0.1
"""Share of the steps, at the start, whose times do not count."""
FORMS = {"rows": "none", "trees": "auto"}
"""Names of the columns, and values of Model.trees."""


class Ours:
    """A simulation, and the times (s) and reports of its steps."""

    def __init__(self, model: amontons.Model, dt: float, controls: dict[str, float]) -> None:
        self.simulation = amontons.Simulation(model, dt=dt, on_failure="ignore")
        for name, value in controls.items():
            self.simulation.set_control(name, value)
        self.times: list[float] = []
        self.reports: list[amontons.Report] = []

    def step(self) -> None:
        before = thread_time_ns()
        self.reports.append(self.simulation.step())
        self.times.append(1e-9 * (thread_time_ns() - before))

    def facts(self, form: str) -> dict[str, Any]:
        found = worst_of(self.reports, self.simulation.model.length) | {
            "joint_rows": fmean(r.joint_rows for r in self.reports),
            "contacts": fmean(r.contacts for r in self.reports), "longest": max(self.times),
        }  # fmt: skip
        return {form: median(counted(self.times))} | {f"{form}_{key}": value for key, value in found.items()}


class Theirs:
    def __init__(self, m: Any, dt: float, controls: dict[str, float]) -> None:
        m.opt.timestep = dt
        self.model, self.data, self.times = m, mujoco.MjData(m), []
        for name, value in controls.items():
            self.data.ctrl[mujoco_actuator(m, name)] = value

    def step(self) -> None:
        before = thread_time_ns()
        mujoco.mj_step(self.model, self.data)
        self.times.append(1e-9 * (thread_time_ns() - before))


def counted(times: list[float]) -> list[float]:
    return times[int(WARM * len(times)) :]


def compare(options: argparse.Namespace) -> dict[str, Any]:
    """Medians of processor time per step (s), and what each form reached."""
    start, dt = perf_counter(), options.dt or 2e-3
    model, facts = our_model(options.file)
    model, theirs, more = beside(model, options.file, options.urdf)
    row = {key: facts[key] for key in ("load", "what")} | {"mujoco_refuses": more["mujoco_refuses"]}
    if model is None:
        return row
    controls = random_controls(model, np.random.default_rng(1))
    ours = {form: Ours(replace(model, trees=trees), dt, controls) for form, trees in FORMS.items()}
    others = [] if theirs is None else [Theirs(theirs, dt, controls)]
    row["wanted_steps"] = math.ceil(options.duration / dt - 1e-9)
    row["stopped"] = ""
    row["steps"] = 0
    while row["steps"] < row["wanted_steps"] and perf_counter() < start + 0.9 * options.limit:
        try:
            for program in (*ours.values(), *others):
                for _ in range(min(TURN, row["wanted_steps"] - row["steps"])):
                    program.step()
        except amontons.SimulationError as error:
            row["stopped"] = str(error)[:300]
            break
        row["steps"] = len(ours["rows"].times)
    if row["steps"] == 0:
        return row
    for form, run in ours.items():
        row |= run.facts(form)
    row["trees_to_rows"] = row["trees"] / row["rows"]
    row["run_trees_to_rows"] = sum(counted(ours["trees"].times)) / sum(counted(ours["rows"].times))
    if others:
        row["mujoco"] = median(counted(others[0].times))
        row["trees_to_mujoco"] = row["trees"] / row["mujoco"]
    return row
