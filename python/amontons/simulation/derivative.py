"""Derivatives of a time step on the faces of its solution: what is open, sticks or slides goes on to.

The implicit function theorem gives the change of the impulses from the factors of the equations on the faces
(multibody/derivatives/held_faces.hpp). All else is a smooth map: from states and parameters to the problem,
and from impulses to the state after the step. It is differentiated by central differences.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, reals, shown, vector
from ..errors import InputError
from ..model.compiled import Parts
from ..model.coordinates import degrees
from ..model.model import Model
from ..model.quantities import parameter, values_of
from ..model.variants import variant_at
from .differences import (
    CHANGE,
    HELD,
    HELD_REACH,
    UNCHANGED,
    Entry,
    Sides,
    Stepped,
    entries_of,
    felt,
    names_of,
    nonsmooth_of,
)

OPEN_END = 1e-4
"""Relative: by which parameters change, and in their units those of zero. Errors are 1e-8 of the third
derivative. Less would be near rounding: that of positions over dt is in the velocities that close loops."""
INCONSISTENT = 1e-4
"""A held solution whose equations err by more of its change (m/s) has no derivative."""
NEAR = 10.0
"""Changes: margins below so many are borders."""


@dataclass(frozen=True)
class Derivative:
    """The derivative of a step: (q, qd) after it over (q, qd), inputs and parameters before it.

    Rows, and columns of A: changes of q along qd (nv), qd (nv), activations (na), as in `Linearisation`;
    those of rows from the q after the step. qd is that of the middle of a step, with which the next one
    begins. So the derivative of two steps is the product of theirs.

    >>> simulation = Simulation(scenes.make("pendulum"))
    >>> report = simulation.step()
    >>> simulation.derivative().A.shape  # (q, qd) after the step over (q, qd) before it
    (2, 2)
    """

    A: Array
    """(2 nv + na, 2 nv + na)"""
    B: Array
    """(2 nv + na, inputs): of inputs over this step"""
    B_before: Array
    """(2 nv + na, inputs): of inputs over the step before, since forces act from middle to middle"""
    P: Array
    """(2 nv + na, parameters), in the units of the parameters"""
    rates: Array
    """(nv, columns of A, B, B_before and P): of qd at the instant of q, which a simulation shows"""
    dt: float
    """s"""
    states: tuple[str, ...]
    """names of the rows: hip.change, ..., hip.rate, ..."""
    inputs: tuple[str, ...]
    """names of the columns of B"""
    parameters: tuple[str, ...]
    """names of the columns of P, as they were given"""
    differentiable: bool
    """False: the step has no derivative here, and the numbers are those of the faces that it chose"""
    margin: float
    """the least change of a velocity (m/s) that may bring a contact, joint or drive to another face: open,
    stick, slide, at a limit. Infinite if there is no border"""
    reason: str
    """why it is not differentiable; empty if it is"""

    def vjp(self, cotangent: ArrayLike, rates: ArrayLike | None = None) -> Pullback:
        """The products of a row vector, (2 nv + na,), with A, B, B_before and P: of a loss, its derivatives.

        cotangent: of the loss over the state after the step. rates: (nv,), over the qd that the simulation
        shows after it. Raises InputError for another length.
        """
        w = vector("cotangent", cotangent)
        if len(w) != len(self.A):
            raise InputError(f"cotangent has {len(w)} entries; the state has {len(self.A)}")
        parts = [w @ each for each in (self.A, self.B, self.B_before, self.P)]
        if rates is not None:
            seen = vector("rates", rates)
            if len(seen) != len(self.rates):
                raise InputError(f"rates has {len(seen)} entries; qd has {len(self.rates)}")
            ends = np.cumsum([len(part) for part in parts])[:-1]
            parts = [p + more for p, more in zip(parts, np.split(seen @ self.rates, ends), strict=True)]
        return Pullback(*parts)


@dataclass(frozen=True)
class Pullback:
    """Derivatives of a loss over what was before a step.

    >>> simulation = Simulation(scenes.make("pendulum"))
    >>> report = simulation.step()
    >>> simulation.derivative().vjp(np.array([1.0, 0.0])).state.shape
    (2,)
    """

    state: Array
    """(2 nv + na,)"""
    inputs: Array
    """(inputs,), over this step"""
    inputs_before: Array
    """(inputs,), over the step before"""
    parameters: Array
    """(parameters,)"""


@dataclass(frozen=True)
class StepGradient(Pullback):
    """Derivatives of a loss over what was before the step just made, as `Simulation.vjp` returns them.

    >>> simulation = Simulation(scenes.make("pendulum"))
    >>> report = simulation.step()
    >>> back = simulation.vjp(q=[1.0])
    >>> back.q.shape, back.state.shape
    ((1,), (2,))
    """

    q: Array
    """(nq,), over q before the step, per unit of q. A loss does not change with the length of a quaternion"""
    qd: Array
    """(nv,), over the rates with which the step began: of a first step the qd that was set"""
    differentiable: bool
    """as in `Derivative`"""
    margin: float
    """m/s, as in `Derivative`"""
    reason: str
    """why it is not differentiable; empty if it is"""


def cotangent(what: str, values: ArrayLike | None, shape: tuple[int, ...]) -> Array:
    """Derivatives of a loss over an array of this shape; None: zero."""
    if values is None:
        return np.zeros(shape)
    given = reals(what, values)
    if given.shape != shape:
        raise InputError(f"{what} has the shape {given.shape}; it must be {shape}")
    return given


class Held:
    """The last step of a simulation, made again on its faces from nearby states and parameters."""

    def __init__(self, core: _core.Simulation, model: Model, options: _core.SimulationOptions) -> None:
        """core: after the step, solved to rounding; it goes back to the state before it."""
        self.step = _core.HeldStep(core)
        self.model, self._options = model, self.step.options(options, HELD_REACH)
        core.restore_last()
        self._before = core.snapshot()
        self.share = self._before.arrays["last_step"] / self._options.dt
        """how much a load over the step before counts beside one over this: kicks go from middle to middle"""
        self.after = self.simulation()
        """after the held step"""
        self.after.step()
        self.step.close()

    def simulation(self, model: Model | None = None) -> _core.Simulation:
        """Before the step; of a variant of the model."""
        model = model or self.model
        made = _core.Simulation(model.core, self._options)
        if model is self.model:
            made.restore(self._before)
            return made
        arrays = self._before.arrays
        scalars = {name: arrays.pop(name) for name in ("time", "steps", "impulse_step", "last_step")}
        made.restore(_core.State(model.core, arrays=arrays, **scalars))
        return made


def derivative_of(
    held: Held, dt: float, inputs: str, parameters: Iterable[str], threads: int | None, unsound: str
) -> Derivative:
    """See `Simulation.derivative`; unsound: what else keeps the step from having one."""
    model, core = held.model, held.simulation()
    stepped = Stepped(core, model.tree.coordinates(held.after)[0], threads)
    entries = felt(stepped, model, entries_of(core, model, inputs, held.step.margin))
    sides = stepped.sides(entries)
    stepped.unbent(entries, sides)
    before = _before(held, stepped, entries, sides)
    names = [parameters] if isinstance(parameters, str) else list(parameters)
    states, driven = names_of(model, inputs)
    size = len(states)
    moved = [_parameter_slope(held, stepped, name) for name in names]
    slopes = [*(side.slope for side in sides), *before, *moved]
    whole = np.array(slopes).reshape(len(slopes), len(stepped.middle)).T
    matrix, ends = whole[:size], np.cumsum([size, len(driven), len(driven)])
    A, B, B_before, P = (part.copy() for part in np.split(matrix, ends, axis=1))
    of_state = [Sides(side.low[:size], side.high[:size], side.by) for side in sides]
    nonsmooth = nonsmooth_of(states + driven, entries, of_state, stepped.middle[:size])
    reason = unsound or _reason(held.step, nonsmooth)
    return Derivative(
        A,
        B,
        B_before,
        P,
        whole[size:].copy(),
        dt,
        states,
        driven,
        tuple(names),
        not reason,
        held.step.margin,
        reason,
    )


def _before(held: Held, stepped: Stepped, entries: Sequence[Entry], sides: Sequence[Sides]) -> list[Array]:
    """Slopes over the inputs of the step before: of loads a multiple of those over the present ones."""
    inputs = [(e, side) for e, side in zip(entries, sides, strict=True) if e.kind in HELD]
    direct = [e for e, _ in inputs if not _is_load(held.model, e)]
    again = stepped.sides([replace(e, kind=HELD[e.kind]) for e in direct])
    own = {e.index: side.slope for e, side in zip(direct, again, strict=True)}
    return [own.get(e.index, held.share * side.slope) for e, side in inputs]


def _is_load(model: Model, entry: Entry) -> bool:
    """Whether an input is in the step by its mean over the kick alone.

    Activations follow the present control, and motors of speed or place have it for their aim.
    """
    if entry.kind == "joint_forces":
        return True
    actuator, joint, dof = model.core.controls[entry.index]
    if actuator >= 0:
        return model.actuators[actuator].dynamics == "none"
    return model.joints[joint].dofs[dof].motor.kind == "effort"


def remembered_slips(core: _core.Simulation, model: Model) -> list[str]:
    """Names of all that slipped in the last step with a friction that remembers its slip (Stribeck).

    The slip is not among (q, qd), so that the derivative of two steps is not the product of theirs.
    """
    state, found = core.snapshot().arrays, []
    for a, b, *_, slip in state["contacts"].tolist():
        material = model.core.material(int(a), int(b), Parts().make)
        if slip > 0 and material.friction_static is not None and material.stribeck_speed > 0:
            found.append(model.geom_names[int(a)])
    for k, (name, dof) in enumerate(degrees(model.joints)):
        if dof.friction_static is not None and dof.stribeck_speed > 0 and state["dof_slips"][k] > 0:
            found.append(name)
    return list(dict.fromkeys(found))


def _parameter_slope(held: Held, stepped: Stepped, name: str) -> Array:
    near = held.model._neighbours
    if name not in near:
        near[name] = _neighbours_of(held.model, name)
    low, high = near[name]

    def after(model: Model) -> Array:
        return stepped.after([UNCHANGED], held.simulation(model))[0]

    first = stepped.middle if low[1] is held.model else after(low[1])
    return Sides(first, after(high[1]), (low[0], high[0])).slope


def _neighbours_of(model: Model, name: str) -> tuple[tuple[float, Model], tuple[float, Model]]:
    """By how much a parameter changes to both sides, and the variants; 0 and the model for one at zero."""
    what, at = parameter(model, name)
    values = values_of(what, model, at)
    largest = max(map(abs, values))
    by = OPEN_END * largest if largest > 0 else OPEN_END
    ends = (-by, by) if min(values) >= by else (0.0, by)
    low, high = (
        (change, with_values(model, {name: [v + change for v in values]}) if change else model)
        for change in ends
    )
    return low, high


def with_values(model: Model, values: Mapping[str, Sequence[float]]) -> Model:
    """The variant with values of parameters, "damping:elbow", for each of the places that they name."""
    changes: dict[str, dict[int, float]] = {}
    for name, each in values.items():
        what, at = parameter(model, name)
        changes.setdefault(what, {}).update(zip(at, each, strict=True))
    return variant_at(model, changes)


def _reason(step: _core.HeldStep, nonsmooth: Sequence[str]) -> str:
    if step.others:
        return f"contacts or rows of the step change with the state: {step.others} steps were not held"
    if not step.determines_velocities:
        return "the velocities depend on impulses that are not determined (a stack, a table on many legs)"
    if nonsmooth:
        return (
            f"changes of {', '.join(nonsmooth[:3])} differ to both sides: a position is about to be corrected"
        )
    if step.residual > INCONSISTENT * CHANGE:
        return "contacts and joints contradict each other after a change"
    if step.margin < NEAR * CHANGE:
        return f"a contact or drive is at a border between two faces: margin {shown(step.margin)} m/s"
    return ""
