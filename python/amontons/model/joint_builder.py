"""The joints of ModelBuilder, all in terms of the two general kinds of `Joint`."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, Unpack

from .. import checks
from ..checks import Numbers, Quaternion, about, changed, number, shown, unit_vector
from ..errors import InputError
from ..guidance import guided
from .joint_options import (
    BallOptions,
    DofOptions,
    DofsOptions,
    JointOptions,
    Limits,
    ball_fields,
    bounds,
    dofs_of,
    joint_fields,
    require_options,
)
from .parts import OWN, WORLD, Body, Dof, Joint
from .transforms import ORIGIN, Transform, conjugate, cross, dot, rotate, rotation_to_z, subtract

Place = tuple[int, Transform, int]
"""A body, and the frame and index of one of its links; ORIGIN and OWN of the body itself."""
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


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
        name = self._checked("add_ball_joint", options, BallOptions)
        return self._add_framed(name, a, b, options, point, spherical=True, **ball_fields(options))

    def add_revolute_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Numbers,
        axis: Numbers,
        play: float = 0.0,
        journal_radius: float = 0.0,
        play_friction: float = 0.0,
        **options: Unpack[DofOptions],
    ) -> int:
        """A hinge: A turns about the axis through `point`; the coordinate is the angle (rad).

        play: radial clearance (m) of a journal on A in a bearing on B, both about the axis. Coordinates 0 and
        1 are then the place of the journal in its bearing (m), 2 is the angle, which has the options.
        journal_radius: m. play_friction: mu between both.

        >>> builder = ModelBuilder()
        >>> bar = builder.add_body("bar", shape=shapes.Capsule(0.02, 0.5), mass=1, position=(0, 0, -0.5))
        >>> axis = {"point": (0, 0, 0), "axis": (0, 1, 0)}
        >>> hinge = builder.add_revolute_joint(bar, **axis, limits=(-1, 1), name="hinge")
        >>> Simulation(builder.build(), dt=5e-3).kinematics.coordinate("hinge")
        0.0
        """
        name = self._checked("add_revolute_joint", options, DofOptions)
        fields = _play(name, play, journal_radius=journal_radius, play_friction=play_friction)
        if fields:
            hinge = dofs_of(name, [("hinge", Z)], options)
            dofs = (Dof("slide", X), Dof("slide", Y), *hinge)
            return self._add_framed(name, a, b, options, point, _along(name, "axis", axis), dofs, **fields)
        dofs = dofs_of(name, [("hinge", Z)], options)
        return self._add_framed(name, a, b, options, point, _along(name, "axis", axis), dofs)

    def add_prismatic_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        axis: Numbers,
        point: Numbers | None = None,
        play: float = 0.0,
        play_length: float = 0.0,
        play_friction: float = 0.0,
        play_normal: Numbers | None = None,
        **options: Unpack[DofOptions],
    ) -> int:
        """A slide: A moves along the axis without turning; the coordinate is the displacement (m).

        point: where reactions are reported, by default the origin of A. play: clearance (m) on either side of
        a slider of the length play_length (m) about `point`, in the plane with the normal play_normal.
        Coordinate 0 is then the displacement, with the options, 1 that across (m), 2 the tilt (rad).
        play_friction: mu between slider and guide.
        """
        name = self._checked("add_prismatic_joint", options, DofOptions)
        fields = _play(name, play, play_length=play_length, play_friction=play_friction)
        if fields:
            slide = dofs_of(name, [("slide", X)], options)
            if play_normal is None or not play_length:
                raise InputError(f'joint "{name}": play needs play_length > 0 and play_normal')
            along = unit_vector(f'joint "{name}": axis', axis)
            rotation = _frame(along, unit_vector(f'joint "{name}": play_normal', play_normal), name)
            dofs = (*slide, Dof("slide", Y), Dof("hinge", Z))
            return self._add_framed(name, a, b, options, point, rotation, dofs, **fields)
        dofs = dofs_of(name, [("slide", Z)], options)
        return self._add_framed(name, a, b, options, point, _along(name, "axis", axis), dofs)

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
        name = self._checked("add_cylindrical_joint", options, DofsOptions)
        dofs = dofs_of(name, [("slide", Z), ("hinge", Z)], options)
        return self._add_framed(name, a, b, options, point, _along(name, "axis", axis), dofs)

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
        name = self._checked("add_universal_joint", options, DofsOptions)
        first = unit_vector(f'joint "{name}": axis_1', axis_1)
        second = unit_vector(f'joint "{name}": axis_2', axis_2)
        across = cross(first, second)
        if dot(across, across) < 1e-6:
            raise InputError(f'joint "{name}": axis_1 and axis_2 are parallel; give two directions')
        rotation = rotation_to_z(first)
        in_frame = rotate(conjugate(rotation), second)
        dofs = dofs_of(name, [("hinge", Z), ("hinge", in_frame)], options)
        return self._add_framed(name, a, b, options, point, rotation, dofs)

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
        name = self._checked("add_planar_joint", options, DofsOptions)
        dofs = dofs_of(name, [("slide", X), ("slide", Y), ("hinge", Z)], options)
        return self._add_framed(name, a, b, options, point, _along(name, "normal", normal), dofs)

    def add_fixed_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Numbers | None = None,
        **options: Unpack[JointOptions],
    ) -> int:
        """A weld. point: where reactions are reported, by default the origin of A."""
        name = self._checked("add_fixed_joint", options, JointOptions)
        return self._add_framed(name, a, b, options, point)

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
        name = self._checked("add_point_on_line_joint", options, DofOptions)
        dofs = dofs_of(name, [("slide", Z)], options)
        rotation = _along(name, "axis", axis)
        return self._add_framed(name, a, b, options, point, rotation, dofs, spherical=True)

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
        at_a, at_b = checks.point(f"{who}: point_a", point_a), checks.point(f"{who}: point_b", point_b)
        if limits is not None and length is not None:
            raise InputError(f"{who}: length and limits are both given; keep one of them")
        if limits is None:
            length = math.dist(at_a, at_b) if length is None else number(f"{who}: length", length)
            if not length > 0:
                raise InputError(f"{who}: the length is {length:g}; it must be positive, or use a ball joint")
            limits = (length, length)
        with about(who):
            shortest, longest = bounds(limits)
        (index_a, _, link_a), (index_b, _, link_b) = self._ends(who, a, b)
        joint = Joint(
            name,
            "distance",
            index_a,
            index_b,
            self._local(index_a, Transform(at_a)),
            self._local(index_b, Transform(at_b)),
            link_a=link_a,
            link_b=link_b,
            lower_distance=0.0 if shortest == -math.inf else shortest,
            upper_distance=longest,
            **joint_fields(options),
        )
        return self._append("joint", self._joints, joint)

    def add_joint(self, joint: Joint) -> int:
        """Add a general joint; its bodies may be names, also of links, its frames are in them."""
        if not isinstance(joint, Joint):
            raise InputError(f"joint is {shown(joint)}; give a Joint")
        name = self._new_name("joint", joint.name or None)
        moved: dict[str, Any] = {}
        for end, (body, inner, link) in zip(
            "ab", self._ends(f'joint "{name}"', joint.body_a, joint.body_b), strict=True
        ):
            moved[f"body_{end}"] = body
            if link != OWN:
                moved |= {f"frame_{end}": inner @ getattr(joint, f"frame_{end}"), f"link_{end}": link}
        return self._append("joint", self._joints, changed(joint, name=name, **moved))

    def _checked(self, function: str, options: Mapping[str, Any], kind: Any) -> str:
        """The name of a new joint, after a look at the options that were given."""
        require_options(function, options, kind)
        return self._new_name("joint", options.get("name"))

    def _add_framed(
        self,
        name: str,
        a: int | str,
        b: int | str | None,
        options: Mapping[str, Any],
        point: Numbers | None,
        rotation: Quaternion | None = None,
        dofs: tuple[Dof, ...] = (),
        **spherical_fields: Any,
    ) -> int:
        """Adds a joint whose frames meet at `point` of the world, turned by `rotation`, B's if None."""
        who = f'joint "{name}"'
        (index_a, inner_a, link_a), (index_b, inner_b, link_b) = self._ends(who, a, b)
        pose_a = self._bodies[index_a].pose
        frame_a = pose_a if link_a == OWN else pose_a @ inner_a
        origin = frame_a.position if point is None else checks.point(f"{who}: point", point)
        if rotation is None:
            pose_b = ORIGIN if index_b == WORLD else self._bodies[index_b].pose
            rotation = (pose_b if link_b == OWN else pose_b @ inner_b).rotation
        frame = Transform(origin, rotation)
        joint = Joint(
            name=name,
            body_a=index_a,
            body_b=index_b,
            frame_a=self._local(index_a, frame),
            frame_b=self._local(index_b, frame),
            link_a=link_a,
            link_b=link_b,
            dofs=dofs,
            **joint_fields(options),
            **spherical_fields,
        )
        return self._append("joint", self._joints, joint)

    def _local(self, body: int, frame: Transform) -> Transform:
        """A frame of the world in the frame of a body at its initial pose."""
        if body == WORLD:
            return frame
        pose = self._bodies[body].pose
        back = conjugate(pose.rotation)
        # The difference first: exact for frames near the body, however far both are from the origin.
        offset = rotate(back, subtract(frame.position, pose.position))
        return Transform(
            offset, (Transform((0.0, 0.0, 0.0), back) @ Transform(rotation=frame.rotation)).rotation
        )

    def _ends(self, who: str, a: int | str | None, b: int | str | None) -> tuple[Place, Place]:
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


def _along(name: str, what: str, axis: Numbers) -> Quaternion:
    """The rotation of a frame whose third axis is the direction `axis` in the world."""
    return rotation_to_z(unit_vector(f'joint "{name}": {what}', axis))


def _play(name: str, play: float, **more: float) -> dict[str, float]:
    """The fields of a joint with play; none without."""
    if play != 0:
        return {"play": play, **more}
    if given := [key for key, value in more.items() if value != 0]:
        raise InputError(f'joint "{name}": {", ".join(given)} without play; give the clearance, as play=1e-4')
    return {}


def _frame(x: tuple[float, float, float], z: tuple[float, float, float], name: str) -> Quaternion:
    """The rotation of a frame with these two perpendicular axes."""
    if abs(dot(x, z)) > 1e-6:
        raise InputError(f'joint "{name}": play_normal is not normal to the axis; give a perpendicular one')
    turn = rotation_to_z(z)
    first, y = rotate(turn, X), cross(z, x)
    half = 0.5 * math.atan2(dot(first, y), dot(first, x))
    about = Transform(rotation=(math.cos(half), 0.0, 0.0, -math.sin(half)))
    return (Transform(rotation=turn) @ about).rotation
