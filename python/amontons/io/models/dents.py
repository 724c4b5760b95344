"""Meshes with dents: a hull collides in their place, which a list says, or convex parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ...checks import listed, number
from ...errors import InputError
from ...model.decomposing import decompose
from ...model.model import Model
from ...model.parts import WORLD
from ...model.shapes import Mesh, Shape
from .issues import Issues

SHARE = 0.01
"""Error of a decomposition over the diagonal of the mesh, where the user gives none"""


def with_parts(model: Model, issues: Issues, error: bool | float) -> tuple[Model, list[int]]:
    """The model with convex parts in place of hulls that fill dents, and the former geom of each geom.

    error: False lists the hulls; True or a length (m) decomposes their meshes. A note has the deviations.
    """
    parts: dict[int, Sequence[Shape]] = {}
    notes: list[str] = []
    for k, geom in enumerate(model.geoms):
        dent = issues.dents.get(id(geom.shape))
        if dent is None:
            continue
        if error is False:
            issues.add(dent.where, dent.what, dent.effect)
            continue
        if geom.body == WORLD or model.bodies[geom.body].motion == "static":
            parts[k] = (dent.mesh,)
            continue
        depth = _error(dent.mesh, error)
        try:
            found = decompose(dent.mesh, error=depth)
        except InputError as reason:
            if "needs CoACD" in str(reason):
                raise
            issues.add(dent.where, f"{dent.what}; {reason}", dent.effect)
            continue
        parts[k] = found.hulls
        notes.append(f'"{geom.name}" {len(found.hulls)} parts, {1e3 * found.deviation:.3g} mm')
    if notes:
        issues.notes.append(
            f"meshes collide as convex parts, which reach outside of them by at most: {listed(notes)}"
        )
    return _divided(model, parts) if parts else (model, list(range(len(model.geoms))))


def _error(mesh: Mesh, error: bool | float) -> float:
    if error is True:
        return SHARE * float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    length = number("decompose", error)
    if not length > 0:
        raise InputError(f"decompose is {length:g}; give a length in m, > 0, or True")
    return length


def _divided(model: Model, parts: dict[int, Sequence[Shape]]) -> tuple[Model, list[int]]:
    """Each part is a geom of its own, with the name of the former one and a number."""
    geoms, former = [], list[int]()
    places: list[range] = []
    for k, geom in enumerate(model.geoms):
        start = len(geoms)
        if k in parts:
            named = [f"{geom.name}.{i}" for i in range(len(parts[k]))] if len(parts[k]) > 1 else [geom.name]
            geoms += [replace(geom, shape=s, name=name) for s, name in zip(parts[k], named, strict=True)]
        else:
            geoms.append(geom)
        places.append(range(start, len(geoms)))
        former += [k] * len(places[-1])
    pairs = tuple(
        replace(pair, geom_a=a, geom_b=b)
        for pair in model.pair_materials
        for a, b in product(places[pair.geom_a], places[pair.geom_b])
    )
    apart = tuple((a, b) for pair in model.excluded_geoms for a, b in product(*(places[k] for k in pair)))
    return replace(model, geoms=tuple(geoms), pair_materials=pairs, excluded_geoms=apart), former
