"""Which geoms touch, and with which friction: MuJoCo's rules in terms of masks, exclusions and pairs."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, product

import numpy as np

from ...checks import Array
from ...model.parts import Material, PairMaterial
from .bodies import Bodies, fixed_groups
from .compiled import Compiled
from .geoms import BITS, Geoms, coefficients, with_friction

Pairs = set[tuple[int, int]]
Coefficients = tuple[float, ...]
"""Sliding friction, torsional and rolling friction (m)."""


def excluded_bodies(compiled: Compiled, bodies: Bodies) -> Pairs:
    """<exclude>, and the rule that a body does not touch its parent.

    What is fixed to each other counts as one body, and the world touches its children (MuJoCo, Computation,
    Collision, Selection, filter 3).
    """
    m = compiled.model
    groups = fixed_groups(compiled, bodies)
    found: Pairs = set()
    for root, members in groups.items():
        if root == 0:
            continue
        found.update(combinations(members, 2))
        parent = int(m.body_weldid[m.body_parentid[root]])
        if parent != 0 and compiled.enabled("filterparent"):
            found.update(product(members, groups[parent]))
    for e, signature in enumerate(m.exclude_signature):
        pair = int(signature) >> 16, int(signature) & 0xFFFF
        for body in pair:
            if bodies.owner[body] != body:
                compiled.refuse(
                    "exclude",
                    e,
                    f'"{compiled.name("body", body)}" has no mass and is part of '
                    f'"{compiled.name("body", bodies.owner[body])}" here, which touches nothing of the other',
                )
        a, b = (bodies.at(body) for body in pair)
        if a != b:
            found.add((a, b))
    return {(min(p), max(p)) for p in found}


def read_contacts(
    compiled: Compiled, bodies: Bodies, geoms: Geoms
) -> tuple[list[PairMaterial], list[tuple[int, int]]]:
    """Pair materials and exclusions; <pair> may add bits to the masks of geoms."""
    excluded = excluded_bodies(compiled, bodies)
    pairs = _combined(compiled, geoms)
    if compiled.enabled("contact"):
        pairs |= _explicit(compiled, geoms, excluded)
    materials = [
        PairMaterial(a, b, Material(friction=mu, torsional_friction=torsion, rolling_friction=rolling))
        for (a, b), (mu, torsion, rolling) in sorted(pairs.items())
    ]
    return materials, sorted(excluded)


def _combined(compiled: Compiled, geoms: Geoms) -> dict[tuple[int, int], Coefficients]:
    """The coefficients of pairs for which MuJoCo's rule is not the larger of the materials of both.

    The geom of higher priority decides alone. Of equal ones the larger condim counts, and of each coefficient
    the larger one, whether or not its geom's own condim asks for it.
    """
    m = compiled.model
    ids = np.array(list(geoms.index), dtype=int)
    friction, dim, priority = m.geom_friction[ids], m.geom_condim[ids], m.geom_priority[ids]
    if (dim == 1).all():
        geoms.geoms[:] = [with_friction(geom, 0.0) for geom in geoms.geoms]
        return {}
    if np.ptp(dim) == 0 and np.ptp(priority) == 0:
        return {}
    higher = priority[:, None] - priority[None, :]

    def of_pairs(values: Array) -> Array:
        a, b = values[:, None], values[None, :]
        return np.where(higher > 0, a, np.where(higher < 0, b, np.maximum(a, b)))

    rule = coefficients(of_pairs(dim), np.stack([of_pairs(column) for column in friction.T], axis=-1))
    own = coefficients(dim, friction)
    own[:, 0] = friction[:, 0]
    differs = (rule != np.maximum(own[:, None], own[None, :])).any(axis=-1)
    a, b = np.nonzero(np.triu(differs, 1))
    return {
        (i, j): tuple(rule[i, j].tolist())
        for i, j in zip(a.tolist(), b.tolist(), strict=True)
        if _may_touch(geoms, i, j)
    }


def _may_touch(geoms: Geoms, i: int, j: int) -> bool:
    a, b = geoms.geoms[i], geoms.geoms[j]
    return a.body != b.body and bool(a.category & b.mask or b.category & a.mask)


def _explicit(compiled: Compiled, geoms: Geoms, excluded: Pairs) -> dict[tuple[int, int], Coefficients]:
    """<pair>: friction of its own, and contact even if the masks of the geoms do not ask for it."""
    m = compiled.model
    found: dict[tuple[int, int], Coefficients] = {}
    bits: dict[int, int] = {}  # by first geom: the bit that stands for its pairs
    for p in range(m.npair):
        a, b = (geoms.index.get(int(g[p])) for g in (m.pair_geom1, m.pair_geom2))
        if a is None or b is None:
            continue  # the geom is listed already
        bodies = sorted((geoms.geoms[a].body, geoms.geoms[b].body))
        if bodies[0] == bodies[1] or (bodies[0], bodies[1]) in excluded:
            what = "the same body" if bodies[0] == bodies[1] else "bodies that exclude each other"
            compiled.refuse("pair", p, f"a contact of geoms of {what}; move the geom to another body")
            continue
        if not _may_touch(geoms, a, b) and not _share_bit(geoms, a, b, bits):
            compiled.refuse("pair", p, "no bit of contype and conaffinity is left for this pair; free some")
            continue
        # Sliding, torsional and rolling friction; the others are those along the second tangent.
        values = coefficients(m.pair_dim[p], m.pair_friction[p, [0, 2, 3]])
        found[min(a, b), max(a, b)] = tuple(values.tolist())
    return found


def _share_bit(geoms: Geoms, a: int, b: int, bits: dict[int, int]) -> bool:
    """Lets two geoms touch by a bit that no other pair uses; False if all 32 are taken."""
    if a not in bits:
        used = 0
        for geom in geoms.geoms:
            used |= geom.category | geom.mask
        if used == BITS:
            return False
        bits[a] = ~used & (used + 1)  # the lowest free bit
    geoms.geoms[a] = replace(geoms.geoms[a], category=geoms.geoms[a].category | bits[a])
    geoms.geoms[b] = replace(geoms.geoms[b], mask=geoms.geoms[b].mask | bits[a])
    return True
