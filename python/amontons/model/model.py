"""The constant part of a simulation. SI units.

A body index of -1 is the world. Most models come from `ModelBuilder` or a file; the classes of which they are
made are for code that makes or reads models by itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from os import PathLike
from types import MappingProxyType
from typing import Any

import numpy as np

from .. import _core
from ..checks import Array, Vector3, chosen, shown, suggestion, vector3
from ..errors import InputError
from .controls import control_limits_of, control_names_of, no_control
from .coordinates import Coordinate, coordinates_of
from .drives import Actuator, Tendon
from .links import Link, Places, check_links, place_index, places_of
from .parts import NO_FLUID, Body, Bond, Coupling, Fluid, FluidBox, Geom, Joint, PairMaterial, words
from .presets import Keyframe, Unread
from .sensing import Sensor, Site
from .transforms import ORIGIN
from .variants import variant
from .visuals import Visual

FRICTION_RULES = words(_core.FrictionRule)

PYTHON_PARTS = {
    "keyframes": Keyframe, "unread": Unread, "sites": Site, "sensors": Sensor, "visuals": Visual,
    "links": Link,
}  # fmt: skip
"""Fields that the compiled model does not know, and so does not check."""
TREES = words(_core.Trees)
TREE_TERMS = {"maximal": "none", "minimal": "auto", "reduced": "auto"}
"""Names of coordinates elsewhere -> here."""


def _names(parts: str) -> cached_property[tuple[str, ...]]:
    def names(model: Model) -> tuple[str, ...]:
        """Names by index."""
        return tuple(part.name for part in getattr(model, parts))

    return cached_property(names)


@dataclass(frozen=True)
class Model:
    """Bodies, geoms, joints and drives, checked as a whole; simulations share it and never change it.

    Raises InputError naming the thing and the remedy.

    >>> model = scenes.make("pendulum")
    >>> model.body_names, model.joint_names, model.nq
    (('bar',), ('hinge',), 1)
    >>> model.joint_index("hinge")
    0
    """

    gravity: Vector3 = (0.0, 0.0, -9.81)
    """acceleration of gravity (m/s^2)"""
    friction_rule: str = "geometric_mean"
    """how two frictions combine: geometric_mean | maximum | minimum | mean"""
    bodies: tuple[Body, ...] = ()
    """rigid bodies; parts name them by index"""
    geoms: tuple[Geom, ...] = ()
    """shapes with materials on bodies or on the world, which make contacts"""
    joints: tuple[Joint, ...] = ()
    """joints between two bodies, or a body and the world"""
    couplings: tuple[Coupling, ...] = ()
    """equations between two joint coordinates: gears, racks, mimics"""
    pair_materials: tuple[PairMaterial, ...] = ()
    """materials of pairs of geoms, in place of the combined ones"""
    excluded_bodies: tuple[tuple[int, int], ...] = ()
    """pairs of bodies that never touch"""
    excluded_geoms: tuple[tuple[int, int], ...] = ()
    """pairs of geoms that never touch"""
    fluid: Fluid = NO_FLUID
    """fluid around the bodies that have a fluid box"""
    fluid_boxes: tuple[FluidBox, ...] = ()
    """boxes by which the fluid acts on bodies"""
    bonds: tuple[Bond, ...] = ()
    """points at which bodies hold together until they break, as mortar"""
    tendons: tuple[Tendon, ...] = ()
    """lengths with limits, springs and friction"""
    actuators: tuple[Actuator, ...] = ()
    """drives with a control each, beside the motors of joints: `Simulation.set_control`"""
    keyframes: tuple[Keyframe, ...] = field(default=(), repr=False, compare=False, metadata={"core": False})
    """states to start from: `Simulation.apply_keyframe`"""
    unread: tuple[Unread, ...] = field(default=(), repr=False, compare=False, metadata={"core": False})
    """elements of the model file that were not read, the worst first"""
    sites: tuple[Site, ...] = field(default=(), repr=False, compare=False, metadata={"core": False})
    """frames to look at: `Simulation.kinematics.sites`"""
    sensors: tuple[Sensor, ...] = field(default=(), repr=False, compare=False, metadata={"core": False})
    """sensors: `Simulation.sensors` has their readings"""
    visuals: tuple[Visual, ...] = field(default=(), repr=False, compare=False, metadata={"core": False})
    """visual shapes, where they differ from the geoms"""
    links: tuple[Link, ...] = field(default=(), metadata={"core": False})
    """parts of bodies that have names of their own, as fixed joints of a file hold them"""
    trees: str = "none"
    """bodies in coordinates of their joints, which then hold exactly: none | auto. With auto these are bodies
    whose rigid joints form a tree. Joints that close its loops, and compliant ones, are rows. Models of
    MJCF and URDF files have auto."""
    core: _core.Model = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "gravity", vector3("gravity", self.gravity))
        chosen("friction rule", self.friction_rule, FRICTION_RULES)
        chosen("trees", self.trees, TREES, TREE_TERMS)
        for f in fields(self):
            if isinstance(getattr(self, f.name, None), list):
                object.__setattr__(self, f.name, tuple(getattr(self, f.name)))
        for name, kind in PYTHON_PARTS.items():
            parts = getattr(self, name)
            if not isinstance(parts, tuple) or not all(isinstance(part, kind) for part in parts):
                raise InputError(f"{name} = {shown(parts)}; give a tuple of {kind.__name__}")
        object.__setattr__(self, "core", _core.Model(self.stepped()))
        check_links(self)

    def stepped(self) -> dict[str, Any]:
        """The fields that a step reads."""
        listed = (f.name for f in fields(self) if f.init and f.metadata.get("core", True))
        return {name: getattr(self, name) for name in listed}

    def __reduce__(self) -> tuple[Any, ...]:  # the compiled model is made again
        return Model, tuple(getattr(self, f.name) for f in fields(self) if f.init)

    def __copy__(self) -> Model:  # it never changes
        return self

    def __deepcopy__(self, memo: object) -> Model:
        return self

    def with_(
        self,
        *,
        friction: Mapping[Any, float] | None = None,
        restitution: Mapping[Any, float] | None = None,
        mass: Mapping[str, float] | None = None,
        mass_scale: Mapping[str, float] | None = None,
        damping: Mapping[str, float] | None = None,
        armature: Mapping[str, float] | None = None,
        gain: Mapping[str, float] | None = None,
    ) -> Model:
        """A variant: this model with other numbers, each by a name or by a pattern, {"foot*": 0.4}.

        friction, restitution: of geoms, or of all geoms of a body or link. Contacts combine them by the rules
            of the model. Pairs with a material of their own follow their geoms. Two names set that of a pair:
            {("foot*", "floor"): 0.4}.
        mass: of bodies with all their links, or of links (kg); inertia in proportion. mass_scale: factors.
        damping (N s/m, N m s/rad), armature (kg, kg m^2): of degrees of freedom, or all of a joint.
        gain: of controls: on the control, and in the bias of servos; kp of position motors, kd of others.

        Warns (ModelWarning) of pairs with a value of their own that stays, and of a value that changes no
        contact. Raises InputError naming the name that is not known, or the value that cannot be.

        >>> model = scenes.make("incline")
        >>> rough = model.with_(friction={"*": 0.9})
        >>> rough.geoms[0].material.friction
        0.9
        """
        given = {name: value for name, value in locals().items() if name != "self"}
        return variant(self, given)

    @cached_property
    def _neighbours(self) -> dict[str, Any]:
        """Variants with a parameter changed by little to both sides, kept by derivatives of steps: they take
        longer to make than many steps."""
        return {}

    body_names = _names("bodies")
    geom_names = _names("geoms")
    joint_names = _names("joints")
    tendon_names = _names("tendons")
    actuator_names = _names("actuators")
    site_names = _names("sites")
    keyframe_names = _names("keyframes")

    @cached_property
    def link_names(self) -> tuple[str, ...]:
        """Names of the bodies, then of the links that are parts of them, as `Simulation.kinematics.links`."""
        return (*self.body_names, *(link.name for link in self.links))

    @cached_property
    def geom_links(self) -> tuple[int, ...]:
        """The link or body of each geom, an index of `link_names`; -1 is the world."""
        return tuple(place_index(len(self.bodies), geom.body, geom.link) for geom in self.geoms)

    @cached_property
    def _geom_link_array(self) -> Array:
        return np.array(self.geom_links, dtype=np.int32)

    @cached_property
    def _link_places(self) -> Places:
        """In the order of `link_names`."""
        bodies = [*range(len(self.bodies)), *(link.body for link in self.links)]
        return places_of(bodies, [ORIGIN] * len(self.bodies) + [link.frame for link in self.links])

    @cached_property
    def _site_places(self) -> Places:
        return places_of([site.body for site in self.sites], [site.frame for site in self.sites])

    @cached_property
    def tree(self) -> _core.Tree:
        """The joints that place the bodies one after the other; the others close loops."""
        return _core.Tree(self.core)

    @cached_property
    def coordinates(self) -> Mapping[str, Coordinate]:
        """The generalised coordinates by name, in the order of `Simulation.q`.

        A joint with one degree of freedom gives its name to it, a floating base that of its body; files name
        every degree of freedom.
        """
        return MappingProxyType(coordinates_of(self.tree, self.bodies, self.joints))

    @property
    def nq(self) -> int:
        """The length of `Simulation.q`."""
        return self.tree.nq

    @property
    def nv(self) -> int:
        """The length of `Simulation.qd`: degrees of freedom of the tree."""
        return self.tree.nv

    @cached_property
    def q_names(self) -> tuple[str, ...]:
        """A name for every entry of `Simulation.q`."""
        return tuple(name for c in self.coordinates.values() for name in c.q_names)

    @cached_property
    def qd_names(self) -> tuple[str, ...]:
        """A name for every entry of `Simulation.qd`."""
        return tuple(name for c in self.coordinates.values() for name in c.qd_names)

    @cached_property
    def control_names(self) -> tuple[str, ...]:
        """Names by index in `Simulation.controls`: of all actuators, then of the motors of all joints.

        A motor has the name of its coordinate, with " motor" behind it where an actuator has that name.
        """
        return tuple(control_names_of(self.core, self.actuators, self.joints))

    @cached_property
    def control_limits(self) -> tuple[tuple[float, float], ...]:
        """(lower, upper) of every control, infinite without a bound; of effort motors `max_effort`."""
        return control_limits_of(self.core, self.actuators, self.joints)

    def control_index(self, control: int | str) -> int:
        """The index in `Simulation.controls` of an actuator or motor, by index or name.

        Raises InputError naming what is known, or the joint without a motor and the remedy.
        """
        if isinstance(control, str) and control not in self.control_names:
            reason = no_control(control, self.core, self.actuators, self.joints, self.control_names)
            if reason is not None:
                raise reason
        return index_of("control", control, self.control_names)

    @property
    def dofs(self) -> int:
        """Number of coordinates of all joints, the length of `Simulation.state.joint_coordinates`."""
        return self.core.dofs

    @property
    def total_mass(self) -> float:
        """Mass of the dynamic bodies (kg)."""
        return self.core.total_mass

    @property
    def length(self) -> float:
        """The median bounding radius of moving shapes (m), of which default tolerances are fractions."""
        return self.core.length

    def body_index(self, body: int | str) -> int:
        """The index of a body given by index or name; InputError if there is none."""
        link = next((link for link in self.links if link.name == body), None)
        if link is not None:
            raise InputError(
                f'"{link.name}" is a link of the body "{self.bodies[link.body].name}", on which the joint '
                f'"{link.joint}" fixes it; give the body, or ask Simulation.kinematics.link("{link.name}")'
            )
        return index_of("body", body, self.body_names)

    def link_index(self, link: int | str) -> int:
        """The index in `link_names` of a link or body given by index or name; InputError if there is none."""
        return index_of("link" if self.links else "body", link, self.link_names)

    def geom_index(self, geom: int | str) -> int:
        """The index of a geom given by index or name; InputError if there is none."""
        return index_of("geom", geom, self.geom_names)

    def joint_index(self, joint: int | str) -> int:
        """The index of a joint given by index or name; InputError if there is none."""
        link = next((link for link in self.links if link.joint == joint), None)
        if link is not None and joint not in self.joint_names:
            raise InputError(
                f'the joint "{link.joint}" fixes the link "{link.name}" on the body '
                f'"{self.bodies[link.body].name}", which is one with it; its forces are in '
                "Simulation.forces.link_reactions"
            )
        return index_of("joint", joint, self.joint_names)

    def site_index(self, site: int | str) -> int:
        """The index of a site given by index or name; InputError if there is none."""
        return index_of("site", site, self.site_names)

    def tendon_index(self, tendon: int | str) -> int:
        """The index of a tendon given by index or name; InputError if there is none."""
        return index_of("tendon", tendon, self.tendon_names)

    def actuator_index(self, actuator: int | str) -> int:
        """The index of an actuator given by index or name; InputError if there is none."""
        return index_of("actuator", actuator, self.actuator_names)

    def keyframe_index(self, keyframe: int | str) -> int:
        """The index of a keyframe given by index or name; InputError if there is none."""
        return index_of("keyframe", keyframe, self.keyframe_names)

    def dof_index(self, joint: int | str, dof: int = 0) -> int:
        """The index of a joint's degree of freedom among the coordinates of all joints."""
        j = self.joint_index(joint)
        count = len(self.joints[j].dofs)
        if isinstance(dof, bool) or not isinstance(dof, int) or not 0 <= dof < count:
            raise InputError(
                f'joint "{self.joints[j].name}" has {count} degrees of freedom; dof = {shown(dof)} is '
                "none of them, which count from 0"
            )
        return self.core.first_dof(j) + dof

    def __repr__(self) -> str:
        return (
            f"amontons.Model({len(self.bodies)} bodies, {len(self.geoms)} geoms, {len(self.joints)} joints, "
            f"{self.dofs} joint coordinates)"
        )


def no_model(what: str, thing: Any) -> InputError:
    """Message of a function whose argument is not a Model."""
    if isinstance(thing, str) and thing.isidentifier():
        remedy = f"if it is a scene, give amontons.scenes.{thing[:80]}()"
    elif isinstance(thing, str | PathLike):
        remedy = f"read it by amontons.load_model({shown(str(thing))})"
    elif hasattr(thing, "build"):
        remedy = "give what its build() returns"
    elif isinstance(getattr(thing, "model", None), Model):
        remedy = "give its model"
    elif callable(thing) and not isinstance(thing, type):
        remedy = f"call it: {getattr(thing, '__name__', 'it')}()"
    else:
        remedy = "give a Model, as builder.build() and load_model(path) do"
    return InputError(f"{what} is a {type(thing).__name__}; {remedy}")


def index_of(what: str, key: object, names: Sequence[str]) -> int:
    """The index of the name `key` among `names`, or `key` itself, checked, if it is an index."""
    if isinstance(key, str):
        if key in names:
            return names.index(key)
        listed = ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")
        name = f'"{key}"' if len(key) <= 80 else shown(key)
        raise InputError(f"there is no {what} {name}{suggestion(key, names)}; known are {listed or 'none'}")
    try:
        index = key.__index__()  # type: ignore[attr-defined]
    except (AttributeError, TypeError):  # arrays have __index__ and raise
        raise InputError(f"{what} {shown(key)}: give an index or a name") from None
    if isinstance(key, bool) or not 0 <= index < len(names):
        raise InputError(f"there is no {what} {shown(key)}; the model has {len(names)}")
    return index
