"""Static equilibrium of blocks as the variational inequality of one step from rest, with its certificate.

Blocks of mass M at rest feel the loads f and the forces x at the corners of their joints, D' x. The problem

    u = D M^-1 (f + D' x),   x in K,   u in K*,   <x, u> = 0   (K: Coulomb's cones)

always has a solution, and v = M^-1 (f + D' x) is the smallest acceleration, by kinetic energy, that keeps
blocks from passing into each other under the associated law. So v = 0 exactly if forces in the cones balance
the loads. If not, v is a mechanism on which the loads have the power <f, v> = v' M v > 0. Any equilibrium
would need <f, v> = -<x, D v> <= 0, since D v is in the dual cone. So v proves that there is none.

Coulomb's law has the same forces of equilibrium (v = 0 makes the term of De Saxce zero) and the proof by v
holds for it too. But a balance may need forces that nothing causes: a wedge between two walls is held by
friction once it is squeezed. So `placed` asks what happens to blocks put in place without stress: it solves
Coulomb's problem with joints of a small compliance, and again with a smaller one. The acceleration left is
proportional to the compliance if the blocks stand, and does not depend on it if they move.

Joints of a model (`ties`) add rows that are free or of one sign; a mechanism keeps the former at rest.

Mortar that bears tension shifts the cones: x = y - s with y in K, s the tensile strength times the area of
the corner.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...checks import Array
from ...model.assembly import Assembly
from ...problem.cones import Bilateral, Cone, Friction, NonNegative
from ...problem.operators import Contacts
from ...problem.problem import Problem
from .joints import Joint
from .polygons import inset, shares, widths
from .ties import Tie

BALANCED = 1e-6
"""Acceleration left over that of free fall, by kinetic energy, up to which the loads are balanced"""
PROOF = 1e3
"""A mechanism proves collapse if it excludes all joint forces whose sum is less than this times the loads"""
TOLERANCES = (1e-8, 1e-11)
"""Natural residuals of a solve, and of a second one where the first decides nothing"""
COMPLIANCES = (1e-5, 1e-7, 1e-9)
"""Compliances of joints placed without stress, over the mean of their diag(A)"""
ITERATIONS = 200
"""Iterations of a solve with compliance, where an interior point needs tens. Where it decides nothing, `auto`
does: equal blocks make its matrix singular, and it may stall"""
VANISHES, REMAINS = 0.1, 0.5
"""Ratio of the accelerations of one compliance and the next, of blocks that stand or move"""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Forces and accelerations of one load, and what they prove.

    >>> from amontons.studies import stability
    >>> stability(scenes.make("arch")).equilibrium.status
    'stands'
    """

    status: str
    """stands: forces in the cones balance the loads. falls: a mechanism proves that none can. undecided"""
    forces: Array
    """(c, 3) at the corners of the joints: along the normal, which pushes block a off block b, and along
    both axes of the joint (N)"""
    acceleration: Array
    """(n, 6) of the free blocks, linear of the centre of mass and angular (m/s^2, rad/s^2); 0 if it stands"""
    unbalanced: float
    """sqrt(v' M v) over that of free fall"""
    power: float
    """of loads and mortar on the mechanism, in N m/s^2: positive where it proves collapse"""
    reach: float
    """The mechanism excludes all equilibria whose joint forces have a sum below this times the loads; inf for
    one that is exact"""
    residual: float
    """natural residual of the solve"""
    ties: Array
    """(t,) multiples of the wrenches of the ties of the model, in their order"""


@dataclass(frozen=True, eq=False)
class Statics:
    """Joints of an assembly as a variational inequality; `solve` asks it about loads."""

    assembly: Assembly
    joints: tuple[Joint, ...]
    tension: float = 0.0
    """tensile strength of the joints (Pa); their cohesion then is friction times it"""
    friction: float = 1.0
    """factor of all coefficients of friction"""
    reduced: tuple[Array, ...] | None = None
    """for each joint (k, 2) the corners that bear, where the strength leaves less than the face"""
    ties: tuple[Tie, ...] = ()
    """joints of the model, those of both signs first"""

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Indices of the blocks that are not supports."""
        return tuple(i for i, block in enumerate(self.assembly.blocks) if not block.fixed)

    @cached_property
    def corners(self) -> tuple[Array, NDArray[np.int64]]:
        """(c, 3) points of the forces (m), and (c,) the joint of each."""
        if self.reduced is None:
            points = [joint.polygon for joint in self.joints]
        else:
            points = [
                flat @ joint.axes + (joint.polygon[0] @ joint.normal) * joint.normal
                for joint, flat in zip(self.joints, self.reduced, strict=True)
            ]
        owner = np.repeat(np.arange(len(points)), np.array([len(p) for p in points], dtype=np.int64))
        return np.concatenate([*points, np.zeros((0, 3))]), owner

    @cached_property
    def operator(self) -> Contacts:
        """D M^-1 D'."""
        points, owner = self.corners
        place = {block: k for k, block in enumerate(self.free)}
        masses = [self.assembly.blocks[i].mass for i in self.free]
        centres = np.array([mass.centre_of_mass for mass in masses]).reshape(-1, 3)
        a = np.array([place.get(joint.a, -1) for joint in self.joints], dtype=np.int64)[owner]
        b = np.array([place.get(joint.b, -1) for joint in self.joints], dtype=np.int64)[owner]
        arms = [np.where((side >= 0)[:, None], points - centres[side], 0.0) for side in (a, b)]
        return Contacts(
            [1 / mass.mass for mass in masses],
            np.array([np.linalg.inv(mass.inertia) for mass in masses]).reshape(-1, 3, 3),
            a,
            b,
            arms[0],
            arms[1],
            np.array([joint.normal for joint in self.joints]).reshape(-1, 3)[owner],
            direction=np.array([joint.axes[0] for joint in self.joints]).reshape(-1, 3)[owner],
            **self._tie_rows(place, centres),
        )

    def _tie_rows(self, place: dict[int, int], centres: Array) -> dict[str, Array]:
        """Rows of the ties, of the velocities of both bodies."""
        bodies: list[list[int]] = [[], []]
        rows: list[list[Array]] = [[], []]
        for tie in self.ties:
            for side, (block, sign) in enumerate(((tie.a, 1.0), (tie.b, -1.0))):
                k = place.get(block, -1)
                arm = tie.point - centres[k] if k >= 0 else np.zeros(3)
                force, moment = tie.wrenches[:, :3], tie.wrenches[:, 3:] + np.cross(arm, tie.wrenches[:, :3])
                bodies[side] += [k] * len(force)
                rows[side] += list(sign * np.concatenate((force, moment), axis=1))
        return {
            "joint_body_a": np.array(bodies[0], dtype=np.int64),
            "joint_body_b": np.array(bodies[1], dtype=np.int64),
            "joint_jacobian_a": np.array(rows[0]).reshape(-1, 6),
            "joint_jacobian_b": np.array(rows[1]).reshape(-1, 6),
        }

    @cached_property
    def free_rows(self) -> int:
        """Rows of ties that bear both signs."""
        return sum(len(tie.wrenches) for tie in self.ties if not tie.one_sided)

    @cached_property
    def cones(self) -> list[Cone]:
        """K: a cone per corner, then the rows of the ties."""
        single = sum(len(tie.wrenches) for tie in self.ties) - self.free_rows
        made: list[Cone] = [Friction(self.mu)] if len(self.mu) else []
        made += [Bilateral(self.free_rows)] if self.free_rows else []
        return made + ([NonNegative(single)] if single else [])

    @cached_property
    def jacobian(self) -> sp.csr_array:
        """D, (3 c + t, 6 n), sparse."""
        return self.operator.stored().jacobian()

    @cached_property
    def mobility(self) -> sp.csr_array:
        """M^-1, (6 n, 6 n), sparse."""
        return self.operator.inverse_mass_matrix()

    @cached_property
    def mu(self) -> Array:
        """(c,) coefficients of friction."""
        return self.friction * np.array([joint.friction for joint in self.joints])[self.corners[1]]

    @cached_property
    def shift(self) -> Array:
        """(3 c + t,) s: the tension that each corner bears (N)."""
        s = np.zeros((len(self.mu), 3))
        if self.tension:
            for k, joint in enumerate(self.joints):
                flat = joint.flat if self.reduced is None else self.reduced[k]
                share = shares(flat) if len(flat) > 2 else np.full(len(flat), 1 / max(len(flat), 1))
                s[self.corners[1] == k, 0] = self.tension * joint.area * share / share.sum()
        return np.append(s, np.zeros(self.operator.shape[0] - s.size))

    @cached_property
    def weights(self) -> Array:
        """(n, 6) the loads of gravity alone (N)."""
        loads = np.zeros((len(self.free), 6))
        for k, i in enumerate(self.free):
            loads[k, :3] = self.assembly.blocks[i].mass.mass * np.array(self.assembly.gravity)
        return loads

    def problem(
        self, loads: Array, *, law: str = "associated", bias: Array | None = None, compliance: float = 0.0
    ) -> Problem:
        """The variational inequality of loads (n, 6) (N, N m).

        bias: (3 c + t,) velocities added to b. compliance: of each corner, over the mean of its diag(A).
        """
        b = self.jacobian @ (self.mobility @ loads.ravel())
        if bias is not None:
            b = b + bias
        A = self.operator
        if self.tension:
            b = b - A @ self.shift
        if compliance:
            soft = compliance * A.diagonal()[: 3 * len(self.mu)].reshape(-1, 3).mean(axis=1)
            arrays = {key: value for key, value in vars(A).items() if not key.startswith("_")}
            A = Contacts.from_arrays(arrays | {"compliance": soft})
            b[: 3 * len(soft)] -= np.repeat(soft, 3) * self.shift[: 3 * len(soft)]
        return Problem(A, b, self.cones, law=law)

    def solve(self, loads: Array, *, bias: Array | None = None) -> Equilibrium:
        """The forces that balance loads (n, 6) (N, N m about the centres), or the mechanism that proves that
        none do.
        """
        problem = self.problem(loads, bias=bias)
        for tolerance in TOLERANCES:
            solution = problem.solve(method="interior-point", tolerance=tolerance)
            made = self._judged(loads, solution.x, solution.residual)
            if made.status != "undecided":
                break
        return made

    def placed(self, loads: Array) -> Equilibrium:
        """Forces and accelerations by Coulomb's law of blocks that were placed without stress."""
        few = self._placed(loads, "interior-point", ITERATIONS)
        return few if few.status != "undecided" else self._placed(loads, "auto", None)

    def _placed(self, loads: Array, method: str, most: int | None) -> Equilibrium:
        left: list[float] = []
        for compliance in COMPLIANCES:
            problem = self.problem(loads, law="coulomb", compliance=compliance)
            solution = problem.solve(method=method, tolerance=TOLERANCES[0], max_iterations=most)
            made = self._judged(loads, solution.x, solution.residual)
            left.append(made.unbalanced)
            status = "undecided"
            if made.unbalanced <= BALANCED or (len(left) > 1 and left[-1] <= VANISHES * left[-2]):
                status = "stands"
            elif len(left) > 1 and solution.converged and left[-1] >= REMAINS * left[-2]:
                status = "falls"
            if status != "undecided":
                break
        return replace(made, status=status)

    def _judged(self, loads: Array, y: Array, residual: float) -> Equilibrium:
        D, f = self.jacobian, loads.ravel()
        x = y - self.shift
        left = f + D.T @ x
        v = self.mobility @ left
        fall = float(f @ (self.mobility @ f))
        unbalanced = float(np.sqrt(max(v @ left, 0.0) / fall)) if fall else 0.0
        u = D @ v
        power = float(f @ v - self.shift @ u)
        opens, ties = np.split(u, [3 * len(self.mu)])
        opens = opens.reshape(-1, 3)
        dual = self.mu * np.linalg.norm(opens[:, 1:], axis=1) - opens[:, 0]
        held, single = np.split(ties, [self.free_rows])
        outside = max(float(part.max(initial=0.0)) for part in (dual, np.abs(held), -single))
        total = float(np.linalg.norm(loads[:, :3], axis=1).sum()) or 1.0
        reach = power / (outside * total) if outside > 0 else np.inf
        status = "undecided"
        if unbalanced <= BALANCED:
            status = "stands"
        elif power > 0 and reach >= PROOF:
            status = "falls"
        forces, ties = np.split(x, [3 * len(self.mu)])
        return Equilibrium(
            status, forces.reshape(-1, 3), v.reshape(-1, 6), unbalanced, power, reach, residual, ties
        )

    def sums(self, equilibrium: Equilibrium) -> tuple[Array, Array]:
        """For each joint the force on block a (j, 3) (N) and its moment about the origin (j, 3) (N m)."""
        points, owner = self.corners
        frames = np.array([[joint.normal, *joint.axes] for joint in self.joints]).reshape(-1, 3, 3)
        forces = np.einsum("ck,ckj->cj", equilibrium.forces, frames[owner])
        moments = np.cross(points, forces)
        count = len(self.joints)

        def summed(parts: Array) -> Array:
            return np.stack([np.bincount(owner, parts[:, k], count) for k in range(3)], axis=1)

        return summed(forces), summed(moments)


def reduced_faces(joints: Sequence[Joint], normal_forces: Array, strength: float) -> tuple[Array, ...] | None:
    """The part of each face in which the force may act so that a stress block of `strength` (Pa) bears it.

    A stress block along an edge of mean width w has the depth N / (strength w), its force half of that from
    the edge. So each edge moves inwards by N / (2 strength w). None if a joint has no part left.
    """
    made = []
    for joint, force in zip(joints, normal_forces, strict=True):
        flat = joint.flat
        if len(flat) < 3 or not force > 0:
            made.append(flat)
            continue
        left = inset(flat, force / (2 * strength * widths(flat)))
        if len(left) < 3:
            return None
        made.append(left)
    return tuple(made)
