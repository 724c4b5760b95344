"""Forces: efforts and reactions of the last step, and the equations of motion at the present state."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..checks import Array, Vector3, flag, reals
from ..errors import InputError
from ..problem.problem import Problem
from .coordinates import degree, entries, read_only
from .holding import held_by
from .links import link_reactions
from .part import Part
from .passive import passive_forces_of
from .step_report import Table
from .tables import (
    actuator_table,
    contact_sums,
    effort_table,
    reaction_table,
    tendon_table,
    tensions_of,
)

if TYPE_CHECKING:
    from .loads import Loads


@dataclass(frozen=True)
class Instant:
    """Time and coordinates at which the forces of the last step act: the start of the step.

    Contact forces, reactions, efforts and controls are means over the step, at this pose.

    >>> simulation = Simulation(scenes.make("pendulum"), dt=0.01)
    >>> report = simulation.run(0.1)
    >>> round(simulation.forces.instant.time, 9), round(simulation.time, 9)
    (0.09, 0.1)
    """

    time: float
    """start of the step, or of its last substep (s)"""
    q: Array
    """generalised coordinates at that time, (nq,), in the order of `Simulation.q`"""


@dataclass(frozen=True)
class Effort:
    """Efforts along one degree of freedom in the last step: a row of `Simulation.forces.joint_efforts`.

    >>> simulation = Simulation(scenes.make("slider_crank"))
    >>> report = simulation.run(0.1)
    >>> effort = simulation.forces.effort("crank pivot")
    >>> effort.motor == effort.total
    True
    """

    time: float
    """time at which the efforts act: the start of the step (s)"""
    coordinate: float
    """coordinate of the degree of freedom at that time (m or rad)"""
    control: float
    """control of its motor (N, N m, m/s, rad/s, m, rad); NaN without a motor"""
    motor: float
    """effort of its motor and its actuators (N or N m)"""
    passive: float
    """effort of spring, damper and armature (N or N m)"""
    friction: float
    """effort of dry friction (N or N m)"""
    limit: float
    """effort of its limits (N or N m), positive away from the lower one"""

    @property
    def total(self) -> float:
        """The sum (N or N m), without `state.joint_forces`."""
        return self.motor + self.passive + self.friction + self.limit


@dataclass(frozen=True)
class Reaction:
    """Reaction of a joint on its body A, in world axes: a row of `Simulation.forces.joint_reactions`.

    >>> simulation = Simulation(scenes.make("pendulum", angle=0))  # hangs at rest
    >>> report = simulation.step()
    >>> print(np.round(simulation.forces.reaction("hinge").force, 3))  # its weight
    [ 0.     0.    24.525]
    """

    time: float
    """time at which it acts: the start of the step (s)"""
    point: Vector3
    """point of action, about which the torque is taken (m)"""
    force: Vector3
    """force on body A (N)"""
    torque: Vector3
    """torque on body A (N m)"""


class Forces(Part):
    """`Simulation.forces`: what acted in the last step, and what acts along qd at present.

    >>> simulation = Simulation(scenes.make("pendulum", angle=0))
    >>> report = simulation.step()
    >>> simulation.forces.mass_matrix().shape
    (1, 1)
    >>> print(np.round(simulation.forces.reaction("hinge").force, 3))
    [ 0.     0.    24.525]
    """

    @property
    def instant(self) -> Instant:
        """The time and pose to which forces of the last step belong; InputError before the first step."""
        time, q = self._core.instant()
        return Instant(time, read_only(q))

    def effort(self, joint: int | str, dof: int = 0) -> Effort:
        """Efforts along a joint's degree of freedom in the last step, by index or name.

        joint: or the name of a degree of freedom. Raises InputError before the first step.
        """
        time = self._core.instant_time
        joint, dof = degree(self._model, joint, dof)
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

    @property
    def joint_efforts(self) -> Table:
        """Efforts along each degree of freedom in the last step (N or N m), and its coordinate.

        Fields: joint, dof, coordinate, control (of its motor, NaN without one), passive (spring, damper and
        armature), motor (with the actuators on it), friction, limit. The coordinate is that of the instant to
        which efforts belong, the start of the step (`instant`).
        """
        return effort_table(self._core)

    @property
    def tendon_efforts(self) -> Table:
        """Forces along each tendon in the last step (N, N m), and its present length.

        Fields: tendon, length (m, or the unit of its joints), rate, passive (spring, damper and armature),
        friction, limit; efforts are positive where they lengthen it. Actuators are in `actuator_efforts`.
        """
        return tendon_table(self._core)

    @property
    def actuator_efforts(self) -> Table:
        """Effort of each actuator in the last step, and its present length.

        Fields: actuator, control, activation, length, rate (of its transmission, gear included), effort (N,
        N m).
        """
        return actuator_table(self._core)

    def tensions(self, tendon: int | str) -> Array:
        """Tensions (N) of the parts of a rope with friction on its path in the last step, (places + 1,).

        The places are those of its path with friction, in their order; a belt has two parts. A tension is
        positive where the rope pulls; a slack rope has none. InputError for a tendon without friction on its
        path: `tendon_efforts` has its forces.
        """
        return tensions_of(self._model, self._core, tendon)

    def reaction(self, joint: int | str) -> Reaction:
        """Reaction of a joint in the last step, by index or name, on its body A.

        joint: may also be a link of a file, or the fixed joint that holds it on its body. Its reaction
        follows from the balance of all that it carries, in the present pose (`link_reactions`). Raises
        InputError before the first step.
        """
        time = self._core.instant_time
        for k, link in enumerate(self._model.links):
            if joint in (link.name, link.joint) and joint not in self._model.joint_names:
                return _reaction(self._core.time, self.link_reactions[k])
        return _reaction(time, reaction_table(self._core)[self._model.joint_index(joint)])

    @property
    def joint_reactions(self) -> Table:
        """Force (N) and torque (N m) of each joint's locked directions on its body A, world axes.

        Fields: joint, body_a, body_b, point (m, where A held the joint at the start of the step; the torque
        is about it), force, torque. Impacts are in them; what acts along the free directions is in
        `joint_efforts`.
        """
        return reaction_table(self._core)

    @property
    def link_reactions(self) -> Table:
        """Force (N) and torque (N m) of the fixed joint that holds each link on its body, world axes.

        Fields: link (an index of `Model.link_names`), body, point (m, the origin of the link now; the torque
        is about it), force, torque. A row for each of `Model.links`: means over the last step, from the
        balance of all that hangs on the joint. Loads of `state.forces` act on the body, not on a link.
        """
        return link_reactions(self._core, self._model, self._model.tree.rates(self._core))

    def contact_forces(self) -> tuple[Array, Array]:
        """Sums over the contacts of each body in the last step: forces (n, 3) (N) and torques (n, 3) (N m).

        Torques are about the centres of mass, in world axes.
        """
        return contact_sums(self._core, self._simulation.contacts, len(self._model.bodies))

    @property
    def impulses(self) -> Array:
        """The solution x of the last step's problem, in the order and the units of its rows (N s, N m s)."""
        core = self._core.problem
        if core is None or not core.has_moments:
            return self._core.impulses
        problem: Problem = self._simulation.problem()
        return problem._from_units(self._core.impulses)

    def loads(self) -> Loads:
        """Collect the loads of joints and contacts from the next step on: `Loads`, until its stop().

        Usable as `with simulation.forces.loads() as loads: simulation.run(2.0)`; then `loads.joints` and
        `loads.contacts` have peak, time of the peak, mean, rms and impulse of each component.
        """
        from .loads import Loads

        loads = Loads(self._model)
        loads.watch(self._simulation)
        return loads

    def momentum(self) -> tuple[Vector3, Vector3]:
        """Linear momentum (N s), and angular momentum about the world's origin (N m s), of dynamic bodies."""
        linear, angular = self._core.momentum()
        return tuple(linear), tuple(angular)  # type: ignore[return-value]

    def mass_matrix(self) -> Array:
        """M(q), (nv, nv), with the armatures of joints and tendons; of the tree, without loops."""
        return self._model.tree.mass_matrix(self._core)

    def bias_forces(self) -> Array:
        """c(q, qd), (nv,): Coriolis, centrifugal and gravity forces, so that M qdd + c = tau (N, N m)."""
        return self.inverse_dynamics(np.zeros(self._model.nv))

    def inverse_dynamics(self, qdd: ArrayLike, *, passive: bool = False) -> Array:
        """tau = M qdd + c, (nv,): what springs, dampers, motors, contacts and loads must add up to.

        passive: without what springs, dampers and drag do of it, `passive_forces()`: what is left to motors,
            contacts and loads, as `mj_inverse` of MuJoCo says.
        """
        tau = self._model.tree.inverse_dynamics(self._core, entries("qdd", qdd, self._model.nv))
        return tau - self.passive_forces() if flag("passive", passive) else tau

    def passive_forces(self) -> Array:
        """The forces along qd, (nv,), of springs, dampers and the drag of the fluid at present (N, N m).

        Those of joints and tendons, positive where they speed up qd, without dry friction, armature and
        actuators. Raises InputError naming a joint that closes a loop with springs on several degrees of
        freedom.
        """
        return passive_forces_of(self._core, self._model)

    def generalised_forces(self, forces: ArrayLike, torques: ArrayLike | None = None) -> Array:
        """The forces along qd, (nv,), of forces at the centres of mass and torques on bodies, (n, 3) each.

        World axes; what `contact_forces()` returns, for example.
        """
        shape = (len(self._model.bodies), 3)
        given = [
            np.zeros(shape) if x is None else reals(name, x)
            for name, x in (("forces", forces), ("torques", torques))
        ]
        for name, x in zip(("forces", "torques"), given, strict=True):
            if x.shape != shape:
                raise InputError(f"{name} has the shape {x.shape}; the model asks for {shape}")
        return self._model.tree.generalised_forces(self._core, *given)

    def gravity_compensation(self, *, joints: Iterable[str] | None = None, springs: bool = True) -> Array:
        """The generalised forces, (nv,), that hold the present pose at rest against gravity (N, N m).

        In the order of `qd`: bias_forces() without velocities, less what springs hold. Contacts and loads are
        not in them.

        joints: names of the coordinates or joints that hold it, the entries of all others are zero; the
            smallest forces of those that do. None: all of them; where loops are closed, with the forces with
            which the loops carry nothing. Closed loops carry the rest if joints are named.
        springs: whether springs help; False: as if there were none.

        Raises InputError naming what is not held by these joints, as a floating base, or who is not known.
        """
        still = self._core.copy()
        still.linear_velocities[...] = still.angular_velocities[...] = 0.0
        forces = self._model.tree.inverse_dynamics(still, np.zeros(self._model.nv))
        if flag("springs", springs):
            forces = forces - passive_forces_of(still, self._model)
        return forces if joints is None else held_by(still, self._model, joints, forces)


def _reaction(time: float, row: Table) -> Reaction:
    return Reaction(time, *(tuple(row[name].tolist()) for name in ("point", "force", "torque")))  # type: ignore[arg-type]
