"""Tendons and actuators: immutable data with the fields of multibody/model/description.hpp."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .. import _core
from ..checks import Vector3, chosen
from ..guidance import guided
from .fields import Part, Real
from .parts import WORLD, words
from .transforms import ORIGIN, Transform

PATHS = words(_core.PathKind)
TRANSMISSIONS = words(_core.TransmissionKind)
ACTIVATIONS = words(_core.ActivationKind)


@dataclass(frozen=True)
class TendonTerm(Part, called="tendon term"):
    """One joint coordinate in a fixed tendon.

    >>> parts.TendonTerm(joint=0, coefficient=0.5).coefficient
    0.5
    """

    joint: int | str
    """a name only in `ModelBuilder.add`"""
    dof: int = 0
    coefficient: float = 1.0


@dataclass(frozen=True)
class PathElement(Part):
    """One element of the path of a spatial tendon: a point, an obstacle to wrap around, or a pulley.

    >>> parts.PathElement("point", body=0, frame=Transform((0, 0, 0.1))).kind
    'point'
    """

    kind: str = "point"
    """point (the tendon passes through the origin of the frame) | sphere, cylinder (an obstacle that it goes
    around, or through, between the points before and after; a cylinder is about the frame's third axis and
    has no ends) | pulley (the tendon begins anew at the next point, and counts 1 / divisor from there on)"""
    body: int | str | None = WORLD
    """a name, and None for the world, only in `ModelBuilder.add`"""
    frame: Transform = ORIGIN
    """in the body frame"""
    radius: float = 0.0
    """of an obstacle (m)"""
    side: Vector3 | None = None
    """of an obstacle: a point in the frame of side_body (m) on whose side the tendon passes; inside the
    obstacle, the tendon passes through it. None: the shorter way round"""
    side_body: int | str | None = WORLD
    divisor: float = 1.0
    """of a pulley"""
    friction: float = 0.0
    """Coulomb's mu of the tendon on a point (an eye) or an obstacle (a drum, a sheave). The tensions before
    and after it differ by at most the factor exp(friction angle), where the tendon turns by the angle"""
    turns: float = 0.0
    """of a cylinder: full turns of the tendon around it besides the way between its neighbours"""

    def __post_init__(self) -> None:
        chosen("kind of path element", self.kind, PATHS)
        self._settle(f"{self.kind}: ")


@guided
@dataclass(frozen=True)
class Tendon(Part, called="tendon"):
    """A tendon: a length that follows from joint coordinates or a path, with limits, spring and friction.

    Fixed: the linear combination `terms` of joint coordinates, in their unit. Spatial: the length of `path`
    (m). Efforts along it are positive where they lengthen it.

    >>> points = [parts.PathElement("point", body) for body in (-1, 0)]  # from the world to body 0
    >>> rope = parts.Tendon("rope", path=points, upper=1.0)
    >>> rope.upper
    1.0
    """

    name: str = ""
    terms: tuple[TendonTerm, ...] = ()
    path: tuple[PathElement, ...] = ()
    lower: Real = -math.inf
    upper: Real = math.inf
    """limits of the length (m, or the unit of the terms)"""
    stiffness: float = 0.0
    """of a spring without force between the rest lengths (N/m, N m/rad)"""
    rest_lower: float = 0.0
    rest_upper: float = 0.0
    damping: float = 0.0
    """N s/m, N m s/rad"""
    friction: float = 0.0
    """largest effort of dry friction (N, N m)"""
    armature: float = 0.0
    """inertia of the drive (kg, kg m^2)"""
    closed: bool = False
    """a belt: the path is two parallel cylinders, around the outside of which the tendon runs"""

    def __post_init__(self) -> None:
        self._in_order(self._settle())


@guided
@dataclass(frozen=True)
class Transmission(Part, called="transmission"):
    """The transmission of an actuator: a length l (m or rad). A unit effort does a unit of work per unit of
    l.

    >>> load_model(examples.path("gripper.xml")).actuators[0].transmission.kind
    'dof'
    """

    kind: str = "dof"
    """dof (l = gear q) | tendon (l = gear times its length) | wrench (force and torque per unit of effort at
    the frame on a body, the opposite on the reference body) | slider_crank (a rod joins the origin of frame
    to a slider on the third axis of the reference frame: l = gear times its place there)"""
    joint: int | str = -1
    """names of joints, tendons and bodies, and None for the world, only in `ModelBuilder.add`"""
    dof: int = 0
    tendon: int | str = -1
    body: int | str | None = WORLD
    reference_body: int | str | None = WORLD
    frame: Transform = ORIGIN
    """in the body frame"""
    reference: Transform = ORIGIN
    """in the frame of the reference body"""
    force: Vector3 = (0.0, 0.0, 0.0)
    torque: Vector3 = (0.0, 0.0, 0.0)
    """of a wrench, per unit of effort, in the axes of the reference frame: l = <force, p> + <torque, r> with
    the position p and rotation vector r of the frame seen from there"""
    own_axes: bool = False
    """force and torque are in the axes of the frame (a thruster), and l = <torque, r>"""
    rod: float = 0.0
    """length of the rod of a slider-crank (m)"""
    gear: float = 1.0

    def __post_init__(self) -> None:
        chosen("kind of transmission", self.kind, TRANSMISSIONS)
        self._settle()


@guided
@dataclass(frozen=True)
class Actuator(Part, called="actuator"):
    """A drive with a control: see `Simulation.set_control` and `ModelBuilder.add_actuator`.

    effort = clip((g0 + g1 l + g2 l') w + b0 + b1 l + b2 l', force limits) with gain g, bias b, the length l
    and rate l' of the transmission, and w the control, clipped to its limits, or the activation. Terms that
    oppose the motion act within the step, like a motor. The others use the values at its start.

    >>> model = load_model(examples.path("gripper.xml"))
    >>> [actuator.name for actuator in model.actuators]
    ['lift', 'left', 'right']
    """

    name: str = ""
    transmission: Transmission = Transmission()
    gain: tuple[float, float, float] = (1.0, 0.0, 0.0)
    bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    lower_force: Real = -math.inf
    upper_force: Real = math.inf
    """N or N m"""
    control: float = 0.0
    """initial"""
    lower_control: Real = -math.inf
    upper_control: Real = math.inf
    dynamics: str = "none"
    """of the activation w: none (w = control) | integrator (w' = control) | filter (w' = (control - w) /
    time_constant)"""
    time_constant: float = 0.0
    """s"""
    activation: float = 0.0
    """initial"""
    lower_activation: Real = -math.inf
    upper_activation: Real = math.inf
    early: bool = False
    """the effort takes the activation of the end of the step, not of its start"""

    def __post_init__(self) -> None:
        chosen("dynamics of an actuator", self.dynamics, ACTIVATIONS)
        who = self._settle()
        for end in ("_force", "_control", "_activation"):
            self._in_order(who, end)

    def clipped(self, control: float) -> float:
        """The control within its limits, as it acts."""
        return min(max(control, self.lower_control), self.upper_control)


LAWS = ("effort", "position", "velocity")


def law(kind: str, kp: float, kd: float) -> dict[str, Sequence[float]]:
    """Gain and bias of the usual laws: of an effort the control itself, of a servo the difference to it."""
    chosen("law of an actuator", kind, dict.fromkeys(LAWS))
    if kind == "effort":
        return {"gain": (1.0, 0.0, 0.0), "bias": (0.0, 0.0, -kd)}
    if kind == "position":
        return {"gain": (kp, 0.0, 0.0), "bias": (0.0, -kp, -kd)}
    return {"gain": (kd, 0.0, 0.0), "bias": (0.0, 0.0, -kd)}
