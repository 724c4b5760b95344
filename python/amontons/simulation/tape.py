"""Derivatives of a loss over whole rollouts: backwards through the derivatives of their steps.

A tape keeps the state before each row. The steps of a row are made again from it, with the same bits, as the
way back needs them. So a tape takes little memory, and a rollout with one takes little more time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import _core
from ..checks import Array
from .derivative import StepGradient
from .driving import clipped


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
    cotangents: tuple[Array, Array],
    parameters: Iterable[str],
    inputs: str | None,
    threads: int | None,
) -> Gradient:
    """See `Rollout.vjp`. worlds: simulations of the rollout."""
    names = [parameters] if isinstance(parameters, str) else list(parameters)
    inputs = inputs or (
        "controls" if tape.controls is not None or tape.joint_forces is None else "joint_forces"
    )
    asked = _Asked(names, inputs, threads)
    found = [_of_world(tape, k, worlds[k], [c[k] for c in cotangents], asked) for k in range(len(worlds))]
    return Gradient(*(np.array(part) for part in zip(*found, strict=True)))


def _of_world(
    tape: Tape, k: int, world: Any, cotangents: Sequence[Array], asked: _Asked
) -> tuple[Array, ...]:
    """The parts of a gradient that belong to one world."""
    model, rows = world.model, len(cotangents[0])
    sim = world.copy()
    width = {"controls": len(model.control_names), "joint_forces": model.nv, "none": 0}[asked.inputs]
    inputs, by_parameters = np.zeros((rows, width)), np.zeros(len(asked.parameters))
    smooth, margin = np.ones(rows, dtype=bool), np.full(rows, np.inf)
    back: StepGradient | None = None
    for row in reversed(range(rows)):
        by_q, by_qd = (each[row] for each in cotangents)
        if back is None and not (by_q.any() or by_qd.any()):
            continue
        for number, step in reversed(list(enumerate(_steps_of(tape, k, row, sim)))):
            back = step.vjp(
                by_q,
                by_qd,
                state=back and back.state,
                parameters=asked.parameters,
                inputs=asked.inputs,
                threads=asked.threads,
            )
            by_q = by_qd = None
            by_parameters += back.parameters
            inputs[row] += back.inputs
            if row > 0 or number > 0:
                inputs[row if number > 0 else row - 1] += back.inputs_before
            smooth[row] &= back.differentiable
            margin[row] = min(margin[row], back.margin)
    if asked.inputs == "controls" and tape.controls is not None:
        inputs[clipped(model, tape.controls[k]) != tape.controls[k]] = 0
    start = (np.zeros(model.nq), np.zeros(model.nv)) if back is None else (back.q, back.qd)
    return *start, inputs, by_parameters, smooth, margin


def _steps_of(tape: Tape, k: int, row: int, sim: Any) -> list[Any]:
    """Simulations after each of the steps of a row, which are made again."""
    sim._core.restore(tape.before[row][k])
    if tape.controls is not None:
        sim.state.controls = clipped(sim.model, tape.controls[k, row])
    if tape.joint_forces is not None:
        sim.state.joint_forces = tape.joint_forces[k, row]
    found = []
    for _ in range(tape.repeat):
        sim._core.step()
        found.append(sim.copy())
    return found
