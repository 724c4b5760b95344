"""Efforts and reactions of the last step by name, and the instant to which they belong."""

from __future__ import annotations

from dataclasses import dataclass

from ..checks import Array, Vector3
from .driving import Driving
from .forces import effort_table, reaction_table
from .outcome import Table


@dataclass(frozen=True)
class Instant:
    """To which contacts, reactions, efforts and controls of the last step belong.

    They are means over the step, and fit the pose at its start.
    """

    time: float
    """of the start of the step, of the last substep (s)"""
    q: Array
    """generalised coordinates then, (nq,), as `Simulation.q`"""


@dataclass(frozen=True)
class Effort:
    """Efforts along one degree of freedom in the last step: a row of `Simulation.joint_efforts`."""

    time: float
    """of the instant to which it belongs, the start of the step (s)"""
    coordinate: float
    """at that instant (m or rad)"""
    control: float
    """of its motor (N, N m, m/s, rad/s, m, rad); NaN without one"""
    motor: float
    """of its motor and of the actuators on it (N or N m)"""
    passive: float
    """of spring, damper and armature (N or N m)"""
    friction: float
    """N or N m"""
    limit: float
    """positive away from the lower limit (N or N m)"""

    @property
    def total(self) -> float:
        """The sum (N or N m); what `state.joint_forces` put there is not in it."""
        return self.motor + self.passive + self.friction + self.limit


@dataclass(frozen=True)
class Reaction:
    """Reaction of a joint on its body A, in world axes: a row of `Simulation.joint_reactions`."""

    time: float
    """of the instant to which it belongs (s)"""
    point: Vector3
    """about which the torque is (m)"""
    force: Vector3
    """N"""
    torque: Vector3
    """N m"""


class Acting(Driving):
    """Functions of `Simulation` that return efforts and reactions of the last step by name."""

    @property
    def instant(self) -> Instant:
        """The time and pose to which forces of the last step belong; InputError before the first step."""
        time, q = self._core.instant()
        q.flags.writeable = False
        return Instant(time, q)

    def effort(self, joint: int | str, dof: int = 0) -> Effort:
        """Efforts along a joint's degree of freedom in the last step, by index or name.

        joint: or the name of a degree of freedom. Raises InputError before the first step.
        """
        time = self._core.instant_time
        joint, dof = self._degree(joint, dof)
        row = effort_table(self._core)[self._model.dof_index(joint, dof)]
        _, _, coordinate, control, passive, motor, friction, limit = row.item()
        return Effort(time, coordinate, control, motor, passive, friction, limit)

    def efforts(self) -> Array:
        """Total efforts along all degrees of freedom in the last step (N or N m), (dofs,).

        Each is the sum of motor, passive, friction and limit in `joint_efforts`, in that order of rows; zeros
        before the first step.
        """
        table = effort_table(self._core)
        return table["motor"] + table["passive"] + table["friction"] + table["limit"]

    def reaction(self, joint: int | str) -> Reaction:
        """Reaction of a joint in the last step, by index or name, on its body A.

        joint: may also be a link of a file, or the fixed joint that holds it on its body. Its reaction
        follows from the balance of all that it carries, in the present pose (`link_reactions`). Raises
        InputError before the first step.
        """
        time = self._core.instant_time
        for k, link in enumerate(self._model.links):
            if joint in (link.name, link.joint) and joint not in self._model.joint_names:
                return _reaction(self.time, self.link_reactions[k])
        return _reaction(time, reaction_table(self._core)[self._model.joint_index(joint)])

    @property
    def time(self) -> float:
        """Simulated time (s)."""
        return self._core.time


def _reaction(time: float, row: Table) -> Reaction:
    return Reaction(time, *(tuple(row[name].tolist()) for name in ("point", "force", "torque")))  # type: ignore[arg-type]
