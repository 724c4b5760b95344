"""The parts of a model that is being made: their lists and names, and the function that adds one."""

from __future__ import annotations

from collections.abc import KeysView, Mapping
from dataclasses import dataclass, replace
from typing import Any, get_args, get_type_hints

from ..checks import about, changed, chosen, shown
from ..errors import InputError
from ..guidance import guided
from .drives import Actuator, Tendon
from .links import Link
from .mass import MassProperties
from .model import index_of
from .parts import OWN, WORLD, Body, Bond, Coupling, FluidBox, Geom, Joint, PairMaterial
from .presets import Keyframe, Unread
from .references import Place, rewired
from .sensing import Sensor, Site
from .shapes import Shape
from .transforms import ORIGIN, Transform
from .visuals import Visual

LONGEST_NAME = 1000


@dataclass(frozen=True)
class KeyframePart:
    """The keyframe of a model for the bodies and degrees of freedom that came from it."""

    bodies: tuple[int, ...]
    first_dof: int
    first_actuator: int
    actuators: int
    """how many"""
    motors: Mapping[int, float]
    """controls of motors by degree of freedom, of all joints together"""
    keyframe: Keyframe


class Parts:
    """The parts of a builder, or those that a model adds to it. Indices are those of the builder."""

    bodies: list[Body]
    geoms: list[Geom]
    joints: list[Joint]
    couplings: list[Coupling]
    sites: list[Site]
    sensors: list[Sensor]
    tendons: list[Tendon]
    actuators: list[Actuator]
    links: list[Link]
    pair_materials: list[PairMaterial]
    fluid_boxes: list[FluidBox]
    bonds: list[Bond]
    visuals: list[Visual]
    excluded_bodies: list[tuple[int, int]]
    excluded_geoms: list[tuple[int, int]]
    unread: list[Unread]

    def __init__(self, **lists: list[Any]) -> None:
        vars(self).update({name: [] for name in Parts.__annotations__} | lists)
        self.keyframes: dict[str, list[KeyframePart]] = {}

    def lists(self) -> dict[str, list[Any]]:
        """The lists by their names, which are those of `Model`."""
        return {name: getattr(self, name) for name in Parts.__annotations__}


LISTS: dict[type, str] = {
    get_args(kind)[0]: name
    for name, kind in get_type_hints(Parts).items()
    if name not in ("excluded_bodies", "excluded_geoms", "unread")
}
"""Parts that may be added, and their lists in `Parts` and `Model`."""
NAMED = {
    kind.__name__.lower(): LISTS[kind]
    for kind in (Body, Geom, Joint, Coupling, Site, Sensor, Tendon, Actuator, Link)
}
"""Kinds of parts with names of their own, and their lists."""


@guided
class Collection:
    """Parts by their lists, in which they refer to each other by index, and their names."""

    def __init__(self) -> None:
        self._parts = Parts()
        self._names: dict[str, dict[str, int]] = {kind: {} for kind in NAMED}

    def add(self, part: Any) -> int:
        """Add a part as a whole and return its index among its kind.

        part: Body, Geom, Joint, Tendon, Actuator or any other of `amontons.parts` that a list of `Model`
        holds. Bodies, links, joints and tendons in it are indices or names; a frame is in the body or link
        that the part names. A part without a name gets one.

        >>> builder = ModelBuilder()
        >>> arm = builder.add_body("arm", shape=shapes.Capsule(0.02, 0.3), mass=1)
        >>> hinge = builder.add(Joint("elbow", body_a="arm", body_b="world", dofs=[Dof()]))
        >>> drive = builder.add(parts.Actuator("drive", parts.Transmission(joint="elbow", gear=50)))
        >>> builder.build().actuator_names
        ('drive',)
        """
        if type(part) not in LISTS:
            known = ", ".join(kind.__name__ for kind in LISTS)
            raise InputError(f"add: {shown(part)} is no part; give one of {known}")
        return self._append(self._referred(part))

    def part(self, kind: str, key: int | str) -> Any:
        """The part of a kind ("body", "geom", "joint" and so on) with this index or name; InputError if none.

        >>> builder = ModelBuilder()
        >>> ball = builder.add_body("ball", shape=shapes.Sphere(0.1), mass=1)
        >>> builder.part("body", "ball").mass
        1.0
        """
        return getattr(self._parts, chosen("kind", kind, NAMED))[self._index(kind, key)]

    def names(self, kind: str) -> KeysView[str]:
        """The names of a kind of parts, in the order in which they were added."""
        return self._names[kind].keys()

    def pose(self, body: int | str | None) -> Transform:
        """Where a body, given by index or name, is in the world at the start; the world is at ORIGIN."""
        index = self._mount(body, OWN)[0]
        return ORIGIN if index == WORLD else self._parts.bodies[index].pose

    def is_fixed(self, body: int | str | None) -> bool:
        """Whether a body, given by index or name, is static; the world is."""
        index = self._mount(body, OWN)[0]
        return index == WORLD or self._parts.bodies[index].motion == "static"

    def set_mass(self, body: int | str, solid: MassProperties) -> None:
        """Give a body the mass properties of a solid in place of its own (`Shape.mass_properties`)."""
        index = self._index("body", body)
        self._parts.bodies[index] = replace(self._parts.bodies[index], **vars(solid))

    def _referred(self, part: Any) -> Any:
        """The part with a name of its own and with indices; InputError if something in it does not exist."""
        kind = type(part).__name__.lower()
        name = self._new_name(kind, part.name or None) if kind in NAMED else ""
        who = f'{kind} "{name}"' if name else f"add: {kind}"
        with about(who):
            part = rewired(part, self._mount, self._reference)
            for joint, dof in _coordinates(part):
                self._require_dof(joint, dof)
            if isinstance(part, Actuator) and part.transmission.kind == "tendon":
                self._index("tendon", part.transmission.tendon)
        if isinstance(part, Joint):
            self._require_two(who, part.body_a, part.body_b)  # type: ignore[arg-type]
        if isinstance(part, Geom) and part.body != WORLD:
            carrier = self._parts.bodies[part.body]
            require_movable(f'{who} of body "{carrier.name}"', part.shape, carrier.motion)
        return part if not name or part.name == name else changed(part, name=name)

    def _append(self, part: Any) -> int:
        things = getattr(self._parts, LISTS[type(part)])
        names = self._names.get(type(part).__name__.lower())
        if names is not None:
            names[part.name] = len(things)
        things.append(part)
        return len(things) - 1

    def _require_two(self, who: str, a: int, b: int) -> None:
        if a == WORLD:
            raise InputError(f"{who}: body A must not be the world; swap the bodies")
        if a == b:
            raise InputError(
                f'{who} joins body "{self._parts.bodies[a].name}" to itself; it needs two bodies'
            )

    def _require_dof(self, joint: object, dof: object) -> None:
        found = self._parts.joints[self._index("joint", joint)]
        if not (type(dof) is int and 0 <= dof < len(found.dofs)):
            raise InputError(f'joint "{found.name}" has no degree of freedom {shown(dof)}')

    def _mount(self, body: Any, link: int) -> Place:
        """The body of a body or link given by index or name, its frame there, and the link."""
        if isinstance(body, str) and body in self._names["link"]:
            index = self._names["link"][body]
            found = self._parts.links[index]
            return found.body, found.frame, index
        return self._body(None if type(body) is int and body == WORLD else body), None, link

    def _reference(self, kind: str, key: Any) -> int:
        return WORLD if type(key) is int and key == WORLD else self._index(kind, key)

    def _body(self, body: int | str | None) -> int:
        """The index of a body given by index or name."""
        is_world = body is None or (isinstance(body, str) and body == "world")
        return WORLD if is_world else self._index("body", body)

    def _index(self, kind: str, key: object) -> int:
        """The index of a thing given by index or name."""
        names = self._names[kind]
        if isinstance(key, str) and key in names:
            return names[key]
        return index_of(kind, key, tuple(names))

    def _new_name(self, kind: str, name: str | None) -> str:
        """The name, or one made up, that no other thing of its kind has."""
        names = self._names[kind]
        if name is None:
            number = len(names)
            while f"{kind}{number}" in names:
                number += 1
            return f"{kind}{number}"
        if not isinstance(name, str) or not name or name == "world":
            raise InputError(f'{kind} name {shown(name)}: give a string that is not empty and not "world"')
        if len(name) > LONGEST_NAME:
            raise InputError(f"{kind} name {shown(name)}: give one of at most {LONGEST_NAME} characters")
        if any("\ud800" <= c <= "\udfff" for c in name):
            raise InputError(
                f"{kind} name {shown(name)}: it has an unpaired surrogate, half of a character; remove it"
            )
        if name in names or (kind == "body" and name in self._names["link"]):
            raise InputError(f'there is a {kind} "{name}" already; names must be unique')
        return name


def _coordinates(part: Any) -> list[tuple[Any, Any]]:
    """The degrees of freedom that a part names: joints with the number of one of theirs."""
    if isinstance(part, Tendon):
        return [(term.joint, term.dof) for term in part.terms]
    if isinstance(part, Actuator) and part.transmission.kind == "dof":
        return [(part.transmission.joint, part.transmission.dof)]
    if isinstance(part, Coupling):
        ends = ((part.joint_a, part.dof_a), (part.joint_b, part.dof_b))
        return [end for end in ends if end[0] != WORLD]
    return []


def require_movable(who: str, shape: Shape, motion: str) -> None:
    if shape.static_only and motion == "dynamic":
        if hasattr(shape, "vertices"):
            remedy = "use shapes.Hull(vertices), or several hulls of its convex parts"
        else:
            remedy = 'put it on the world by add_geom(None, shape), or use another shape, or motion="static"'
        raise InputError(f"{who}: a {type(shape).__name__} does not move by forces; {remedy}")
