"""Variants of a model: the same bodies, geoms and joints with other numbers."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import isclose, sqrt
from typing import Any

from ..checks import listed, shown
from ..errors import InputError, ModelWarning
from ..escapes import visible
from .parts import Material, PairMaterial
from .quantities import LISTS, QUANTITIES, Draft, Model, checked, draft_of, material_with, places

RULES = {
    "geometric_mean": lambda a, b: sqrt(a * b),
    "maximum": max,
    "minimum": min,
    "mean": lambda a, b: 0.5 * (a + b),
}
"""`Model.friction_rule`"""
OF_PAIRS = ("friction", "restitution")
"""Quantities that pairs of geoms may have for themselves."""
CLOSE = 1e-9
"""relative: by what values of a file differ that follow from each other"""


def variant(model: Model, given: Mapping[str, Mapping[Any, Any] | None]) -> Model:
    """See `Model.with_`; given: values by name for each quantity, and factors for "mass_scale"."""
    draft = draft_of(model)
    for what, values in given.items():
        if values is None:
            continue
        if not isinstance(values, Mapping):
            raise InputError(f"{what} is {shown(values)}; give values by name, as {what}={{'foot*': 0.4}}")
        _change(model, draft, what, values)
    return _made(model, draft)


def variant_at(model: Model, given: Mapping[str, Mapping[int, float]]) -> Model:
    """The variant with the values of quantities at places (`quantities.places`)."""
    draft = draft_of(model)
    for what, named in given.items():
        _write(model, draft, what, named)
        if what in OF_PAIRS:
            _follow(model, draft, what, set(named), set())
    return _made(model, draft)


def _made(model: Model, draft: Draft) -> Model:
    now = {name: tuple(draft[name]) for name in LISTS}
    return replace(model, **{name: parts for name, parts in now.items() if parts != getattr(model, name)})


def _write(model: Model, draft: Draft, what: str, values: Mapping[int, float]) -> None:
    for k, value in values.items():
        QUANTITIES[what].write(model, draft, k, value)


def _change(model: Model, draft: Draft, what: str, values: Mapping[Any, Any]) -> None:
    kind = what.removesuffix("_scale")
    named: dict[int, float] = {}
    pairs: dict[tuple[int, int], float] = {}
    for pattern, value in values.items():
        number = checked(what, pattern, value)
        if isinstance(pattern, tuple) and kind in OF_PAIRS:
            pairs |= dict.fromkeys(_pairs_of(model, kind, pattern), number)
            continue
        for k in places(kind, model, pattern):
            if k in named:
                raise InputError(f'{what}: two patterns name "{QUANTITIES[kind].names(model)[k]}"')
            named[k] = number
    if what != kind:
        named = {k: factor * QUANTITIES[kind].read(model, draft, k) for k, factor in named.items()}
    _write(model, draft, kind, named)
    if kind in OF_PAIRS:
        _follow(model, draft, kind, set(named), set(pairs))
        _set_pairs(model, draft, kind, pairs)
        _warn_of_none(model, draft, kind, set(named))


def _pairs_of(model: Model, what: str, patterns: tuple[Any, ...]) -> list[tuple[int, int]]:
    """The pairs of geoms that two patterns name and that are on different bodies."""
    if len(patterns) != 2:
        raise InputError(f"{what}: {shown(patterns)} must be a pair of names, as ('foot*', 'floor')")
    first, second = (places(what, model, pattern) for pattern in patterns)
    body = [geom.body for geom in model.geoms]
    found = {(min(a, b), max(a, b)) for a in first for b in second if body[a] != body[b]}
    if not found:
        raise InputError(f"{what}: {shown(patterns)} names no two geoms of different bodies")
    return sorted(found)


def _follow(model: Model, draft: Draft, what: str, named: set[int], given: set[tuple[int, int]]) -> None:
    """Pairs with a material of their own take the new values of their geoms where they had the old ones.

    A pair has the value of its geoms by the rule of the model, or that of one of them, as the priority of a
    file says. Another value is its own and stays, and a warning says so.
    """
    old, new = ([getattr(geom.material, what) for geom in geoms] for geoms in (model.geoms, draft["geoms"]))
    own = []
    for k, pair in enumerate(draft["pair_materials"]):
        a, b = pair.geom_a, pair.geom_b
        if not named & {a, b} or (min(a, b), max(a, b)) in given:
            continue
        value, rule = getattr(pair.material, what), _rule(model, what)
        if isclose(value, rule(old[a], old[b]), rel_tol=CLOSE):
            value = rule(new[a], new[b])
        elif (one := next((g for g in (a, b) if isclose(value, old[g], rel_tol=CLOSE)), None)) is not None:
            value = new[one]
        else:
            own.append(f'("{model.geom_names[a]}", "{model.geom_names[b]}") {value:g}')
        draft["pair_materials"][k] = replace(pair, material=material_with(pair.material, what, value))
    if own:
        warnings.warn(
            f"{what} of pairs of their own stays: {listed(own)}; name the pairs, as "
            f"{what}={{('foot', 'floor'): 0.4}}",
            ModelWarning,
            stacklevel=5,
        )


def _warn_of_none(model: Model, draft: Draft, what: str, named: set[int]) -> None:
    """Warns where a value changes no contact with what is fixed, whose larger one counts; without anything
    fixed, where it changes no contact at all."""
    rule = _rule(model, what)
    if rule not in (max, min) or draft["geoms"] == list(model.geoms):
        return
    if draft["pair_materials"] != list(model.pair_materials):
        return
    old, new = ([getattr(geom.material, what) for geom in geoms] for geoms in (model.geoms, draft["geoms"]))
    met = _partners(model, named)
    if not met or any(rule(old[a], old[b]) != rule(new[a], new[b]) for a, b in met):
        return
    which = "larger" if rule is max else "smaller"
    a, b = met[0]
    warnings.warn(
        f"{what} = {new[a]:g} of {visible(model.geom_names[a])!r} changes no contact: the {which} value of "
        f"two geoms counts, and {visible(model.geom_names[b])!r} has {new[b]:g}; give it to both, or to the "
        f"pair: {what}={{('foot', 'floor'): 0.4}}",
        ModelWarning,
        stacklevel=5,
    )


def _partners(model: Model, named: set[int]) -> list[tuple[int, int]]:
    """Pairs of a named geom and one that it may touch, which is fixed if any is."""
    own = {frozenset((pair.geom_a, pair.geom_b)) for pair in model.pair_materials}
    where = [(g.body, g.category, g.mask) for g in model.geoms]
    moves = [k >= 0 and model.bodies[k].motion == "dynamic" for k, _, _ in where]
    found = []
    for a in sorted(named):
        body, category, mask = where[a]
        for b, (other, other_category, other_mask) in enumerate(where):
            meet = body != other and (category & other_mask or other_category & mask)
            if meet and frozenset((a, b)) not in own:
                found.append((a, b))
    fixed = [pair for pair in found if not moves[pair[1]]]
    return fixed or found


def _rule(model: Model, what: str) -> Any:
    return RULES[model.friction_rule] if what == "friction" else max


def _set_pairs(model: Model, draft: Draft, what: str, values: Mapping[tuple[int, int], float]) -> None:
    at = {
        (min(pair.geom_a, pair.geom_b), max(pair.geom_a, pair.geom_b)): k
        for k, pair in enumerate(draft["pair_materials"])
    }
    for (a, b), value in values.items():
        if (a, b) in at:
            pair = draft["pair_materials"][at[a, b]]
            changed = replace(pair, material=material_with(pair.material, what, value))
            draft["pair_materials"][at[a, b]] = changed
        else:
            both = [draft["geoms"][k].material for k in (a, b)]
            if any(material.friction_across is not None for material in both):
                raise InputError(
                    f'{what} of the pair "{model.geom_names[a]}", "{model.geom_names[b]}" depends on the '
                    "direction; give it by builder.set_pair_material"
                )
            material = material_with(combined(model.friction_rule, *both), what, value)
            draft["pair_materials"].append(PairMaterial(a, b, material))


def combined(rule: str, a: Material, b: Material) -> Material:
    """The material of a pair without one of its own, as contacts combine it; friction_across is left out."""
    total = a.compliance + b.compliance
    static = [m.friction if m.friction_static is None else m.friction_static for m in (a, b)]
    has_static = any(m.friction_static is not None for m in (a, b))
    return Material(
        friction=RULES[rule](a.friction, b.friction),
        torsional_friction=max(a.torsional_friction, b.torsional_friction),
        rolling_friction=max(a.rolling_friction, b.rolling_friction),
        restitution=max(a.restitution, b.restitution),
        compliance=total,
        relaxation_time=(a.compliance * a.relaxation_time + b.compliance * b.relaxation_time) / (total or 1),
        rest_offset=a.rest_offset + b.rest_offset,
        friction_static=RULES[rule](*static) if has_static else None,
        stribeck_speed=max(a.stribeck_speed, b.stribeck_speed),
    )


def same_structure(models: Iterable[Model]) -> str:
    """The difference that keeps models from advancing together; empty if they differ in numbers alone."""
    first, *others = [(m.nq, m.nv, m.q_names, m.control_names) for m in models]
    for k, other in enumerate(others, 1):
        for what, a, b in zip(("nq", "nv", "coordinates", "controls"), first, other, strict=True):
            if a != b:
                return f"model {k} has other {what} than model 0: {shown(b)}, not {shown(a)}"
    return ""
