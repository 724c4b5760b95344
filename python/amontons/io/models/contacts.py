"""Which geoms touch, and with which friction: MuJoCo's rules in terms of masks, exclusions and pairs."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, product

import numpy as np

from ...checks import Array
from ...limits import readable
from ...model.parts import Material, PairMaterial
from .bodies import Bodies, fixed_groups
from .compiled import Compiled
from .geoms import Geoms, coefficients, with_friction
from .size import too_large
from .softness import (
    DEFAULT_IMPEDANCE,
    DEFAULT_REFERENCE,
    Softness,
    inverse_weights,
    loads,
    mixed,
    softness,
)

Pairs = set[tuple[int, int]]
Values = dict[str, float]
"""Fields of a Material."""
MANY = 1000
"""Pairs: so many more with a material of their own are worth it where geoms then keep their friction."""
PAIR = 64
"""Bytes that a pair of geoms takes while rules of pairs are compared."""
FRICTIONS = ("friction", "torsional_friction", "rolling_friction")


def excluded_pairs(compiled: Compiled, bodies: Bodies, geoms: Geoms) -> tuple[Pairs, Pairs]:
    """Of bodies and of geoms: <exclude>, and the rule that a body does not touch its parent.

    What is fixed to each other counts as one body, and the world touches its children (MuJoCo, Computation,
    Collision, Selection, filter 3).
    """
    m = compiled.model
    groups = fixed_groups(compiled, bodies)
    found: Pairs = set()
    of_geoms: Pairs = set()
    on: dict[int, list[int]] = {}
    for geom, ours in geoms.index.items():
        on.setdefault(int(m.geom_bodyid[geom]), []).append(ours)
    for root, members in groups.items():
        if root == 0:
            continue
        found.update(combinations(members, 2))
        parent = int(m.body_weldid[m.body_parentid[root]])
        if parent != 0 and compiled.enabled("filterparent"):
            found.update(product(members, groups[parent]))
    shared = {bodies.at(i) for i in range(m.nbody) if bodies.owner[i] != i}
    for signature in m.exclude_signature.tolist():
        pair = signature >> 16, signature & 0xFFFF
        a, b = (bodies.at(body) for body in pair)
        if shared & {a, b}:  # of a part of a body
            of_geoms.update(product(*(on.get(body, []) for body in pair)) if a != b else ())
        elif a != b:
            found.add((a, b))
    return _ordered(found), _ordered(of_geoms)


def _ordered(pairs: Pairs) -> Pairs:
    return {(min(p), max(p)) for p in pairs}


def read_contacts(
    compiled: Compiled, bodies: Bodies, geoms: Geoms
) -> tuple[list[PairMaterial], list[tuple[int, int]], list[tuple[int, int]]]:
    """Pair materials, excluded bodies and excluded geoms; makes geoms soft."""
    excluded, excluded_geoms = excluded_pairs(compiled, bodies, geoms)
    frictions = _frictions(compiled, geoms)
    soft = _soften(compiled, geoms)
    pairs = {}
    made: dict[tuple, Material] = {}  # many pairs share few materials
    for a, b in sorted({*frictions, *soft}):
        changes = {**frictions.get((a, b), {}), **soft.get((a, b), {})}
        key = (geoms.geoms[a].material, geoms.geoms[b].material, *changes.items())
        if key not in made:
            made[key] = replace(combined(key[0], key[1]), **changes)
        pairs[a, b] = made[key]
    found = {pair: PairMaterial(*pair, material) for pair, material in pairs.items()}
    if compiled.enabled("contact"):
        found |= _explicit(compiled, geoms)
    return [found[pair] for pair in sorted(found)], sorted(excluded), sorted(excluded_geoms)


def combined(a: Material, b: Material) -> Material:
    """The material of a pair without one of its own, by the rules of the model: frictions and restitutions
    the larger one, compliances and offsets the sum."""
    total = a.compliance + b.compliance
    return Material(
        friction=max(a.friction, b.friction),
        torsional_friction=max(a.torsional_friction, b.torsional_friction),
        rolling_friction=max(a.rolling_friction, b.rolling_friction),
        restitution=max(a.restitution, b.restitution),
        compliance=total,
        relaxation_time=(a.compliance * a.relaxation_time + b.compliance * b.relaxation_time) / (total or 1),
        rest_offset=a.rest_offset + b.rest_offset,
    )


def _frictions(compiled: Compiled, geoms: Geoms) -> dict[tuple[int, int], Values]:
    """The coefficients of pairs for which MuJoCo's rule is not the larger of the materials of both.

    The geom of higher priority decides alone. Of equal ones the larger condim counts, and of each coefficient
    the larger one, whether or not its geom's own condim asks for it.
    """
    m = compiled.model
    ids = np.array(list(geoms.index), dtype=int)
    dim, priority = m.geom_condim[ids], m.geom_priority[ids]
    if (dim == 1).all():
        geoms.geoms[:] = [with_friction(geom, 0.0) for geom in geoms.geoms]
        return {}
    if np.ptp(dim) == 0 and np.ptp(priority) == 0:
        return {}
    _require_pairs(compiled, len(ids))
    rule = coefficients(*_condim_and_friction(compiled, ids[:, None], ids[None, :]))
    own = coefficients(dim, m.geom_friction[ids])
    differs = _unlike(rule, own)  # a geom of condim 1 slides freely
    own[:, 0] = m.geom_friction[ids, 0]
    with_own = _unlike(rule, own)  # it has the friction that it brings into others' contacts
    if np.count_nonzero(with_own) <= np.count_nonzero(differs) + MANY:
        differs = with_own
    else:
        geoms.geoms[:] = [
            with_friction(geom, 0.0) if slides else geom
            for geom, slides in zip(geoms.geoms, dim == 1, strict=True)
        ]
    a, b = np.nonzero(differs)
    return {
        (i, j): dict(zip(FRICTIONS, rule[i, j].tolist(), strict=True))
        for i, j in zip(a.tolist(), b.tolist(), strict=True)
        if _may_touch(geoms, i, j)
    }


def _require_pairs(compiled: Compiled, geoms: int) -> None:
    """FileError where a table of all pairs of geoms goes beyond the limit of memory."""
    taken = PAIR * geoms**2
    if taken > compiled.limits.memory:
        what = (
            f"{geoms} geoms of unlike condim, priority or softness, of which all pairs take {readable(taken)}"
        )
        raise too_large(str(compiled.path), what, "memory")


def _unlike(rule: Array, own: Array) -> Array:
    """Which pairs i < j have other coefficients than the larger ones of both."""
    return np.triu((rule != np.maximum(own[:, None], own[None, :])).any(axis=-1), 1)


def _condim_and_friction(compiled: Compiled, a: Array, b: Array) -> tuple[Array, Array]:
    """condim (...) and the three coefficients (..., 3) of pairs of MuJoCo's geoms, by its rule."""
    m = compiled.model
    higher = m.geom_priority[a] - m.geom_priority[b]

    def of_pairs(values: Array) -> Array:
        return np.where(
            higher > 0, values[a], np.where(higher < 0, values[b], np.maximum(values[a], values[b]))
        )

    return of_pairs(m.geom_condim), np.stack([of_pairs(column) for column in m.geom_friction.T], axis=-1)


def _soften(compiled: Compiled, geoms: Geoms) -> dict[tuple[int, int], Values]:
    """Gives geoms the softness of their contact with what does not move, or else with their like; returns
    that of the pairs of which the combination of both is not the one of MuJoCo."""
    m = compiled.model
    ids = np.array(list(geoms.index), dtype=int)
    plain = (m.geom_solref[ids] == DEFAULT_REFERENCE).all(axis=1)
    plain &= (m.geom_solimp[ids] == DEFAULT_IMPEDANCE).all(axis=1)
    if plain.all() or not compiled.enabled("contact"):
        return {}
    _require_pairs(compiled, len(ids))
    category, mask = (np.array([getattr(g, name) for g in geoms.geoms]) for name in ("category", "mask"))
    meets = (category[:, None] & mask[None, :] != 0) | (mask[:, None] & category[None, :] != 0)
    touching = np.zeros(m.ngeom, dtype=bool)
    touching[ids[meets.any(axis=1)]] = True
    load = loads(compiled, touching)
    fixed = m.body_weldid[m.geom_bodyid[ids]] == 0
    partner = np.arange(len(ids))
    for i in np.nonzero(~fixed)[0].tolist():
        against = np.nonzero(meets[i] & fixed)[0]
        partner[i] = against[0] if len(against) else i
    own = _softness_of(compiled, ids, ids[partner], load)
    own.compliance[fixed] = own.restitution[fixed] = 0.0
    alone = partner == np.arange(len(ids))
    own.compliance[alone] *= 0.5  # of two of its like
    for i, geom in enumerate(geoms.geoms):
        if own.compliance[i] or (own.restitution[i]):
            geoms.geoms[i] = replace(geom, material=replace(geom.material, **_values(own, i)))
    meets &= ~(plain[:, None] & plain[None, :])
    meets &= ~(fixed[:, None] & fixed[None, :])
    a, b = np.nonzero(np.triu(meets, 1))
    if not len(a):
        return {}
    pair = _softness_of(compiled, ids[a], ids[b], load)
    materials = [geom.material for geom in geoms.geoms]
    compliance, restitution = (
        np.array([getattr(m, name) for m in materials]) for name in ("compliance", "restitution")
    )
    # Some per cent more or less are nothing: loads are not known better.
    differs = np.abs(compliance[a] + compliance[b] - pair.compliance) > 0.05 * pair.compliance
    differs |= np.abs(np.maximum(restitution[a], restitution[b]) - pair.restitution) > 0.01
    body = np.array([geom.body for geom in geoms.geoms])
    differs &= body[a] != body[b]
    return {(int(a[k]), int(b[k])): _values(pair, k) for k in np.nonzero(differs)[0].tolist()}


def _softness_of(compiled: Compiled, a: Array, b: Array, load: Array) -> Softness:
    """Of contacts of MuJoCo's geoms a (n,) and b (n,)."""
    m = compiled.model
    dim, friction = _condim_and_friction(compiled, a, b)
    solref, solimp = mixed(compiled, a, b)
    pair = np.stack([m.geom_bodyid[a], m.geom_bodyid[b]], axis=-1)
    weight = inverse_weights(compiled, pair, dim, friction[:, 0])
    # What does not move brings no load; of two that move the smaller one counts.
    moves = m.body_weldid[pair] != 0
    both = np.where(moves, load[np.stack([a, b], axis=-1)], np.inf).min(axis=1)
    return softness(compiled, solref, solimp, weight, np.where(moves.any(axis=1), both, 0.0))


def _values(soft: Softness, k: int) -> Values:
    return {
        "compliance": float(soft.compliance[k]),
        "relaxation_time": float(soft.relaxation_time[k]),
        "restitution": float(soft.restitution[k]),
    }


def _may_touch(geoms: Geoms, i: int, j: int) -> bool:
    a, b = geoms.geoms[i], geoms.geoms[j]
    return a.body != b.body and bool(a.category & b.mask or b.category & a.mask)


def _explicit(compiled: Compiled, geoms: Geoms) -> dict[tuple[int, int], PairMaterial]:
    """<pair>: a material of its own, and contact whatever masks and exclusions say."""
    m = compiled.model
    found = {}
    soft = _softness_of_pairs(compiled)
    for p in range(m.npair):
        a, b = (geoms.index.get(int(g[p])) for g in (m.pair_geom1, m.pair_geom2))
        if a is None or b is None or geoms.geoms[a].body == geoms.geoms[b].body:
            continue  # the geom is listed already, or the two never move against each other
        # Sliding, torsional and rolling friction; the others are those along the second tangent.
        values = coefficients(m.pair_dim[p], m.pair_friction[p, [0, 2, 3]])
        frictions = dict(zip(FRICTIONS, values.tolist(), strict=True))
        material = Material(**frictions, rest_offset=max(float(m.pair_margin[p]), 0.0), **_values(soft, p))
        pair = min(a, b), max(a, b)
        found[pair] = PairMaterial(*pair, material, always=True)
    return found


def _softness_of_pairs(compiled: Compiled) -> Softness:
    """Of all <pair>s, under the load of the body that moves."""
    m = compiled.model
    geoms = np.stack([m.pair_geom1, m.pair_geom2], axis=-1)
    pair = m.geom_bodyid[geoms]
    weight = inverse_weights(compiled, pair, m.pair_dim, m.pair_friction[:, 0])
    moves = m.body_weldid[pair] != 0
    touching = np.zeros(m.ngeom, dtype=bool)
    touching[geoms.reshape(-1)] = True
    both = np.where(moves, loads(compiled, touching)[geoms], np.inf).min(axis=1)
    load = np.where(moves.any(axis=1), both, 0.0)
    return softness(compiled, m.pair_solref, m.pair_solimp, weight, load)
