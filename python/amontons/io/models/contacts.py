"""Which geoms touch, and with which friction: MuJoCo's rules in terms of masks, exclusions and pairs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from ...checks import Array
from ...limits import readable
from ...model.parts import Material, PairMaterial
from ...model.variants import combined
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
MANY = 1000
"""Pairs: so many more with a material of their own are worth it where geoms then keep their friction."""
PAIR = 64
"""Bytes that a pair of geoms takes while rules of pairs are compared."""
FRICTIONS = ("friction", "torsional_friction", "rolling_friction")
SOFTNESS = ("compliance", "relaxation_time", "restitution")


@dataclass(frozen=True)
class Values:
    """Fields of materials of pairs of geoms a < b."""

    a: Array
    b: Array
    kind: Array
    """of each pair, as many have the same fields"""
    columns: Array
    """(kinds, 3): FRICTIONS or SOFTNESS"""

    def keys(self, count: int) -> Array:
        """A number for each pair, of `count` geoms, in the order of pairs."""
        return self.a * count + self.b


NO_PAIRS = Values(*(np.zeros(0, dtype=int) for _ in range(3)), np.zeros((0, 3)))


def excluded_pairs(compiled: Compiled, bodies: Bodies, geoms: Geoms) -> tuple[Pairs, Pairs]:
    """Excluded pairs of bodies and of geoms: <exclude>, and the rule that a body does not touch its parent.

    Bodies that are fixed to each other count as one body, and the world touches its children (MuJoCo,
    Computation, Collision, Selection, filter 3).
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
    pairs = _paired(geoms, frictions, soft)
    if compiled.enabled("contact") and (explicit := _explicit(compiled, geoms)):
        found = {(pair.geom_a, pair.geom_b): pair for pair in pairs} | explicit
        pairs = [found[pair] for pair in sorted(found)]
    return pairs, sorted(excluded), sorted(excluded_geoms)


def _paired(geoms: Geoms, frictions: Values, soft: Values) -> list[PairMaterial]:
    """Sorted pairs with materials of their own. There may be a million, which share few materials."""
    count = len(geoms.geoms)
    both = np.concatenate([frictions.keys(count), soft.keys(count)])
    keys, _ = np.unique(both, return_index=True)  # with the index NumPy sorts; without, its hashing is slow
    a, b = np.divmod(keys, max(count, 1))
    known: dict[Material, int] = {}
    own = np.array([known.setdefault(geom.material, len(known)) for geom in geoms.geoms], dtype=int)
    code = own[a] * len(known) + own[b]
    which = []
    for values in (frictions, soft):
        kind = np.zeros(len(keys), dtype=int)  # 0: as both materials together have it
        kind[np.searchsorted(keys, values.keys(count))] = values.kind + 1
        _, code = np.unique(code * (len(values.columns) + 1) + kind, return_inverse=True)
        which.append((values, kind))
    _, first = np.unique(code, return_index=True)
    materials = []
    for k in first.tolist():
        changes: dict[str, float] = {}
        for (values, kind), names in zip(which, (FRICTIONS, SOFTNESS), strict=True):
            if kind[k]:
                changes |= zip(names, values.columns[kind[k] - 1].tolist(), strict=True)
        of_a, of_b = (geoms.geoms[int(g)].material for g in (a[k], b[k]))
        materials.append(replace(combined("maximum", of_a, of_b), **changes))
    return list(map(PairMaterial, a.tolist(), b.tolist(), (materials[k] for k in code.tolist())))


def _kinds(rows: Array, a: Array, b: Array) -> tuple[Array, Array]:
    """The first pair of each kind, and the kind of each pair.

    a, b: the geoms of pairs, (pairs,). rows: (geoms, n), from which the values of pairs follow.
    """
    levels, kind = np.unique(rows, axis=0, return_inverse=True)
    code = kind.reshape(-1)[a] * len(levels) + kind.reshape(-1)[b]
    _, first, found = np.unique(code, return_index=True, return_inverse=True)
    return first, found


def _frictions(compiled: Compiled, geoms: Geoms) -> Values:
    """The coefficients of pairs for which MuJoCo's rule is not the larger of the materials of both.

    The geom of higher priority decides alone. Equal priorities take the larger condim, and the larger of each
    coefficient, even if the geom's own condim does not use it.
    """
    m = compiled.model
    ids = np.array(list(geoms.index), dtype=int)
    dim, priority = m.geom_condim[ids], m.geom_priority[ids]
    if (dim == 1).all():
        geoms.geoms[:] = [with_friction(geom, 0.0) for geom in geoms.geoms]
        return NO_PAIRS
    if np.ptp(dim) == 0 and np.ptp(priority) == 0:
        return NO_PAIRS
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
    body, category, mask = _fields(geoms)
    a, b = np.nonzero(differs)
    meet = (body[a] != body[b]) & ((category[a] & mask[b] != 0) | (category[b] & mask[a] != 0))
    a, b = a[meet], b[meet]
    first, kind = _kinds(np.column_stack([dim, priority, m.geom_friction[ids]]), a, b)
    return Values(a, b, kind, rule[a[first], b[first]])


def _fields(geoms: Geoms) -> tuple[Array, Array, Array]:
    """Body, category and mask of all geoms."""
    return tuple(np.array([getattr(g, name) for g in geoms.geoms]) for name in ("body", "category", "mask"))


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


def _soften(compiled: Compiled, geoms: Geoms) -> Values:
    """Gives geoms the softness of their contact with what does not move, or else with their like; returns
    that of the pairs of which the combination of both is not the one of MuJoCo."""
    m = compiled.model
    ids = np.array(list(geoms.index), dtype=int)
    plain = (m.geom_solref[ids] == DEFAULT_REFERENCE).all(axis=1)
    plain &= (m.geom_solimp[ids] == DEFAULT_IMPEDANCE).all(axis=1)
    if plain.all() or not compiled.enabled("contact"):
        return NO_PAIRS
    _require_pairs(compiled, len(ids))
    body, category, mask = _fields(geoms)
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
        return NO_PAIRS
    body_of = m.geom_bodyid[ids]
    rows = [
        m.geom_condim,
        m.geom_priority,
        m.geom_friction,
        m.geom_solref,
        m.geom_solimp,
        m.geom_solmix,
        load,
    ]
    rows = np.column_stack([*(row[ids] for row in rows), m.body_invweight0[body_of, 0], fixed])
    first, kind = _kinds(rows, a, b)
    pair = _softness_of(compiled, ids[a[first]], ids[b[first]], load)
    materials = [geom.material for geom in geoms.geoms]
    compliance, restitution = (
        np.array([getattr(m, name) for m in materials]) for name in ("compliance", "restitution")
    )
    # Some per cent more or less are nothing: loads are not known better.
    wanted = pair.compliance[kind]
    differs = np.abs(compliance[a] + compliance[b] - wanted) > 0.05 * wanted
    differs |= np.abs(np.maximum(restitution[a], restitution[b]) - pair.restitution[kind]) > 0.01
    differs &= body[a] != body[b]
    columns = np.stack([getattr(pair, name) for name in SOFTNESS], axis=1)
    return Values(a[differs], b[differs], kind[differs], columns)


def _softness_of(compiled: Compiled, a: Array, b: Array, load: Array) -> Softness:
    """Values for contacts of MuJoCo's geoms a (n,) and b (n,)."""
    m = compiled.model
    dim, friction = _condim_and_friction(compiled, a, b)
    solref, solimp = mixed(compiled, a, b)
    pair = np.stack([m.geom_bodyid[a], m.geom_bodyid[b]], axis=-1)
    weight = inverse_weights(compiled, pair, dim, friction[:, 0])
    # A fixed body has no load; for two moving bodies the smaller load counts.
    moves = m.body_weldid[pair] != 0
    both = np.where(moves, load[np.stack([a, b], axis=-1)], np.inf).min(axis=1)
    return softness(compiled, solref, solimp, weight, np.where(moves.any(axis=1), both, 0.0))


def _values(soft: Softness, k: int) -> dict[str, float]:
    return {name: float(getattr(soft, name)[k]) for name in SOFTNESS}


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
    """Values of all <pair>s, under the load of the moving body."""
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
