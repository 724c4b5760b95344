"""Driving a simulation: targets, controls, keyframes, a new start."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..checks import Array, number, shown, suggestion
from ..errors import InputError
from ..model.presets import Keyframe
from .coordinates import Values
from .outcome import Table
from .queries import Queries
from .state import State


class Driving(Queries):
    """How `Simulation` is driven, beside writing coordinates and loads."""

    _state: State
    _contacts: Table | None

    def set_target(self, joint: int | str, value: float, dof: int = 0) -> None:
        """Set the target of a motor: effort (N, N m), speed (m/s, rad/s) or position (m, rad)."""
        index = self._model.dof_index(joint, dof)
        j = self._model.joint_index(joint)
        if self._model.joints[j].dofs[dof].motor.kind == "none":
            drives = self._model.actuators
            by = [a.name for a in drives if a.transmission.kind == "dof" and a.transmission.joint == j]
            remedy = f'use set_control("{by[0]}", ...)' if by else "give it one in the model"
            raise InputError(f'joint "{self._model.joints[j].name}" has no motor; {remedy}')
        self._state.targets[index] = number("target", value)

    @property
    def controls(self) -> Array:
        """The controls of all actuators in the order of `Model.actuators`; read only, assign a whole array.

        Each is clipped to the limits of its actuator.
        """
        array = self._state.controls.copy()
        array.flags.writeable = False
        return array

    @controls.setter
    def controls(self, values: ArrayLike) -> None:
        drives = self._model.actuators
        array = np.array(values, dtype=np.float64)
        if array.shape != (len(drives),):
            raise InputError(f"controls has the shape {array.shape}; the model asks for ({len(drives)},)")
        values = [
            drive.clipped(number(f'control of "{drive.name}"', value))
            for drive, value in zip(drives, array.tolist(), strict=True)
        ]
        self._state.controls = values

    def set_control(self, actuator: int | str, control: float) -> None:
        """Set the control of an actuator, clipped to its limits."""
        index = self._model.actuator_index(actuator)
        self._state.controls[index] = self._model.actuators[index].clipped(number("control", control))

    def apply_keyframe(self, name: str) -> None:
        """Put bodies, coordinates, targets and controls as a keyframe says, loads to zero; time goes on."""
        frame = self._keyframe(name)
        state = self._state
        for name in ("positions", "orientations", "linear_velocities", "angular_velocities"):
            view = getattr(state, name)
            view[...] = np.reshape(getattr(frame, name), view.shape)  # of no bodies there are no rows
        self._core.set_joint_coordinates(np.array(frame.joint_coordinates, dtype=np.float64))
        state.targets = frame.targets
        if frame.controls:
            state.controls, state.activations = frame.controls, frame.activations
        state.forces = state.torques = 0.0

    def _keyframe(self, name: str) -> Keyframe:
        known = self._model.keyframes
        if not isinstance(name, str) or name not in known:
            what = f'"{name}"' if isinstance(name, str) and len(name) <= 80 else shown(name)
            near = suggestion(name, known)
            raise InputError(f"there is no keyframe {what}{near}; known are {', '.join(known) or 'none'}")
        return known[name]

    def reset(
        self, keyframe: str | None = None, *, q: Values | None = None, qd: Values | None = None
    ) -> None:
        """Begin again: the model's initial state or a keyframe, and then q and qd where they are given.

        Time goes back to zero, or to that of the keyframe; loads, motors and impulses are those of a new
        simulation. q, qd: as in `set_q` and `set_qd`. If they are refused, nothing has changed.
        """
        frame = None if keyframe is None else self._keyframe(keyframe)
        before = self._core.copy()
        self._core.reset()
        self._contacts = None
        try:
            if frame is not None and keyframe is not None:
                self.apply_keyframe(keyframe)
                self._core.set_time(frame.time)
            if q is not None:
                self.set_q(q)
            if qd is not None:
                self.set_qd(qd)
        except InputError:
            self._core.assign(before)
            raise
