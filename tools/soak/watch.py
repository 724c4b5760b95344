"""What must hold of every step of a scene, whatever is in it.

- All numbers are finite.
- No energy from nothing: the step says that it is balanced, and, without motors, kinetic energy and that of
  springs grow by no more than what gravity does along the mean velocities. A heavy body may squeeze a
  light one out: what that flies off with is energy of the heavy one.
- No accepted nonsense: in a step that says it converged no contact closes faster than a share of the speeds
  in the scene, or of that which it has without impulses, be the bodies ever so light.
- No lost body: at the end none is below the floor or behind a wall. What flies over a wall is not lost, nor
  is what hangs on joints that are torn: joints and walls may contradict each other, and the report tells.

A step that missed its tolerance and says so is no fault; it is counted. So is a body that is lost in such a
step or after it, and the SimulationError of velocities beyond all numbers: the user was told that they are
wrong.
"""

from __future__ import annotations

from typing import Any

import amontons
import numpy as np

from .family import Failure
from .random_scene import WIDE, Scene

Array = np.ndarray[Any, Any]

OF_ENERGY, OF_WEIGHT, OF_CHANGE = 1e-2, 0.25, 2e-2
"""What a step may seem to gain by its tolerance and by its second order: of the energy that is there, of what
gravity gives in a step to a body at rest, m (g h)^2 / 2, of the energy of the change of velocities. A quarter
of the second is what a contact may do: a body that rises at u < g h, and is held at the end of the step, has
taken the impulse m (g h - u) along the mean velocity u / 2, at most m (g h)^2 / 8."""
CLOSING = 0.25
"""Of the speeds in a scene: how fast a contact may close in a step that converged. At a tolerance of one in a
thousand a body of a ten-thousandth of the mass may miss by a tenth."""


class Watch:
    """The promises, for one simulation. Raises Failure where one is broken.

    Velocities are those of the middles of steps, which impulses change: those of the state are of an instant.
    """

    def __init__(self, scene: Scene, sim: amontons.Simulation) -> None:
        self.scene, self.sim = scene, sim
        bodies = scene.model.bodies
        self.mass = np.array([b.mass for b in bodies])[:, None]
        self.inertia = np.array([b.inertia for b in bodies])
        self.moving = self.in_the_middle()
        self.spins = self.moving.angular_velocities.copy()
        self.springs = 0.0  # J, at the end of the last step
        self.centre = np.array([b.centre_of_mass for b in bodies])
        self.extent = np.array(scene.extents)
        self.gravity = np.array(scene.model.gravity)
        self.over = np.zeros(len(bodies), dtype=bool)
        self.velocities = self.of_centres()
        self.stored: tuple[float, float] | None = None  # J, kinetic and of springs
        self.jointed = np.zeros(len(bodies), dtype=bool)
        for joint in scene.model.joints:
            ends = (joint.body_a, joint.body_b)
            self.jointed[[b for b in ends if isinstance(b, int) and b >= 0]] = True
        self.missed = 0
        self.ended = False  # by a SimulationError
        self.joint_error = 0.0  # m, of the last step
        self.worst = self.rise = self.closing = 0.0
        self.lost = 0  # bodies, after a step that missed

    def in_the_middle(self) -> Any:
        """The state with the velocities with which the bodies moved in the last step."""
        copy = self.sim.copy()
        copy._core.show_middle()
        return copy.state

    def of_centres(self) -> Array:
        """Velocities of the centres of mass."""
        state = self.moving
        w, u = state.orientations[:, :1], state.orientations[:, 1:]
        t = 2 * np.cross(u, self.centre)
        arm = self.centre + w * t + np.cross(u, t)
        return np.asarray(state.linear_velocities + np.cross(state.angular_velocities, arm))

    def step(self) -> amontons.Report | None:
        """The report; none after misses, where the simulation ended and said so."""
        try:
            report = self.sim.step()
        except amontons.SimulationError:
            if not self.missed:
                raise
            self.ended = True
            return None
        self.missed += report.status != "converged"
        self.worst = max(self.worst, report.residual)
        values = (report.energy, report.residual, report.penetration, report.joint_error)
        if not np.isfinite(values).all() or not np.isfinite(self.sim.state.positions).all():
            raise Failure("not finite", f"step {self.sim.steps}: {report}")
        self.joint_error = report.joint_error
        self.moving = self.in_the_middle()
        velocities = self.of_centres()
        self.look_at_energy(report, velocities)
        if report.converged and report.contacts:
            self.look_at_contacts(report)
        self.velocities = velocities
        # Who may leave over a wall, now or later.
        self.over |= self.sim.state.positions[:, 2] > 0.8 * WIDE * self.scene.size
        return report

    def look_at_energy(self, report: amontons.Report, velocities: Array) -> None:
        """The second look is for steps in one part: between several the velocities are not known."""
        if not report.balanced:
            raise Failure("energy", f"step {self.sim.steps} is not balanced: {report}")
        scene, before, spun = self.scene, self.stored, self.spun()
        # Springs in the middle, too: the mean of both ends.
        springs = 0.5 * (self.springs + report.spring_energy)
        self.springs = report.spring_energy
        self.stored = self.kinetic(velocities), springs
        if before is None or report.substeps > 1 or scene.driven:
            return
        mean = 0.5 * (self.velocities + velocities)
        kick = self.sim._core.impulse_step
        given = kick * float((self.mass * mean * self.gravity).sum())
        changed = 0.5 * float((self.mass * (velocities - self.velocities) ** 2).sum()) + spun
        weight = 0.5 * float((self.mass * (scene.dt * self.gravity) ** 2).sum())
        allowed = OF_ENERGY * (sum(self.stored) + sum(before)) + OF_WEIGHT * weight + OF_CHANGE * changed
        if scene.options["recovery"] == "velocity":
            # Overlaps are taken back at such a speed, which is what was asked for.
            allowed += float(self.mass.sum()) * scene.model.length**2
        kinetic, springs = self.stored[0] - before[0], self.stored[1] - before[1]
        errors = max(report.penetration, report.joint_error)
        if scene.options["recovery"] == "projection" and errors > 1e-4 * scene.model.length:
            # Bodies are moved out of each other, which bends springs as it lifts weights, apart from the
            # velocities. How far is not told; the springs give at most all that they hold.
            springs = -max(before[1], self.stored[1])
        share = (kinetic + springs - given) / max(allowed, 1e-300)
        self.rise = max(self.rise, share)
        if share > 1:
            text = f"step {self.sim.steps}: {share * allowed:.3g} J to {before[0]:.3g}: {report}"
            raise Failure("energy", text)

    def kinetic(self, velocities: Array) -> float:
        """J, of these velocities of centres and the spins of now."""
        local = self.local(self.moving.angular_velocities)
        turning = 0.5 * float(np.einsum("bi,bij,bj->", local, self.inertia, local))
        return 0.5 * float((self.mass * velocities**2).sum()) + turning

    def local(self, vectors: Array) -> Array:
        """In the axes of the bodies."""
        turns = self.moving.orientations
        w, u = turns[:, :1], -turns[:, 1:]
        t = 2 * np.cross(u, vectors)
        return np.asarray(vectors + w * t + np.cross(u, t))

    def spun(self) -> float:
        """Energy of the change of angular velocities since the last call (J), in the axes of the bodies."""
        local = self.local(self.moving.angular_velocities - self.spins)
        self.spins = self.moving.angular_velocities.copy()
        return 0.5 * float(np.einsum("bi,bij,bj->", local, self.inertia, local))

    def look_at_contacts(self, report: amontons.Report) -> None:
        """Their u_n = (A x + b)_n, in which gaps and turns are, against the speeds of the bodies and b."""
        problem = self.sim.problem()
        u = problem._product(self.sim.forces.impulses) + problem.b
        normals: list[int] = []
        row = 0
        for cone in problem.cones:
            if len(normals) < report.contacts:
                sets = len(cone.parameters[0]) if cone.parameters else cone.rows
                normals += range(row, row + cone.rows, cone.rows // max(1, sets))
            row += cone.rows
        at = np.array(normals[: report.contacts])
        # The velocities of the points: of the normal and two tangents, which lead the rows of a contact.
        alone = np.linalg.norm(problem.b[at[:, None] + np.arange(3)], axis=1)
        speed = np.linalg.norm(self.velocities, axis=1).max() + self.scene.dt * np.linalg.norm(self.gravity)
        fast = np.maximum(speed, alone)
        shares = -u[at] / fast
        which = int(np.argmax(shares))
        self.closing = max(self.closing, float(shares[which]))
        if shares[which] > CLOSING:
            text = f"contact {which} closes at {shares[which]:.2g} of {fast[which]:.3g} m/s: {report}"
            raise Failure("accepted nonsense", f"step {self.sim.steps}: {text}")

    def end(self) -> None:
        scene, positions = self.scene, self.sim.state.positions / self.scene.size
        extent = self.extent / scene.size
        side = np.abs(positions[:, :2]).max(axis=1)
        # The floor may end behind the walls, where what flew over them falls.
        stays = ~self.over | scene.endless
        low = (positions[:, 2] < -extent - 0.3) & stays
        behind = (side > WIDE + extent) & ~self.over
        torn = self.jointed & (self.joint_error > 0.1 * scene.size)
        for what, which in (("fell through the floor", low), ("went through a wall", behind)):
            if not (which & ~torn).any():
                continue
            if self.missed:
                self.lost += int((which & ~torn).sum())
                continue
            k = np.flatnonzero(which & ~torn)
            raise Failure("lost body", f"{k} {what}: {positions[k]} of {scene.size}")
