"""The joints of ModelBuilder, all in terms of the two general kinds of `Joint`."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from .errors import InputError
from .model import WORLD, Body, Dof, Joint, Motor
from .transforms import (
    Quaternion,
    Transform,
    conjugate,
    cross,
    dot,
    number,
    rotate,
    rotation_to_z,
    subtract,
    unit_vector,
    vector3,
)

Limits = Sequence[Any] | None
PerDof = float | Sequence[float]

_FIELDS = ("stiffness", "rest", "damping", "friction", "armature")


class JointBuilder(ABC):
    """The add_*_joint functions: points and axes in world coordinates at the initial poses of the bodies.

    Every joint moves body A relative to body B; b=None is the world. Coordinates are zero at the initial
    poses. Options of all joints: compliance of the locked directions (m/N, 0 is rigid), collide (whether the
    two bodies may touch; the shapes of the world may in any case), name. Options of each degree of freedom:
    limits (lower, upper), None for no bound; stiffness, rest, damping of a spring and damper; friction (the
    largest force or torque of dry friction), armature (inertia of the drive), motor. A joint of several
    degrees of freedom takes one value for all of them, or a sequence with one per degree of freedom.
    """

    _bodies: list[Body]
    _joints: list[Joint]

    def add_ball_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Sequence[float],
        stiffness: float = 0.0,
        damping: float = 0.0,
        friction: float = 0.0,
        limit: float | None = None,
        compliance: float = 0.0,
        collide: bool = False,
        name: str | None = None,
    ) -> int:
        """A point of A stays on a point of B; they turn freely about it.

        stiffness, damping: towards the initial relative orientation (N m/rad, N m s/rad). friction: N m.
        limit: the largest angle of rotation (rad).
        """
        joint = Joint(
            spherical=True,
            ball_stiffness=stiffness,
            ball_damping=damping,
            ball_friction=friction,
            ball_limit=math.inf if limit is None else limit,
            compliance=compliance,
            collide=collide,
        )
        return self._add_framed(joint, a, b, name, point, rotation=None)

    def add_revolute_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Sequence[float],
        axis: Sequence[float],
        limits: Limits = None,
        stiffness: float = 0.0,
        rest: float = 0.0,
        damping: float = 0.0,
        friction: float = 0.0,
        armature: float = 0.0,
        motor: Motor | None = None,
        compliance: float = 0.0,
        collide: bool = False,
        name: str | None = None,
    ) -> int:
        """A hinge: A turns about the axis through `point`; the coordinate is the angle (rad)."""
        dofs = _dofs(name, ["hinge"], limits, motor, (stiffness, rest, damping, friction, armature))
        joint = Joint(dofs=dofs, compliance=compliance, collide=collide)
        return self._add_framed(joint, a, b, name, point, _to_axis(_who(name, "axis"), axis))

    def add_prismatic_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        axis: Sequence[float],
        point: Sequence[float] | None = None,
        limits: Limits = None,
        stiffness: float = 0.0,
        rest: float = 0.0,
        damping: float = 0.0,
        friction: float = 0.0,
        armature: float = 0.0,
        motor: Motor | None = None,
        compliance: float = 0.0,
        collide: bool = False,
        name: str | None = None,
    ) -> int:
        """A slide: A moves along the axis without turning; the coordinate is the way (m).

        point: where reactions are reported, by default the origin of A.
        """
        dofs = _dofs(name, ["slide"], limits, motor, (stiffness, rest, damping, friction, armature))
        joint = Joint(dofs=dofs, compliance=compliance, collide=collide)
        return self._add_framed(joint, a, b, name, point, _to_axis(_who(name, "axis"), axis))

    def add_cylindrical_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Sequence[float],
        axis: Sequence[float],
        limits: Limits = None,
        stiffness: PerDof = 0.0,
        rest: PerDof = 0.0,
        damping: PerDof = 0.0,
        friction: PerDof = 0.0,
        armature: PerDof = 0.0,
        motor: Motor | Sequence[Motor | None] | None = None,
        compliance: float = 0.0,
        collide: bool = False,
        name: str | None = None,
    ) -> int:
        """A moves along the axis (degree of freedom 0, m) and turns about it (1, rad)."""
        dofs = _dofs(name, ["slide", "hinge"], limits, motor, (stiffness, rest, damping, friction, armature))
        joint = Joint(dofs=dofs, compliance=compliance, collide=collide)
        return self._add_framed(joint, a, b, name, point, _to_axis(_who(name, "axis"), axis))

    def add_universal_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Sequence[float],
        axis_1: Sequence[float],
        axis_2: Sequence[float],
        limits: Limits = None,
        stiffness: PerDof = 0.0,
        rest: PerDof = 0.0,
        damping: PerDof = 0.0,
        friction: PerDof = 0.0,
        armature: PerDof = 0.0,
        motor: Motor | Sequence[Motor | None] | None = None,
        compliance: float = 0.0,
        collide: bool = False,
        name: str | None = None,
    ) -> int:
        """A cross: A turns about axis_2, fixed in A, which turns about axis_1, fixed in B (angles, rad).

        The axes need not be perpendicular, but they must not be parallel.
        """
        first, second = (
            unit_vector(_who(name, what), axis) for what, axis in (("axis_1", axis_1), ("axis_2", axis_2))
        )
        if dot(*[cross(first, second)] * 2) < 1e-6:
            raise InputError(
                f"{_who(name, 'universal joint')}: axis_1 and axis_2 are parallel; give two directions"
            )
        rotation = rotation_to_z(first)
        dofs = _dofs(name, ["hinge", "hinge"], limits, motor, (stiffness, rest, damping, friction, armature))
        dofs = (dofs[0], replace(dofs[1], axis=rotate(conjugate(rotation), second)))
        joint = Joint(dofs=dofs, compliance=compliance, collide=collide)
        return self._add_framed(joint, a, b, name, point, rotation)

    def add_planar_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        normal: Sequence[float],
        point: Sequence[float] | None = None,
        limits: Limits = None,
        stiffness: PerDof = 0.0,
        rest: PerDof = 0.0,
        damping: PerDof = 0.0,
        friction: PerDof = 0.0,
        armature: PerDof = 0.0,
        motor: Motor | Sequence[Motor | None] | None = None,
        compliance: float = 0.0,
        collide: bool = False,
        name: str | None = None,
    ) -> int:
        """A point of A stays in a plane of B: slides 0 and 1 (m), then a hinge about its normal.

        point: of A, by default the origin of A. The slides complete the normal to a right-handed frame.
        """
        dofs = _dofs(
            name, ["slide", "slide", "hinge"], limits, motor, (stiffness, rest, damping, friction, armature)
        )
        dofs = (replace(dofs[0], axis=(1.0, 0.0, 0.0)), replace(dofs[1], axis=(0.0, 1.0, 0.0)), dofs[2])
        joint = Joint(dofs=dofs, compliance=compliance, collide=collide)
        return self._add_framed(joint, a, b, name, point, _to_axis(_who(name, "normal"), normal))

    def add_fixed_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Sequence[float] | None = None,
        compliance: float = 0.0,
        collide: bool = False,
        name: str | None = None,
    ) -> int:
        """A weld. point: where reactions are reported, by default the origin of A."""
        return self._add_framed(Joint(compliance=compliance, collide=collide), a, b, name, point, None)

    def add_point_on_line_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point: Sequence[float],
        axis: Sequence[float],
        limits: Limits = None,
        stiffness: float = 0.0,
        rest: float = 0.0,
        damping: float = 0.0,
        friction: float = 0.0,
        armature: float = 0.0,
        motor: Motor | None = None,
        compliance: float = 0.0,
        collide: bool = False,
        name: str | None = None,
    ) -> int:
        """A point of A stays on a line of B through its initial place; A turns freely about the point."""
        dofs = _dofs(name, ["slide"], limits, motor, (stiffness, rest, damping, friction, armature))
        joint = Joint(dofs=dofs, spherical=True, compliance=compliance, collide=collide)
        return self._add_framed(joint, a, b, name, point, _to_axis(_who(name, "axis"), axis))

    def add_distance_joint(
        self,
        a: int | str,
        b: int | str | None = None,
        *,
        point_a: Sequence[float],
        point_b: Sequence[float],
        length: float | None = None,
        limits: Limits = None,
        compliance: float = 0.0,
        collide: bool = False,
        name: str | None = None,
    ) -> int:
        """The distance of a point of A and a point of B stays the same (a rod) or within limits (a rope).

        length: m, by default the initial distance. limits: (shortest, longest), None for no bound.
        """
        name = self._new_name("joint", name)
        who = f'joint "{name}"'
        at_a, at_b = vector3(f"{who}: point_a", point_a), vector3(f"{who}: point_b", point_b)
        if limits is not None and length is not None:
            raise InputError(f"{who}: length and limits are both given; keep one of them")
        if limits is None:
            fixed = math.dist(at_a, at_b) if length is None else number(f"{who}: length", length)
            limits = (fixed, fixed)
            if not fixed > 0:
                raise InputError(f"{who}: the length is {fixed:g}; it must be positive, or use a ball joint")
        lower, upper = _bounds(who, limits)
        lower = max(lower, 0.0) if lower == -math.inf else lower
        if not 0 <= lower <= upper:
            raise InputError(f"{who}: limits are ({lower:g}, {upper:g}); they must be 0 <= lower <= upper")
        index_a, index_b = self._ends(who, a, b)
        joint = Joint(
            name,
            "distance",
            index_a,
            index_b,
            self._local(index_a, Transform(at_a)),
            self._local(index_b, Transform(at_b)),
            lower_distance=lower,
            upper_distance=upper,
            compliance=compliance,
            collide=collide,
        )
        return self._append("joint", self._joints, joint)

    def add_joint(self, joint: Joint) -> int:
        """Add a general joint; its bodies may be names, its frames are in the bodies."""
        if not isinstance(joint, Joint):
            raise InputError(f"joint is {joint!r}; give a Joint")
        name = self._new_name("joint", joint.name or None)
        a, b = self._ends(f'joint "{name}"', joint.body_a, joint.body_b)
        for k, dof in enumerate(joint.dofs):
            _require_order(f'joint "{name}", degree of freedom {k}', dof.lower, dof.upper)
        return self._append("joint", self._joints, replace(joint, name=name, body_a=a, body_b=b))

    def _add_framed(
        self,
        joint: Joint,
        a: int | str,
        b: int | str | None,
        name: str | None,
        point: Sequence[float] | None,
        rotation: Quaternion | None,
    ) -> int:
        """Gives the joint its frames: at `point` in the world, turned by `rotation`, B's axes if None."""
        name = self._new_name("joint", name)
        who = f'joint "{name}"'
        index_a, index_b = self._ends(who, a, b)
        origin = self._bodies[index_a].pose.position if point is None else vector3(f"{who}: point", point)
        if rotation is None:
            rotation = Transform().rotation if index_b == WORLD else self._bodies[index_b].pose.rotation
        for dof in joint.dofs:
            _require_order(who, dof.lower, dof.upper)
        frame = Transform(origin, rotation)
        joint = replace(
            joint,
            name=name,
            body_a=index_a,
            body_b=index_b,
            frame_a=self._local(index_a, frame),
            frame_b=self._local(index_b, frame),
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

    def _ends(self, who: str, a: int | str | None, b: int | str | None) -> tuple[int, int]:
        ends = []
        for body in (a, b):
            try:
                ends.append(WORLD if type(body) is int and body == WORLD else self._body(body))
            except InputError as error:
                raise InputError(f"{who}: {error}") from None
        if ends[0] == WORLD:
            raise InputError(f"{who}: body A must not be the world; swap the bodies")
        if ends[0] == ends[1]:
            raise InputError(
                f'{who} joins body "{self._bodies[ends[0]].name}" to itself; it needs two bodies'
            )
        return ends[0], ends[1]

    @abstractmethod
    def _body(self, body: int | str | None) -> int:
        """The index of a body given by index or name."""

    @abstractmethod
    def _new_name(self, kind: str, name: str | None) -> str:
        """The name, or one made up, that no other thing of its kind has."""

    @abstractmethod
    def _append(self, kind: str, things: list[Any], thing: Any) -> int:
        """Adds a thing; returns its index."""


def _who(name: str | None, what: str) -> str:
    """What an error is about; joints without a name have none yet."""
    return what if name is None else f'joint "{name}": {what}'


def _to_axis(what: str, axis: Sequence[float]) -> Quaternion:
    return rotation_to_z(unit_vector(what, axis))


def _dofs(
    name: str | None, kinds: Sequence[str], limits: Limits, motor: Any, values: Sequence[PerDof]
) -> tuple[Dof, ...]:
    """Degrees of freedom along the third axis with the options of the add_*_joint functions."""
    count = len(kinds)
    columns = [_spread(what, value, count) for what, value in zip(_FIELDS, values, strict=True)]
    bounds = [limits] if count == 1 else _spread("limits", limits, count)
    motors = _spread("motor", motor, count)
    made = []
    for k, kind in enumerate(kinds):
        lower, upper = (
            (-math.inf, math.inf)
            if bounds[k] is None
            else _bounds("joint" if name is None else f'joint "{name}"', bounds[k])
        )
        if motors[k] is not None and not isinstance(motors[k], Motor):
            raise InputError(f"motor is {motors[k]!r}; give a Motor")
        options = {name: column[k] for name, column in zip(_FIELDS, columns, strict=True)}
        made.append(Dof(kind, lower=lower, upper=upper, motor=motors[k] or Motor(), **options))
    return tuple(made)


def _spread(what: str, value: Any, count: int) -> list[Any]:
    """One value per degree of freedom."""
    if value is None or isinstance(value, Motor | str) or not hasattr(value, "__len__"):
        return [value] * count
    if len(value) != count:
        raise InputError(f"{what} has {len(value)} entries; the joint has {count} degrees of freedom")
    return list(value)


def _bounds(who: str, limits: Any) -> tuple[float, float]:
    """(lower, upper) with None for no bound."""
    try:
        lower, upper = limits
    except (TypeError, ValueError):
        raise InputError(f"{who}: limits are {limits!r}; give (lower, upper), None for no bound") from None
    return (
        -math.inf if lower is None else number(f"{who}: lower limit", lower, infinite=True),
        math.inf if upper is None else number(f"{who}: upper limit", upper, infinite=True),
    )


def _require_order(who: str, lower: float, upper: float) -> None:
    if lower > upper:
        raise InputError(f"{who}: the lower limit {lower:g} exceeds the upper one {upper:g}; swap them")
