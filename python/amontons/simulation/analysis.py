"""Results of a state: contact events, inverse kinematics, gravity compensation, linear models."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..checks import Array, Numbers, chosen, flag, integer, option, positive, quaternion, vector3
from ..errors import InputError
from ..model.model import Model
from . import inverse_kinematics as ik
from .events import ContactEvents, contact_events
from .linearise import INPUTS, Linearisation, linearise_core
from .queries import Queries


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

    def gravity_compensation(self) -> Array:
        """The generalised forces, (nv,), that hold the present pose at rest against gravity (N, N m).

        In the order of `qd`: bias_forces() without velocities. Springs, contacts and loads are not in them;
        where loops are closed, they are the forces with which the loops carry nothing.
        """
        still = self._core.copy()
        still.linear_velocities[...] = still.angular_velocities[...] = 0.0
        return self._model.tree.inverse_dynamics(still, np.zeros(self._model.nv))

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
        self, *, inputs: str = "controls", tolerance: float = 1e-10, threads: int | None = None
    ) -> Linearisation:
        """A and B of one time step: the state after it as a linear function of state and inputs before it.

        By central differences, each a step of a copy; the copies run side by side. `Linearisation` describes
        the state and the inputs, their order and units. If contacts begin, end or start to slide, there is no
        derivative: the numbers then belong to a change of 1e-6. Functions of before_step and after_step are
        not called. Each changed state is the nearest one with closed loops.

        inputs: "controls", of actuators and motors, or "joint_forces", generalised forces along qd.
        tolerance: of the solve of each step, if it is tighter than the simulation's. threads: copies at a
            time, by default one per core; the result does not depend on it.

        Raises SimulationError if a step fails, InputError naming the argument.
        """
        chosen("inputs", inputs, INPUTS)
        probe = self.copy()
        least = min(option("tolerance", tolerance), probe.options["tolerance"])
        if threads is not None:
            threads = int(option("threads", threads))
        probe.change_options(tolerance=least, threads=1)
        return linearise_core(probe._core, self._model, self.dt, inputs, threads)
