"""A model in motion."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping
from os import PathLike
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, chosen, flag, number
from ..errors import ModelWarning
from ..guidance import guided
from ..model.model import Model, no_model
from ..model.presets import Keyframe
from ..problem.problem import Problem
from .coordinates import Values, read_only, spread
from .copies import copied, copied_deeply, pickled, unpickle
from .driving import checked_controls, put_keyframe, put_start
from .events import ContactEvents, contact_events
from .forces import Forces
from .kinematics import Kinematics
from .options import core_options, require_known
from .own_method import OwnMethod
from .part import no_attribute
from .saving import load_file, save_file
from .sensors import Plan, Readings, plan_of
from .sensors import read as read_sensors
from .state import State
from .step_report import Report, Table
from .stepping import make_step, run
from .tables import contact_table

if TYPE_CHECKING:
    from .derivative import Derivative, StepGradient
    from .linearise import Linearisation

ON_FAILURE = {"warn": None, "raise": None, "ignore": None}
BeforeStep = Callable[["Simulation"], object]
AfterStep = Callable[["Simulation", Report], object]


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
    cones that the device does not support, and other methods run on the CPU. Models of at least so many geoms
    have their pairs searched there; contacts are the same to the last bit.
    budget: wall clock of a step (s), None for no limit; results then depend on the machine.
    margin: contacts are found up to this gap (m), by default a fiftieth of `Model.length`.
    recovery: correction of errors of position (overlaps, open joints, violated limits). "projection" moves
    the bodies without giving them velocities; smooth motion is of second order. "velocity" pushes them within
    the problem of the step, as Anitescu and Tasora do; it is of first order.
    recovery_speed: largest correction speed (m/s), by default `Model.length` / 0.1 s by projection,
    / 1 s by velocities. restitution_speed: slower impacts do not bounce (m/s), by default 4 |g| dt.
    warm_start: begin each solve with the impulses of the last step.
    max_substeps: a power of two; a step whose residual stays above the tolerance is redone in 2, 4, ...
    parts. on_failure: when it stays there, "warn" (StepWarning), "raise" (SimulationError, with the state put
    back) or "ignore". Velocities that are not finite always raise.

    Raises InputError naming the option.

    >>> simulation = Simulation(scenes.make("stack"), dt=5e-3, tolerance=1e-8)
    >>> report = simulation.run(0.5)
    >>> report.converged, report.residual <= 1e-8, round(simulation.time, 9)
    (True, True, 0.5)
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

    _plan: Plan | None = None  # how the sensors are read, made when they are first
    _apart: float = 0.0  # the error of a joint (m) about which the last warning was given

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
        flag("warm_start", warm_start)
        given = {name: v for name, v in locals().items() if name not in ("self", "model", "on_failure")}
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
        """Largest speed at which errors of position are corrected (m/s)."""
        return self._core.recovery_speed

    @property
    def restitution_speed(self) -> float:
        """Slower impacts do not bounce (m/s)."""
        return self._core.restitution_speed

    def step(self) -> Report:
        """Advance by dt.

        Raises InputError if the state, loads or controls are not usable, and SimulationError as `on_failure`
        says. The state is then that before the step; `contacts` and `problem` show the attempt that failed.

        >>> simulation = Simulation(scenes.make("stack"))
        >>> simulation.step().status
        'converged'
        """
        return make_step(self)

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

        >>> simulation = Simulation(scenes.make("pendulum"))
        >>> report = simulation.run(1.0, after_step=lambda s, r: s.time > 0.2)  # stop early
        >>> round(simulation.time, 3)
        0.2
        """
        return run(self, duration, before_step, after_step, type(self).step is Simulation.step)

    @property
    def contacts(self) -> Table:
        """The contact points of the last step, a structured array with the fields of docs/contacts.md."""
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
        """Generalised accelerations, (nv,), caused by the forces of the last step; zeros before it.

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

        >>> simulation = Simulation(load_model(examples.path("arm.xml")))
        >>> simulation.set_control("elbow", -0.4)
        >>> float(simulation.controls[simulation.model.control_index("elbow")])
        -0.4
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

        >>> simulation = Simulation(scenes.make("pendulum"))
        >>> report = simulation.run(0.5)
        >>> simulation.reset()
        >>> simulation.time
        0.0
        """
        put_start(self, keyframe, q, qd)

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
            slide there is no derivative: the numbers then belong to a change of 1e-6, `nonsmooth` names the
            states, and a StepWarning says so. "held": contacts, limits and drives stay open, stick, slide or
            stay at a bound as in the step from here, which is what a feedback about a stance needs.
        tolerance: of the solve of each step, if it is tighter than the simulation's. threads: copies at a
            time, by default one per core; the result does not depend on it.

        Raises SimulationError if a step fails, InputError naming the argument.

        >>> linear = Simulation(scenes.make("pendulum", angle=0)).linearise()
        >>> linear.A.shape, linear.states
        ((2, 2), ('hinge.change', 'hinge.rate'))
        """
        from .analysis import linear_model

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
        from .analysis import derivative_of_last

        return derivative_of_last(self, inputs, parameters, tolerance, threads)

    def vjp(
        self,
        q: ArrayLike | None = None,
        qd: ArrayLike | None = None,
        *,
        state: ArrayLike | None = None,
        parameters: Iterable[str] = (),
        inputs: str = "controls",
        tolerance: float = 1e-11,
        threads: int | None = None,
    ) -> StepGradient:
        """Derivatives of a loss backwards through the step just made: over what was before it.

        q, qd: (nq,) and (nv,), derivatives of the loss over `q` and `qd` after the step, in units of the loss
            per m, rad, m/s or rad/s; None is zero. The part along a quaternion has no influence.
        state: (2 nv + na,), `StepGradient.state` of the next step, through which the loss depends on this
            one as well.
        parameters, inputs, tolerance, threads: as in `derivative`, of which the result is the product with
            its transposed matrices. It takes the same time.

        Raises InputError before the first step, or naming the argument; SimulationError if a step fails.

        >>> simulation = Simulation(scenes.make("pendulum"), dt=1e-3)
        >>> report = simulation.step()
        >>> back = simulation.vjp(q=[1.0])  # the loss is the angle after the step
        >>> round(float(back.qd[0]), 5)  # s: dt, which the rate before lasts
        0.001
        """
        from .analysis import vjp_of_last

        given = {"q": q, "qd": qd, "state": state}
        return vjp_of_last(self, given, inputs, parameters, tolerance, threads)

    def problem(self) -> Problem:
        """The variational inequality of the last step (of its last substep); InputError before the first.

        Rows: three per contact (normal, tangent 1, tangent 2) and up to three moments over a length where
        there is torsional or rolling friction, in the order of `contacts`, then those of the joints. Its law
        is that of the simulation: `sim.problem().residual(sim.forces.impulses)` is what the report says.

        >>> simulation = Simulation(scenes.make("stack"))
        >>> report = simulation.run(0.1)
        >>> simulation.problem().solve(method="apgd").converged
        True
        """
        from .analysis import problem_of_last

        return problem_of_last(self)

    def change_options(self, **options: Any) -> None:
        """Give options of the simulation (dt, law, method, tolerance, ...) other values; the state stays.

        `state` is a new view; arrays taken from the old one show the past. InputError, with nothing changed,
        if an option is unknown or its value cannot be used.
        """
        require_known(options, self._options)
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

        >>> simulation = Simulation(scenes.make("pendulum"))
        >>> other = simulation.copy()
        >>> simulation.run(0.5).energy == other.run(0.5).energy  # bit for bit
        True
        """
        return copied(self)

    def __copy__(self) -> Simulation:
        return self.copy()

    def __deepcopy__(self, memo: dict[int, Any]) -> Simulation:
        return copied_deeply(self, memo)

    def __getstate__(self) -> dict[str, Any]:
        return pickled(self)

    def __setstate__(self, values: dict[str, Any]) -> None:
        unpickle(self, values)

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
        loaded: Simulation = load_file(path, options)
        return loaded

    def __repr__(self) -> str:
        return f"amontons.Simulation({self._model!r}, t = {self.time:g} s, dt = {self.dt:g} s)"

    if not TYPE_CHECKING:  # checkers of types know which names there are

        def __getattr__(self, name: str) -> Any:
            """Only for names that are not there: those of earlier versions say where they are now."""
            raise no_attribute(self, name, (Kinematics, Forces))
