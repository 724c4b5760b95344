"""Loops of URDF: <loop> of URDF+, and the file beside a URDF that its extended form has (arXiv 2504.04767).

A plain URDF is a tree. Both forms leave it one, and say which frames of two links come together.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from ...checks import listed
from ...errors import FileError, InputError
from ...model.parts import Dof, Joint
from ...model.transforms import ORIGIN, Transform, rotation_to_z
from .bodies import Bodies
from .compiled import Compiled
from .elements import Element
from .joints import Joints
from .urdf import origin_of

DOFS: dict[str, tuple[str, ...]] = {
    "fixed": (), "revolute": ("hinge",), "continuous": ("hinge",), "prismatic": ("slide",),
    "planar": ("slide", "slide", "hinge"), "spherical": (),
}  # fmt: skip
OPEN = 1e-6
"""m: the gap of a loop in the pose of the file from which on a warning names it"""


def read_loops(compiled: Compiled, bodies: Bodies, joints: Joints, beside: Path | None) -> None:
    """Adds the joints that close loops. beside: the file of the extended form."""
    made = _Loops(compiled, bodies, joints)
    if compiled.root.tag == "robot":
        for element in compiled.root.children:
            if element.tag == "loop":
                made.of_element(element)
    if beside is not None:
        made.of_file(beside)
    if made.gaps:
        compiled.issues.notes.append(
            "loops that are open in the pose of the file, which the first steps close: "
            + listed([f'"{name}" {1e3 * gap:.3g} mm' for name, gap in made.gaps])
        )


class _Loops:
    def __init__(self, compiled: Compiled, bodies: Bodies, joints: Joints) -> None:
        self.compiled, self.bodies, self.joints = compiled, bodies, joints
        self.index = {compiled.name("body", i): i for i in range(compiled.model.nbody)}
        self.gaps: list[tuple[str, float]] = []

    def of_element(self, element: Element) -> None:
        kind = element.attributes.get("type", "")
        if kind not in DOFS:
            raise element.fault(f'type="{kind}"; known are {", ".join(DOFS)}')
        ends = []
        for tag in ("successor", "predecessor"):
            end = element.child(tag)
            link = end.attributes.get("link", "") if end else ""
            if end is None or link not in self.index:
                raise element.fault(f'<{tag}> names no link ("{link}")')
            try:
                ends.append((self.index[link], origin_of(end)))
            except ValueError as error:
                raise element.fault(f"<{tag}>: {error}") from None
        axis = element.child("axis")
        direction = (axis.numbers("xyz") if axis else None) or [1.0, 0.0, 0.0]
        length = math.hypot(*direction)
        if len(direction) != 3 or not length > 0:
            raise element.fault(f"the axis {direction} has no direction")
        self._add(element.place, element.name, kind, ends, np.array(direction) / length)

    def of_file(self, path: Path) -> None:
        """closed_loop: pairs of names of links or joints; type: 6D (welded) or 3D (points that coincide)."""
        said = _yaml(path)
        pairs, kinds = said.get("closed_loop") or [], said.get("type") or []
        if not isinstance(pairs, list) or not isinstance(kinds, list):
            raise FileError(f"{path}: closed_loop and type must be lists")
        for k, pair in enumerate(pairs):
            if not isinstance(pair, list) or len(pair) != 2:
                raise FileError(f"{path}: closed_loop[{k}] must be two names, as [frame_a, frame_b]")
            kind = str(kinds[k]).upper() if k < len(kinds) else "6D"
            if kind not in ("3D", "6D"):
                raise FileError(f'{path}: type[{k}] is "{kinds[k]}"; known are 3D and 6D')
            ends = [(self._named(path, str(name)), ORIGIN) for name in reversed(pair)]
            name = f"{pair[0]}_{pair[1]}"
            self._add(str(path), name, "spherical" if kind == "3D" else "fixed", ends, np.array((1.0, 0, 0)))
        for name, kind in zip(said.get("joint_name") or [], said.get("joint_type") or [], strict=False):
            self.compiled.issues.add(None, f'{path.name}: joint "{name}" as {kind}: it stays as in the URDF')

    def _named(self, path: Path, name: str) -> int:
        """The link of a name, or that which the joint of this name places: their frames are one."""
        joint = self.compiled.root.named("joint", name)
        child = joint.child("child") if joint and name not in self.index else None
        link = child.attributes.get("link", "") if child else name
        if link not in self.index:
            raise FileError(f'{path}: closed_loop names "{name}", which is no link and no joint')
        return self.index[link]

    def _add(
        self, place: str, name: str, kind: str, ends: list[tuple[int, Transform]], axis: np.ndarray[Any, Any]
    ) -> None:
        bodies = self.bodies
        (a, frame_a), (b, frame_b) = ((body, bodies.frame[body] @ frame) for body, frame in ends)
        if bodies.at(a) == bodies.at(b) or (bodies.is_static(a) and bodies.is_static(b)):
            raise FileError(f'{place}: the loop "{name}" joins a link to itself, or two that never move')
        if kind == "planar":  # the axis is the normal of the plane
            turn = Transform(rotation=rotation_to_z(tuple(axis.tolist())))
            frame_a, frame_b = frame_a @ turn, frame_b @ turn
            axes = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
        else:
            axes = [tuple(axis.tolist())]
        if bodies.is_static(a):  # the first body of a joint moves
            a, b, frame_a, frame_b = b, a, frame_b, frame_a
            axes = [tuple(-x for x in one) for one in axes]
        taken = {joint.name for joint in self.joints.joints}
        while name in taken or not name:
            name = f"{name or 'loop'}_"
        made = Joint(
            name=name, body_a=bodies.at(a), body_b=bodies.at(b), frame_a=frame_a, frame_b=frame_b,
            link_a=bodies.link[a], link_b=bodies.link[b],
            dofs=tuple(Dof(what, one) for what, one in zip(DOFS[kind], axes, strict=False)),  # type: ignore[arg-type]
            spherical=kind == "spherical", collide=True, closes_loop=True,
        )  # fmt: skip
        self.joints.joints.append(made)
        self._measure(made, kind, np.array(axes[0]))

    def _measure(self, joint: Joint, kind: str, axis: np.ndarray[Any, Any]) -> None:
        """How far the ends are apart, but along the ways that are free."""
        poses = [self.bodies.bodies[k].pose if k >= 0 else ORIGIN for k in (joint.body_a, joint.body_b)]  # type: ignore[operator]
        (at_a, at_b) = poses[0] @ joint.frame_a, poses[1] @ joint.frame_b
        gap = np.array((at_b.inverse() @ at_a).position)
        if kind == "planar":
            gap = gap[2:]
        elif kind == "prismatic":
            gap = gap - gap @ axis * axis
        if (length := float(np.linalg.norm(gap))) > OPEN:
            self.gaps.append((joint.name, length))


def _yaml(path: Path) -> dict[str, Any]:
    try:
        import yaml
    except ImportError:
        raise InputError(f"{path}: loops in YAML need PyYAML: pip install amontons[ros]") from None
    try:
        said = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        raise FileError(f"{path}: is no YAML ({' '.join(str(error).split())[:200]})") from None
    if not isinstance(said, dict):
        raise FileError(f"{path}: holds no table with closed_loop and type")
    return said
