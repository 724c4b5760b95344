"""The joints of ModelBuilder. The builder of the compiled module places their frames."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, Unpack

from .. import _core, checks
from ..checks import Numbers, about, changed, number, shown, unit_vector
from ..errors import InputError
from ..guidance import guided
from .compiled import Parts
from .joint_options import (
    BallOptions,
    DofOptions,
    DofsOptions,
    JointOptions,
    Limits,
    ball_dof,
    bounds,
    dofs_of,
    joint_fields,
    require_options,
)
from .parts import OWN, WORLD, Body, Joint
from .transforms import ORIGIN, Transform

Place = tuple[int, Transform, int]
"""A body, and the frame and index of one of its links; ORIGIN and OWN of the body itself."""
CLEARANCE = ("clearance", "guide_length", "journal_radius", "clearance_friction")
AXES = {"normal": "axis", "axis_1": "axis"}
"""Other names of what is the axis of the compiled builder."""


@guided
class JointBuilder(ABC):
    """The add_*_joint functions: points and axes in world coordinates at the initial poses of the bodies.

    Every joint moves body A relative to body B; b=None is the world. Coordinates are zero at the initial
    poses. Options of all joints: compliance of the locked directions (m/N, 0 is rigid), collide (whether the
    two bodies may touch; the shapes of the world may in any case), name. Options of each degree of freedom:
    limits (lower, upper), None for no bound; stiffness, rest, damping of a spring and damper; friction (the
    largest force or torque of dry friction), armature (inertia of the drive), motor. The options
    friction_static and stribeck_speed are as in `Material`. A joint of several degrees of freedom takes one
    value for all of them, or a sequence with one per degree of freedom.
    """

    _bodies: list[Body]
    _joints: list[Joint]

    def add_ball_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Numbers,
        **options: Unpack[BallOptions],
    ) -> int:
        """A point of A stays on a point of B; they turn freely about it.

        stiffness, damping: towards the initial relative orientation (N m/rad, N m s/rad). friction: N m.
        limit: the largest angle of rotation (rad).

        >>> builder = ModelBuilder()
        >>> bob = builder.add_body("bob", shape=shapes.Sphere(0.05), mass=1, position=(0, 0, -1))
        >>> joint = builder.add_ball_joint(bob, point=(0, 0, 0))
        >>> builder.build().joints[joint].name
        'joint0'
        """
        return self._add("ball", a, b, options, BallOptions, point=point)

    def add_revolute_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Numbers,
        axis: Numbers,
        clearance: float = 0.0,
        journal_radius: float = 0.0,
        clearance_friction: float = 0.0,
        **options: Unpack[DofOptions],
    ) -> int:
        """A hinge: A turns about the axis through `point`; the coordinate is the angle (rad).

        clearance: of a journal on A in a bearing on B (m, radial), both about the axis. Coordinates 0 and
        1 are then the place of the journal in its bearing (m), 2 is the angle, which has the options.
        journal_radius: m. clearance_friction: mu between both.

        >>> builder = ModelBuilder()
        >>> bar = builder.add_body("bar", shape=shapes.Capsule(0.02, 0.5), mass=1, position=(0, 0, -0.5))
        >>> axis = {"point": (0, 0, 0), "axis": (0, 1, 0)}
        >>> hinge = builder.add_revolute_joint(bar, **axis, limits=(-1, 1), name="hinge")
        >>> Simulation(builder.build(), dt=5e-3).kinematics.coordinate("hinge")
        0.0
        """
        clearance_fields = {
            "clearance": clearance,
            "journal_radius": journal_radius,
            "clearance_friction": clearance_friction,
        }
        return self._add("revolute", a, b, options, DofOptions, point=point, axis=axis, **clearance_fields)

    def add_prismatic_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        axis: Numbers,
        point: Numbers | None = None,
        clearance: float = 0.0,
        guide_length: float = 0.0,
        clearance_friction: float = 0.0,
        guide_normal: Numbers | None = None,
        **options: Unpack[DofOptions],
    ) -> int:
        """A slide: A moves along the axis without turning; the coordinate is the displacement (m).

        point: where reactions are reported, by default the origin of A. clearance: on either side (m) of
        a slider of the length guide_length (m) about `point`, in the plane with the normal guide_normal.
        Coordinate 0 is then the displacement, with the options, 1 that across (m), 2 the tilt (rad).
        clearance_friction: mu between slider and guide.
        """
        clearance_fields = {
            "clearance": clearance,
            "guide_length": guide_length,
            "clearance_friction": clearance_friction,
        }
        given = {"point": point, "axis": axis, "guide_normal": guide_normal, **clearance_fields}
        return self._add("prismatic", a, b, options, DofOptions, **given)

    def add_cylindrical_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Numbers,
        axis: Numbers,
        **options: Unpack[DofsOptions],
    ) -> int:
        """A moves along the axis (degree of freedom 0, m) and turns about it (1, rad)."""
        return self._add("cylindrical", a, b, options, DofsOptions, point=point, axis=axis)

    def add_universal_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Numbers,
        axis_1: Numbers,
        axis_2: Numbers,
        **options: Unpack[DofsOptions],
    ) -> int:
        """A cross: A turns about axis_2, fixed in A, which turns about axis_1, fixed in B (angles, rad).

        The axes need not be perpendicular, but they must not be parallel.
        """
        axes = {"axis_1": axis_1, "axis_2": axis_2}
        return self._add("universal", a, b, options, DofsOptions, point=point, **axes)

    def add_planar_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        normal: Numbers,
        point: Numbers | None = None,
        **options: Unpack[DofsOptions],
    ) -> int:
        """A point of A stays in a plane of B: slides 0 and 1 (m), then a hinge about its normal.

        point: of A, by default the origin of A. The slides complete the normal to a right-handed frame.
        """
        return self._add("planar", a, b, options, DofsOptions, point=point, normal=normal)

    def add_fixed_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Numbers | None = None,
        **options: Unpack[JointOptions],
    ) -> int:
        """A weld. point: where reactions are reported, by default the origin of A."""
        return self._add("fixed", a, b, options, JointOptions, point=point)

    def add_point_on_line_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Numbers,
        axis: Numbers,
        **options: Unpack[DofOptions],
    ) -> int:
        """A point of A stays on a line of B through its initial place; A turns freely about the point."""
        return self._add("point_on_line", a, b, options, DofOptions, point=point, axis=axis)

    def add_distance_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point_a: Numbers,
        point_b: Numbers,
        length: float | None = None,
        limits: Limits = None,
        **options: Unpack[JointOptions],
    ) -> int:
        """The distance of a point of A and a point of B stays the same (a rod) or within limits (a rope).

        length: m, by default the initial distance. limits: (shortest, longest), None for no bound.
        """
        name = self._checked("add_distance_joint", options, JointOptions)
        who = f'joint "{name}"'
        points = checks.point(f"{who}: point_a", point_a), checks.point(f"{who}: point_b", point_b)
        if limits is not None and length is not None:
            raise InputError(f"{who}: length and limits are both given; keep one of them")
        with about(who):
            fields = joint_fields(options)
            lower, upper = (None, None) if limits is None else bounds(limits)
        if length is not None:
            length = number(f"{who}: length", length)
        if lower is not None:
            lower = 0.0 if lower == -math.inf else number(f"{who}: shortest", lower)
            upper = number(f"{who}: longest", upper, infinite=True)
        ends, links = self._ends(who, a, b)
        given = {"name": name, "point_a": points[0], "point_b": points[1], "length": length}
        rod = _core.rod_between(*ends, Parts().make, **given, lower=lower, upper=upper)
        return self._joined(rod, links, fields)

    def add_joint(self, joint: Joint) -> int:
        """Add a general joint; its bodies may be names, also of links, its frames are in them."""
        if not isinstance(joint, Joint):
            raise InputError(f"joint is {shown(joint)}; give a Joint")
        name = self._new_name("joint", joint.name or None)
        moved: dict[str, Any] = {}
        for end, (body, inner, link) in zip(
            "ab", self._both(f'joint "{name}"', joint.body_a, joint.body_b), strict=True
        ):
            moved[f"body_{end}"] = body
            if link != OWN:
                moved |= {f"frame_{end}": inner @ getattr(joint, f"frame_{end}"), f"link_{end}": link}
        return self._append("joint", self._joints, changed(joint, name=name, **moved))

    def _checked(self, function: str, options: Mapping[str, Any], kind: Any) -> str:
        """The name of a new joint, after a look at the options that were given."""
        require_options(function, options, kind)
        return self._new_name("joint", options.get("name"))

    def _add(
        self,
        kind: str,
        a: int | str,
        b: int | str | None,
        options: Mapping[str, Any],
        known: Any,
        **given: Any,
    ) -> int:
        """Adds a joint of a kind of the compiled builder, with points, axes and clearance in `given`."""
        name = self._checked(f"add_{kind}_joint", options, known)
        who = f'joint "{name}"'
        new: dict[str, Any] = {"name": name}
        for key, value in given.items():
            if value is None:
                continue
            check = checks.point if key == "point" else number if key in CLEARANCE else unit_vector
            new[AXES.get(key, key)] = check(f"{who}: {key}", value)
        with about(who):
            fields = joint_fields(options)
            if known is BallOptions:
                new["dof"] = ball_dof(options)
            else:
                count = _core.dofs_of_kind(kind)
                new["dofs"] = dofs_of(count, options)
        ends, links = self._ends(who, a, b)
        return self._joined(_core.joint_between(kind, *ends, Parts().make, **new), links, fields)

    def _joined(self, joint: Joint, links: tuple[int, int], fields: Mapping[str, Any]) -> int:
        """Adds a joint that the compiled builder made, with fields that are good."""
        joint = changed(joint, link_a=links[0], link_b=links[1], **fields)
        return self._append("joint", self._joints, joint)

    def _ends(
        self, who: str, a: int | str | None, b: int | str | None
    ) -> tuple[tuple[_core.JointEnd, _core.JointEnd], tuple[int, int]]:
        ends, links = [], []
        for body, part, link in self._both(who, a, b):
            pose = ORIGIN if body == WORLD else self._bodies[body].pose
            frames = ((frame.position, frame.rotation) for frame in (pose, part))
            ends.append(_core.JointEnd(body, *frames))
            links.append(link)
        return (ends[0], ends[1]), (links[0], links[1])

    def _both(self, who: str, a: int | str | None, b: int | str | None) -> tuple[Place, Place]:
        ends = []
        for body in (a, b):
            try:
                ends.append(self._place(None if type(body) is int and body == WORLD else body))
            except InputError as error:
                raise InputError(f"{who}: {error}") from None
        index = ends[0][0]
        if index == WORLD:
            raise InputError(f"{who}: body A must not be the world; swap the bodies")
        if index == ends[1][0]:
            raise InputError(f'{who} joins body "{self._bodies[index].name}" to itself; it needs two bodies')
        return ends[0], ends[1]

    @abstractmethod
    def _place(self, body: int | str | None) -> Place:
        """The body of a body or link given by index or name, the frame of the link in it, and the link."""

    @abstractmethod
    def _new_name(self, kind: str, name: str | None) -> str:
        """The name, or one made up, that no other thing of its kind has."""

    @abstractmethod
    def _append(self, kind: str, things: list[Any], thing: Any) -> int:
        """Adds a thing; returns its index."""
