"""The verdict: does an assembly of blocks stand, and how far is it from not standing?"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...checks import Array, nonnegative_number, positive, shown, vector3
from ...errors import InputError
from ...model.assembly import Assembly
from ...model.model import Model
from .forces import joint_rows
from .joints import default_gap, find_joints, require_joined
from .loads import Load
from .mortar import OPENING, bonded
from .of_model import assembly_of, joints_of, touching
from .overlaps import require_apart
from .ranges import Range, force_range
from .search import WITHIN, Factor, least_friction, load_factor
from .settling import Settlement, settled
from .statics import Equilibrium, Statics, reduced_faces
from .ties import Tie, ties_of

VERDICTS = {
    "stands": "forces within the joints balance the weight, and blocks placed freely stay",
    "needs prestress": "forces within the joints could balance the weight, but blocks placed freely move",
    "falls": "no forces within the joints balance the weight: the mechanism proves it",
    "crushes": "no forces found within the strength of the joints balance the weight",
    "undecided": "the solves did not decide",
}
SETTLED_WITHIN = 0.01
"""Least relative width of the interval of a settlement"""
ROUNDS = 12
"""Solves in which the faces that a compressive strength leaves, and the forces on them, settle"""


@dataclass(frozen=True, eq=False, repr=False)
class Stability:
    """A verdict with its proofs; made by `stability`.

    Forces are in N, points in m, axes are those of the world.

    >>> from amontons.studies import stability
    >>> verdict = stability(scenes.make("arch"))
    >>> bool(verdict.joint_forces["compression"].min() > 0)
    True
    """

    verdict: str
    """stands | needs prestress | falls | crushes | undecided"""
    assembly: Assembly
    """the blocks; free ones are those of `mechanism`"""
    statics: Statics
    """joints and loads as a variational inequality"""
    equilibrium: Equilibrium
    """forces that balance the weight, or the mechanism that proves that none do"""
    placed: Equilibrium
    """what blocks do by Coulomb's law that were put in place without stress"""
    factors: tuple[Factor, ...] = ()
    """of collapse, one per load that was asked for"""
    notes: tuple[str, ...] = ()
    """what was assumed"""
    source: Model | None = None
    """the model that was asked about, if it was one"""

    @property
    def stands(self) -> bool:
        """Whether the verdict is "stands"."""
        return self.verdict == "stands"

    @property
    def meaning(self) -> str:
        """The verdict as a sentence."""
        return VERDICTS[self.verdict]

    @cached_property
    def joint_forces(self) -> np.ndarray[Any, Any]:
        """(j,) a row per joint: force, where it acts, friction used, eccentricity; fields of JOINTS.

        If the blocks stand, these are the forces that joints of a small, equal compliance take. Equilibrium
        allows others too, see `range_of`.
        """
        return joint_rows(self.statics, self.placed if self.stands else self.equilibrium)

    @property
    def tie_forces(self) -> dict[str, tuple[Array, Array]]:
        """For each joint of the model its force (3,) (N) on body a and the moment (3,) (N m) about its point.

        They balance the weight if the blocks stand. Like `joint_forces` they need not be the only ones.
        """
        equilibrium = self.placed if self.stands else self.equilibrium
        parts = np.split(equilibrium.ties, np.cumsum([len(tie.wrenches) for tie in self.statics.ties]))
        sums = [y @ tie.wrenches for y, tie in zip(parts, self.statics.ties, strict=False)]
        return {tie.name: (w[:3], w[3:]) for tie, w in zip(self.statics.ties, sums, strict=True)}

    @cached_property
    def mechanism(self) -> Array | None:
        """(b, 6) linear and angular velocity of every block as it starts to fall; None if it stands.

        The fastest corner has 1 m/s; linear velocities are those of the centres of mass."""
        if self.stands or self.verdict == "undecided":
            return None
        moves = self.equilibrium if self.equilibrium.status == "falls" else self.placed
        return velocities(self.statics, moves)

    def range_of(self, joint: int, along: Sequence[float] | None = None) -> Range:
        """Least and largest force (N) on block a of a joint in equilibrium, along its normal or `along`.

        Both ends are equal where equilibrium determines the force; infinite where blocks can be wedged.
        Raises InputError if the blocks do not stand, and for a joint that does not exist.
        """
        if not 0 <= joint < len(self.statics.joints):
            raise InputError(
                f"range_of: there is no joint {joint}; the assembly has {len(self.statics.joints)}"
            )
        if self.equilibrium.status != "stands":
            raise InputError("range_of: no forces balance the weight, so that a joint has no range of forces")
        axis = self.statics.joints[joint].normal if along is None else np.array(vector3("along", along))
        return force_range(self.statics, self.statics.weights, joint, np.asarray(axis))

    def model(self, *, opening: float = OPENING) -> Model:
        """The model whose simulation answers the same question in time: the one of the verdict, or that of
        `Assembly.model`, with its mortar.

        Where the verdict has `tension`, each joint is bonded at its corners (`parts.Bond`). A bond bears its
        share of the tension until its sides are `opening` (m) apart, and then never again.
        """
        opening = positive("opening", opening)
        return bonded(self.statics, self.source or self.assembly.model(), opening=opening)

    def as_dict(self) -> dict[str, Any]:
        """Verdict, factors and worst joints as plain values, for JSON."""
        rows = self.joint_forces
        names = self.assembly.names
        made: dict[str, Any] = {
            "verdict": self.verdict,
            "meaning": self.meaning,
            "blocks": len(names),
            "supports": list(self.assembly.supports),
            "joints": len(rows),
            "weight": float(np.linalg.norm(self.statics.weights[:, :3], axis=1).sum()),
            "unbalanced": self.equilibrium.unbalanced,
            "factors": [
                {
                    "load": f.load,
                    "unit": f.unit,
                    "lower": f.lower,
                    "upper": _finite(f.upper),
                    "placed": _finite(f.placed),
                }
                for f in self.factors
            ],
            "notes": list(self.notes),
        }
        if len(rows) and self.equilibrium.status == "stands":
            for key in ("friction_used", "eccentricity", "compression"):
                k = int(np.argmax(rows[key]))
                made[f"largest_{key}"] = {
                    "value": float(rows[key][k]), "joint": [names[rows["a"][k]], names[rows["b"][k]]]
                }  # fmt: skip
        if self.mechanism is not None:
            speed = np.linalg.norm(self.mechanism[:, :3], axis=1)
            order = np.argsort(-speed, kind="stable")[:5]
            made["falling"] = [names[i] for i in order.tolist() if speed[i] > 0.05 * speed.max()]
        return made

    def __repr__(self) -> str:
        lines = [f"verdict: {self.verdict} ({self.meaning})", *map(str, self.factors)]
        return "Stability\n  " + "\n  ".join(lines)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def stability(
    subject: Model | Assembly,
    *,
    loads: Iterable[Load | Settlement] = (),
    friction_margin: bool = False,
    gap: float | None = None,
    tension: float = 0.0,
    strength: float = math.inf,
    within: float = WITHIN,
) -> Stability:
    """Whether blocks that touch stand under their weight, with a proof, and how far they are from falling.

    subject: an `Assembly`, as `read_assembly` makes, or a Model, whose rigid joints, rods and ropes bear too.
    loads: growing loads (`horizontal`, `tilt`, `point_load`, `settlement`); each gets its factor of collapse.
    friction_margin: also find the least share of all coefficients of friction that suffices.
    gap: largest distance of faces that touch (m); None for a five-hundredth of the median size of a block.
    tension: tensile strength of mortar (Pa), as if it yielded; the cohesion is the friction times it.
    strength: compressive strength of a joint (Pa), by faces that are reduced for a stress block.
    within: relative width of the interval of a factor; of a settlement at least a hundredth.

    Raises InputError that names the blocks: none is a support, some hang in the air, some overlap.

    >>> from amontons.studies import stability
    >>> stability(scenes.make("arch")).verdict
    'stands'
    """
    tension = nonnegative_number("tension", tension)
    if not strength > 0:
        raise InputError(f"strength is {strength:g}; give the compressive strength of a joint in Pa, > 0")
    wanted = _checked(loads)
    statics, notes = _statics(subject, gap, tension)
    verdict, statics, equilibrium, placed = _verdict(statics, strength)
    factors = []
    if verdict in ("stands", "needs prestress"):
        factors = [
            settled(statics, load, within=max(within, SETTLED_WITHIN))
            if isinstance(load, Settlement)
            else load_factor(statics, load, within=within)
            for load in wanted
        ]
        if friction_margin:
            factors.append(least_friction(statics, within=within))
    if math.isfinite(strength) and factors:
        notes.append("factors are of the faces that the strength leaves under the weight alone")
    source = subject if isinstance(subject, Model) else None
    proofs = (statics, equilibrium, placed, tuple(factors), tuple(notes), source)
    return Stability(verdict, statics.assembly, *proofs)


def _checked(loads: Iterable[Load | Settlement]) -> list[Load | Settlement]:
    wanted = list(loads)
    for load in wanted:
        if not isinstance(load, Load | Settlement):
            raise InputError(
                f"loads: {shown(load)} is no load; make one by horizontal, tilt, point_load or settlement"
            )
    return wanted


def _statics(subject: Model | Assembly, gap: float | None, tension: float) -> tuple[Statics, list[str]]:
    """Joints and ties of what was asked about, and notes; InputError for what no verdict can be about."""
    assembly = assembly_of(subject) if isinstance(subject, Model) else subject
    if not isinstance(assembly, Assembly):
        raise InputError(f"stability: {shown(subject)} is neither a Model nor an Assembly; see read_assembly")
    if all(block.fixed for block in assembly.blocks):
        raise InputError(
            f"all {len(assembly.blocks)} blocks are supports, so that none can fall; name fewer in "
            "supports=, and check which axis of the file points up (up=)"
        )
    distance = default_gap(assembly) if gap is None else nonnegative_number("gap", gap)
    ties: tuple[Tie, ...] = ()
    left_out: tuple[str, ...] = ()
    if isinstance(subject, Model):
        ties, left_out = ties_of(subject)
        require_apart(assembly, distance, touching(subject, assembly))
        found = joints_of(subject, assembly, distance)
    else:
        require_apart(assembly, distance)
        found = find_joints(assembly, distance)
    require_joined(assembly, found, distance, ((tie.a, tie.b) for tie in ties))
    return Statics(assembly, tuple(found), tension=tension, ties=ties), [*assembly.notes, *left_out]


def _verdict(statics: Statics, strength: float) -> tuple[str, Statics, Equilibrium, Equilibrium]:
    loads = statics.weights
    equilibrium = statics.solve(loads)
    if equilibrium.status == "stands" and math.isfinite(strength):
        reduced, statics, equilibrium = _reduced(statics, equilibrium, strength)
        if not reduced:
            return "crushes", statics, equilibrium, equilibrium
    if equilibrium.status != "stands":
        return equilibrium.status, statics, equilibrium, equilibrium
    placed = statics.placed(loads)
    words = {"stands": "stands", "falls": "needs prestress"}
    return words.get(placed.status, "undecided"), statics, equilibrium, placed


def _reduced(
    statics: Statics, equilibrium: Equilibrium, strength: float
) -> tuple[bool, Statics, Equilibrium]:
    """Faces reduced for the forces on them, until those no longer grow."""
    normals = np.array([joint.normal for joint in statics.joints])
    assumed = np.zeros(len(normals))
    current = statics
    for _ in range(ROUNDS):
        acting = np.einsum("jk,jk->j", current.sums(equilibrium)[0], normals)
        if np.all(acting <= assumed * (1 + 1e-3) + 1e-9 * abs(acting).max(initial=0.0)):
            return True, current, equilibrium
        assumed = np.maximum(assumed, acting)
        faces = reduced_faces(statics.joints, assumed, strength)
        if faces is None:
            return False, current, equilibrium
        current = replace(statics, reduced=faces)
        equilibrium = current.solve(current.weights)
        if equilibrium.status != "stands":
            return False, current, equilibrium
    return False, current, equilibrium


def velocities(statics: Statics, moves: Equilibrium) -> Array:
    """(b, 6) of all blocks, supports at rest, scaled so that the fastest corner has 1 m/s."""
    blocks = statics.assembly.blocks
    made = np.zeros((len(blocks), 6))
    fastest = 0.0
    for k, i in enumerate(statics.free):
        made[i] = moves.acceleration[k]
        arms = blocks[i].vertices - np.array(blocks[i].mass.centre_of_mass)
        speed = np.linalg.norm(made[i, :3] + np.cross(made[i, 3:], arms), axis=1)
        fastest = max(fastest, float(speed.max()))
    return made / fastest if fastest > 0 else made
