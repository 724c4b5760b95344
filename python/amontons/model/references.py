"""References of parts to others: to bodies with a frame and link on them, to joints, tendons and geoms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from ..checks import changed
from .drives import Actuator, PathElement, Tendon, TendonTerm, Transmission
from .links import Link
from .parts import OWN, Bond, Coupling, FluidBox, Geom, Joint, PairMaterial
from .sensing import Sensor, Site
from .transforms import Transform
from .visuals import Visual

T = TypeVar("T")
Place = tuple[int, Transform | None, int]
"""A body, the frame in it of what was named, None for the body itself, and the index of the link."""


class Mount(NamedTuple):
    """Fields of a part that say where it is: a body, a frame or point on it, the link of the body."""

    body: str = "body"
    frame: str = "frame"
    link: str = ""


MOUNTS: dict[type, tuple[Mount, ...]] = {
    Geom: (Mount(link="link"),),
    Visual: (Mount(link="link"),),
    Site: (Mount(),),
    FluidBox: (Mount(),),
    Link: (Mount(link="carrier"),),
    Sensor: (Mount(link="link"), Mount("reference", "reference_frame")),
    Joint: (Mount("body_a", "frame_a", "link_a"), Mount("body_b", "frame_b", "link_b")),
    PathElement: (Mount(), Mount("side_body", "side")),
    Transmission: (Mount(), Mount("reference_body", "reference")),
    Bond: (Mount("body_a", "point_a"), Mount("body_b", "point_b")),
}
INDICES: dict[type, dict[str, str]] = {
    TendonTerm: {"joint": "joint"},
    Transmission: {"joint": "joint", "tendon": "tendon"},
    Coupling: {"joint_a": "joint", "joint_b": "joint", "tendon_a": "tendon", "tendon_b": "tendon"},
    PairMaterial: {"geom_a": "geom", "geom_b": "geom"},
}
INNER: dict[type, tuple[str, ...]] = {Tendon: ("terms", "path"), Actuator: ("transmission",)}
"""Fields that hold parts with references of their own."""


def rewired(part: T, place: Callable[[Any, int], Place], index: Callable[[str, Any], int]) -> T:
    """A copy with other references: place(body, link) and index(kind, key) tell them.

    Frames and points move with their bodies. Vectors stay as they are.
    """
    kind = type(part)
    new: dict[str, Any] = {}
    for mount in MOUNTS.get(kind, ()):
        own = getattr(part, mount.link) if mount.link else OWN
        body = getattr(part, mount.body)
        if body is None and kind is Sensor:  # without a reference it tells in the world
            continue
        new[mount.body], frame, link = place(body, own)
        if mount.link:
            new[mount.link] = link
        at = getattr(part, mount.frame)
        if frame is not None and at is not None:
            new[mount.frame] = frame @ at if isinstance(at, Transform) else frame(at)
    for name, of in INDICES.get(kind, {}).items():
        new[name] = index(of, getattr(part, name))
    for name in INNER.get(kind, ()):
        inner = getattr(part, name)
        several = isinstance(inner, tuple)
        moved = tuple(rewired(one, place, index) for one in (inner if several else (inner,)))
        new[name] = moved if several else moved[0]
    return changed(part, **new)
