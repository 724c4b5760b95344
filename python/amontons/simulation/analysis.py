"""Results of a state: contact events, inverse kinematics, gravity compensation, linear models."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..checks import Array, Numbers, chosen, flag, integer, option, positive, quaternion, vector3
from ..errors import InputError, StepWarning
from ..model.model import Model
from . import inverse_kinematics as ik
from .derivative import Derivative, Held, derivative_of, remembered_slips
from .differences import CHANGE, INPUTS, held_change, placed
from .events import ContactEvents, contact_events
from .holding import held_by
from .linearise import Linearisation, linearise_core
from .options import core_options
from .passive import passive_forces_of
from .queries import Queries

CONTACTS = {"free": None, "held": None}


class Analysis(Queries):
    """Results that `Simulation` computes from its state, which they do not change by default."""

    _core: _core.Simulation
    _model: Model
    if TYPE_CHECKING:
        dt: Any

        def copy(self) -> Any:
            """See Simulation"""

    @property
    def contact_events(self) -> ContactEvents:
        """The pairs of geoms that began to carry a contact force in the last step, and those that ceased to.

        (began, ended), arrays with the fields body_a, body_b, geom_a, geom_b, link_a, link_b of `contacts`.
        They compare the last step with the one before it; impacts count. After reset(), load() and unpickling
        every pair that touches begins. Nothing began or ended in a step that failed.
        """
        return contact_events(self._core, self._model)

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

    def solve_ik(
        self,
        site: int | str,
        position: Numbers | None = None,
        orientation: Numbers | None = None,
        *,
        coordinates: Iterable[str] | None = None,
        tolerance: float | None = None,
        max_iterations: int = 100,
        attempts: int = 10,
        apply: bool = False,
    ) -> ik.IkSolution:
        """Coordinates at which a site is at a position, has an orientation, or both, within joint limits.

        By damped least squares, beginning at the present pose, with closed loops kept closed. Says whether it
        converged; `q` of the solution is the nearest that was found. Nothing of the simulation changes.

        site: index or name; also the name of a link or body, whose frame is meant.
        position: (m), orientation: (w, x, y, z), both in the world; at least one of them.
        coordinates: names of those that may move, by default all but floating bases.
        tolerance: of the position (m), by default Model.length / 1e6; angles times Model.length.
        max_iterations: of an attempt. attempts: those after the first begin at poses anywhere within the
            limits, always the same ones.
        apply: set `q` to what was found, converged or not.

        Raises InputError naming the site, the coordinate or the argument.
        """
        body, frame = ik.frame_of(self._model, site)
        if position is None and orientation is None:
            raise InputError("solve_ik needs a position, an orientation or both")
        goal = ik.Goal(
            body,
            frame,
            None if position is None else np.array(vector3("position", position)),
            None if orientation is None else np.array(quaternion("orientation", orientation)),
        )
        near = self._model.length / 1e6 if tolerance is None else positive("tolerance", tolerance)
        effort = ik.Effort(
            near, int(option("max_iterations", max_iterations)), integer("attempts", attempts, 1)
        )
        apply = flag("apply", apply)
        arm = ik.Arm(self._core.copy(), self._model, ik.moving_entries(self._model, coordinates))
        found = ik.solve(arm, goal, effort)
        if apply:
            self.set_q(found.q)
        return found

    def linearise(
        self,
        *,
        inputs: str = "controls",
        contacts: str = "free",
        tolerance: float = 1e-10,
        threads: int | None = None,
    ) -> Linearisation:
        """A and B of one time step: the state after it as a linear function of state and inputs before it.

        By central differences, each a step of a copy; the copies run side by side. `Linearisation` describes
        the state and the inputs, their order and units. Functions of before_step and after_step are not
        called. Each changed state is the nearest one with closed loops.

        inputs: "controls", of actuators and motors, or "joint_forces", generalised forces along qd.
        contacts: "free": each changed step finds its own contacts. Where contacts begin, end or start to
            slide there is no derivative: the numbers then belong to a change of 1e-6, `kinks` names the
            states, and a StepWarning says so. "held": contacts, limits and drives stay open, stick, slide or
            stay at a bound as in the step from here, which is what a feedback about a stance needs.
        tolerance: of the solve of each step, if it is tighter than the simulation's. threads: copies at a
            time, by default one per core; the result does not depend on it.

        Raises SimulationError if a step fails, InputError naming the argument.
        """
        chosen("inputs", inputs, INPUTS)
        chosen("contacts", contacts, CONTACTS)
        if threads is not None:
            threads = int(option("threads", threads))
        probe = self._precise(tolerance)
        core, change = probe._core, CHANGE
        if contacts == "held":
            core.assign(placed(core, self._model, steady=True))
            core.step()
            held = Held(core, self._model, core_options(probe.options))
            core, change = held.simulation(), held_change(self._model, held.step.margin)
        found = linearise_core(core, self._model, self.dt, inputs, threads, change)
        if contacts == "free" and found.kinks:
            count = len(found.states + found.inputs)
            warnings.warn(
                f"differences to both sides disagree for {len(found.kinks)} of {count} states and inputs, as "
                f"{found.kinks[0]}: contacts open, close or begin to slide; for a feedback give "
                'contacts="held"',
                StepWarning,
                stacklevel=2,
            )
        return found

    def _precise(self, tolerance: float) -> Any:
        """A copy whose steps are solved to a tolerance that is no looser."""
        probe = self.copy()
        least = min(option("tolerance", tolerance), probe.options["tolerance"])
        probe.change_options(tolerance=least, threads=1)
        return probe

    def derivative(
        self,
        *,
        parameters: Iterable[str] = (),
        inputs: str = "controls",
        tolerance: float = 1e-11,
        threads: int | None = None,
    ) -> Derivative:
        """The derivative of the step just made, on the faces of its solution: `Derivative`.

        Its rows are the state after the step, its columns state, inputs and parameters before it. Contacts,
        limits, dry friction and bounds of drives stay as they are in the step (open, stick, slide, at a
        bound). `differentiable` says whether that is the derivative of the step itself, `margin` how far the
        next border is. The state does not change, and functions of before_step and after_step are not called.

        parameters: names as "friction:foot", "mass:link2", "damping:elbow", "armature:*", "gain:servo": a
            quantity of `Model.with_` and a name or pattern; of a pattern all change together.
        inputs: "controls" or "joint_forces", as they were during the step.
        tolerance: to which the step is solved again first, if it can be: redundant joints allow less.

        Raises InputError before the first step, or naming the argument; SimulationError if a step fails.
        """
        chosen("inputs", inputs, INPUTS)
        if threads is not None:
            threads = int(option("threads", threads))
        _ = self._core.instant_time  # there was a step
        before = self.copy()
        before._core.restore_last()
        for finest in (tolerance, 100 * tolerance, self.options["tolerance"]):
            precise = before._precise(finest)
            precise._core.assign(placed(precise._core, self._model))
            report = precise._core.step()
            if report.is_sound and report.path == "accurate":
                break
        unsound = "" if report.is_sound and report.path == "accurate" else f"the step ended by {report.path}"
        if report.substeps > 1:
            unsound = f"the step was made in {report.substeps} parts"
        if slipping := remembered_slips(precise._core, self._model):
            unsound = f"the friction of {', '.join(slipping[:3])} depends on the slip of the step before"
        held = Held(precise._core, self._model, core_options(precise.options))
        return derivative_of(held, self.dt, inputs, parameters, threads, unsound)
