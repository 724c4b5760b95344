"""Linear models of a time step: how the state after it follows from the state and the inputs before it.

x+ = f(x, u) by central differences, each a step of a copy of the simulation; the copies run side by side. The
state x has dq (nv), the change of q along qd from the present q, then qd (nv), then the activations of
actuators that have any.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .. import _core
from ..checks import Array
from ..errors import SimulationError
from ..model.model import Model
from .processors import usable_cores
from .tangent import angles, difference, integrate

CHANGE = 1e-6
"""rad, or Model.length: by which coordinates change. Errors are 1e-12 of the third derivative, and 1e-16 /
1e-6 of rounding."""
TOGETHER = 128
"""copies that are kept at a time"""


@dataclass(frozen=True)
class Linearisation:
    """x+ - f(x0, u0) = A (x - x0) + B (u - u0) for one time step dt.

    x: the changes of q along qd from the present q (nv), qd (nv), activations (na). For hinges and slides
    rad and m, rad/s and m/s; of floating bases and balls in the axes of `qd`. u: the controls, in the order
    of `Model.control_names`, or the forces along qd (N, N m).
    """

    A: Array
    """(2 nv + na, 2 nv + na), no units but those of x"""
    B: Array
    """(2 nv + na, inputs)"""
    drift: Array
    """(2 nv + na,), f(x0, u0) - x0: zero where the present state is one of rest"""
    dt: float
    """s"""
    states: tuple[str, ...]
    """names of the entries of x: hip.change, ..., hip.rate, ..., grip.activation"""
    inputs: tuple[str, ...]
    """names of the entries of u: hip.control, or hip.force"""
    residual: float
    """largest natural residual of the steps; above the tolerance A and B are not to be trusted"""


@dataclass(frozen=True)
class Entry:
    """Something that is changed by so much to both sides."""

    kind: str
    """q | qd | activations | controls | joint_forces"""
    index: int
    low: float
    high: float
    """by how much"""


def linearise_core(
    core: _core.Simulation, model: Model, dt: float, inputs: str, threads: int | None
) -> Linearisation:
    """See `Simulation.linearise`."""
    entries = [*_of_state(model), *_of_activations(core, model), *_of_inputs(core, model, inputs)]
    q, qd = model.tree.coordinates(core)
    base = Rows(model, q, dt)
    (middle,), residual = base.after([core.copy()], threads)
    columns = []
    for first in range(0, len(entries), TOGETHER // 2):
        part = entries[first : first + TOGETHER // 2]
        copies = [_changed(core, model, q, qd, e, by) for e in part for by in (e.low, e.high)]
        rows, worst = base.after(copies, threads)
        residual = max(residual, worst)
        for k, entry in enumerate(part):
            columns.append((rows[2 * k + 1] - rows[2 * k]) / (entry.high - entry.low))
    activations = _activated(model)
    start = np.concatenate([np.zeros(model.nv), qd, core.activations[activations]])
    matrix = np.array(columns).reshape(len(columns), len(start)).T
    size = len(start)
    names = _names(model, inputs)
    return Linearisation(
        matrix[:, :size].copy(), matrix[:, size:].copy(), middle - start, dt, *names, residual
    )


class Rows:
    """States of copies of a simulation after a step."""

    def __init__(self, model: Model, q: Array, dt: float) -> None:
        self.model, self.q, self.dt = model, q, dt

    def after(self, copies: list[_core.Simulation], threads: int | None) -> tuple[list[Array], float]:
        """The state of each after a step, and the largest residual."""
        threads = threads or usable_cores()
        q, qd, residuals, _, _, failures = _core.run_worlds(
            self.model.tree, copies, None, None, 1, 1, threads
        )
        if any(failures):
            why = next(failure for failure in failures if failure)
            raise SimulationError(f"there is no linear model here, as a step fails: {why}")
        activations = _activated(self.model)
        rows = [
            np.concatenate([difference(self.model, self.q, q[k, 0]), qd[k, 0], copy.activations[activations]])
            for k, copy in enumerate(copies)
        ]
        return rows, float(residuals.max(initial=0.0))


def _activated(model: Model) -> list[int]:
    return [k for k, drive in enumerate(model.actuators) if drive.dynamics != "none"]


def _of_state(model: Model) -> Iterator[Entry]:
    gravity = float(np.linalg.norm(model.gravity))
    # Rates that fall through Model.length would have; without gravity those that pass it in a second.
    rate = CHANGE * (np.sqrt(gravity / model.length) if gravity > 0 else 1.0)
    units = np.where(angles(model), 1.0, model.length)
    for kind, by in (("q", CHANGE), ("qd", rate)):
        yield from (Entry(kind, k, -by * unit, by * unit) for k, unit in enumerate(units.tolist()))


def _of_activations(core: _core.Simulation, model: Model) -> Iterator[Entry]:
    for k in _activated(model):
        drive, now = model.actuators[k], float(core.activations[k])
        yield _within("activations", k, now, drive.lower_activation, drive.upper_activation)


def _of_inputs(core: _core.Simulation, model: Model, inputs: str) -> Iterator[Entry]:
    if inputs == "controls":
        for k, (lower, upper) in enumerate(model.control_limits):
            yield _within("controls", k, float(core.controls[k]), lower, upper)
    else:
        for k in range(model.nv):
            yield _within("joint_forces", k, float(core.joint_forces[k]), -np.inf, np.inf)


INPUTS = {"controls": None, "joint_forces": None}


def _within(kind: str, index: int, now: float, lower: float, upper: float) -> Entry:
    """At a limit to one side only, beyond which nothing would change."""
    by = CHANGE * max(1.0, abs(now))
    return Entry(kind, index, max(lower - now, -by), min(upper - now, by))


def _changed(
    core: _core.Simulation, model: Model, q: Array, qd: Array, entry: Entry, by: float
) -> _core.Simulation:
    copy, none = core.copy(), np.zeros(model.nv, np.uint8)
    if entry.kind in ("q", "qd"):
        change = np.zeros(model.nv)
        change[entry.index] = by
        if entry.kind == "q":
            model.tree.set_q(copy, integrate(model, q, change), none)
        else:
            model.tree.set_qd(copy, qd + change, none)
    else:
        getattr(copy, entry.kind)[entry.index] += by
    return copy


def _names(model: Model, inputs: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    states = [f"{name}.change" for name in model.qd_names] + [f"{name}.rate" for name in model.qd_names]
    states += [f"{model.actuators[k].name}.activation" for k in _activated(model)]
    if inputs == "controls":
        return tuple(states), tuple(f"{name}.control" for name in model.control_names)
    return tuple(states), tuple(f"{name}.force" for name in model.qd_names)
