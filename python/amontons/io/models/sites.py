"""Sites, with the volume that touch sensors feel in."""

from __future__ import annotations

from ...model import shapes
from ...model.sensing import Site
from ...model.shapes import Shape
from ...model.transforms import Transform
from .bodies import Bodies, unique_names
from .compiled import Compiled, transform


def read_sites(compiled: Compiled, bodies: Bodies) -> tuple[Site, ...]:
    m = compiled.model
    names = unique_names(compiled, "site", m.nsite)
    return tuple(
        Site(names[s], *site_frame(compiled, bodies, s), _shape(compiled, s)) for s in range(m.nsite)
    )


def site_frame(compiled: Compiled, bodies: Bodies, site: int) -> tuple[int, Transform]:
    """Our body that carries a site, and the site's frame in it."""
    m = compiled.model
    body = int(m.site_bodyid[site])
    return bodies.at(body), bodies.frame[body] @ transform(m.site_pos[site], m.site_quat[site])


def _shape(compiled: Compiled, site: int) -> Shape:
    m, kind = compiled.model, compiled.mujoco.mjtGeom
    size = tuple(m.site_size[site].tolist())
    match m.site_type[site]:
        case kind.mjGEOM_CAPSULE:
            return shapes.Capsule(size[0], size[1])
        case kind.mjGEOM_ELLIPSOID:
            return shapes.Ellipsoid(size)
        case kind.mjGEOM_CYLINDER:
            return shapes.Cylinder(size[0], size[1])
        case kind.mjGEOM_BOX:
            return shapes.Box(size)
    return shapes.Sphere(size[0])
