"""Rollouts as functions of PyTorch: gradients of losses over states, controls and parameters.

import amontons.torch
q, qd = amontons.torch.rollout(model, q0, qd0, controls, parameters={"friction:foot": mu}, dt=2e-3)
loss = (q[:, -1] - goal).square().sum()
loss.backward()

Needs PyTorch (pip install torch), on the processor.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

try:
    import torch
except ImportError as error:
    raise ImportError(f"amontons.torch needs PyTorch ({error}): pip install torch") from None

from .model.model import Model
from .studies import tensors


def rollout(
    model: Model,
    q: torch.Tensor,
    qd: torch.Tensor,
    controls: torch.Tensor | None = None,
    *,
    parameters: Mapping[str, torch.Tensor] | None = None,
    steps: int | None = None,
    repeat: int = 1,
    threads: int | None = None,
    **options: Any,
) -> tuple[torch.Tensor, torch.Tensor]:
    """q and qd after each row of controls: (worlds, rows, nq) and (worlds, rows, nv), as `amontons.rollout`.

    q, qd: (worlds, nq) and (worlds, nv) at the start. controls: (worlds, rows, controls); None leaves those
        of the model, for so many `steps`.
    parameters: by name, as "friction:foot", tensors of one number or of one per world, (worlds,).
    options: those of `Simulation`. Results have the dtype of q.

    Derivatives are those of `Rollout.vjp`. Raises InputError naming the argument, and in the way back if a
    world failed.
    """
    given = dict(parameters or {})
    task = tensors.program(model, given, repeat, steps, threads, options)
    return _Rollout.apply(task, q, qd, controls, *given.values())


def _array(tensor: torch.Tensor) -> np.ndarray:
    return tensor.detach().cpu().numpy()


class _Rollout(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, task: Any, q: Any, qd: Any, controls: Any, *parameters: Any) -> Any:
        values = dict(zip(task.names, map(_array, parameters), strict=True))
        table = tensors.by_world(task, values, len(q))
        rows = None if controls is None else _array(controls)
        result = tensors.run(task, _array(q), _array(qd), rows, table, tape=any(ctx.needs_input_grad))
        ctx.task, ctx.result, ctx.given = task, result, (q, qd, controls, *parameters)
        return torch.as_tensor(result.q, dtype=q.dtype), torch.as_tensor(result.qd, dtype=q.dtype)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, by_q: Any, by_qd: Any) -> Any:
        controls = ctx.given[2] is not None
        found = tensors.pulled(ctx.task, ctx.result, _array(by_q), _array(by_qd), controls)
        parts = [*found[:3], *found[3].T]
        return None, *(_like(part, given) for part, given in zip(parts, ctx.given, strict=True))


def _like(part: Any, given: Any) -> Any:
    """A gradient in the form of what it belongs to; of one number for all worlds the sum."""
    if part is None or given is None:
        return None
    found = torch.as_tensor(part, dtype=given.dtype)
    return found if found.shape == given.shape else found.sum()
