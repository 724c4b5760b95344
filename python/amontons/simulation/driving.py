"""Driving a simulation: controls, keyframes, a new start."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, number
from ..errors import InputError
from ..model.model import Model
from ..model.presets import Keyframe
from .state import State


def checked_controls(model: Model, values: ArrayLike) -> Array:
    """All controls, within their limits; InputError for another shape or what is not finite."""
    names = model.control_names
    array = np.array(values, dtype=np.float64)
    if array.shape != (len(names),):
        raise InputError(f"controls has the shape {array.shape}; the model asks for ({len(names)},)")
    for name, value in zip(names, array.tolist(), strict=True):
        number(f'control of "{name}"', value)
    return clipped(model, array)


def put_keyframe(core: _core.Simulation, state: State, model: Model, frame: Keyframe) -> None:
    """See `Simulation.apply_keyframe`."""
    check_fit(model, frame)
    for name in ("positions", "orientations", "linear_velocities", "angular_velocities"):
        view = getattr(state, name)
        view[...] = np.reshape(getattr(frame, name), view.shape)  # of no bodies there are no rows
    core.set_joint_coordinates(np.array(frame.joint_coordinates, dtype=np.float64))
    if frame.controls:
        state.controls = frame.controls
    if frame.activations:
        state.activations = frame.activations
    state.forces = state.torques = 0.0
    state.joint_forces = 0.0


def check_fit(model: Model, frame: Keyframe) -> None:
    """InputError if a keyframe is of another model."""
    own = (len(model.bodies), sum(len(joint.dofs) for joint in model.joints))
    given = (len(frame.positions), len(frame.joint_coordinates))
    if own != given:
        raise InputError(
            f'keyframe "{frame.name}" has {given[0]} bodies and {given[1]} coordinates; the model has '
            f"{own[0]} and {own[1]}: give one of Model.keyframes"
        )


def clipped(model: Model, controls: Array) -> Array:
    """Controls (..., controls) within their limits."""
    lower, upper = np.array(model.control_limits, dtype=np.float64).reshape(-1, 2).T
    return np.ascontiguousarray(np.clip(controls, lower, upper))


def put_start(simulation: Any, keyframe: int | str | None, q: Any, qd: Any) -> None:
    """Put a simulation at the start of its model or at a keyframe, then at q and qd, or do nothing."""
    model, core = simulation._model, simulation._core
    index = None if keyframe is None else model.keyframe_index(keyframe)
    before = core.copy()
    core.reset()
    simulation._contacts = None
    try:
        if index is not None:
            simulation.apply_keyframe(index)
            core.set_time(model.keyframes[index].time)
        if q is not None:
            simulation.set_q(q)
        if qd is not None:
            simulation.set_qd(qd)
    except InputError:
        core.assign(before)
        raise
