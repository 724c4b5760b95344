"""Rollouts and their derivatives on arrays of NumPy, for `amontons.torch` and `amontons.jax`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import Array, option, reals
from ..errors import InputError
from ..model.model import Model, no_model
from ..model.quantities import parameter
from ..simulation.derivative import with_values
from ..simulation.rollout import Rollout, rollout


@dataclass(frozen=True)
class Program:
    """A rollout but for its numbers."""

    model: Model
    names: tuple[str, ...]
    """parameters"""
    repeat: int
    steps: int | None
    """rows, where there are no controls"""
    threads: int | None
    options: tuple[tuple[str, Any], ...]


def program(
    model: Model, names: Any, repeat: int, steps: int | None, threads: int | None, options: Mapping[str, Any]
) -> Program:
    if not isinstance(model, Model):
        raise no_model("model", model)
    for name in names:
        parameter(model, name)
    return Program(model, tuple(names), option("repeat", repeat), steps, threads, tuple(options.items()))


def run(task: Program, q: Any, qd: Any, controls: Any, parameters: Array, tape: bool) -> Rollout:
    """parameters: (worlds, names). Raises InputError naming the argument."""
    states = np.concatenate([_rows("q", q, task.model.nq), _rows("qd", qd, task.model.nv)], axis=1)
    models = [_variant(task, row) for row in parameters] if task.names else [task.model]
    return rollout(
        models,
        states,
        controls,
        steps=task.steps,
        repeat=task.repeat,
        threads=task.threads,
        tape=tape,
        **dict(task.options),
    )


def _variant(task: Program, values: Array) -> Model:
    each = {
        name: [float(value)] * len(parameter(task.model, name)[1])
        for name, value in zip(task.names, values, strict=True)
    }
    return with_values(task.model, each)


def _rows(what: str, values: Any, size: int) -> Array:
    given = reals(what, values)
    if given.ndim != 2 or given.shape[1] != size:
        raise InputError(f"{what} has the shape {given.shape}; it must be (worlds, {size})")
    return given


def by_world(task: Program, values: Mapping[str, Any], worlds: int) -> Array:
    """(worlds, names), of numbers or one array per world."""
    table = np.empty((worlds, len(task.names)))
    for k, name in enumerate(task.names):
        if np.shape(values[name]) not in ((), (worlds,)):
            shape = np.shape(values[name])
            raise InputError(f"{name} has the shape {shape}; it must be a number, or ({worlds},)")
        table[:, k] = reals(name, values[name])
    return table


def pulled(
    task: Program, result: Rollout, q: Array, qd: Array, controls: bool
) -> tuple[Array, Array, Array | None, Array]:
    """Derivatives of a loss over q, qd, controls and parameters, from those over the results."""
    inputs = "controls" if controls else "none"
    back = result.vjp(q, qd, parameters=task.names, inputs=inputs, threads=task.threads)
    return back.q, back.qd, back.inputs if controls else None, back.parameters
