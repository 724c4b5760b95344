"""Parts of models: immutable data with the fields of multibody/model/description.hpp."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from .. import _core
from ..checks import Matrix3, Vector3, chosen
from ..errors import InputError
from ..guidance import former_names, guided
from .fields import Bits, Direction, NonNegative, Part, Point, Positive, Real
from .mass import NOTHING
from .shapes import Shape
from .transforms import ORIGIN, Transform

WORLD = -1
OWN = -1
"""In place of a link: what a body is without its links."""


def words(kind: Any) -> dict[str, Any]:
    """The values of an enumeration of the compiled module by name."""
    return {value.name: value for value in kind}


MOTIONS = words(_core.Motion)
MOTORS = words(_core.MotorKind)
DOFS = words(_core.DofKind)
JOINTS = words(_core.JointKind)


def require_static(what: str, kinetic: float, static: float | None) -> None:
    """InputError if friction at rest is less than that in motion, which no surface has."""
    if static is not None and static < kinetic:
        raise InputError(
            f"{what}friction_static is {static:g}, less than the friction {kinetic:g}; swap them, or leave "
            "friction_static out"
        )


@guided
@dataclass(frozen=True)
class Material(Part, called="material"):
    """Contact properties of a surface.

    Frictions of two surfaces combine by the model's rule, static ones too; of restitutions, torsional and
    rolling frictions and Stribeck speeds the larger one holds; compliances and rest offsets add.
    docs/physics.md has the laws.

    >>> Material(friction=0.4, friction_static=0.5, restitution=0.2).friction
    0.4
    """

    friction: NonNegative = 0.5
    """Coulomb's mu, >= 0"""
    restitution: float = 0.0
    """e in [0, 1]: u_n after = -e u_n before"""
    compliance: NonNegative = 0.0
    """of one contact point (m/N), 0 is rigid"""
    relaxation_time: NonNegative = 0.0
    """of a compliant contact, damping over stiffness (s), >= 0; of two the mean by compliance"""
    rest_offset: NonNegative = 0.0
    """the distance from the surface at which things touch it (m), >= 0"""
    friction_across: NonNegative | None = None
    """mu across the geom's friction_direction, >= 0, `friction` then is that along it; None: the same all
    round"""
    torsional_friction: NonNegative = 0.0
    """largest moment about the normal over the normal force, of each contact point (m), >= 0"""
    rolling_friction: NonNegative = 0.0
    """largest moment in the tangent plane over the normal force, of each contact point (m), >= 0"""
    friction_static: NonNegative | None = None
    """mu of a contact that stuck in the last step, or is new, >= friction; None: `friction`"""
    stribeck_speed: NonNegative = 0.0
    """slip v_s (m/s) in mu = friction + (friction_static - friction) exp(-(v / v_s)^2) of a contact that
    slipped with v in the last step; 0: mu falls to `friction` at once"""

    def __post_init__(self) -> None:
        who = self._settle()
        if not 0 <= self.restitution <= 1:
            raise InputError(f"{who}restitution is {self.restitution:g}; it must lie in [0, 1]")
        require_static(who, self.friction, self.friction_static)


MOTOR_TERMS = {
    "angle": "position",
    "force": "effort",
    "general": "effort",
    "motor": "effort",
    "pd": "position",
    "servo": "position",
    "speed": "velocity",
    "torque": "effort",
}
"""Names of kinds of motors elsewhere -> here."""


@guided
@dataclass(frozen=True)
class Motor(Part, called="motor"):
    """Drive of one degree of freedom of a joint; its control is one of `Simulation.controls`.

    >>> builder = ModelBuilder()
    >>> wheel = builder.add_body("wheel", shape=shapes.Cylinder(0.1, 0.02), mass=1)
    >>> drive = Motor("velocity", max_effort=2)  # N m
    >>> axle = builder.add_revolute_joint(wheel, point=(0, 0, 0), axis=(0, 0, 1), motor=drive, name="axle")
    >>> simulation = Simulation(builder.build())
    >>> simulation.set_control("axle", 5)  # rad/s
    >>> report = simulation.run(0.1)
    >>> round(simulation.kinematics.rate("axle"), 6)
    5.0
    """

    kind: str = "none"
    """meaning of the control: none | effort (force or torque) | velocity | position"""
    control: float = 0.0
    """control at the start (N or N m; m/s or rad/s; m or rad)"""
    max_effort: Real = math.inf
    """largest effort in either direction, > 0 (N or N m)"""
    kp: float = 0.0
    """stiffness of a position motor (N/m or N m/rad): effort = kp (control - q) - kd q'. With 0 the motor
    holds the position exactly"""
    kd: float = 0.0
    """damping (N s/m or N m s/rad) of a position motor with kp, or of a velocity motor: effort = kd
    (control - q'). With 0 a velocity motor holds the velocity exactly"""

    def __post_init__(self) -> None:
        chosen("motor kind", self.kind, MOTORS, MOTOR_TERMS)
        self._settle()
        if self.kp and self.kind != "position":
            raise InputError(
                f"motor: kp is of position motors; a motor of the kind {self.kind} takes "
                + ("kd" if self.kind == "velocity" else "none")
            )
        if self.kd and self.kind != "velocity" and not self.kp:
            raise InputError(
                "motor: kd is of velocity motors, and of position motors with kp; give kp, or damping of the "
                "joint"
            )


@dataclass(frozen=True)
class Dof(Part):
    """One degree of freedom of a joint; its coordinate is the displacement (m) or angle (rad) of A from B.

    >>> Dof("hinge", axis=(0, 0, 1), lower=-1, upper=1, damping=0.1).damping
    0.1
    """

    kind: str = "hinge"
    """hinge (about the axis) | slide (along it)"""
    axis: Direction = (0.0, 0.0, 1.0)
    """in frame_b at zero coordinates"""
    anchor: Point = (0.0, 0.0, 0.0)
    """a point of the axis of a hinge, in frame_b (m)"""
    lower: Real = -math.inf
    upper: Real = math.inf
    stiffness: float = 0.0
    """N/m or N m/rad"""
    rest: float = 0.0
    """the coordinate at which the spring has no force"""
    damping: float = 0.0
    """N s/m or N m s/rad"""
    friction: float = 0.0
    """largest force or torque of dry friction (N or N m)"""
    armature: float = 0.0
    """inertia of the drive (kg or kg m^2)"""
    motor: Motor = Motor()
    name: str = ""
    """of its coordinate in `Model.coordinates`; "" takes that of the joint"""
    lower_effort: Real = -math.inf
    upper_effort: Real = math.inf
    """bounds of the sum that actuators put on it, themselves or by fixed tendons, as far as their efforts do
    not depend on the motion (N, N m)"""
    friction_static: NonNegative | None = None
    """largest dry friction where it stuck in the last step (N or N m), >= friction; None: `friction`"""
    stribeck_speed: NonNegative = 0.0
    """rate (m/s or rad/s) at which dry friction has fallen towards `friction`, as in `Material`; 0: it falls
    at once"""

    def __post_init__(self) -> None:
        chosen("kind of degree of freedom", self.kind, DOFS)
        self._settle()
        self._in_order("")
        require_static("", self.friction, self.friction_static)


@dataclass(frozen=True)
class Body(Part, called="body"):
    """A rigid body; its frame is any frame fixed in it.

    >>> parts.Body("ball", mass=2, inertia=np.diag([0.1, 0.1, 0.1])).mass
    2.0
    """

    name: str = ""
    motion: str = "dynamic"
    """dynamic | kinematic (keeps the velocity that the state holds) | static"""
    mass: float = 0.0
    """kg"""
    centre_of_mass: Vector3 = (0.0, 0.0, 0.0)
    """in the body frame (m)"""
    inertia: Matrix3 = NOTHING.inertia
    """about the centre of mass, in body axes (kg m^2)"""
    pose: Transform = ORIGIN
    """initial, of the body frame in the world"""
    linear_velocity: Vector3 = (0.0, 0.0, 0.0)
    """initial, of the origin of the frame, world axes (m/s)"""
    angular_velocity: Vector3 = (0.0, 0.0, 0.0)
    """initial, world axes (rad/s)"""
    gravity_scale: float = 1.0
    """its weight over mass times gravity: 0 floats, 1 is usual"""

    def __post_init__(self) -> None:
        chosen("motion", self.motion, MOTIONS, {"fixed": "static"})
        self._settle()


@dataclass(frozen=True)
class Geom(Part, called="geom"):
    """A shape on a body, or on the world.

    >>> scenes.make("pendulum").geoms[0].shape
    Box(half=(0.025, 0.025, 0.5))
    """

    name: str = ""
    body: int = WORLD
    frame: Transform = ORIGIN
    """of the shape in the body frame"""
    shape: Shape = field(kw_only=True)
    material: Material = Material()
    surface_velocity: Vector3 = (0.0, 0.0, 0.0)
    """of the surface relative to the body, in body axes (m/s): conveyors, tracks"""
    category: Bits = 1
    """bits; two geoms may touch if the category of one shares a bit with the mask of the other"""
    mask: Bits = 1
    friction_direction: Direction | None = None
    """along which `material.friction` is, in body axes, of any length; its tangential part counts"""
    surface_spin: Vector3 = (0.0, 0.0, 0.0)
    """of the surface about the origin of the geom, in body axes (rad/s): turntables, rollers"""
    link: int = OWN
    """the link of the body that it belongs to, an index of `Model.links`; OWN: none"""

    def __post_init__(self) -> None:
        who = self._settle()
        if self.friction_direction is None and self.material.friction_across is not None:
            raise InputError(
                f"{who}friction_across = {self.material.friction_across:g} is friction across a direction; "
                "give friction_direction, in body axes"
            )


@former_names(play="clearance", play_length="guide_length", play_friction="clearance_friction")
@dataclass(frozen=True)
class Joint(Part, called="joint"):
    """Frame A in body A follows frame B in body B through the degrees of freedom, one after the other.

    No degree of freedom fixes the bodies to each other. Impulses act on A and, opposite, on B. `ModelBuilder`
    makes the usual joints from points and axes in the world.

    >>> joint = scenes.make("pendulum").joints[0]
    >>> joint.name, joint.dofs[0].kind, joint.dofs[0].axis
    ('hinge', 'hinge', (0.0, 0.0, 1.0))
    """

    name: str = ""
    kind: str = "chain"
    """chain | distance (of the origins of the two frames stays within its limits)"""
    body_a: int | str | None = WORLD
    """a name, and None for the world, only in `ModelBuilder.add_joint`; A may not be the world"""
    body_b: int | str | None = WORLD
    frame_a: Transform = ORIGIN
    frame_b: Transform = ORIGIN
    dofs: tuple[Dof, ...] = ()
    """up to six, in frame_b at zero coordinates"""
    spherical: bool = False
    """after the dofs, a free rotation about the origin of frame_a"""
    ball_stiffness: float = 0.0
    """of a spherical joint, towards no rotation (N m/rad)"""
    ball_damping: float = 0.0
    """N m s/rad"""
    ball_friction: float = 0.0
    """N m"""
    ball_limit: Real = math.inf
    """the largest angle of rotation (rad)"""
    ball_armature: float = 0.0
    """inertia of the drive (kg m^2)"""
    lower_distance: float = 0.0
    """m"""
    upper_distance: Real = 0.0
    """m"""
    compliance: float = 0.0
    """of the locked directions (m/N), 0 is rigid"""
    collide: bool = False
    """whether the two bodies may touch each other"""
    closes_loop: bool = False
    """a condition between bodies that other joints place: never among `Simulation.q`"""
    clearance: float = 0.0
    """radial clearance of a journal in its bearing (m), 0: none. Its dofs are two slides and a hinge about
    their normal"""
    guide_length: float = 0.0
    """of a slider along its first slide (m): then `clearance` is its clearance on either side"""
    journal_radius: float = 0.0
    """lever of the friction of a journal (m)"""
    clearance_friction: float = 0.0
    """mu of the journal in its bearing, or of the slider in its guide"""
    link_a: int = OWN
    """the link of body A that it holds, an index of `Model.links`; OWN: none"""
    link_b: int = OWN

    def __post_init__(self) -> None:
        chosen("kind of joint", self.kind, JOINTS)
        who = self._settle()
        lower, upper = self.lower_distance, self.upper_distance
        if self.kind == "distance" and not 0 <= lower <= upper:
            raise InputError(f"{who}limits are ({lower:g}, {upper:g}); they must be 0 <= lower <= upper")


@dataclass(frozen=True)
class Coupling(Part, called="coupling"):
    """Coordinate a = a polynomial in coordinate b: gears, racks, mimics.

    A coordinate is that of a joint's degree of freedom or, where a tendon is named, its length.

    >>> parts.Coupling("gears", 0, 0, 1, 0, coefficients=(0, -2)).coefficients  # a = -2 b
    (0.0, -2.0)
    """

    name: str = ""
    joint_a: int = -1
    dof_a: int = 0
    joint_b: int = -1
    """-1, without tendon_b: the constant coefficient alone"""
    dof_b: int = 0
    coefficients: tuple[float, ...] = (0.0, 1.0)
    """ascending powers"""
    compliance: float = 0.0
    tendon_a: int = -1
    tendon_b: int = -1
    backlash: float = 0.0
    """free travel of coordinate a, half of it on either side (m or rad)"""


@dataclass(frozen=True)
class PairMaterial(Part):
    """A pair of geoms with a material of its own, which replaces the combination of both.

    Its friction_across is across the friction_direction of the geoms, of geom A of the contact if both have
    one.

    >>> ice = parts.PairMaterial(0, 1, Material(friction=0.02))  # of geoms 0 and 1
    >>> ice.material.friction
    0.02
    """

    geom_a: int
    geom_b: int
    material: Material
    always: bool = False
    """whether they may touch whatever category, mask, exclusions and joints say"""


@dataclass(frozen=True)
class Fluid(Part, called="fluid"):
    """The fluid around bodies with a `FluidBox`.

    >>> parts.Fluid(density=1000, viscosity=1e-3, wind=(0.1, 0, 0)).density
    1000.0
    """

    density: float = 0.0
    """kg/m^3, >= 0: air 1.2, water 1000"""
    viscosity: float = 0.0
    """dynamic (Pa s), >= 0: air 2e-5, water 1e-3"""
    wind: Vector3 = (0.0, 0.0, 0.0)
    """velocity of the fluid, world axes (m/s)"""


NO_FLUID = Fluid()


@dataclass(frozen=True)
class FluidBox(Part, called="fluid box"):
    """Fluid forces on a body as on a box: Stokes' drag and dynamic pressure on its faces.

    With the mean edge d, edges b, and the velocity v and spin w along its axes: the force is -(3 pi d
    viscosity + density / 2 b_j b_k |v_i|) v_i and the torque -(pi d^3 viscosity + density / 64 b_i (b_j^4 +
    b_k^4) |w_i|) w_i (MuJoCo, Computation, Fluid forces, inertia model).

    >>> parts.FluidBox(0, Transform(), size=(0.1, 0.1, 0.4)).size
    (0.1, 0.1, 0.4)
    """

    body: int
    frame: Transform
    """of its centre and axes in the body frame"""
    size: Vector3
    """edges (m), >= 0"""


@dataclass(frozen=True)
class Bond(Part, called="bond"):
    """A point at which two bodies hold together, as mortar does, until it breaks for good.

    It pulls the bodies together with `tension`. Their contact bears the pull: so they resist opening up to
    `tension`, and sliding up to the coefficient of friction times it, the cohesion. The pull stays the same
    until the two points are farther apart than `opening`, as in the strip model of Dugdale (1960). A broken
    bond never acts again; `State.bond_openings` is the largest distance so far. Impulses of the contact
    include the pull. `ModelBuilder.add_bond` makes one of a point and a normal of the world.

    >>> parts.Bond(0, -1, (0, 0, -0.1), (0, 0, 0.2), (0, 0, 1), tension=500, opening=1e-4).tension
    500.0
    """

    body_a: int
    body_b: int
    """indices; -1 is the world"""
    point_a: Vector3
    point_b: Vector3
    """in the frames of the bodies (m); one place before anything moves"""
    normal: Direction
    """unit vector from B to A, in the frame of body B"""
    tension: Positive
    """N, > 0"""
    opening: Positive
    """m, > 0; tension times opening is the energy that a break takes (J)"""
