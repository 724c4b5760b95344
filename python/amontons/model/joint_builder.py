"""The joints of ModelBuilder. The builder of the compiled module places their frames."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Unpack

from .. import _core, checks
from ..checks import Numbers, about, changed, number, shown, unit_vector
from ..errors import InputError
from ..guidance import guided
from .collection import Collection
from .compiled import Parts
from .joint_options import (
    BallOptions,
    DofOptions,
    JointOptions,
    Limits,
    ball_dof,
    bounds,
    dofs_of,
    joint_fields,
    require_options,
)
from .parts import OWN, Joint
from .references import Place
from .transforms import ORIGIN

Key = int | str
"""A body or link by index or name."""
CHECKS = {"point": checks.point, "point_a": checks.point, "point_b": checks.point} | dict.fromkeys(
    ("length", "clearance", "guide_length", "journal_radius", "clearance_friction"), number
)
"""Those of arguments that are no directions."""
AXES = {"normal": "axis", "axis_1": "axis"}
"""Other names of what is the axis of the compiled builder."""


@guided
class JointBuilder(Collection):
    """The add_*_joint functions: points and axes in world coordinates at the initial poses of the bodies.

    Every joint moves body A relative to body B; b=None is the world. Coordinates are zero at the initial
    poses. Options of all joints: compliance of the locked directions (m/N, 0 is rigid), collide (whether the
    two bodies may touch; the shapes of the world may in any case), name. Options of each degree of freedom:
    limits (lower, upper), None for no bound; stiffness, rest, damping of a spring and damper; friction (the
    largest force or torque of dry friction), armature (inertia of the drive), motor. The options
    friction_static and stribeck_speed are as in `Material`. A joint of several degrees of freedom takes one
    value for all of them, or a sequence with one per degree of freedom.
    """

    def add_ball_joint(
        self, a: Key, b: Key | None = None, *, point: Numbers, **options: Unpack[BallOptions]
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
        return self._add("ball", BallOptions, locals())

    def add_revolute_joint(
        self,
        a: Key,
        b: Key | None = None,
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
        return self._add("revolute", DofOptions, locals())

    def add_prismatic_joint(
        self,
        a: Key,
        b: Key | None = None,
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
        return self._add("prismatic", DofOptions, locals())

    def add_cylindrical_joint(
        self, a: Key, b: Key | None = None, *, point: Numbers, axis: Numbers, **options: Unpack[DofOptions]
    ) -> int:
        """A moves along the axis (degree of freedom 0, m) and turns about it (1, rad)."""
        return self._add("cylindrical", DofOptions, locals())

    def add_universal_joint(
        self,
        a: Key,
        b: Key | None = None,
        *,
        point: Numbers,
        axis_1: Numbers,
        axis_2: Numbers,
        **options: Unpack[DofOptions],
    ) -> int:
        """A cross: A turns about axis_2, fixed in A, which turns about axis_1, fixed in B (angles, rad).

        The axes need not be perpendicular, but they must not be parallel.
        """
        return self._add("universal", DofOptions, locals())

    def add_planar_joint(
        self,
        a: Key,
        b: Key | None = None,
        *,
        normal: Numbers,
        point: Numbers | None = None,
        **options: Unpack[DofOptions],
    ) -> int:
        """A point of A stays in a plane of B: slides 0 and 1 (m), then a hinge about its normal.

        point: of A, by default the origin of A. The slides complete the normal to a right-handed frame.
        """
        return self._add("planar", DofOptions, locals())

    def add_fixed_joint(
        self, a: Key, b: Key | None = None, *, point: Numbers | None = None, **options: Unpack[JointOptions]
    ) -> int:
        """A weld. point: where reactions are reported, by default the origin of A."""
        return self._add("fixed", JointOptions, locals())

    def add_point_on_line_joint(
        self, a: Key, b: Key | None = None, *, point: Numbers, axis: Numbers, **options: Unpack[DofOptions]
    ) -> int:
        """A point of A stays on a line of B through its initial place; A turns freely about the point."""
        return self._add("point_on_line", DofOptions, locals())

    def add_distance_joint(
        self,
        a: Key,
        b: Key | None = None,
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
        return self._add("distance", JointOptions, locals())

    def add_joint(self, joint: Joint) -> int:
        """Add a general joint; its bodies may be names, also of links, its frames are in them."""
        if not isinstance(joint, Joint):
            raise InputError(f"joint is {shown(joint)}; give a Joint")
        return self.add(joint)

    def _add(self, kind: str, known: Any, given: Mapping[str, Any]) -> int:
        """Adds a joint of a kind of the compiled builder. given: the arguments of an add_*_joint function."""
        a, b, options = given["a"], given["b"], given["options"]
        require_options(f"add_{kind}_joint", options, known)
        name = self._new_name("joint", options.get("name"))
        who = f'joint "{name}"'
        new: dict[str, Any] = {"name": name}
        for key, value in given.items():
            if key not in ("self", "a", "b", "limits", "options") and value is not None:
                new[AXES.get(key, key)] = CHECKS.get(key, unit_vector)(f"{who}: {key}", value)
        with about(who):
            fields = joint_fields(options)
            if known is BallOptions:
                new["dof"] = ball_dof(options)
            elif kind != "distance":
                new["dofs"] = dofs_of(_core.dofs_of_kind(kind), options)
            elif given["limits"] is not None:
                lower, upper = bounds(given["limits"])
                new["lower"] = 0.0 if lower == -math.inf else number("shortest", lower)
                new["upper"] = number("longest", upper, infinite=True)
            ends = [self._mount(body, OWN) for body in (a, b)]
        self._require_two(who, ends[0][0], ends[1][0])
        joint = _core.joint_between(kind, *map(self._end, ends), Parts().make, **new)
        return self._append(changed(joint, link_a=ends[0][2], link_b=ends[1][2], **fields))

    def _end(self, place: Place) -> _core.JointEnd:
        body, frame, _ = place
        both = self.pose(body), frame or ORIGIN
        return _core.JointEnd(body, *((at.position, at.rotation) for at in both))
