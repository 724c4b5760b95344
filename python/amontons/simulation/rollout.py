"""Many simulations of one model, or of its variants, at once on all cores."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core, step_counts
from ..checks import Array, about, chosen, flag, function, option, reals
from ..errors import InputError, SimulationError, StepWarning
from ..model.model import Model, no_model
from ..model.variants import same_structure
from .driving import clipped
from .processors import usable_cores as usable_cores
from .simulation import AfterStep, BeforeStep, Simulation
from .stepping import steps_watched

if TYPE_CHECKING:
    from .tape import Gradient, Tape


@dataclass(frozen=True)
class Rollout:
    """Trajectories returned by `rollout`: a row per world, and in it one per row of controls.

    The rows of a world that failed are NaN from there on, and `failures` says why.

    >>> worlds = rollout(scenes.make("pendulum"), np.zeros((3, 2)), steps=10)
    >>> worlds.q.shape, worlds.failures
    ((3, 10, 1), ['', '', ''])
    """

    q: Array
    """coordinates after the last step of each row, (worlds, rows, nq)"""
    qd: Array
    """velocities after the last step of each row, (worlds, rows, nv)"""
    residuals: Array
    """largest residual of the steps of a row, (worlds, rows)"""
    missed: Array
    """number of steps of a row that did not converge or gained energy, (worlds, rows)"""
    time: Array
    """time since the start at the end of each row, (rows,) (s)"""
    sensors: Array
    """values of the sensors, (worlds, rows, values), as `Simulation.sensors.array`; no values without
    sensors=True"""
    simulations: list[Simulation]
    """the worlds at their ends, ready to continue"""
    failures: list[str]
    """reason and row at which each world stopped; empty if it did not"""
    tape: Tape | None = None
    """with tape=True: the states that `vjp` needs"""

    def vjp(
        self,
        q: ArrayLike | None = None,
        qd: ArrayLike | None = None,
        *,
        parameters: Iterable[str] = (),
        inputs: str | None = None,
        threads: int | None = None,
    ) -> Gradient:
        """Derivatives of a loss, backwards through the steps of a rollout with tape=True.

        q, qd: (worlds, rows, nq) and (worlds, rows, nv), derivatives of the loss over `q` and `qd`; None is
            zero. The part along a quaternion has no influence.
        parameters: names as in `Simulation.derivative`, "friction:foot".
        inputs: "controls", "joint_forces" or "none", which takes less time; by default what the rollout was
            given.
        threads: as in `Simulation.derivative`.

        Each step is one of `Simulation.vjp`, on the faces of its solution. Raises InputError naming
        the argument.
        """
        from .derivative import cotangent
        from .differences import INPUTS
        from .tape import gradient

        if self.tape is None:
            raise InputError("the rollout has no tape; give rollout(..., tape=True)")
        if inputs is not None:
            chosen("inputs", inputs, INPUTS)
        slopes = cotangent("q", q, self.q.shape), cotangent("qd", qd, self.qd.shape)
        if any(self.failures):
            k = next(k for k, failure in enumerate(self.failures) if failure)
            raise InputError(f"world {k} has no derivative: {self.failures[k]}")
        return gradient(self.tape, self.simulations, slopes, parameters, inputs, threads)


def rollout(
    model: Model | Sequence[Model],
    states: ArrayLike | Sequence[Simulation],
    controls: ArrayLike | None = None,
    *,
    joint_forces: ArrayLike | None = None,
    steps: int | None = None,
    repeat: int = 1,
    threads: int | None = None,
    sensors: bool = False,
    tape: bool = False,
    before_step: BeforeStep | None = None,
    after_step: AfterStep | None = None,
    **options: Any,
) -> Rollout:
    """Advance many worlds of a model side by side in C++, without Python's lock.

    model: of all worlds, or one per world: variants (`Model.with_`) with the same coordinates and controls.
    states: (worlds, nq + nv), q and then qd of each world; or simulations of the models, which are copied and
        so go on bit for bit, with their own options.
    controls: (worlds, rows, controls), or (rows, controls) for all worlds alike, in the order of
        `Model.control_names`: each row is set and held for `repeat` steps. None leaves them as they are.
    joint_forces: (worlds, rows, nv), or (rows, nv): `State.joint_forces`, likewise (N, N m).
    steps: rows, where neither controls nor joint_forces say how many.
    threads: worlds at a time, by default as many as there are cores to use. Every world has the bits that it
        has by itself, whatever their number.
    sensors: read the sensors of the model after each row, one world after the other with Python's lock held.
    tape: keep the state before each row, for `Rollout.vjp`: derivatives of a loss over controls, states at
        the start and parameters. Without functions before and after steps.
    before_step, after_step: as in `Simulation.run`, called with each world; a true result of after_step ends
        its world, whose rows from there on are NaN. With them, and with those of given simulations, all
        worlds advance one after the other, in Python.
    options: those of `Simulation`, for all worlds; on_failure too.

    A world whose velocities come out not finite stops, the others go on, and a StepWarning names it. Raises
    InputError naming the argument and, with on_failure="raise", SimulationError naming the first such world,
    or one whose steps missed their tolerance.

    >>> starts = [[0.1, 0.0], [0.2, 0.0]]  # q, then qd
    >>> rollout(scenes.make("pendulum"), starts, steps=100).q.shape
    (2, 100, 1)
    """
    models = models_of(model)
    worlds = _worlds(models, states, options)
    model = models[0]
    function("before_step", before_step)
    function("after_step", after_step)
    rows = _rows(model, controls, joint_forces, len(worlds), steps)
    repeat, sensors = option("repeat", repeat), flag("sensors", sensors)
    watched = before_step or after_step or any(world.before_step or world.after_step for world in worlds)
    taped = _tape(rows, repeat, bool(watched)) if flag("tape", tape) else None
    courses, readings, done, failures = [], [], 0, [""] * len(worlds)
    stopped = [False] * len(worlds)
    for part in rows.single() if sensors or taped else [rows]:
        if taped:
            taped.add(worlds)
        if watched:
            course = advance_watched(worlds, part, repeat, before_step, after_step, stopped)
        else:
            course = advance_worlds(worlds, part.controls, repeat, threads, part.joint_forces, part.count)
        failed = _mark_failed(course, done, failures, stopped)
        courses.append(course)
        done += course.q.shape[1]
        readings.append(_readings(worlds, sensors, failed, course.q.shape[1]))
    q, qd, residuals, missed = _joined(courses)
    _report_failures(worlds, failures)
    _report(worlds, residuals, missed, repeat)
    time = worlds[0].dt * repeat * np.arange(1, done + 1)
    read = np.concatenate(readings, axis=1)
    return Rollout(q, qd, residuals, missed, time, read, worlds, failures, taped)


def _mark_failed(course: Course, done: int, failures: list[str], stopped: list[bool]) -> Array:
    """Adds the failures of a part to those before; NaN for worlds that failed or stopped before it."""
    failures[:] = [old or _failure(course, k, done) for k, old in enumerate(failures)]
    failed = np.array([bool(failure) for failure in failures]) | stopped
    for values in (course.q, course.qd, course.residuals):
        values[failed & (np.array(course.done) == 0)] = np.nan
    return failed


def _tape(rows: Rows, repeat: int, watched: bool) -> Tape:
    if watched:
        raise InputError("tape: functions before and after steps have no derivative; leave them out")
    from .tape import Tape

    return Tape(rows.controls, rows.joint_forces, repeat)


def _readings(worlds: Sequence[Simulation], sensors: bool, failed: Array, rows: int) -> Array:
    """(worlds, rows, values): the sensors after the last of some rows, NaN of worlds that failed."""
    values = np.array([world.sensors.array if sensors else () for world in worlds], dtype=np.float64)
    values[failed] = np.nan
    return np.repeat(values[:, None], rows, axis=1)


def _joined(courses: Sequence[Course]) -> tuple[Array, ...]:
    """q, qd, residuals and missed steps of all rows, (worlds, rows, ...)."""
    names = ("q", "qd", "residuals", "missed")
    return tuple(np.concatenate([getattr(course, n) for course in courses], axis=1) for n in names)


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


@dataclass(frozen=True)
class Rows:
    """Inputs of worlds, row by row; None leaves them unchanged."""

    controls: Array | None
    """(worlds, rows, controls)"""
    joint_forces: Array | None
    """(worlds, rows, nv)"""
    count: int

    def single(self) -> Iterator[Rows]:
        """One row each."""
        for k in range(self.count):
            parts = (None if v is None else v[:, k : k + 1] for v in (self.controls, self.joint_forces))
            yield Rows(*parts, 1)


def advance_worlds(
    worlds: Sequence[Simulation],
    controls: Array | None,
    repeat: int,
    threads: int | None,
    joint_forces: Array | None = None,
    rows: int | None = None,
) -> Course:
    """Advance simulations of alike models by controls and forces by rows, or by so many rows without."""
    threads = usable_cores() if threads is None else option("threads", threads)
    models = [world.model for world in worlds]
    alike = all(model is models[0] for model in models)
    given = controls
    if controls is not None and alike:
        given = clipped(models[0], controls)
    elif controls is not None:
        given = np.array([clipped(model, own) for model, own in zip(models, controls, strict=True)])
    forces = None if joint_forces is None else np.ascontiguousarray(joint_forces)
    rows = controls.shape[1] if rows is None and controls is not None else rows
    cores = [world._core for world in worlds]
    trees = [model.tree for model in (models[:1] if alike else models)]
    course = Course(*_core.run_worlds(trees, cores, given, forces, rows, repeat, threads))
    for world in worlds:
        world._contacts = None
    return course


def advance_watched(
    worlds: Sequence[Simulation],
    rows: Rows,
    repeat: int,
    before_step: BeforeStep | None,
    after_step: AfterStep | None,
    stopped: list[bool],
) -> Course:
    """Does the same as `advance_worlds`, step by step, with the functions before and after each step. Marks
    worlds that after_step stopped.
    """
    model, count = worlds[0].model, len(worlds)
    q, qd, residuals = (np.full((count, rows.count, *n), np.nan) for n in ((model.nq,), (model.nv,), ()))
    missed = np.zeros((count, rows.count), dtype=np.uint64)
    done, failures = [0] * count, [""] * count
    for k, world in enumerate(worlds):
        for row in range(rows.count):
            if stopped[k] or failures[k]:
                break
            if rows.controls is not None:
                world.state.controls = clipped(world.model, rows.controls[k, row])
            if rows.joint_forces is not None:
                world.state.joint_forces = rows.joint_forces[k, row]
            try:
                steps = steps_watched(world, repeat, before_step, after_step)
            except InputError as error:
                failures[k] = str(error)
                break
            residuals[k, row] = max(step.residual for step in steps)
            missed[k, row] = sum(not step.is_sound for step in steps)
            if not steps[-1].advanced:
                failures[k] = f"the velocities came out not finite at t = {world.time:g} s"
                break
            q[k, row], qd[k, row] = world.q, world.qd
            done[k], stopped[k] = row + 1, world._ended
    return Course(q, qd, residuals, missed, done, failures)


def models_of(given: Any) -> list[Model]:
    """One model, or one per world."""
    models = [given] if isinstance(given, Model) or not isinstance(given, Sequence) else list(given)
    for model in models:
        if not isinstance(model, Model):
            raise no_model("model", model)
    if not models:
        raise InputError("model is empty; give a Model, or one per world")
    if difference := same_structure(models):
        raise InputError(f"{difference}; the models of a rollout are variants of one")
    return models


def _worlds(models: list[Model], states: Any, options: dict[str, Any]) -> list[Simulation]:
    if isinstance(states, Sequence) and states and all(isinstance(s, Simulation) for s in states):
        if options:
            raise InputError(f"{', '.join(options)}: simulations have their own options; give states instead")
        for k, (world, model) in enumerate(zip(states, _by_state(models, len(states)), strict=True)):
            if world.model is not model:
                raise InputError(
                    f"states[{k}] is a simulation of another model; give the models of the simulations: "
                    "rollout([s.model for s in states], states)"
                )
            if world.dt != states[0].dt:
                raise InputError(
                    f"states[{k}] has dt = {world.dt:g} s, states[0] {states[0].dt:g} s; make all with one dt"
                )
        return [world.copy() for world in states]
    rows, first = reals("states", states), models[0]
    size = first.nq + first.nv
    if rows.ndim != 2 or rows.shape[1] != size or not len(rows):
        raise InputError(
            f"states has the shape {rows.shape}; it must be (worlds, {size}): nq = {first.nq} coordinates, "
            f"then nv = {first.nv} velocities"
        )
    fresh: dict[int, Simulation] = {}
    for model in models:
        if id(model) not in fresh:
            fresh[id(model)] = Simulation(model, **options)
    worlds = [fresh[id(model)].copy() for model in _by_state(models, len(rows))]
    for k, (world, row) in enumerate(zip(worlds, rows, strict=True)):
        with about(f"states[{k}]"):
            world.reset(q=row[: first.nq], qd=row[first.nq :])
    return worlds


def _by_state(models: list[Model], worlds: int) -> list[Model]:
    if len(models) not in (1, worlds):
        raise InputError(f"there are {len(models)} models but {worlds} states; give one model, or one each")
    return models * worlds if len(models) == 1 else models


def _rows(model: Model, controls: Any, joint_forces: Any, worlds: int, steps: int | None) -> Rows:
    count = None if steps is None else option("steps", steps)
    given: list[Array | None] = []
    for what, values, columns, size in (
        ("controls", controls, "controls", len(model.control_names)),
        ("joint_forces", joint_forces, "nv", model.nv),
    ):
        if values is not None:
            values = _by_world(what, values, worlds, columns, size)
            if count is not None and count != values.shape[1]:
                said = f"steps = {count}" if steps is not None else f"controls has {count} rows"
                raise InputError(f"{said}, but {what} has {values.shape[1]} rows; give one of them")
            count = values.shape[1]
        given.append(values)
    if count is None:
        raise InputError("rollout needs controls, or steps to go without")
    return Rows(*given, count)


def _by_world(what: str, values: Any, worlds: int, columns: str, size: int) -> Array:
    """(worlds, rows, size), of an array that may be without worlds."""
    given = reals(what, values)
    if given.ndim == 2:
        given = np.broadcast_to(given, (worlds, *given.shape))
    if given.ndim != 3 or given.shape[0] != worlds or given.shape[2] != size or not given.shape[1]:
        raise InputError(
            f"{what} has the shape {np.shape(values)}; it must be (worlds, rows, {columns}) = "
            f"({worlds}, rows, {size}), or (rows, {size})"
        )
    if not np.isfinite(given).all():
        where = ", ".join(map(str, np.argwhere(~np.isfinite(given))[0]))
        raise InputError(f"{what}[{where}] is not finite")
    return given


def _report(worlds: Sequence[Simulation], residuals: Array, missed: Array, repeat: int) -> None:
    """Reports steps that did not converge, once for all worlds."""
    largest = float(np.nanmax(residuals, initial=0.0))  # those of worlds that stopped are NaN
    counted = step_counts.saw(largest, steps=residuals.size * repeat, missed=int(missed.sum()))
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
