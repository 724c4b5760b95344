"""Errors and warnings of a simulation about steps that were made, as `on_failure` asks."""

from __future__ import annotations

import logging
import warnings
from typing import Any

from .. import _core, step_counts
from ..errors import SimulationError, StepWarning
from ..escapes import visible

logger = logging.getLogger(__name__)


def check_steps(simulation: Any, last: _core.Report, steps: int, residual: float, stacklevel: int) -> None:
    """After some steps, of which only the last can have failed: what `on_failure` says of it."""
    if not last.advanced:
        raise SimulationError(
            f"the velocities at t = {simulation.time:g} s came out not finite, or beyond 1e15 m/s "
            f"({last.status}); the state is that before the step. Look for loads or speeds out of any "
            "proportion, or make dt smaller"
        )
    if logger.isEnabledFor(logging.DEBUG):
        logger.debug(
            "t = %g s: %s, residual %.1e, %d iterations, %d contacts",
            *(last.time, last.status, residual, last.iterations, last.contacts),
        )
    usual = last.is_usual(simulation._model.length)
    counted = step_counts.saw(residual, steps=steps, missed=not usual and not last.is_sound)
    if usual:
        return
    on_failure = simulation._options["on_failure"]
    if on_failure != "ignore":
        _check_joints(simulation, last, stacklevel + 1)
    if last.is_sound or on_failure == "ignore" or (counted and on_failure == "warn"):
        return
    if not last.balanced:
        what = f"gained {last.energy_balance:.3g} J from nothing"
    elif last.residual > simulation._options["tolerance"]:
        what = (
            f"has a residual of {last.residual:.2e}, above the tolerance {simulation._options['tolerance']:g}"
        )
    else:  # of the whole; beside heavy bodies it does not see light ones
        what = f"leaves light bodies with wrong velocities, at a residual of {last.residual:.2e}"
    message = f"the step to t = {last.time:g} s {what} ({last.method}: {last.status})"
    if on_failure == "raise":
        simulation._core.restore_last()
        raise SimulationError(
            f"{message}; the state is that before the step. Allow max_substeps, more iterations or a "
            "looser tolerance"
        )
    warnings.warn(message, StepWarning, stacklevel=stacklevel)


def _check_joints(simulation: Any, last: _core.Report, stacklevel: int) -> None:
    """Warn about a joint that stays apart by more than Model.length / 1000; again at twice the error."""
    length = simulation._model.length
    error = max(last.joint_error, length * last.joint_angle_error)
    if last.joints_close or last.worst_joint < 0 or error <= max(length / 1000, 2 * simulation._apart):
        return
    simulation._apart = error
    name = visible(simulation._model.joint_names[last.worst_joint])
    message = (
        f'joint "{name}" is apart by {error:.2g} m at t = {last.time:g} s (angles times Model.length): '
        "its constraints contradict others, or dt is too long for the motion"
    )
    warnings.warn(message, StepWarning, stacklevel=stacklevel)
