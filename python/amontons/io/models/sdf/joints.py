"""Joints of SDF."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ....errors import FileError
from ....model.builder import ModelBuilder
from ....model.parts import WORLD, Dof, Joint, Motor
from ....model.transforms import ORIGIN, Transform, Vector3, conjugate, dot, rotate
from ..elements import Element
from ..issues import Issues
from .frames import ROOT, Scope
from .values import bound, flag, text, value, vector, version

KINDS = {
    "fixed": (), "ball": (), "revolute": ("hinge",), "continuous": ("hinge",), "prismatic": ("slide",),
    "revolute2": ("hinge", "hinge"), "universal": ("hinge", "hinge"), "screw": ("slide", "hinge"),
}  # fmt: skip


@dataclass
class Made:
    """A joint that was read: its index, its ends in the model, its axis in the world."""

    index: int
    child: int
    parent: int
    axis: Vector3


class Joints:
    """Reads joints into a builder whose bodies are there."""

    def __init__(self, builder: ModelBuilder, bodies: dict[tuple[int, str], int], issues: Issues) -> None:
        self.builder, self.bodies, self.issues = builder, bodies, issues
        self.made: dict[str, Made] = {}
        self.later: list[tuple[Scope, Element]] = []
        """what couples joints that may follow in the file"""

    def read(self, scope: Scope, element: Element) -> None:
        kind = element.attributes.get("type", "")
        if kind == "gearbox":
            self.later.append((scope, element))
            return
        if kind not in KINDS:
            self.issues.add(element, f'type="{kind}": this kind of joint', "large")
            return
        ends = [self._end(scope, element, tag) for tag in ("child", "parent")]
        (child, child_pose), (parent, parent_pose) = ends
        if child == parent:
            raise FileError(f"{element.place}: {element} joins a link to itself")
        static = [self.builder.is_fixed(end) for end in (child, parent)]
        if all(static):
            return
        frame = scope.element_pose(element, text(element, "child"))
        axes = [element.child(tag) for tag in ("axis", "axis2")]
        dofs = []
        for number, what in enumerate(KINDS[kind]):
            axis = axes[0 if kind == "screw" else number]
            direction = rotate(conjugate(frame.rotation), self._axis(scope, element, axis, frame))
            dofs.append(self._dof(what, direction, axis, limited=kind not in ("continuous", "screw")))
        if static[0]:
            # The first body of a joint moves: its coordinates then run the other way.
            child, parent, child_pose, parent_pose = parent, child, parent_pose, child_pose
            dofs = [_reversed(dof) for dof in reversed(dofs)]
        name = scope.prefix + element.name
        with element.told():
            index = self.builder.add_joint(
                Joint(
                    name,
                    body_a=child,
                    body_b=parent,
                    frame_a=child_pose.inverse() @ frame,
                    frame_b=parent_pose.inverse() @ frame,
                    dofs=tuple(dofs),
                    spherical=kind == "ball",
                )
            )
            if kind == "screw":
                lead = _lead(element)
                self.builder.add_coupling(index, index, dof_a=0, dof_b=1, coefficients=(0.0, lead))
        axis = rotate(frame.rotation, dofs[0].axis) if dofs else (0.0, 0.0, 1.0)
        self.made[name] = Made(index, child, parent, axis)
        self.later += [(scope, axis) for axis in axes if axis is not None and axis.child("mimic")]

    def _end(self, scope: Scope, element: Element, tag: str) -> tuple[int, Transform]:
        child = element.child(tag)
        if child is None or not child.text.strip():
            raise FileError(f"{element.place}: {element} has no <{tag}>; give it one")
        found = scope.link(child.text.strip(), child)
        if found is None:
            return WORLD, ORIGIN
        where, name = found
        body = self.bodies[id(where), name]
        return body, self.builder.pose(body)

    def _axis(self, scope: Scope, joint: Element, axis: Element | None, frame: Transform) -> Vector3:
        """The direction of an axis in the world."""
        xyz = axis.child("xyz") if axis is not None else None
        given = vector(axis, "xyz", (0.0, 0.0, 1.0))
        if not any(given):
            raise joint.fault("<xyz> is zero; give the direction of the axis")
        if xyz is not None and xyz.attributes.get("expressed_in"):
            turn = scope.in_world(xyz.attributes["expressed_in"], xyz).rotation
        # Up to 1.4 an axis was in the frame of the model; then this was a switch.
        elif flag(axis, "use_parent_model_frame", default=version(joint) < (1, 5)):
            turn = scope.in_world(ROOT, joint).rotation
        else:
            turn = frame.rotation
        return rotate(turn, given)  # type: ignore[arg-type]

    def _dof(self, kind: str, direction: Vector3, axis: Element | None, *, limited: bool) -> Dof:
        dynamics = axis.child("dynamics") if axis is not None else None
        limit = axis.child("limit") if axis is not None else None
        lower, upper = bound(limit, "lower", -math.inf), bound(limit, "upper", math.inf)
        if lower > upper:
            assert limit is not None
            self.issues.add(limit, f"lower {lower:g} is above upper {upper:g}; it moves without limits")
        if not limited or lower > upper:
            lower, upper = -math.inf, math.inf
        effort = bound(limit, "effort", math.inf)
        given: dict[str, Any] = {
            "damping": value(dynamics, "damping", 0.0),
            "friction": value(dynamics, "friction", 0.0),
            "stiffness": value(dynamics, "spring_stiffness", 0.0),
            "rest": value(dynamics, "spring_reference", 0.0),
            "motor": Motor(max_effort=effort if effort > 0 else math.inf),
        }
        return Dof(kind, direction, lower=lower, upper=upper, **given)

    def finish(self) -> None:
        """Couples joints: mimics and gearboxes."""
        for scope, element in self.later:
            (self._gearbox if element.tag == "joint" else self._mimic)(scope, element)

    def _named(self, scope: Scope, name: str) -> Made | None:
        return self.made.get(scope.prefix + name)

    def _mimic(self, scope: Scope, axis: Element) -> None:
        mimic = axis.child("mimic")
        assert axis.parent is not None
        assert mimic is not None
        leader, follower = self._named(scope, mimic.attributes.get("joint", "")), axis.parent
        own = self._named(scope, follower.name)
        if leader is None or own is None:
            self.issues.add(mimic, "the joint that it follows is not there", "large")
            return
        ratio, offset = value(mimic, "multiplier", 1.0), value(mimic, "offset", 0.0)
        self.builder.add_coupling(
            own.index,
            leader.index,
            dof_a=int(axis.tag == "axis2"),
            dof_b=int(mimic.attributes.get("axis") == "axis2"),
            coefficients=(offset - ratio * value(mimic, "reference", 0.0), ratio),
        )

    def _gearbox(self, scope: Scope, element: Element) -> None:
        """theta_2 = -ratio theta_1, the angles of parent and child from the body of reference."""
        bodies = [self._end(scope, element, tag)[0] for tag in ("parent", "child")]
        found = scope.link(text(element, "gearbox_reference_body") or "world", element)
        base = WORLD if found is None else self.bodies[id(found[0]), found[1]]
        frame = scope.element_pose(element, text(element, "child"))
        hinges, signs = [], []
        for body, tag in zip(bodies, ("axis", "axis2"), strict=True):
            made = next((m for m in self.made.values() if {m.child, m.parent} == {body, base}), None)
            if made is None:
                self.issues.add(element, "a gearbox without a joint from its body of reference", "large")
                return
            wanted = self._axis(scope, element, element.child(tag), frame)
            turned = 1.0 if made.child == body else -1.0
            hinges.append(made.index)
            signs.append(turned * math.copysign(1.0, dot(wanted, made.axis)))
        ratio = -value(element, "gearbox_ratio", 1.0) * signs[0] * signs[1]
        self.builder.add_coupling(hinges[1], hinges[0], coefficients=(0.0, ratio))


def _reversed(dof: Dof) -> Dof:
    a, b, c = dof.axis
    return Dof(**{**vars(dof), "axis": (-a, -b, -c)})


def _lead(element: Element) -> float:
    """m per rad of a screw: screw_thread_pitch is m per turn, thread_pitch -rad per m."""
    if element.child("screw_thread_pitch") is not None:
        return value(element, "screw_thread_pitch", 1.0) / (2 * math.pi)
    pitch = value(element, "thread_pitch", 1.0)
    if pitch == 0:
        raise element.fault("thread_pitch is 0")
    return -1 / pitch
