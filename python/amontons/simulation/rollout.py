"""Many simulations of one model at once, on all cores."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core, watching
from ..checks import Array, flag, option, reals
from ..errors import InputError, SimulationError, StepWarning
from ..model.model import Model, no_model
from .simulation import Simulation


@dataclass(frozen=True)
class Rollout:
    """Where the worlds of `rollout` went: a row per world, and in it one per row of controls.

    The rows of a world that failed are NaN from there on, and `failures` says why.
    """

    q: Array
    """(worlds, rows, nq), after the last step of each row"""
    qd: Array
    """(worlds, rows, nv)"""
    residuals: Array
    """(worlds, rows), the largest of the steps of a row"""
    missed: Array
    """(worlds, rows), how many steps of a row did not converge, or gained energy from nothing"""
    time: Array
    """(rows,), since the start (s)"""
    sensors: Array
    """(worlds, rows, values), as `Simulation.sensors.array`; no values unless they were asked for"""
    simulations: list[Simulation]
    """the worlds at their ends, from which they can go on"""
    failures: list[str]
    """of each world why it stopped, with its row; empty if it did not"""


def rollout(
    model: Model,
    states: ArrayLike | Sequence[Simulation],
    controls: ArrayLike | None = None,
    *,
    steps: int | None = None,
    repeat: int = 1,
    threads: int | None = None,
    sensors: bool = False,
    **options: Any,
) -> Rollout:
    """Advance many worlds of a model side by side in C++, without Python's lock.

    states: (worlds, nq + nv), q and then qd of each world; or simulations of the model, which are copied and
        so go on bit for bit, with their own options.
    controls: (worlds, rows, actuators), or (rows, actuators) for all worlds alike: each row is set and held
        for `repeat` steps. None leaves them as they are, for `steps` rows.
    threads: worlds at a time, by default as many as there are cores to use. Every world has the bits that it
        has by itself, whatever their number.
    sensors: read the sensors of the model after each row, one world after the other with Python's lock held.
    options: those of `Simulation`, for all worlds; on_failure too.

    A world whose velocities come out not finite stops, the others go on, and a StepWarning names it. Raises
    InputError naming the argument and, with on_failure="raise", SimulationError naming the first such world,
    or one whose steps missed their tolerance.
    """
    if not isinstance(model, Model):
        raise no_model("model", model)
    worlds = _worlds(model, states, options)
    rows = _controls(model, controls, len(worlds), steps)
    repeat = option("repeat", repeat)
    sensors = flag("sensors", sensors)
    courses, readings, done, failures = [], [], 0, [""] * len(worlds)
    for part in _in_single_rows(rows) if sensors else [rows]:
        course = advance_worlds(worlds, part, repeat, threads)
        failures = [old or _failure(course, k, done) for k, old in enumerate(failures)]
        failed = np.array([bool(failure) for failure in failures])
        for values in (course.q, course.qd, course.residuals):
            values[failed & (np.array(course.done) == 0)] = np.nan  # of a world that failed in a part before
        courses.append(course)
        done += course.q.shape[1]
        values = np.array([world.sensors.array if sensors else () for world in worlds], dtype=np.float64)
        values[failed] = np.nan
        readings.append(np.repeat(values[:, None], course.q.shape[1], axis=1))
    q, qd, residuals, missed = (
        np.concatenate([getattr(course, name) for course in courses], axis=1)
        for name in ("q", "qd", "residuals", "missed")
    )
    _report_failures(worlds, failures)
    _report(worlds, residuals, missed, repeat)
    time = worlds[0].dt * repeat * np.arange(1, done + 1)
    return Rollout(q, qd, residuals, missed, time, np.concatenate(readings, axis=1), worlds, failures)


def _failure(course: Course, world: int, before: int) -> str:
    """Why a world stopped in a part of the rows, if it did."""
    if not (why := course.failures[world]):
        return ""
    remedy = "look for loads or speeds out of proportion, or make dt smaller"
    return f"row {before + course.done[world]}: {why}; {remedy}"


def _report_failures(worlds: Sequence[Simulation], failures: Sequence[str]) -> None:
    """Reports velocities that are not finite, once for all worlds, as `on_failure` says."""
    told = [(k, why) for k, why in enumerate(failures) if why]
    heard = [(k, why) for k, why in told if worlds[k].options["on_failure"] != "ignore"]
    if not heard:
        return
    k, why = next((e for e in heard if worlds[e[0]].options["on_failure"] == "raise"), heard[0])
    message = f"world {k}, {why}"
    if worlds[k].options["on_failure"] == "raise":
        raise SimulationError(message)
    more = f"; {len(told)} of {len(worlds)} worlds stopped" if len(told) > 1 else ""
    warnings.warn(f"{message}{more}; its rows are NaN from there on", StepWarning, stacklevel=3)


@dataclass(frozen=True)
class Course:
    """Results of worlds, including failed ones: their rows are NaN from the failure on."""

    q: Array
    qd: Array
    residuals: Array
    missed: Array
    done: list[int]
    """rows that each world completed"""
    failures: list[str]
    """why a world stopped, empty if it did not"""


def advance_worlds(
    worlds: Sequence[Simulation], controls: Array | int, repeat: int, threads: int | None
) -> Course:
    """Advance simulations of one model by controls (worlds, rows, actuators), or by so many rows without."""
    threads = usable_cores() if threads is None else option("threads", threads)
    model = worlds[0].model
    given = None if isinstance(controls, int) else clipped(model, controls)
    rows = controls if isinstance(controls, int) else controls.shape[1]
    cores = [world._core for world in worlds]
    course = Course(*_core.run_worlds(model.tree, cores, given, rows, repeat, threads))
    for world in worlds:
        world._contacts = None
    return course


def clipped(model: Model, controls: Array) -> Array:
    """Controls (worlds, rows, actuators) within the limits of their actuators."""
    lower, upper = (
        np.array([getattr(drive, name) for drive in model.actuators], dtype=np.float64)
        for name in ("lower_control", "upper_control")
    )
    return np.ascontiguousarray(np.clip(controls, lower, upper))


def _in_single_rows(rows: Array | int) -> list[Array | int]:
    return [1] * rows if isinstance(rows, int) else [rows[:, k : k + 1] for k in range(rows.shape[1])]


def usable_cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _worlds(model: Model, states: Any, options: dict[str, Any]) -> list[Simulation]:
    if isinstance(states, Sequence) and states and all(isinstance(s, Simulation) for s in states):
        if options:
            raise InputError(f"{', '.join(options)}: simulations have their own options; give states instead")
        for k, world in enumerate(states):
            if world.model is not model:
                raise InputError(f"states[{k}] is a simulation of another model")
            if world.force_callbacks:
                raise InputError(
                    f"states[{k}] has force_callbacks, which rollout does not call; give controls"
                )
            if world.dt != states[0].dt:
                raise InputError(f"states[{k}] has dt = {world.dt:g} s, states[0] {states[0].dt:g} s")
        return [world.copy() for world in states]
    first = Simulation(model, **options)
    rows = reals("states", states)
    size = model.nq + model.nv
    if rows.ndim != 2 or rows.shape[1] != size or not len(rows):
        raise InputError(
            f"states has the shape {rows.shape}; it must be (worlds, {size}): nq = {model.nq} coordinates, "
            f"then nv = {model.nv} velocities"
        )
    worlds = [first.copy() for _ in rows]
    for k, (world, row) in enumerate(zip(worlds, rows, strict=True)):
        try:
            world.reset(q=row[: model.nq], qd=row[model.nq :])
        except InputError as error:
            raise InputError(f"states[{k}]: {error}") from None
    return worlds


def _controls(model: Model, controls: Any, worlds: int, steps: int | None) -> Array | int:
    """(worlds, rows, actuators), or the number of rows."""
    if controls is None:
        if steps is None:
            raise InputError("rollout needs controls, or steps to go without")
        return option("steps", steps)
    given = reals("controls", controls)
    count = len(model.actuators)
    if given.ndim == 2:
        given = np.broadcast_to(given, (worlds, *given.shape))
    if given.ndim != 3 or given.shape[0] != worlds or given.shape[2] != count or not given.shape[1]:
        raise InputError(
            f"controls has the shape {np.shape(controls)}; it must be (worlds, rows, actuators) = "
            f"({worlds}, rows, {count}), or (rows, {count})"
        )
    if steps is not None and steps != given.shape[1]:
        raise InputError(f"steps = {steps}, but controls has {given.shape[1]} rows; give one of them")
    if not np.isfinite(given).all():
        where = ", ".join(map(str, np.argwhere(~np.isfinite(given))[0]))
        raise InputError(f"controls[{where}] is not finite")
    return given


def _report(worlds: Sequence[Simulation], residuals: Array, missed: Array, repeat: int) -> None:
    """Reports steps that did not converge, once for all worlds."""
    largest = float(np.nanmax(residuals, initial=0.0))  # those of worlds that stopped are NaN
    counted = watching.saw(largest, steps=residuals.size * repeat, missed=int(missed.sum()))
    heard = np.array([world.options["on_failure"] != "ignore" for world in worlds])
    rows = np.argwhere((missed > 0) & heard[:, None])
    if not len(rows):
        return
    k, row = max(rows, key=lambda at: float(residuals[tuple(at)]))
    said = f"{missed[heard].sum()} steps in {len(rows)} of {residuals.size} rows"
    if residuals[k, row] <= worlds[k].options["tolerance"]:
        message = (
            f"{said} gained energy from nothing or left light bodies with wrong velocities, "
            f"the first of them in row {row} of world {k}"
        )
    else:
        where = f"{residuals[k, row]:.2e}, of world {k} in row {row}"
        message = f"{said} did not converge, the largest residual is {where}"
    if any(worlds[k].options["on_failure"] == "raise" for k, _ in rows):
        raise SimulationError(f"{message}; allow max_substeps, more iterations or a looser tolerance")
    if not counted:
        warnings.warn(message, StepWarning, stacklevel=3)
