"""Copies of a simulation, and what a pickle holds of one."""

from __future__ import annotations

import copy
from typing import Any

from .. import _core
from .options import core_options

OF_PROCESS = {
    "_core", "_state", "_contacts", "_plan", "_in_callback", "_ended", "_before_run", "_after_run",
}  # fmt: skip
"""Attributes that a pickle leaves out."""
OWN = OF_PROCESS | {"_model", "_options", "before_step", "after_step"}
"""Attributes that are ours; a user may have put others there."""
SCALARS = ("time", "steps", "impulse_step", "last_step")


def copied(simulation: Any) -> Any:
    """One that goes on from here, and shares only the model."""
    other = object.__new__(type(simulation))
    other.__dict__.update(simulation.__dict__)
    other.before_step, other.after_step = list(simulation.before_step), list(simulation.after_step)
    other._options = dict(simulation._options)
    other._in_callback = other._ended = False
    other._before_run = other._after_run = None
    other._take(simulation._core.copy())
    return other


def copied_deeply(simulation: Any, memo: dict[int, Any]) -> Any:
    """The same with copies of what a user has put there."""
    other = memo[id(simulation)] = copied(simulation)
    for name, value in simulation.__dict__.items():
        if name not in OWN:
            setattr(other, name, copy.deepcopy(value, memo))
    return other


def pickled(simulation: Any) -> dict[str, Any]:
    """The attributes and the arrays of the state."""
    values = {name: v for name, v in simulation.__dict__.items() if name not in OF_PROCESS}
    return values | {"_arrays": simulation._core.snapshot().arrays}


def unpickle(simulation: Any, values: dict[str, Any]) -> None:
    """Make a simulation of what `pickled` returned."""
    arrays = values.pop("_arrays")
    simulation.__dict__.update(values)
    core = _core.Simulation(simulation._model.core, core_options(simulation._options))
    restore(core, simulation._model.core, arrays)
    simulation._take(core)


def restore(core: _core.Simulation, model: _core.Model, arrays: dict[str, Any]) -> None:
    """Put a compiled simulation into the state of the arrays of a snapshot."""
    scalars = {name: arrays.pop(name) for name in SCALARS}
    core.restore(_core.State(model, arrays=arrays, **scalars))


def set_clock(simulation: Any, time: float, steps: int) -> None:
    """Take over a time and a number of steps from a recording."""
    arrays = simulation._core.snapshot().arrays | {"time": time, "steps": steps}
    restore(simulation._core, simulation._model.core, arrays)
    simulation._take(simulation._core)
