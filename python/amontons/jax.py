"""Rollouts as functions of JAX: gradients of losses over states, controls and parameters.

import amontons.jax
def loss(mu):
    q, qd = amontons.jax.rollout(model, q0, qd0, controls, parameters={"friction:foot": mu}, dt=2e-3)
    return ((q[:, -1] - goal) ** 2).sum()
slope = jax.grad(loss)(0.5)

Needs JAX (pip install jax). A rollout runs on the processor, as a callback, and may stand within `jax.jit`.
Results have all their digits after jax.config.update("jax_enable_x64", True).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

try:
    import jax
    import jax.numpy as jnp
except ImportError as error:
    raise ImportError(f"amontons.jax needs JAX ({error}): pip install jax") from None

from .errors import InputError
from .model.model import Model
from .studies import tensors


def rollout(
    model: Model,
    q: Any,
    qd: Any,
    controls: Any = None,
    *,
    parameters: Mapping[str, Any] | None = None,
    steps: int | None = None,
    repeat: int = 1,
    threads: int | None = None,
    **options: Any,
) -> tuple[jax.Array, jax.Array]:
    """q and qd after each row of controls: (worlds, rows, nq) and (worlds, rows, nv), as `amontons.rollout`.

    q, qd: (worlds, nq) and (worlds, nv) at the start. controls: (worlds, rows, controls); None leaves those
        of the model, for so many `steps`.
    parameters: by name, as "friction:foot", one number or one per world, (worlds,).
    options: those of `Simulation`, which must be hashable. Results have the dtype of q.

    Derivatives are those of `Rollout.vjp`; the way back makes the rollout once more. Raises InputError
    naming the argument.
    """
    given = dict(parameters or {})
    task = tensors.program(model, given, repeat, steps, threads, options)
    if controls is None and steps is None:
        raise InputError("rollout needs controls, or steps to go without")
    q = jnp.asarray(q, float)
    columns = [jnp.broadcast_to(jnp.asarray(value, float), len(q)) for value in given.values()]
    table = jnp.stack(columns, axis=1) if columns else jnp.zeros((len(q), 0))
    rows = None if controls is None else jnp.asarray(controls, float)
    return _rollout(_Key(task), q, jnp.asarray(qd, float), rows, table)


class _Key:
    """A program as JAX compares it: by what it is, as models are."""

    def __init__(self, task: tensors.Program) -> None:
        self.task = task
        self._same = (id(task.model), task.names, task.repeat, task.steps, task.threads, task.options)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self._same == other._same

    def __hash__(self) -> int:
        return hash(self._same)


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def _rollout(key: _Key, q: Any, qd: Any, controls: Any, table: Any) -> Any:
    count = key.task.steps if controls is None else controls.shape[1]
    shapes = [jax.ShapeDtypeStruct((len(q), count, part.shape[1]), q.dtype) for part in (q, qd)]

    def run(*numbers: Any) -> Any:
        result = tensors.run(key.task, *_arrays(numbers), tape=False)
        return result.q.astype(q.dtype), result.qd.astype(q.dtype)

    return tuple(jax.pure_callback(run, shapes, q, qd, controls, table, vmap_method="sequential"))


def _forward(key: _Key, *numbers: Any) -> Any:
    return _rollout(key, *numbers), numbers


def _backward(key: _Key, numbers: Any, slopes: Any) -> Any:
    controls = numbers[2] is not None
    like = [None if n is None else jax.ShapeDtypeStruct(n.shape, n.dtype) for n in numbers]

    def pull(numbers: Any, slopes: Any) -> Any:
        result = tensors.run(key.task, *_arrays(numbers), tape=True)
        found = tensors.pulled(key.task, result, *_arrays(slopes), controls)
        return tuple(None if f is None else f.astype(n.dtype) for f, n in zip(found, like, strict=True))

    return jax.pure_callback(pull, tuple(like), numbers, slopes, vmap_method="sequential")


def _arrays(values: Any) -> list[Any]:
    return [None if value is None else np.asarray(value, dtype=np.float64) for value in values]


_rollout.defvjp(_forward, _backward)
