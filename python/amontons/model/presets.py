"""Parts of a model from its file: keyframes, and the list of unread elements. SI units."""

from __future__ import annotations

from dataclasses import dataclass

from ..checks import Quaternion, Vector3


@dataclass(frozen=True, repr=False)
class Keyframe:
    """A state of a model to start from, see `Simulation.apply_keyframe`.

    >>> model = load_model(examples.path("quadruped.xml"))
    >>> simulation = Simulation(model)
    >>> simulation.reset("stand")
    >>> model.keyframe_names
    ('crouch', 'stand')
    """

    name: str
    time: float
    """s"""
    positions: tuple[Vector3, ...]
    """of the body frames, as in `Simulation.state` (m)"""
    orientations: tuple[Quaternion, ...]
    linear_velocities: tuple[Vector3, ...]
    """of the origins of the body frames, world axes (m/s)"""
    angular_velocities: tuple[Vector3, ...]
    """world axes (rad/s)"""
    joint_coordinates: tuple[float, ...]
    """of all degrees of freedom (m, rad)"""
    controls: tuple[float, ...] = ()
    """of all actuators and motors, as `Simulation.controls`; none: as they are"""
    activations: tuple[float, ...] = ()
    """of all actuators; none: as they are"""

    def __repr__(self) -> str:
        counts = f"{len(self.positions)} bodies, {len(self.joint_coordinates)} coordinates"
        return f"Keyframe({self.name!r}, time={self.time:g}, {counts})"


EFFECTS = ("large", "small", "none")
"""How much what was not read changes the motion, worst first."""


@dataclass(frozen=True)
class Unread:
    """An element of a model file that is not supported; `Model.unread` lists them.

    >>> model = load_model(examples.path("arm.xml"))
    >>> for item in model.unread:
    ...     print(item.place, item.what, item.effect)
    >>> len(model.unread)
    0
    """

    place: str
    """file:line"""
    element: str
    """as in the file: <geom name="foot">; empty if it is not known which"""
    what: str
    """what was not read, why, and what to do about it"""
    effect: str
    """large (a part of the mechanism or of its drive is missing) | small (a force or a coefficient is another
    one) | none (the motion is the same)"""

    @property
    def changes_motion(self) -> bool:
        """Whether the model moves otherwise than the file asks for."""
        return self.effect != "none"

    def __str__(self) -> str:
        return ": ".join(filter(None, (self.place, self.element, self.what)))
