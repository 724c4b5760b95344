"""Bodies as trees, for formats in which a body stands within the one that carries it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ...checks import Array, Vector3
from ...model.model import Model
from ...model.parts import WORLD, Dof, Joint
from ...model.transforms import Transform, axis_angle, rotate, subtract
from ...simulation.simulation import Simulation


@dataclass(frozen=True)
class Branch:
    """A body, what carries it, and the joint in between."""

    body: int
    parent: int
    joint: int | None
    """None: it moves freely, or not at all"""
    turned: bool = False
    """whether the parent is body A of the joint"""


class Trees:
    """The branches of a model, parents first; the joints that are left close loops."""

    def __init__(self, model: Model) -> None:
        self.model = model
        simulation = Simulation(model)
        coordinates: Array = simulation.state.joint_coordinates
        self.start = [
            coordinates[model.core.first_dof(j) :][: len(joint.dofs)] for j, joint in enumerate(model.joints)
        ]
        """by joint: its coordinates in the initial pose"""
        self.lengths: Array = simulation.tendon_efforts["length"]
        """of the tendons in the initial pose"""
        self.branches: list[Branch] = []
        self.loops: list[int] = []
        self._grow()
        self.branches = self._in_order()

    def _in_order(self) -> list[Branch]:
        """Branches after each other, each with all that hangs on it; of one parent in the model's order."""
        above: dict[int, list[Branch]] = {}
        for branch in sorted(self.branches, key=lambda each: -each.body):
            above.setdefault(branch.parent, []).append(branch)
        found: list[Branch] = []
        left = above.pop(WORLD, [])
        while left:
            found.append(left.pop())
            left += above.pop(found[-1].body, [])
        return found

    def _grow(self) -> None:
        model = self.model
        joints = [
            j for j, joint in enumerate(model.joints) if joint.kind == "chain" and not joint.closes_loop
        ]
        self.loops = sorted(set(range(len(model.joints))) - set(joints))
        still = [b for b, body in enumerate(model.bodies) if body.motion != "dynamic"]
        self.branches = [Branch(b, WORLD, None) for b in still]
        there = {WORLD, *still}
        while True:
            while self._pass(joints, there):
                pass
            left = [b for b in range(len(model.bodies)) if b not in there]
            if not left:
                break
            # A root moves freely: a body that no joint hangs on another one, if there is one.
            hanging = {model.joints[j].body_a for j in joints}
            root = next((b for b in left if b not in hanging), left[0])
            self.branches.append(Branch(root, WORLD, None))
            there.add(root)
        self.loops.sort()

    def _pass(self, joints: list[int], there: set[int]) -> bool:
        """Adds the bodies that joints hold on those that are there; False if there are none."""
        before = len(there)
        for j in list(joints):
            a, b = (int(end) for end in (self.model.joints[j].body_a, self.model.joints[j].body_b))  # type: ignore[arg-type]
            if a not in there and b not in there:
                continue
            joints.remove(j)
            if a in there and b in there:
                self.loops.append(j)
                continue
            turned = a in there
            self.branches.append(Branch(b if turned else a, a if turned else b, j, turned))
            there.add(b if turned else a)
        return len(there) > before


def at_start(joint: Joint, start: Array, turned: bool) -> Iterator[tuple[int, Vector3, Vector3, float]]:
    """The degrees of freedom from the parent outwards: index, axis and anchor in the body that they carry.

    Both are those of the initial pose, at the coordinate that comes last.
    """
    order = list(range(len(joint.dofs)))
    frame, sign = joint.frame_a, 1.0
    if turned:
        order.reverse()
        frame, sign = joint.frame_b, -1.0
    # Later members of the chain have turned the axis, as the child sees it.
    found = []
    for k in reversed(order):
        dof, q = joint.dofs[k], float(start[k])
        axis = rotate(frame.rotation, dof.axis)
        found.append((k, tuple(sign * x for x in axis), frame(dof.anchor), q))
        step = moved(dof, q)
        frame = frame @ (step if turned else step.inverse())
    yield from reversed(found)  # type: ignore[misc]


def moved(dof: Dof, q: float) -> Transform:
    """The displacement by a degree of freedom."""
    if dof.kind == "slide":
        return Transform(tuple(q * x for x in dof.axis))  # type: ignore[arg-type]
    turn = axis_angle(dof.axis, q)
    return Transform(subtract(dof.anchor, rotate(turn, dof.anchor)), turn)
