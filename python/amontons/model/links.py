"""Links: named parts of bodies. A fixed joint of a file makes one body of its two; the names stay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import Array, Matrix3, Vector3
from ..errors import InputError
from .fields import Part
from .mass import NOTHING
from .parts import OWN, WORLD
from .transforms import ORIGIN, Transform

Places = tuple[Array, Array]
"""Frames on bodies: bodies (n,), -1 is the world, and positions (m) with quaternions, (n, 7)."""


def frame_rows(frames: Sequence[Transform]) -> Array:
    """(n, 7): positions and quaternions."""
    return np.array([(*f.position, *f.rotation) for f in frames], dtype=np.float64).reshape(-1, 7)


def places_of(bodies: Sequence[int], frames: Sequence[Transform]) -> Places:
    """For the compiled module."""
    return np.array(bodies, dtype=np.int32), frame_rows(frames)


@dataclass(frozen=True)
class Link(Part, called="link"):
    """A part of a body that has a name of its own: a fixed joint of a file holds it there.

    Mass and inertia of the body include those of its links.

    >>> load_model(examples.path("dog.urdf"), floating_base=True).link_names[:3]
    ('trunk', 'front_left_thigh', 'front_left_shin')
    """

    name: str
    body: int
    frame: Transform = ORIGIN
    """in the body frame"""
    carrier: int = OWN
    """the link that holds it; OWN: what the body is without its links"""
    joint: str = ""
    """name of the fixed joint"""
    mass: float = 0.0
    """of this part alone (kg)"""
    centre_of_mass: Vector3 = (0.0, 0.0, 0.0)
    """in the frame of the link (m)"""
    inertia: Matrix3 = NOTHING.inertia
    """about its centre of mass, in its own axes (kg m^2)"""


def check_links(model: Any) -> None:
    """Raises InputError where a link, or the body or link that something says it is on, does not exist."""
    links, bodies = model.links, model.bodies
    for things in (model.sites, model.sensors, model.visuals):
        for thing in things:
            if not WORLD <= thing.body < len(bodies):
                what = type(thing).__name__.lower()
                raise InputError(f'{what} "{thing.name}": there is no body {thing.body}')
    names = {body.name for body in bodies if body.name}
    for k, link in enumerate(links):
        if not 0 <= link.body < len(bodies):
            raise InputError(f'link "{link.name}": there is no body {link.body}')
        if link.name in names:
            raise InputError(f'link "{link.name}": there is another link or a body of this name; rename one')
        names.add(link.name)
        if link.carrier != OWN and not (0 <= link.carrier < k and links[link.carrier].body == link.body):
            raise InputError(f'link "{link.name}": its carrier must be a link of its body before it')

    def check(what: str, name: str, body: Any, link: int) -> None:
        if link != OWN and not (0 <= link < len(links) and body in (None, links[link].body)):
            raise InputError(f'{what} "{name}": its body has no link {link}')

    for geom in model.geoms:
        check("geom", geom.name, geom.body, geom.link)
    for visual in model.visuals:
        check("visual", visual.name, visual.body, visual.link)
    for joint in model.joints:
        check("joint", joint.name, joint.body_a, joint.link_a)
        check("joint", joint.name, joint.body_b, joint.link_b)
    for sensor in model.sensors:
        check("sensor", sensor.name, sensor.body, sensor.link)
        for k in sensor.links:
            check("sensor", sensor.name, None, k)


def place_index(bodies: int, body: int, link: int) -> int:
    """The index in `Model.link_names` of a link of a body, or of the body itself; -1 is the world."""
    return body if link == OWN else bodies + link
