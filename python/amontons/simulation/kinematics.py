"""Kinematics of the present state: coordinates by name, links, sites, Jacobians, rays, inverse kinematics."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..checks import Array, Numbers, Vector3, flag, integer, option, positive, quaternion, sequence, vector3
from ..errors import InputError
from ..model.parts import WORLD
from .coordinates import degree, entry
from .links import moving_frames
from .part import Part
from .rays import cast_rays, geoms_of
from .step_report import Table

if TYPE_CHECKING:
    from . import inverse_kinematics as ik


class RayHit(NamedTuple):
    """The first hit of a ray.

    >>> simulation = Simulation(scenes.make("incline", angle=0))
    >>> hit = simulation.kinematics.ray((2, 0, 3), (0, 0, -1))
    >>> hit.distance
    3.0
    """

    distance: float
    """m; infinite where it meets nothing"""
    geom: int
    """-1 where it meets nothing"""
    normal: Vector3
    """of the surface there, outwards, world axes"""
    link: int = -1
    """of the geom, an index of `Model.link_names`; -1 is the world"""


class Kinematics(Part):
    """`Simulation.kinematics`: where everything is at present, and how it moves.

    >>> simulation = Simulation(scenes.make("pendulum"))
    >>> simulation.set_q({"hinge": 0.5})
    >>> simulation.kinematics.coordinate("hinge")
    0.49999999999999994
    """

    def coordinate(self, joint: int | str, dof: int = 0) -> float:
        """The coordinate of a joint's degree of freedom (m, or rad with full turns counted).

        joint: index or name, or the name of a degree of freedom; also of joints that close loops.
        """
        joint, dof = degree(self._model, joint, dof)
        values = self._model.tree.joint_coordinates(self._core)
        return float(values[self._model.dof_index(joint, dof)])

    def rate(self, joint: int | str, dof: int = 0) -> float:
        """The velocity of a joint's degree of freedom (m/s, rad/s); InputError if it closes a loop."""
        return float(self._model.tree.coordinates(self._core)[1][entry(self._model, joint, dof)])

    def acceleration(self, joint: int | str, dof: int = 0) -> float:
        """The acceleration of a joint's degree of freedom over the last step (m/s^2, rad/s^2); as `rate`."""
        return float(self._model.tree.rates(self._core)[entry(self._model, joint, dof)])

    @property
    def links(self) -> Table:
        """All bodies, then the links that are parts of them, in the order of `Model.link_names`.

        Fields: body, position (m), orientation (w, x, y, z), velocities of the origin (world axes). A
        structured array; `link(name)` is one row.
        """
        return moving_frames(self._core, self._model._link_places)

    def link(self, link: int | str) -> Table:
        """One row of `links`, by index or name: the pose and motion of a link of a file, or of a body."""
        k = self._model.link_index(link)
        return moving_frames(self._core, self._model._link_places, slice(k, k + 1))[0]

    @property
    def sites(self) -> Table:
        """All sites: body, position (m), orientation (w, x, y, z), velocities of the site (world axes).

        A structured array; `site(name)` is one row.
        """
        return moving_frames(self._core, self._model._site_places)

    def site(self, site: int | str) -> Table:
        """One row of `sites`, by index or name."""
        k = self._model.site_index(site)
        return moving_frames(self._core, self._model._site_places, slice(k, k + 1))[0]

    def jacobian(self, body: int | str | None, point: Numbers | None = None) -> Array:
        """(6, nv): velocity of a point of a body or link (3 rows), then its angular velocity, over qd.

        In world axes. point: in its frame (m), by default the origin. `jacobian(...) @ qd` is the velocity
        but for what a kinematic body brings along.

        >>> simulation = Simulation(scenes.make("pendulum"))
        >>> simulation.kinematics.jacobian(0).shape  # linear rows, then angular ones
        (6, 1)
        """
        named = body is not None and not (isinstance(body, str) and body == "world")
        index = self._model.link_index(body) if named else WORLD
        at = (0.0, 0.0, 0.0) if point is None else vector3("point", point)
        if index >= len(self._model.bodies):
            link = self._model.links[index - len(self._model.bodies)]
            index, at = link.body, link.frame(at)
        return self._model.tree.jacobian(self._core, index, at)

    def jacobians(self) -> Array:
        """(n, 6, nv): `jacobian(link)` of all n bodies and links, in the order of `Model.link_names`."""
        bodies, frames = self._model._link_places
        return self._model.tree.jacobians(self._core, bodies, frames)

    def site_jacobian(self, site: int | str) -> Array:
        """(6, nv): velocity of a site (3 rows), then its angular velocity, per unit of qd; world axes."""
        found = self._model.sites[self._model.site_index(site)]
        return self.jacobian(None if found.body == WORLD else found.body, found.frame.position)

    def tendon_jacobian(self, tendon: int | str) -> Array:
        """(nv,): the rate of a tendon's length over qd."""
        return self._model.tree.tendon_jacobian(self._core, self._model.tendon_index(tendon))

    def ray(self, origin: Numbers, direction: Numbers, *, exclude: Iterable[int | str | None] = ()) -> RayHit:
        """The first geom that a ray meets: distance, geom, normal and link.

        origin, direction: in the world (m; of any length, not zero). exclude: bodies or links, by index or
        name, that the ray passes through; None is the world. Geoms that touch nothing count too. From inside
        a shape it is where the ray leaves; planes are met from above only.
        """
        distances, geoms, normals = self.rays(
            [vector3("origin", origin)], [vector3("direction", direction)], exclude=exclude
        )
        geom = int(geoms[0])
        link = self._model.geom_links[geom] if geom >= 0 else -1
        return RayHit(float(distances[0]), geom, tuple(normals[0].tolist()), link)

    def rays(
        self, origins: ArrayLike, directions: ArrayLike, *, exclude: Iterable[int | str | None] = ()
    ) -> tuple[Array, Array, Array]:
        """Many rays at once: origins and directions (n, 3); distances (n,), geoms (n,), normals (n, 3)."""
        starts, along = np.broadcast_arrays(_points("origins", origins), _points("directions", directions))
        lengths = np.linalg.norm(along, axis=1, keepdims=True)
        if not (lengths > 0).all():
            raise InputError("a direction is zero; give one of any other length")
        hidden = {-1 if b in (None, "world", -1) else self._model.link_index(b) for b in _listed(exclude)}
        return cast_rays(self._core, starts, along / lengths, geoms_of(self._model, hidden))

    def solve_ik(
        self,
        site: int | str,
        position: Numbers | None = None,
        orientation: Numbers | None = None,
        *,
        coordinates: Iterable[str] | None = None,
        tolerance: float | None = None,
        max_iterations: int = 100,
        attempts: int = 10,
        apply: bool = False,
    ) -> ik.IkSolution:
        """Coordinates at which a site is at a position, has an orientation, or both, within joint limits.

        By damped least squares, beginning at the present pose, with closed loops kept closed. Says whether it
        converged; `q` of the solution is the nearest that was found. Nothing of the simulation changes.

        site: index or name; also the name of a link or body, whose frame is meant.
        position: (m), orientation: (w, x, y, z), both in the world; at least one of them.
        coordinates: names of those that may move, by default all but floating bases.
        tolerance: of the position (m), by default Model.length / 1e6; angles times Model.length.
        max_iterations: of an attempt. attempts: those after the first begin at poses anywhere within the
            limits, always the same ones.
        apply: set `q` to what was found, converged or not.

        Raises InputError naming the site, the coordinate or the argument.
        """
        from . import inverse_kinematics as ik

        body, frame = ik.frame_of(self._model, site)
        if position is None and orientation is None:
            raise InputError("solve_ik needs a position, an orientation or both")
        goal = ik.Goal(
            body,
            frame,
            None if position is None else np.array(vector3("position", position)),
            None if orientation is None else np.array(quaternion("orientation", orientation)),
        )
        near = self._model.length / 1e6 if tolerance is None else positive("tolerance", tolerance)
        effort = ik.Effort(
            near, int(option("max_iterations", max_iterations)), integer("attempts", attempts, 1)
        )
        apply = flag("apply", apply)
        arm = ik.Arm(self._core.copy(), self._model, ik.moving_entries(self._model, coordinates))
        found = ik.solve(arm, goal, effort)
        if apply:
            self._model.tree.set_q(self._core, found.q, np.zeros(self._model.nv, np.uint8))
        return found


def _listed(bodies: Any) -> list[int | str | None]:
    if bodies is None:
        return []
    return (
        [bodies] if isinstance(bodies, str) or hasattr(bodies, "__index__") else sequence("exclude", bodies)
    )


def _points(what: str, values: ArrayLike) -> Array:
    try:
        array = np.atleast_2d(np.asarray(values, dtype=np.float64))
    except Exception:  # NumPy asks the object, which may raise anything
        raise InputError(f"{what} must be numbers of shape (n, 3)") from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{what} has the shape {array.shape}; it must be (n, 3)")
    if not np.isfinite(array).all():
        raise InputError(f"{what} has an entry that is not finite")
    return array
