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
from .outcome import Table
from .rays import cast_rays

SITES = np.dtype(
    [
        ("body", np.int32),
        ("position", np.float64, 3),
        ("orientation", np.float64, 4),
        ("linear_velocity", np.float64, 3),
        ("angular_velocity", np.float64, 3),
    ]
)
"""The fields of Simulation.sites."""


class RayHit(NamedTuple):
    """What a ray meets first."""

    distance: float
    """m; infinite where it meets nothing"""
    geom: int
    """-1 where it meets nothing"""
    normal: Vector3
    """of the surface there, outwards, world axes"""


class Queries(GeneralisedCoordinates):
    """What `Simulation` answers about the present state beside coordinates."""

    _core: _core.Simulation
    _model: Model
    _plan: sensors.Plan | None = None
    """how the sensors are read, made when they are first"""

    @property
    def sites(self) -> Table:
        """All sites: body, position (m), orientation (w, x, y, z), velocities of the site (world axes).

        A structured array; `site(name)` is one row.
        """
        sites, tree = self._model.sites, self._model.tree
        table = np.zeros(len(sites), SITES)
        table["body"] = [site.body for site in sites]
        frames = sensors.frame_rows([site.frame for site in sites])
        rows, _ = tree.observe(self._core, np.zeros(tree.nv), np.ascontiguousarray(table["body"]), frames)
        seen = sensors.Frames(rows)
        table["position"], table["orientation"] = seen.position, seen.orientation
        table["linear_velocity"], table["angular_velocity"] = seen.velocity, seen.angular_velocity
        return table

    def site(self, site: int | str) -> Table:
        """One row of `sites`, by index or name."""
        return self.sites[self._model.site_index(site)]

    def site_jacobian(self, site: int | str) -> Array:
        """(6, nv): velocity of a site (3 rows), then its angular velocity, per unit of qd; world axes."""
        found = self._model.sites[self._model.site_index(site)]
        return self.jacobian(None if found.body == WORLD else found.body, found.frame.position)

    @property
    def sensors(self) -> sensors.Readings:
        """What the sensors of the model read now: arrays by name, and all of them as `array`.

        Forces and accelerations are means over the last step. docs/models.md lists the kinds.
        """
        if self._plan is None:
            self._plan = sensors.plan_of(self._model)
        return sensors.read(self._core, self._model, self._plan, self.qdd)

    def ray(self, origin: Numbers, direction: Numbers, *, exclude: Iterable[int | str | None] = ()) -> RayHit:
        """The first geom that a ray meets: distance, geom and normal.

        origin, direction: in the world (m; of any length, not zero). exclude: bodies, by index or name, that
        the ray passes through; None is the world. Geoms that touch nothing count too. From inside a shape it
        is where the ray leaves; planes are met from above only.
        """
        distances, geoms, normals = self.rays(
            [vector3("origin", origin)], [vector3("direction", direction)], exclude=exclude
        )
        return RayHit(float(distances[0]), int(geoms[0]), tuple(normals[0].tolist()))

    def rays(
        self, origins: ArrayLike, directions: ArrayLike, *, exclude: Iterable[int | str | None] = ()
    ) -> tuple[Array, Array, Array]:
        """Many rays at once: origins and directions (n, 3); distances (n,), geoms (n,), normals (n, 3)."""
        starts, along = np.broadcast_arrays(_points("origins", origins), _points("directions", directions))
        lengths = np.linalg.norm(along, axis=1, keepdims=True)
        if not (lengths > 0).all():
            raise InputError("a direction is zero; give one of any other length")
        hidden = {-1 if b in (None, "world", -1) else self._model.body_index(b) for b in _listed(exclude)}
        return cast_rays(self._core, self._model, starts, along / lengths, hidden)


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
