"""Robots on the floor, counted: the rows of robots.py --fall.

With both forms of joints the cases are those with large islands, and each runs with trees and with rows. Each
case runs without control and with random controls, which change every 0.1 s, with steps of 2 ms beside
MuJoCo in turns of one step. Times are of the processor. Counts are over the steps with contacts.
"""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter, thread_time
from typing import Any

import amontons
import mujoco
import numpy as np
from common import Row, control_range

from robot.fall_cases import cases, large_cases
from robot.motion import mujoco_actuator

DT = 2e-3
"""s."""
HELD = 50
"""Steps for which random controls stay the same."""
FEW = 4
"""Factorisations that a step on the floor should need at most."""
LONG, SHORT = 10.0, 2e-3
"""A step stalls above so many medians, if it takes longer than this (s)."""
DIRECT = ("elimination", "warm start", "none")
"""Methods of the report that leave nothing to the order of methods."""


def runs(robots: Path, folder: Path, options: Any) -> Iterator[tuple[str, str, str, Path]]:
    """Case, control, form of joints and file; files that are made go to `folder`."""
    both = options.trees == "both"
    for name, path in (large_cases if both else cases)(robots, folder):
        if not options.only or any(part in name for part in options.only):
            forms = ("auto", "none") if both else (options.trees,)
            yield from ((name, control, trees, path) for control in ("none", "random") for trees in forms)


def fall(case: str, control: str, trees: str, path: Path, options: Any) -> Row:
    with warnings.catch_warnings(action="ignore"):  # of steps too: the row has the residuals
        model = replace(amontons.load_model(path), trees=trees)
        ours = amontons.Simulation(model, dt=DT, on_failure="ignore")
        theirs = mujoco.MjModel.from_xml_path(str(path))
        theirs.opt.timestep = DT
        data, rng = mujoco.MjData(theirs), np.random.default_rng(1)
        steps: list[Row] = []
        start = perf_counter()
        for k in range(math.ceil(options.duration / DT - 1e-9)):
            if control == "random" and k % HELD == 0:
                turn_to(model, ours, theirs, data, rng)
            steps.append(both(ours, theirs, data))
            if perf_counter() > start + options.limit:
                break
    return {"case": case, "control": control, "trees": trees, **facts(steps)}


def turn_to(model: amontons.Model, ours: amontons.Simulation, theirs: Any, data: Any, rng: Any) -> None:
    for drive in model.actuators:
        value = float(rng.uniform(*control_range(drive)))
        ours.set_control(drive.name, value)
        data.ctrl[mujoco_actuator(theirs, drive.name)] = value


def both(ours: amontons.Simulation, theirs: Any, data: Any) -> Row:
    before = thread_time()
    report = ours.step()
    between = thread_time()
    mujoco.mj_step(theirs, data)
    return {
        "time": between - before, "theirs": thread_time() - between, "solve": report.timings.solve,
        "wall": report.timings.total, "contacts": report.contacts, "mujoco_contacts": data.ncon,
        "joint_rows": report.joint_rows, "factorizations": report.factorizations,
        "products": report.products, "missed": not report.converged, "method": report.method,
    }  # fmt: skip


def facts(steps: list[Row]) -> Row:
    """Contacts, factorisations, step, solve and mujoco_step (s) are medians; above_few: share of steps (%);
    ordered: steps that a method of the order ended."""
    touching = [s for s in steps if s["contacts"]] or steps

    def of(key: str, some: list[Row] = touching) -> Any:
        return np.array([float(s[key]) for s in some])

    times, theirs, factored = of("time"), of("theirs"), of("factorizations")
    usual = float(np.median(of("time", steps)))
    ordered = [s["method"] for s in steps if s["method"] not in DIRECT]
    return {
        "steps": len(steps), "contacts": np.median(of("contacts")), "most_contacts": of("contacts").max(),
        "mujoco_contacts": np.median(of("mujoco_contacts")), "joint_rows": np.median(of("joint_rows")),
        "factorizations": np.median(factored), "factorizations_90": np.percentile(factored, 90),
        "factorizations_mean": factored.mean(), "most_factorizations": factored.max(),
        "above_few": 100 * np.mean(factored > FEW), "products_mean": of("products").mean(),
        "most_products": of("products").max(), "missed": int(of("missed", steps).sum()),
        "stalled": int(np.sum(of("time", steps) > max(LONG * usual, SHORT))), "ordered": len(ordered),
        "methods": ", ".join(f"{n} {count}" for n, count in sorted(Counter(ordered).items())),
        "step": np.median(times), "longest": of("time", steps).max(),
        "solve_share": of("solve").sum() / of("wall").sum(), "solve": np.median(of("solve")),
        "mujoco_step": np.median(theirs),
        "ratio": np.median(times) / np.median(theirs), "ratio_of_run": times.sum() / theirs.sum(),
    }  # fmt: skip
