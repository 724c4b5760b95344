"""Linear models of a time step: how the state after it follows from the state and the inputs before it.

x+ = f(x, u) by central differences, each a step of a copy of the simulation; the copies run side by side.
The step is one of a motion that lasts: rates are those of the middles of steps, and inputs are held since.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from ..checks import Array
from ..guidance import former_names
from ..model.model import Model
from .differences import Stepped, activated, entries_of, names_of, nonsmooth_of, steadied


@former_names(kinks="nonsmooth")
@dataclass(frozen=True)
class Linearisation:
    """x+ - f(x0, u0) = A (x - x0) + B (u - u0) for one time step dt.

    x: the changes of q along qd from the present q (nv), qd (nv), activations (na). For hinges and slides
    rad and m, rad/s and m/s; of floating bases and balls in the axes of `qd`. u: the controls, in the order
    of `Model.control_names`, or the forces along qd (N, N m). The rates are those of the middles of the last
    step and of the next one: with them undamped motions neither grow nor decay.

    >>> linear = Simulation(scenes.make("pendulum", angle=0)).linearise()
    >>> linear.A.shape
    (2, 2)
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
    nonsmooth: tuple[str, ...] = ()
    """names of states and inputs whose differences to both sides disagree: no derivative is there"""


def linearise_core(
    core: _core.Simulation,
    model: Model,
    dt: float,
    inputs: str,
    threads: int | None,
    margin: float | None = None,
) -> Linearisation:
    """See `Simulation.linearise`."""
    core = steadied(core)
    q, qd = model.tree.coordinates(core)
    stepped = Stepped(core, q, threads, steady=True)
    entries = entries_of(core, model, inputs, margin)
    sides = stepped.sides(entries)
    if margin is not None:
        stepped.unbent(entries, sides)
    start = np.concatenate([np.zeros(model.nv), qd, core.activations[activated(model)]])
    size = len(start)
    slopes = np.array([side.slope for side in sides]).reshape(len(sides), size + model.nv)
    matrix = slopes[:, :size].T
    states, driven = names_of(model, inputs)
    nonsmooth = nonsmooth_of(states + driven, entries, sides, stepped.middle)
    return Linearisation(
        matrix[:, :size].copy(),
        matrix[:, size:].copy(),
        stepped.middle[:size] - start,
        dt,
        states,
        driven,
        stepped.residual,
        nonsmooth,
    )
