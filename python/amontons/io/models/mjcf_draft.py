"""An MJCF file while it is written: its sections, the names of what stands in it, and what is lost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from ...model import shapes
from ...model.coordinates import coordinate_name, is_floating
from ...model.model import Model
from ...model.parts import OWN, Joint
from ...model.shapes import Shape
from ...model.transforms import IDENTITY, ORIGIN, Transform
from .losses import Lost
from .trees_out import Trees

SECTIONS = ("asset", "contact", "tendon", "equality", "actuator", "sensor", "keyframe")
EVERYWHERE = shapes.Sphere(1e3)
"""The volume of a touch sensor that feels the whole body, m"""


def words(*values: Any) -> str:
    """Numbers as text, with every digit."""
    return " ".join(repr(float(v)) for v in np.ravel(np.array(values, dtype=np.float64)))


def placed(element: ET.Element, frame: Transform) -> ET.Element:
    if any(frame.position):
        element.set("pos", words(frame.position))
    if frame.rotation != IDENTITY:
        element.set("quat", words(frame.rotation))
    return element


def within(frame: Transform, other: Transform) -> Transform:
    """A frame as the first one, which stands in the same body, sees it; to the bit if that is the body's."""
    return other if frame == ORIGIN else frame.inverse() @ other


def ranged(made: ET.Element, name: str, lower: float, upper: float) -> None:
    """A range, if there is one. MuJoCo has no limit on one side: the other one is far away.

    It has no range without a width either; see `Draft.hold`.
    """
    if (math.isinf(lower) and math.isinf(upper)) or lower == upper:
        return
    far = 1e6 * max(1.0, *(abs(x) for x in (lower, upper) if math.isfinite(x)))
    made.set(name, words(max(lower, -far), min(upper, far)))


def sized(made: ET.Element, shape: Shape | None) -> bool:
    """Type and size of a shape that a few lengths describe; False of others."""
    kinds: dict[type, tuple[str, tuple[str, ...]]] = {
        shapes.Sphere: ("sphere", ("radius",)), shapes.Capsule: ("capsule", ("radius", "half_length")),
        shapes.Cylinder: ("cylinder", ("radius", "half_length")), shapes.Box: ("box", ("half",)),
        shapes.Ellipsoid: ("ellipsoid", ("radii",)),
    }  # fmt: skip
    if type(shape) not in kinds:
        return False
    kind, sizes = kinds[type(shape)]
    made.set("type", kind)
    made.set("size", words(*(x for name in sizes for x in np.ravel(getattr(shape, name)))))
    return True


class Draft:
    """The tree of elements, and names by what they stand for."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.lost: list[Lost] = []
        self.trees = Trees(model)
        self.root = ET.Element("mujoco")
        self.sections = {tag: ET.Element(tag) for tag in SECTIONS}
        self.elements: dict[tuple[int, int], ET.Element] = {}
        """of the world, of bodies, and of those of their links that are bodies in the file"""
        self.names: dict[tuple[int, int], str] = {}
        """of the hinge, slide or ball (-1) that is a degree of freedom of a joint; not of a floating base"""
        self.placed: dict[str, tuple[int, int]] = {}
        """by the name of a joint: the body and the joint of the model, -1 for a body that moves freely"""
        self.drives: dict[tuple[int, int, int], ET.Element] = {}
        """of the controls of the model, by actuator, joint and degree of freedom"""
        self._sites: dict[tuple[ET.Element, int, Transform, str], str] = {}
        self._taken: set[str] = {site.name for site in model.sites}

    def lose(self, part: str, what: str, effect: str = "large") -> None:
        self.lost.append(Lost(part, what, effect))

    def joint_name(self, joint: Joint, dof: int) -> str:
        """That of its coordinate; of a ball behind others the last part of the name that MJCF gave them."""
        if dof >= 0 or not joint.dofs:
            return coordinate_name(joint, dof)
        before = "+".join(part.name for part in joint.dofs)
        rest = joint.name.removeprefix(f"{before}+")
        if is_floating(joint) or rest != joint.name:
            return rest
        return coordinate_name(joint, dof)

    def at(self, body: int, link: int = OWN) -> tuple[ET.Element, Transform]:
        """The element of a link of a body, or else of the body, and its frame in that of the body."""
        if (body, link) in self.elements and link != OWN:
            return self.elements[body, link], self.model.links[link].frame
        return self.elements[body, OWN], ORIGIN

    def model_sites(self) -> None:
        """The sites, each on the link of a sensor that is there, if any."""
        link = {(s.body, s.frame): s.link for s in self.model.sensors}
        for site in self.model.sites:
            self._site(site.body, link.get((site.body, site.frame), OWN), site.frame, site.shape, site.name)

    def site(
        self, body: int, frame: Transform, wanted: str, shape: Shape | None = None, link: int | None = None
    ) -> str:
        """The name of a site at a place of a body, which is made if there is none.

        shape, link: what it must have, if any.
        """
        for (element, place, at, volume), name in self._sites.items():
            fits = link is None or element is self.at(body, link)[0]
            if (place, at) == (body, frame) and fits and (shape is None or volume == repr(shape)):
                return name
        while wanted in self._taken:
            wanted += "_"
        return self._site(body, OWN if link is None else link, frame, shape, wanted)

    def point(self, body: int, position: Sequence[float], wanted: str) -> str:
        """The name of a site at a point, whatever its axes."""
        for (_, place, at, _), name in self._sites.items():
            if place == body and at.position == tuple(position):
                return name
        return self.site(body, Transform(tuple(position)), wanted)  # type: ignore[arg-type]

    def _site(self, body: int, link: int, frame: Transform, shape: Shape | None, name: str) -> str:
        element, own = self.at(body, link)
        made = placed(ET.SubElement(element, "site", name=name), within(own, frame))
        sized(made, shape)
        self._taken.add(name)
        self._sites.setdefault((element, body, frame, repr(shape)), name)
        return name

    def hold(self, tag: str, name: str, moved: float) -> None:
        """Keeps a joint or tendon where it has moved to from the start: limits without a width."""
        made = ET.SubElement(self.sections["equality"], tag, {f"{tag}1": name, "name": f"{name} held"})
        made.set("polycoef", words(moved, 0, 0, 0, 0))
