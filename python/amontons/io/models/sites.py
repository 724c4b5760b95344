"""Sites, with the volume that touch sensors feel in."""

from __future__ import annotations

from ...model.sensing import Site
from ...model.transforms import Transform
from .bodies import Bodies, unique_names
from .compiled import Compiled, transform
from .geoms import primitive


def read_sites(compiled: Compiled, bodies: Bodies) -> tuple[Site, ...]:
    m = compiled.model
    names = unique_names(compiled, "site", m.nsite)
    volumes = [primitive(compiled, m.site_type[s], m.site_size[s].tolist()) for s in range(m.nsite)]
    return tuple(Site(names[s], *site_frame(compiled, bodies, s), volumes[s]) for s in range(m.nsite))


def site_frame(compiled: Compiled, bodies: Bodies, site: int) -> tuple[int, Transform]:
    """Our body that carries a site, and the site's frame in it."""
    m = compiled.model
    body = int(m.site_bodyid[site])
    return bodies.at(body), bodies.frame[body] @ transform(m.site_pos[site], m.site_quat[site])
