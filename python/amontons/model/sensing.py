"""Where a model is looked at: sites, frames fixed in bodies, and sensors, what is measured there."""

from __future__ import annotations

from dataclasses import dataclass

from ..checks import Vector3, chosen
from .parts import OWN, WORLD
from .shapes import Shape
from .transforms import ORIGIN, Transform

SENSORS: dict[str, int] = {
    # at a site, in its axes
    "accelerometer": 3, "velocimeter": 3, "gyro": 3, "magnetometer": 3, "force": 3, "torque": 3,
    "touch": 1, "rangefinder": 1,
    # of a coordinate
    "jointpos": 1, "jointvel": 1, "jointactuatorfrc": 1, "ballquat": 4, "ballangvel": 3,
    "jointlimitpos": 1, "jointlimitvel": 1, "jointlimitfrc": 1,
    # of an actuator or a tendon
    "actuatorpos": 1, "actuatorvel": 1, "actuatorfrc": 1, "tendonpos": 1, "tendonvel": 1,
    "tendonactuatorfrc": 1, "tendonlimitpos": 1, "tendonlimitvel": 1, "tendonlimitfrc": 1,
    # of a frame, in the world or in that of a reference
    "framepos": 3, "framequat": 4, "framexaxis": 3, "frameyaxis": 3, "framezaxis": 3,
    "framelinvel": 3, "frameangvel": 3, "framelinacc": 3, "frameangacc": 3, "insidesite": 1,
    # of a body with all that hangs on it
    "subtreecom": 3, "subtreelinvel": 3, "subtreeangmom": 3,
    "clock": 1,
}  # fmt: skip
"""Kinds of sensors, named as in MJCF, with the number of values; docs/models.md says what they measure."""


@dataclass(frozen=True)
class Site:
    """A named frame fixed in a body; `Simulation.kinematics.site` reads its pose and velocity.

    >>> parts.Site("tip", body=0, frame=Transform((0, 0, 0.3))).name
    'tip'
    """

    name: str = ""
    body: int = WORLD
    frame: Transform = ORIGIN
    """in the body frame"""
    shape: Shape | None = None
    """the volume in which a touch sensor feels; None: anywhere on the body"""


@dataclass(frozen=True)
class Sensor:
    """A sensor of a model; `Simulation.sensors` reads its value.

    >>> [(s.name, s.kind) for s in load_model(examples.path("quadruped.xml")).sensors[:2]]
    [('gyro', 'gyro'), ('accelerometer', 'accelerometer')]
    """

    name: str
    kind: str
    """one of SENSORS"""
    body: int = WORLD
    """of the frame that is looked at"""
    frame: Transform = ORIGIN
    """in the body frame"""
    reference: int | None = None
    """the body of the frame in which frame sensors tell; None: the world"""
    reference_frame: Transform = ORIGIN
    source: str = ""
    """the coordinate, tendon or actuator, by name"""
    shape: Shape | None = None
    """of touch sensors, at `frame`; of insidesite, at `reference_frame`"""
    bodies: tuple[int, ...] = ()
    """of force, torque and subtree sensors: the bodies that hang on it, each with all its links"""
    field: Vector3 = (0.0, 0.0, 0.0)
    """of magnetometers: the field in the world"""
    cutoff: float = 0.0
    """values are clipped to +- this; 0: they are not"""
    link: int = OWN
    """the link of `body` whose frame it is, an index of `Model.links`; OWN: none"""
    links: tuple[int, ...] = ()
    """of force, torque and subtree sensors: links that count, of bodies that are not in `bodies`"""

    def __post_init__(self) -> None:
        chosen("kind of sensor", self.kind, SENSORS)
        object.__setattr__(self, "bodies", tuple(self.bodies))
        object.__setattr__(self, "links", tuple(self.links))
        object.__setattr__(self, "field", tuple(self.field))

    @property
    def size(self) -> int:
        """Number of values."""
        return SENSORS[self.kind]
