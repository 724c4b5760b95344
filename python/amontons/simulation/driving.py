"""Driving a simulation: controls, keyframes, a new start."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..checks import Array, number
from ..errors import InputError
from ..model.model import Model
from ..model.presets import Keyframe
from .coordinates import Values
from .outcome import Table
from .queries import Queries
from .state import State


class Driving(Queries):
    """How `Simulation` is driven, beside writing coordinates and loads."""

    _state: State
    _contacts: Table | None

    @property
    def controls(self) -> Array:
        """The controls of all actuators, then of all motors, in the order of `Model.control_names`.

        Read only, assign a whole array; each is clipped to its `Model.control_limits`. The control of a motor
        is its effort (N, N m), velocity (m/s, rad/s) or position (m, rad).
        """
        array = self._state.controls.copy()
        array.flags.writeable = False
        return array

    @controls.setter
    def controls(self, values: ArrayLike) -> None:
        names = self._model.control_names
        array = np.array(values, dtype=np.float64)
        if array.shape != (len(names),):
            raise InputError(f"controls has the shape {array.shape}; the model asks for ({len(names)},)")
        for name, value in zip(names, array.tolist(), strict=True):
            number(f'control of "{name}"', value)
        self._state.controls = clipped(self._model, array)

    def set_control(self, control: int | str, value: float) -> None:
        """Set one of `controls`, of an actuator or motor by index or name, clipped to its limits.

        The motor of a joint has the joint's name; see `Model.control_names`. InputError for a joint without a
        motor says how it gets one.
        """
        index = self._model.control_index(control)
        lower, upper = self._model.control_limits[index]
        self._state.controls[index] = min(max(number("control", value), lower), upper)

    def apply_keyframe(self, keyframe: int | str | Keyframe) -> None:
        """Put bodies, coordinates and controls as a keyframe says, loads to zero; time goes on.

        keyframe: a name or number of `Model.keyframes`, or a Keyframe of as many bodies and coordinates.
        """
        frame = (
            self._fitting(keyframe)
            if isinstance(keyframe, Keyframe)
            else self._model.keyframes[self._model.keyframe_index(keyframe)]
        )
        state = self._state
        for name in ("positions", "orientations", "linear_velocities", "angular_velocities"):
            view = getattr(state, name)
            view[...] = np.reshape(getattr(frame, name), view.shape)  # of no bodies there are no rows
        self._core.set_joint_coordinates(np.array(frame.joint_coordinates, dtype=np.float64))
        if frame.controls:
            state.controls = frame.controls
        if frame.activations:
            state.activations = frame.activations
        state.forces = state.torques = 0.0
        state.joint_forces = 0.0

    def _fitting(self, frame: Keyframe) -> Keyframe:
        """The keyframe; InputError if it is of another model."""
        own = (len(self._model.bodies), sum(len(joint.dofs) for joint in self._model.joints))
        given = (len(frame.positions), len(frame.joint_coordinates))
        if own != given:
            raise InputError(
                f'keyframe "{frame.name}" has {given[0]} bodies and {given[1]} coordinates; the model has '
                f"{own[0]} and {own[1]}: give one of Model.keyframes"
            )
        return frame

    def reset(
        self, keyframe: int | str | None = None, *, q: Values | None = None, qd: Values | None = None
    ) -> None:
        """Set the initial state of the model or a keyframe, and then q and qd where they are given.

        Time goes back to zero, or to that of the keyframe; loads, motors and impulses are those of a new
        simulation. q, qd: as in `set_q` and `set_qd`. If they are refused, nothing has changed.
        """
        index = None if keyframe is None else self._model.keyframe_index(keyframe)
        before = self._core.copy()
        self._core.reset()
        self._contacts = None
        try:
            if index is not None:
                self.apply_keyframe(index)
                self._core.set_time(self._model.keyframes[index].time)
            if q is not None:
                self.set_q(q)
            if qd is not None:
                self.set_qd(qd)
        except InputError:
            self._core.assign(before)
            raise


def clipped(model: Model, controls: Array) -> Array:
    """Controls (..., controls) within their limits."""
    lower, upper = np.array(model.control_limits, dtype=np.float64).reshape(-1, 2).T
    return np.ascontiguousarray(np.clip(controls, lower, upper))
