"""Derivatives of a loss over whole rollouts: backwards through the derivatives of their steps.

A tape keeps the state before each row. The steps of a row are made again from it, with the same bits, as the
way back needs them. So a tape takes little memory, and a rollout with one takes little more time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, reals
from ..errors import InputError
from ..model.model import Model
from .derivative import Derivative
from .driving import clipped
from .tangent import along_velocities, of_coordinates


@dataclass(frozen=True)
class Gradient:
    """Derivatives of a loss over what a rollout was given, as `Rollout.vjp` returns them.

    >>> worlds = rollout(scenes.make("pendulum"), np.zeros((3, 2)), steps=10, tape=True)
    >>> worlds.vjp(q=np.ones_like(worlds.q)).q.shape
    (3, 1)
    """

    q: Array
    """(worlds, nq), over q at the start. A loss does not change with the length of a quaternion"""
    qd: Array
    """(worlds, nv), over qd at the start"""
    inputs: Array
    """(worlds, rows, controls), (worlds, rows, nv) of joint forces or (worlds, rows, 0). 0 where a control is
    beyond a limit"""
    parameters: Array
    """(worlds, parameters)"""
    differentiable: Array
    """(worlds, rows) of bool: whether all steps of a row are; True where the loss does not depend on them"""
    margin: Array
    """(worlds, rows), m/s: the least `Derivative.margin` of the steps of a row, infinite without any"""


@dataclass
class Tape:
    """The way of a rollout: its inputs, and its states."""

    controls: Array | None
    """(worlds, rows, controls)"""
    joint_forces: Array | None
    """(worlds, rows, nv)"""
    repeat: int
    before: list[list[_core.State]] = field(default_factory=list)
    """rows of worlds: the state before each row"""

    def add(self, worlds: Sequence[Any]) -> None:
        self.before.append([world._core.snapshot() for world in worlds])


@dataclass(frozen=True)
class _Asked:
    """The request of a way back."""

    parameters: list[str]
    inputs: str
    threads: int | None


def gradient(
    tape: Tape,
    worlds: Sequence[Any],
    q: Array,
    cotangents: tuple[Array, Array],
    parameters: Iterable[str],
    inputs: str | None,
    threads: int | None,
) -> Gradient:
    """See `Rollout.vjp`. worlds: simulations of the rollout; q: its coordinates."""
    names = [parameters] if isinstance(parameters, str) else list(parameters)
    inputs = inputs or (
        "controls" if tape.controls is not None or tape.joint_forces is None else "joint_forces"
    )
    asked = _Asked(names, inputs, threads)
    found = [
        _of_world(tape, k, worlds[k], q[k], [c[k] for c in cotangents], asked) for k in range(len(worlds))
    ]
    return Gradient(*(np.array(part) for part in zip(*found, strict=True)))


def _of_world(
    tape: Tape, k: int, world: Any, q: Array, cotangents: Sequence[Array], asked: _Asked
) -> tuple[Array, ...]:
    """The parts of a gradient that belong to one world."""
    model, rows = world.model, len(q)
    sim = world.copy()
    width = {"controls": len(model.control_names), "joint_forces": model.nv, "none": 0}[asked.inputs]
    inputs, by_parameters = np.zeros((rows, width)), np.zeros(len(asked.parameters))
    smooth, margin = np.ones(rows, dtype=bool), np.full(rows, np.inf)
    adjoint: Array | None = None
    for row in reversed(range(rows)):
        by_q, by_qd = along_velocities(model, q[row], cotangents[0][row]), cotangents[1][row]
        if adjoint is None:
            if not (by_q.any() or by_qd.any()):
                continue
            adjoint = np.zeros(2 * model.nv + _activations(model))
        adjoint[: model.nv] += by_q
        # The state has the rates of the middle of a step; a row has those of its end.
        seen: Array | None = by_qd
        for number, step in reversed(list(enumerate(_steps_of(tape, k, row, sim, asked)))):
            back = step.vjp(adjoint, seen)
            adjoint, seen = back.state, None
            by_parameters += back.parameters
            inputs[row] += back.inputs
            if row > 0 or number > 0:
                inputs[row if number > 0 else row - 1] += back.inputs_before
            smooth[row] &= step.differentiable
            margin[row] = min(margin[row], step.margin)
    if adjoint is None:
        adjoint = np.zeros(2 * model.nv)
    if asked.inputs == "controls" and tape.controls is not None:
        inputs[clipped(model, tape.controls[k]) != tape.controls[k]] = 0
    sim._core.restore(tape.before[0][k])
    by_q = of_coordinates(model, sim.q, adjoint[: model.nv])
    return by_q, adjoint[model.nv : 2 * model.nv], inputs, by_parameters, smooth, margin


def _steps_of(tape: Tape, k: int, row: int, sim: Any, asked: _Asked) -> list[Derivative]:
    """The derivatives of the steps of a row, which are made again."""
    sim._core.restore(tape.before[row][k])
    if tape.controls is not None:
        sim.state.controls = clipped(sim.model, tape.controls[k, row])
    if tape.joint_forces is not None:
        sim.state.joint_forces = tape.joint_forces[k, row]
    found = []
    for _ in range(tape.repeat):
        sim._core.step()
        found.append(sim.derivative(parameters=asked.parameters, inputs=asked.inputs, threads=asked.threads))
    return found


def _activations(model: Model) -> int:
    return sum(drive.dynamics != "none" for drive in model.actuators)


def cotangent(what: str, values: ArrayLike | None, shape: tuple[int, ...]) -> Array:
    """Derivatives of a loss over an array of this shape; None: zero."""
    if values is None:
        return np.zeros(shape)
    given = reals(what, values)
    if given.shape != shape:
        raise InputError(f"{what} has the shape {given.shape}; the rollout has {shape}")
    return given
