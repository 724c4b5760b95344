"""Generalised coordinates of a model: their order and names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from .. import _core
from .parts import WORLD, Body, Dof, Joint
from .transforms import ORIGIN

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

QUATERNION = ("qw", "qx", "qy", "qz")
PARTS = {
    "free": (("x", "y", "z", *QUATERNION), ("vx", "vy", "vz", "wx", "wy", "wz")),
    "ball": (QUATERNION, ("wx", "wy", "wz")),
}
"""Suffixes of the entries of q and qd, after the name of the coordinate and a dot."""


@dataclass(frozen=True)
class Coordinate:
    """One elementary joint between two bodies: a hinge, a slide, a ball, or none (a floating base).

    docs/state.md says what its entries of q and qd mean.
    """

    name: str
    kind: str
    """hinge | slide | ball | free"""
    body: int
    """which it moves"""
    joint: int
    """-1 of a floating base that no joint holds"""
    dof: int
    """of the joint; -1 of a ball or a floating base"""
    q: slice
    """its entries in `Simulation.q`"""
    qd: slice
    """its entries in `Simulation.qd`"""

    @property
    def q_names(self) -> tuple[str, ...]:
        """Names of its entries in q: hip, or torso.x, ..., torso.qw, ..."""
        return tuple(f"{self.name}.{part}" for part in PARTS[self.kind][0]) if self.dof < 0 else (self.name,)

    @property
    def qd_names(self) -> tuple[str, ...]:
        """Names of its entries in qd: hip, or torso.vx, ..., torso.wx, ..."""
        return tuple(f"{self.name}.{part}" for part in PARTS[self.kind][1]) if self.dof < 0 else (self.name,)


def coordinates_of(
    tree: _core.Tree, bodies: Sequence[Body], joints: Sequence[Joint]
) -> dict[str, Coordinate]:
    """The coordinates of a tree of bodies and joints by name.

    They are in the order of q: that of the bodies, and of the degrees of freedom of their joints.
    """
    found: dict[str, Coordinate] = {}
    for name, kind, body, joint, dof, q, qd in _parts(tree, bodies, joints):
        while name in found:
            name += "_"
        nq, nv = (len(part) for part in PARTS.get(kind, ("1", "1")))
        found[name] = Coordinate(name, kind, body, joint, dof, slice(q, q + nq), slice(qd, qd + nv))
    return found


def _parts(
    tree: _core.Tree, bodies: Sequence[Body], joints: Sequence[Joint]
) -> Iterator[tuple[str, str, int, int, int, int, int]]:
    """name, kind, body, joint, dof, first of q, first of qd."""
    for body, _, joint, _, q, nq, v, _ in tree.links:
        if joint < 0:
            yield bodies[body].name, "free", body, -1, -1, q, v
            continue
        own = joints[joint]
        dofs = len(own.dofs)
        if is_floating(own):
            yield bodies[body].name, "free", body, joint, -1, q, v
            continue
        for k, dof in enumerate(own.dofs):
            yield coordinate_name(own, k), dof.kind, body, joint, k, q + k, v + k
        if nq > dofs:
            yield coordinate_name(own, -1), "ball", body, joint, -1, q + dofs, v + dofs


def is_floating(joint: Joint) -> bool:
    """Whether the coordinates of a joint to the world are those of a floating base: x, y, z, then a ball."""
    along = tuple(dof.axis for dof in joint.dofs if dof.kind == "slide")
    frames = joint.frame_a == joint.frame_b == ORIGIN
    return frames and joint.spherical and joint.body_b == WORLD and along == AXES and len(joint.dofs) == 3


def coordinate_name(joint: Joint, dof: int) -> str:
    """The name of a degree of freedom of a joint, or of its ball (-1)."""
    if dof < 0:
        return joint.name + (".ball" if joint.dofs else "")
    alone = len(joint.dofs) == 1 and not joint.spherical
    return joint.dofs[dof].name or (joint.name if alone else f"{joint.name}[{dof}]")


def joint_labels(joints: Sequence[Joint]) -> list[str]:
    """Names, and for joints without one their number."""
    return [joint.name or f"joint {k}" for k, joint in enumerate(joints)]


def degrees(joints: Sequence[Joint]) -> Iterator[tuple[str, Dof]]:
    """Name and description of all degrees of freedom, in the order of `Simulation.forces.joint_efforts`."""
    for joint, label in zip(joints, joint_labels(joints), strict=True):
        named = joint if joint.name else replace(joint, name=label)
        for d, dof in enumerate(joint.dofs):
            yield coordinate_name(named, d), dof


def known(names: Sequence[str]) -> str:
    """The names, as an error lists them."""
    return ", ".join(names[:30]) + (", ..." if len(names) > 30 else "") or "none"
