"""A model in motion."""

from __future__ import annotations

import copy
import logging
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from types import MappingProxyType
from typing import Any

import numpy as np

from .. import _core, watching
from ..checks import Array, Vector3, chosen, flag, function, option, suggestion
from ..errors import InputError, ModelWarning, SimulationError, StepWarning
from ..guidance import guided
from ..hooks import hook
from ..model.model import Model, no_model
from ..problem.options import OPTION_TERMS
from ..problem.problem import Problem
from ..visible import visible
from .acting import Acting
from .analysis import Analysis
from .forces import (
    actuator_table,
    contact_sums,
    contact_table,
    effort_table,
    reaction_table,
    tendon_table,
    tensions_of,
)
from .loads import Loads
from .options import core_options
from .outcome import Report, Table
from .own_method import OwnMethod
from .state import State

logger = logging.getLogger(__name__)
ON_FAILURE = {"warn": None, "raise": None, "ignore": None}
BeforeStep = Callable[["Simulation"], object]
AfterStep = Callable[["Simulation", Report], object]
_OF_PROCESS = {
    *("_core", "_state", "_contacts", "_plan", "_in_callback", "_ended", "_before_run", "_after_run")
}
"""attributes that a pickle leaves out"""
PATIENCE = 0.05
"""of a run without callbacks: after so long (s) the compiled module lets Python look at signals"""


@hook
def save_file(simulation: Simulation, path: str | PathLike[str]) -> None:
    """Function behind `Simulation.save`; amontons.io supplies it."""
    raise NotImplementedError("import amontons.io, which writes files")


@hook
def load_file(path: str | PathLike[str], options: dict[str, Any]) -> Simulation:
    """Function behind `Simulation.load`; amontons.io supplies it."""
    raise NotImplementedError("import amontons.io, which reads files")


@hook
def open_viewer(simulation: Simulation, options: dict[str, Any]) -> Any:
    """Function behind `Simulation.view`; amontons.viewer supplies it."""
    raise NotImplementedError("import amontons.viewer, which shows simulations")


class Simulation(Acting, Analysis):
    """A model and its state, advanced in time steps, each one variational inequality.

    dt: time step (s). law: "coulomb" or "associated". method, tolerance, max_iterations, threads: of the
    solve of each step, as in `amontons.solve`.
    method: or a function (problem, x0, options) -> x of the Problem of a step, a start (m,) in K and
    `SolveOptions`, which returns impulses (m,). Our residual judges x: where it misses the tolerance the step
    did not converge and ends with the safe step, as with every method. x that is not finite counts as zero.
    An error of the function ends the step and restores the state; so does x of another shape.
    device, device_contacts: steps with at least so many contacts are solved on the device, a name of
    `amontons.devices()`, by "p-spg-fb" or "apgd", under that method or "auto". Smaller steps, steps with
    cones that the device does not support, and other methods run on the CPU.
    budget: wall clock of a step (s), None for no limit; results then depend on the machine.
    margin: contacts are found up to this gap (m), by default a fiftieth of `Model.length`.
    recovery: correction of errors of position (overlaps, open joints, violated limits). "projection" moves
    the bodies without giving them velocities; smooth motion is of second order. "velocity" pushes them within
    the problem of the step, as Anitescu and Tasora do; it is of first order.
    recovery_speed: errors are taken back no faster (m/s), by default `Model.length` in 0.1 s by projection,
    in 1 s by velocities. restitution_speed: slower impacts do not bounce (m/s), by default 4 |g| dt.
    warm_start: begin each solve with the impulses of the last step.
    max_substeps: a power of two; a step whose residual stays above the tolerance is redone in 2, 4, ...
    parts. on_failure: when it stays there, "warn" (StepWarning), "raise" (SimulationError, with the state put
    back) or "ignore". Velocities that are not finite always raise.

    Raises InputError naming the option.
    """

    before_step: list[BeforeStep]
    """called as f(simulation) before each step, to set controls and loads; they make no steps"""
    after_step: list[AfterStep]
    """called as f(simulation, report) after each step; they make no steps, and a true result ends the
    `run`"""
    _in_callback = False
    _ended = False
    """whether a function of after_step asked the last step to end the run"""
    _before_run: BeforeStep | None = None
    _after_run: AfterStep | None = None
    """what `run` was given"""

    _apart: float = 0.0
    """The error of a joint (m) about which the last warning was given."""

    @guided
    def __init__(
        self,
        model: Model,
        *,
        dt: float = 5e-3,
        law: str = "coulomb",
        method: str | OwnMethod = "auto",
        tolerance: float = 1e-6,
        max_iterations: int | None = None,
        budget: float | None = None,
        threads: int | None = None,
        device: str = "cpu",
        device_contacts: int = 20_000,
        margin: float | None = None,
        recovery: str = "projection",
        recovery_speed: float | None = None,
        restitution_speed: float | None = None,
        warm_start: bool = True,
        max_substeps: int = 1,
        on_failure: str = "warn",
    ) -> None:
        if not isinstance(model, Model):
            raise no_model("model", model)
        if not model.bodies:
            warnings.warn("the model has no bodies: nothing will move; add_body adds one", ModelWarning, 3)
        chosen("on_failure", on_failure, ON_FAILURE)
        given = dict(
            dt=dt,
            law=law,
            method=method,
            tolerance=tolerance,
            max_iterations=max_iterations,
            budget=budget,
            threads=threads,
            device=device,
            device_contacts=device_contacts,
            margin=margin,
            recovery=recovery,
            recovery_speed=recovery_speed,
            restitution_speed=restitution_speed,
            warm_start=flag("warm_start", warm_start),
            max_substeps=max_substeps,
        )
        given = {name: v.item() if isinstance(v, np.generic) else v for name, v in given.items()}
        self._model, self._options = model, given | {"on_failure": on_failure}
        self._state: State
        self._contacts: Table | None
        self._take(_core.Simulation(model.core, core_options(given)))
        self.before_step, self.after_step = [], []

    @property
    def model(self) -> Model:
        """The model, shared and never changed."""
        return self._model

    @property
    def options(self) -> Mapping[str, Any]:
        """The options as they were given, by name; read only."""
        return MappingProxyType(self._options)

    @property
    def dt(self) -> float:
        """Time step (s)."""
        return float(self._options["dt"])

    @property
    def steps(self) -> int:
        """Number of steps since the start."""
        return self._core.steps

    @property
    def state(self) -> State:
        """The state of the simulation: views of the arrays that a step changes."""
        return self._state

    @property
    def margin(self) -> float:
        """The gap up to which contacts are found (m)."""
        return self._core.margin

    @property
    def recovery_speed(self) -> float:
        """The speed at which errors of position are taken back, at most (m/s)."""
        return self._core.recovery_speed

    @property
    def restitution_speed(self) -> float:
        """Slower impacts do not bounce (m/s)."""
        return self._core.restitution_speed

    def step(self) -> Report:
        """Advance by dt.

        Raises InputError if the state, loads or controls are not usable, and SimulationError as `on_failure`
        says. The state is then that before the step; `contacts` and `problem` show the attempt that failed.
        """
        self._require_no_callback()
        self._call(self.before_step, self._before_run)
        self._contacts = None
        core = self._core.step()
        self._check(core, 1, core.residual, stacklevel=3)
        report = Report(core)
        self._ended = self._call(self.after_step, self._after_run, report)
        return report

    def _call(self, functions: Sequence[Callable[..., object]], last: Any, *report: Report) -> bool:
        """Calls what goes before or after a step; whether one returned something true."""
        if last is not None:
            functions = [*functions, last]
        elif not functions:
            return False
        self._in_callback = True
        try:
            return any([bool(function(self, *report)) for function in functions])
        finally:
            self._in_callback = False

    def _require_no_callback(self) -> None:
        if self._in_callback:
            raise InputError(
                "before_step and after_step make no step of their own simulation, which is within one; step "
                "a copy()"
            )

    def _steps_watched(
        self, count: int, before_step: BeforeStep | None, after_step: AfterStep | None
    ) -> list[_core.Report]:
        """At most so many steps with what is called before and after each, and without a word about them."""
        made: list[_core.Report] = []
        self._ended = False
        while len(made) < count and not self._ended and (not made or made[-1].advanced):
            self._call(self.before_step, before_step)
            self._contacts = None
            made.append(self._core.step())
            self._ended = made[-1].advanced and self._call(self.after_step, after_step, Report(made[-1]))
        return made

    def _check(self, last: _core.Report, steps: int, residual: float, stacklevel: int) -> None:
        """After some steps, of which only the last can have failed: what `on_failure` says of it."""
        if not last.advanced:
            raise SimulationError(
                f"the velocities at t = {self.time:g} s came out not finite, or beyond 1e15 m/s "
                f"({last.status}); the state is that before the step. Look for loads or speeds out of any "
                "proportion, or make dt smaller"
            )
        if logger.isEnabledFor(logging.DEBUG):
            logger.debug(
                "t = %g s: %s, residual %.1e, %d iterations, %d contacts",
                *(last.time, last.status, residual, last.iterations, last.contacts),
            )
        usual = last.is_usual(self._model.length)
        counted = watching.saw(residual, steps=steps, missed=not usual and not last.is_sound)
        if usual:
            return
        on_failure = self._options["on_failure"]
        if on_failure != "ignore":
            self._check_joints(last, stacklevel + 1)
        if last.is_sound or on_failure == "ignore" or (counted and on_failure == "warn"):
            return
        if not last.balanced:
            what = f"gained {last.energy_balance:.3g} J from nothing"
        elif last.residual > self._options["tolerance"]:
            what = (
                f"has a residual of {last.residual:.2e}, above the tolerance {self._options['tolerance']:g}"
            )
        else:  # of the whole; beside heavy bodies it does not see light ones
            what = f"leaves light bodies with wrong velocities, at a residual of {last.residual:.2e}"
        message = f"the step to t = {last.time:g} s {what} ({last.method}: {last.status})"
        if on_failure == "raise":
            self._core.restore_last()
            raise SimulationError(
                f"{message}; the state is that before the step. Allow max_substeps, more iterations or a "
                "looser tolerance"
            )
        warnings.warn(message, StepWarning, stacklevel=stacklevel)

    def _check_joints(self, last: _core.Report, stacklevel: int) -> None:
        """Warn about a joint that stays apart by more than Model.length / 1000; again at twice the error."""
        length = self._model.length
        error = max(last.joint_error, length * last.joint_angle_error)
        if last.joints_close or last.worst_joint < 0 or error <= max(length / 1000, 2 * self._apart):
            return
        self._apart = error
        name = visible(self._model.joint_names[last.worst_joint])
        message = (
            f'joint "{name}" is apart by {error:.2g} m at t = {last.time:g} s (angles times Model.length): '
            "its constraints contradict others, or dt is too long for the motion"
        )
        warnings.warn(message, StepWarning, stacklevel=stacklevel)

    def run(
        self,
        duration: float,
        *,
        before_step: BeforeStep | None = None,
        after_step: AfterStep | None = None,
    ) -> Report:
        """Step until `duration` (s) has passed and return the last report.

        before_step: called as before_step(simulation) before each step, to set controls and loads.
        after_step: called as after_step(simulation, report) after each step; a true result ends the run.
        They come after those in the lists `Simulation.before_step` and `after_step`. Without any of them all
        steps are made by the compiled module; Ctrl-C ends between two of them.
        """
        steps = max(1, math.ceil(option("duration", duration) / self.dt - 1e-9))
        function("before_step", before_step)
        function("after_step", after_step)
        watched = before_step or after_step or self.before_step or self.after_step
        if not watched and type(self).step is Simulation.step:
            return self._run(steps)
        self._require_no_callback()
        self._before_run, self._after_run = before_step, after_step
        try:
            for _ in range(steps):
                self._ended = False
                report = self.step()
                if self._ended:
                    break
        finally:
            self._before_run = self._after_run = None
        return report

    def _run(self, steps: int) -> Report:
        self._require_no_callback()
        self._contacts = None
        while True:  # between two parts Python looks at signals
            part = self._core.run(steps, PATIENCE)
            self._check(part.report, part.steps, part.residual, stacklevel=4)
            steps -= part.steps
            if steps <= 0:
                return Report(part.report)

    @property
    def contacts(self) -> Table:
        """The contact points of the last step, a structured array with the fields of docs/simulation.md."""
        if self._contacts is None:
            self._contacts = contact_table(self._core, self._model)
        return self._contacts

    @property
    def joint_reactions(self) -> Table:
        """Force (N) and torque (N m) of each joint's locked directions on its body A, world axes.

        Fields: joint, body_a, body_b, point (m, where A held the joint at the start of the step; the torque
        is about it), force, torque. Impacts are in them; what acts along the free directions is in
        `joint_efforts`.
        """
        return reaction_table(self._core)

    @property
    def joint_efforts(self) -> Table:
        """Efforts along each degree of freedom in the last step (N or N m), and its coordinate.

        Fields: joint, dof, coordinate, control (of its motor, NaN without one), passive (spring, damper and
        armature), motor (with the actuators on it), friction, limit. The coordinate is that of the instant to
        which efforts belong, the start of the step (`instant`).
        """
        return effort_table(self._core)

    @property
    def tendon_efforts(self) -> Table:
        """Forces along each tendon in the last step (N, N m), and its present length.

        Fields: tendon, length (m, or the unit of its joints), rate, passive (spring, damper and armature),
        friction, limit; efforts are positive where they lengthen it. Actuators are in `actuator_efforts`.
        """
        return tendon_table(self._core)

    def tensions(self, tendon: int | str) -> Array:
        """Tensions (N) of the parts of a rope with friction on its path in the last step, (places + 1,).

        The places are those of its path with friction, in their order; a belt has two parts. A tension is
        positive where the rope pulls; a slack rope has none. InputError for a tendon without friction on its
        path: `tendon_efforts` has its forces.
        """
        return tensions_of(self.model, self._core, tendon)

    @property
    def actuator_efforts(self) -> Table:
        """Effort of each actuator in the last step, and its present length.

        Fields: actuator, control, activation, length, rate (of its transmission, gear included), effort (N,
        N m).
        """
        return actuator_table(self._core)

    def loads(self) -> Loads:
        """Collect the loads of joints and contacts from the next step on: `Loads`, until its stop().

        Usable as `with simulation.loads() as loads: simulation.run(2.0)`; then `loads.joints` and
        `loads.contacts` have peak, time of the peak, mean, rms and impulse of each component.
        """
        loads = Loads(self._model)
        loads.watch(self)
        return loads

    def contact_forces(self) -> tuple[Array, Array]:
        """Sums over the contacts of each body in the last step: forces (n, 3) (N) and torques (n, 3) (N m).

        Torques are about the centres of mass, in world axes.
        """
        return contact_sums(self._core, self.contacts, len(self._model.bodies))

    @property
    def impulses(self) -> Array:
        """The solution x of the last step's problem, in the order and the units of its rows (N s, N m s)."""
        core = self._core.problem
        if core is None or not core.has_moments:
            return self._core.impulses
        return self.problem()._from_units(self._core.impulses)

    def problem(self) -> Problem:
        """The variational inequality of the last step (of its last substep); InputError before the first.

        Rows: three per contact (normal, tangent 1, tangent 2) and up to three moments over a length where
        there is torsional or rolling friction, in the order of `contacts`, then those of the joints. Its law
        is that of the simulation: `sim.problem().residual(sim.impulses)` is what the report says.
        """
        core = self._core.problem
        if core is None:
            raise InputError("there is no problem before the first step; call step() first")
        return Problem._from_core(
            core,
            name=f"step {self.steps}",
            description=f"t = {self.time:g} s, dt = {self.dt:g} s, law {self._options['law']}",
            source="amontons.Simulation",
        )

    def momentum(self) -> tuple[Vector3, Vector3]:
        """Linear momentum (N s), and angular momentum about the world's origin (N m s), of dynamic bodies."""
        linear, angular = self._core.momentum()
        return tuple(linear), tuple(angular)  # type: ignore[return-value]

    def change_options(self, **options: Any) -> None:
        """Give options of the simulation (dt, law, method, tolerance, ...) other values; the state stays.

        `state` is a new view; arrays taken from the old one show the past. InputError, with nothing changed,
        if an option is unknown or its value cannot be used.
        """
        if unknown := set(options) - set(self._options):
            known = ", ".join(sorted(self._options))
            near = suggestion(
                min(unknown), self._options, OPTION_TERMS | {"timestep": "dt", "time-step": "dt"}
            )
            raise InputError(f"unknown option {min(unknown)!r} of a simulation{near}; known are {known}")
        changed = Simulation(self._model, **{**self._options, **options})
        changed._core.restore(self._core.snapshot())
        self._options = changed._options
        self._take(changed._core)

    def _take_model(self, model: Model) -> None:
        """Begin again with a variant of the model. A viewer that shows this simulation sees it go on."""
        fresh = Simulation(model, **self._options)
        self._model = model
        self._take(fresh._core)

    def copy(self) -> Simulation:
        """A simulation that goes on from here bit for bit, and shares with this one only the model.

        Its lists `before_step` and `after_step` are its own and hold the same functions. `copy.copy` and
        `copy.deepcopy` do the same. Pickling leaves out the tables of the last step (contacts, reactions,
        problem), which the next step makes again.
        """
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other.before_step, other.after_step = list(self.before_step), list(self.after_step)
        other._options = dict(self._options)
        other._in_callback = other._ended = False
        other._before_run = other._after_run = None
        other._take(self._core.copy())
        return other

    def __copy__(self) -> Simulation:
        return self.copy()

    def __deepcopy__(self, memo: dict[int, Any]) -> Simulation:
        other = self.copy()
        memo[id(self)] = other
        own = {
            "_core",
            "_model",
            "_options",
            "_state",
            "_contacts",
            "_plan",
            "_in_callback",
            "_ended",
            "_before_run",
            "_after_run",
            "before_step",
            "after_step",
        }
        for name, value in self.__dict__.items():  # what a user has put there
            if name not in own:
                setattr(other, name, copy.deepcopy(value, memo))
        return other

    def __getstate__(self) -> dict[str, Any]:
        values = {name: v for name, v in self.__dict__.items() if name not in _OF_PROCESS}
        snapshot = self._core.snapshot()
        return values | {"_arrays": snapshot.arrays}

    def __setstate__(self, values: dict[str, Any]) -> None:
        arrays = values.pop("_arrays")
        self.__dict__.update(values)
        core = _core.Simulation(self._model.core, core_options(self._options))
        scalars = {name: arrays.pop(name) for name in ("time", "steps", "impulse_step", "last_step")}
        core.restore(_core.State(self._model.core, arrays=arrays, **scalars))
        self._take(core)

    def _set_clock(self, time: float, steps: int) -> None:
        """Take over a time and a number of steps from a recording."""
        snapshot = self._core.snapshot()
        arrays = snapshot.arrays
        arrays |= {"time": time, "steps": steps}
        scalars = {name: arrays.pop(name) for name in ("time", "steps", "impulse_step", "last_step")}
        self._core.restore(_core.State(self._model.core, arrays=arrays, **scalars))
        self._take(self._core)

    def _take(self, core: _core.Simulation) -> None:
        """Go on with another compiled simulation."""
        self._core, self._state, self._contacts = core, State(core), None

    def save(self, path: str | PathLike[str]) -> None:
        """Write model, options and state to an HDF5 file from which `load` continues bit for bit.

        Functions of before_step and after_step are not stored. Raises FileError; no partial file is left.
        """
        save_file(self, path)

    def view(self, **options: Any) -> Any:
        """Show the simulation on a page in the browser: `amontons.view`, which says what the options are."""
        return open_viewer(self, options)

    @classmethod
    def load(cls, path: str | PathLike[str], **options: Any) -> Simulation:
        """The simulation that `save` wrote; `options` replace those that it had.

        limits: an `amontons.Limits`, among the options: what the file may ask for.

        Raises FileNotFoundError, or FileError naming the file and what is wrong.
        """
        return load_file(path, options)

    def __repr__(self) -> str:
        return f"amontons.Simulation({self._model!r}, t = {self.time:g} s, dt = {self.dt:g} s)"
