"""A model in motion."""

from __future__ import annotations

import copy
import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, chosen, flag, function, number, option, suggestion
from ..errors import InputError, ModelWarning
from ..guidance import guided
from ..hooks import hook
from ..model.model import Model, no_model
from ..model.presets import Keyframe
from ..problem.options import OPTION_TERMS
from ..problem.problem import Problem
from .analysis import derivative_of_last, linear_model
from .coordinates import Values, read_only, spread
from .derivative import Derivative
from .driving import checked_controls, put_keyframe
from .events import ContactEvents, contact_events
from .forces import Forces
from .kinematics import Kinematics
from .linearise import Linearisation
from .options import core_options
from .outcome import Report, Table
from .own_method import OwnMethod
from .sensors import Plan, Readings, plan_of
from .sensors import read as read_sensors
from .state import State
from .tables import contact_table
from .verdict import check_steps

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


class Simulation:
    """A model and its state, advanced in time steps, each one variational inequality.

    dt: time step (s). law: "coulomb" or "associated". method, tolerance, max_iterations, threads: of the
    solve of each step, as in `amontons.vi.solve`.
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

    _plan: Plan | None = None
    """how the sensors are read, made when they are first"""
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
        check_steps(self, core, 1, core.residual, stacklevel=3)
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
            check_steps(self, part.report, part.steps, part.residual, stacklevel=4)
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
    def time(self) -> float:
        """Simulated time (s)."""
        return self._core.time

    @property
    def q(self) -> Array:
        """Generalised coordinates, (nq,), of the present poses; read only, assign a whole array to set them.

        In the order of `Model.coordinates`: of hinges and slides rad and m, of a floating base the position
        of its body frame and its orientation (w, x, y, z), of a ball the rotation (w, x, y, z).
        """
        return read_only(self._model.tree.coordinates(self._core)[0])

    @q.setter
    def q(self, values: ArrayLike) -> None:
        self.set_q(values)

    @property
    def qd(self) -> Array:
        """Generalised velocities, (nv,); read only, assign a whole array to set them.

        Hinges and slides: rad/s and m/s. Floating base: the velocity of its frame's origin in world axes,
        then its angular velocity in body axes. Ball: the angular velocity in the axes of body A.
        """
        return read_only(self._model.tree.coordinates(self._core)[1])

    @qd.setter
    def qd(self, values: ArrayLike) -> None:
        self.set_qd(values)

    @property
    def qdd(self) -> Array:
        """Generalised accelerations, (nv,), of which the last step's forces are the cause; zeros before it.

        Means from the middle of the step before to that of the last one.
        """
        return read_only(self._model.tree.rates(self._core))

    def set_q(self, values: Values) -> None:
        """Move the bodies to coordinates, all of them (nq,) or some by name: {"hip": 0.3}.

        Bodies go where the tree of joints puts them; qd stays. Quaternions are normalised. Where joints close
        loops or are coupled, the coordinates that were not named follow, as little as it takes; of an array
        all may. Raises InputError naming the joint and its gap if a loop does not close, or the coordinate
        that is not finite; nothing has changed then.
        """
        q, held = spread(self._core, self._model, values, "q")
        self._model.tree.set_q(self._core, q, held)

    def set_qd(self, values: Values) -> None:
        """Set generalised velocities, all of them (nv,) or some by name; as `set_q`, and poses stay."""
        qd, held = spread(self._core, self._model, values, "qd")
        self._model.tree.set_qd(self._core, qd, held)

    @property
    def controls(self) -> Array:
        """The controls of all actuators, then of all motors, in the order of `Model.control_names`.

        Read only, assign a whole array; each is clipped to its `Model.control_limits`. The control of a motor
        is its effort (N, N m), velocity (m/s, rad/s) or position (m, rad).
        """
        return read_only(self._state.controls.copy())

    @controls.setter
    def controls(self, values: ArrayLike) -> None:
        self._state.controls = checked_controls(self._model, values)

    def set_control(self, control: int | str, value: float) -> None:
        """Set one of `controls`, of an actuator or motor by index or name, clipped to its limits.

        The motor of a joint has the joint's name; see `Model.control_names`. InputError for a joint without a
        motor says how it gets one.
        """
        index = self._model.control_index(control)
        lower, upper = self._model.control_limits[index]
        self._state.controls[index] = min(max(number("control", value), lower), upper)

    def apply_keyframe(self, keyframe: int | str | Keyframe) -> None:
        """Put bodies, coordinates and controls as a keyframe says, loads to zero; time goes on.

        keyframe: a name or number of `Model.keyframes`, or a Keyframe of as many bodies and coordinates.
        """
        if not isinstance(keyframe, Keyframe):
            keyframe = self._model.keyframes[self._model.keyframe_index(keyframe)]
        put_keyframe(self._core, self._state, self._model, keyframe)

    def reset(
        self, keyframe: int | str | None = None, *, q: Values | None = None, qd: Values | None = None
    ) -> None:
        """Set the initial state of the model or a keyframe, and then q and qd where they are given.

        Time goes back to zero, or to that of the keyframe; loads, motors and impulses are those of a new
        simulation. q, qd: as in `set_q` and `set_qd`. If they are refused, nothing has changed.
        """
        index = None if keyframe is None else self._model.keyframe_index(keyframe)
        before = self._core.copy()
        self._core.reset()
        self._contacts = None
        try:
            if index is not None:
                self.apply_keyframe(index)
                self._core.set_time(self._model.keyframes[index].time)
            if q is not None:
                self.set_q(q)
            if qd is not None:
                self.set_qd(qd)
        except InputError:
            self._core.assign(before)
            raise

    @property
    def kinematics(self) -> Kinematics:
        """Where everything is at present: joints, links, sites, Jacobians, rays, inverse kinematics."""
        return Kinematics(self)

    @property
    def forces(self) -> Forces:
        """Efforts, reactions and impulses of the last step, and the equations of motion along qd."""
        return Forces(self)

    @property
    def sensors(self) -> Readings:
        """Present readings of the sensors: arrays by name, and all of them as `array`.

        Forces and accelerations are means over the last step. docs/models.md lists the kinds.
        """
        if self._plan is None:
            self._plan = plan_of(self._model)
        return read_sensors(self._core, self._model, self._plan, self.qdd)

    @property
    def contact_events(self) -> ContactEvents:
        """The pairs of geoms that began to carry a contact force in the last step, and those that ceased to.

        (began, ended), arrays with the fields body_a, body_b, geom_a, geom_b, link_a, link_b of `contacts`.
        They compare the last step with the one before it; impacts count. After reset(), load() and unpickling
        every pair that touches begins. Nothing began or ended in a step that failed.
        """
        return contact_events(self._core, self._model)

    def linearise(
        self,
        *,
        inputs: str = "controls",
        contacts: str = "free",
        tolerance: float = 1e-10,
        threads: int | None = None,
    ) -> Linearisation:
        """A and B of one time step: the state after it as a linear function of state and inputs before it.

        By central differences, each a step of a copy; the copies run side by side. `Linearisation` describes
        the state and the inputs, their order and units. Functions of before_step and after_step are not
        called. Each changed state is the nearest one with closed loops.

        inputs: "controls", of actuators and motors, "joint_forces", generalised forces along qd, or "none".
        contacts: "free": each changed step finds its own contacts. Where contacts begin, end or start to
            slide there is no derivative: the numbers then belong to a change of 1e-6, `kinks` names the
            states, and a StepWarning says so. "held": contacts, limits and drives stay open, stick, slide or
            stay at a bound as in the step from here, which is what a feedback about a stance needs.
        tolerance: of the solve of each step, if it is tighter than the simulation's. threads: copies at a
            time, by default one per core; the result does not depend on it.

        Raises SimulationError if a step fails, InputError naming the argument.
        """
        return linear_model(self, inputs, contacts, tolerance, threads)

    def derivative(
        self,
        *,
        parameters: Iterable[str] = (),
        inputs: str = "controls",
        tolerance: float = 1e-11,
        threads: int | None = None,
    ) -> Derivative:
        """The derivative of the step just made, on the faces of its solution: `Derivative`.

        Its rows are the state after the step, its columns state, inputs and parameters before it. Contacts,
        limits, dry friction and bounds of drives stay as they are in the step (open, stick, slide, at a
        bound). `differentiable` says whether that is the derivative of the step itself, `margin` how far the
        next border is. The state does not change, and functions of before_step and after_step are not called.

        parameters: names as "friction:foot", "mass:link2", "damping:elbow", "armature:*", "gain:servo": a
            quantity of `Model.with_` and a name or pattern; of a pattern all change together.
        inputs: "controls" or "joint_forces", as they were during the step, or "none", which takes less time.
        tolerance: to which the step is solved again first, if it can be: redundant joints allow less.

        Raises InputError before the first step, or naming the argument; SimulationError if a step fails.
        """
        return derivative_of_last(self, inputs, parameters, tolerance, threads)

    def problem(self) -> Problem:
        """The variational inequality of the last step (of its last substep); InputError before the first.

        Rows: three per contact (normal, tangent 1, tangent 2) and up to three moments over a length where
        there is torsional or rolling friction, in the order of `contacts`, then those of the joints. Its law
        is that of the simulation: `sim.problem().residual(sim.forces.impulses)` is what the report says.
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

    @classmethod
    def load(cls, path: str | PathLike[str], **options: Any) -> Simulation:
        """The simulation that `save` wrote; `options` replace those that it had.

        limits: an `amontons.Limits`, among the options: what the file may ask for.

        Raises FileNotFoundError, or FileError naming the file and what is wrong.
        """
        return load_file(path, options)

    def __repr__(self) -> str:
        return f"amontons.Simulation({self._model!r}, t = {self.time:g} s, dt = {self.dt:g} s)"

    if not TYPE_CHECKING:  # checkers of types know which names there are

        def __getattr__(self, name: str) -> Any:
            """Only for names that are not there: those of earlier versions say where they are now."""
            if name == "view":
                raise AttributeError("simulation.view() is now amontons.view(simulation)")
            for part in (Kinematics, Forces):
                if not name.startswith("_") and hasattr(part, name):
                    where = part.__name__.lower()
                    raise AttributeError(f"simulation.{name} is now simulation.{where}.{name}")
            raise AttributeError(f"a simulation has no attribute {name!r}{suggestion(name, dir(self))}")
