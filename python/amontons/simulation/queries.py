"""Questions about the present state: sites, sensors, rays."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, Numbers, Vector3, sequence, vector3
from ..errors import InputError
from ..model.model import Model
from ..model.parts import WORLD
from . import sensors
from .coordinates import GeneralisedCoordinates
from .links import link_reactions, moving_frames
from .outcome import Table
from .rays import cast_rays, geoms_of


class RayHit(NamedTuple):
    """The first hit of a ray."""

    distance: float
    """m; infinite where it meets nothing"""
    geom: int
    """-1 where it meets nothing"""
    normal: Vector3
    """of the surface there, outwards, world axes"""
    link: int = -1
    """of the geom, an index of `Model.link_names`; -1 is the world"""


class Queries(GeneralisedCoordinates):
    """Queries of `Simulation` about the present state beside coordinates."""

    _core: _core.Simulation
    _model: Model
    _plan: sensors.Plan | None = None
    """how the sensors are read, made when they are first"""

    @property
    def sites(self) -> Table:
        """All sites: body, position (m), orientation (w, x, y, z), velocities of the site (world axes).

        A structured array; `site(name)` is one row.
        """
        return moving_frames(self._core, self._model._site_places)

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
    def link_reactions(self) -> Table:
        """Force (N) and torque (N m) of the fixed joint that holds each link on its body, world axes.

        Fields: link (an index of `Model.link_names`), body, point (m, the origin of the link now; the torque
        is about it), force, torque. A row for each of `Model.links`: means over the last step, from the
        balance of all that hangs on the joint. Loads of `state.forces` act on the body, not on a link.
        """
        return link_reactions(self._core, self._model, self.qdd)

    def site(self, site: int | str) -> Table:
        """One row of `sites`, by index or name."""
        k = self._model.site_index(site)
        return moving_frames(self._core, self._model._site_places, slice(k, k + 1))[0]

    def site_jacobian(self, site: int | str) -> Array:
        """(6, nv): velocity of a site (3 rows), then its angular velocity, per unit of qd; world axes."""
        found = self._model.sites[self._model.site_index(site)]
        return self.jacobian(None if found.body == WORLD else found.body, found.frame.position)

    @property
    def sensors(self) -> sensors.Readings:
        """Present readings of the sensors: arrays by name, and all of them as `array`.

        Forces and accelerations are means over the last step. docs/models.md lists the kinds.
        """
        if self._plan is None:
            self._plan = sensors.plan_of(self._model)
        return sensors.read(self._core, self._model, self._plan, self.qdd)

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
