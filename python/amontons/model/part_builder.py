"""Models added to a builder as a whole."""

from __future__ import annotations

import math
from abc import abstractmethod

from ..checks import Numbers, changed, shown
from ..errors import InputError
from ..guidance import guided
from .composing import NAMED, NAMELESS, Added, Counts, KeyframePart, Parts, Seat, bottom, parts_of, top
from .drive_builder import DriveBuilder
from .joint_builder import Place
from .links import Link
from .model import Model, no_model
from .parts import OWN, WORLD, Coupling, Geom
from .presets import Unread
from .shapes import Shape
from .transforms import IDENTITY, ORIGIN, Transform, add


@guided
class PartBuilder(DriveBuilder):
    """The function add_model; what is in composing.py does not know the builder."""

    _geoms: list[Geom]
    _couplings: list[Coupling]
    _keyframes: dict[str, list[KeyframePart]]
    _links: list[Link]
    _unread: list[Unread]
    _trees: str | None
    _names: dict[str, dict[str, int]]

    def add_model(
        self,
        model: Model,
        *,
        position: Numbers = (0.0, 0.0, 0.0),
        orientation: Numbers = IDENTITY,
        prefix: str = "",
        parent: int | str | None = None,
        on: str | None = None,
    ) -> Added:
        """Add all parts of a model: bodies, geoms, joints, tendons, couplings, actuators, materials,
        keyframes.

        position, orientation: of the model's world in the world of the builder, or in the frame of `parent`
        (m; unit quaternion w, x, y, z).
        prefix: in front of all its names. Keyframes of the same name become one; where a part has none of
        that name, it stands as at the start.
        parent: the body or link that takes the place of the model's world: what was fixed or jointed to it is
        so to the parent, and what was free is held by a fixed joint of its first body.
        on: the geom or body of the builder on which the model stands: position[2] is then measured from
        the highest point there to the lowest of its shapes, both at the initial poses.

        Gravity, friction rule and fluid are those of the builder; so is `trees`, unless it is None there.
        Returns the indices that the parts got.
        """
        if not isinstance(model, Model):
            raise no_model("add_model: model", model)
        if not isinstance(prefix, str):
            raise InputError(f"add_model: prefix is {shown(prefix)}; give a string")
        if on is not None and parent is not None:
            raise InputError("add_model: on and parent are both given; keep one of them")
        place = Transform.named("add_model", position, orientation)
        if on is not None:
            place = changed(place, position=add(place.position, (0.0, 0.0, self._rise(model, place, on))))
        carrier, inner, link = self._place(parent)
        place = inner @ place
        pose = ORIGIN if carrier == WORLD else self._bodies[carrier].pose
        carries = carrier != WORLD and self._bodies[carrier].motion != "static"
        seat = Seat(carrier, place, pose @ place, carries, link)
        before = Counts(
            len(self._bodies),
            len(self._geoms),
            len(self._joints),
            len(self._couplings),
            len(self._tendons),
            len(self._actuators),
            len(self._links),
            sum(len(joint.dofs) for joint in self._joints),
        )
        parts = parts_of(model, seat, prefix, before, self._holding_name)
        self._require_new(parts)
        if carries:
            for geom in parts.geoms:
                if geom.body == carrier:
                    motion = self._bodies[carrier].motion
                    require_movable(
                        f'geom "{geom.name}" of body "{self._bodies[carrier].name}"', geom.shape, motion
                    )
        self._take(parts, model)
        return parts.added

    def _place(self, body: int | str | None) -> Place:
        if isinstance(body, str) and body in self._names["link"]:
            index = self._names["link"][body]
            return self._links[index].body, self._links[index].frame, index
        return self._body(body), ORIGIN, OWN

    @abstractmethod
    def _body(self, body: int | str | None) -> int:
        """The index of a body given by index or name."""

    def _rise(self, model: Model, place: Transform, on: str) -> float:
        """How far up a model must go to stand on a geom or body."""
        if not isinstance(on, str):
            raise InputError(f"add_model: on is {shown(on)}; give the name of a geom or body")
        if on in self._names["geom"]:
            below = [self._geoms[self._names["geom"][on]]]
        elif on in self._names["body"]:
            below = [geom for geom in self._geoms if geom.body == self._names["body"][on]]
        else:
            raise InputError(f'add_model: on="{on}" is no geom or body of the builder; add it first')
        turned = [changed(b, pose=Transform((0, 0, 0), place.rotation) @ b.pose) for b in model.bodies]
        rise = top(below, self._bodies) - bottom(model.geoms, turned)
        if not math.isfinite(rise):
            raise InputError(
                f'add_model: on="{on}" needs shapes on both that can touch; give position instead'
            )
        return rise

    def _holding_name(self, body: str) -> str:
        name = f"{body}_mount"
        while name in self._names["joint"]:
            name += "_"
        return name

    def _require_new(self, parts: Parts) -> None:
        """Nothing may be added when a name is taken."""
        added = {kind: getattr(parts, name) for kind, name in NAMED.items()}
        added["link"] = [*parts.bodies, *parts.links]
        for kind, things in added.items():
            known = dict(self._names[kind])
            if kind in ("body", "link"):
                known |= self._names["body"] | self._names["link"]
            for thing in things:
                if thing.name in known or thing.name == "world":
                    raise InputError(
                        f'add_model: there is a {kind} "{thing.name}" already; give the model a prefix='
                    )
                known[thing.name] = 0

    def _take(self, parts: Parts, model: Model) -> None:
        for kind, name in NAMED.items():
            for thing in getattr(parts, name):
                self._append(kind, getattr(self, f"_{name}"), thing)
        for name in NAMELESS:
            getattr(self, f"_{name}").extend(getattr(parts, name))
        for name, part in parts.keyframes.items():
            self._keyframes.setdefault(name, []).append(part)
        self._unread += model.unread
        if self._trees is None and model.trees != "none":
            self._trees = model.trees


def require_movable(who: str, shape: Shape, motion: str) -> None:
    if shape.static_only and motion == "dynamic":
        if hasattr(shape, "vertices"):
            remedy = "use shapes.Hull(vertices), or several hulls of its convex parts"
        else:
            remedy = 'put it on the world by add_geom(None, shape), or use another shape, or motion="static"'
        raise InputError(f"{who}: a {type(shape).__name__} does not move by forces; {remedy}")
