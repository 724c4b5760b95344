"""Pairs of a model that never touch, or have a material of their own, as elements of MJCF."""

from __future__ import annotations

from collections import Counter
from itertools import product
from xml.etree import ElementTree as ET

from ...model.parts import Geom, Material
from .mjcf_draft import Draft, words

DIMENSIONS = ((6, "rolling_friction"), (4, "torsional_friction"), (3, "friction"))
"""condim by the first coefficient that is not zero"""
Names = tuple[str, str]


def condim(material: Material) -> str:
    return str(next((n for n, name in DIMENSIONS if getattr(material, name) > 0), 1))


def write_contacts(draft: Draft) -> None:
    """Pairs are excluded by the bodies of the file, of which links are some."""
    model, section = draft.model, draft.sections["contact"]
    apart = {(min(a, b), max(a, b)) for a, b in model.excluded_bodies}
    apart |= {
        (min(ends), max(ends))
        for ends in ((int(j.body_a), int(j.body_b)) for j in model.joints if not j.collide)  # type: ignore[arg-type]
    }
    excluded = _by_bodies(draft, apart)
    excluded |= _by_geoms(draft, excluded)
    for one, other in sorted(excluded):
        ET.SubElement(section, "exclude", body1=one, body2=other)
    for pair in model.pair_materials:
        a, b = model.geoms[pair.geom_a], model.geoms[pair.geom_b]
        meet = a.category & b.mask or b.category & a.mask
        if not pair.always and (not meet or _names(draft, a, b) in excluded):
            continue
        m = pair.material
        ET.SubElement(
            section, "pair", geom1=a.name, geom2=b.name, margin=words(m.rest_offset), condim=condim(m),
            friction=words(*[m.friction] * 2, m.torsional_friction, *[m.rolling_friction] * 2),
        )  # fmt: skip


def _part(draft: Draft, geom: Geom) -> str:
    """The body of the file that a geom is on."""
    return draft.at(geom.body, geom.link)[0].get("name", "world")


def _names(draft: Draft, one: Geom, other: Geom) -> Names:
    a, b = sorted((_part(draft, one), _part(draft, other)))
    return a, b


def _by_bodies(draft: Draft, apart: set[tuple[int, int]]) -> set[Names]:
    parts: dict[int, set[str]] = {}
    for geom in draft.model.geoms:
        parts.setdefault(geom.body, set()).add(_part(draft, geom))
    found: set[Names] = set()
    for a, b in apart:
        ends = [{draft.at(body)[0].get("name", "world")} | parts.get(body, set()) for body in (a, b)]
        found |= {(min(pair), max(pair)) for pair in product(*ends)}
    return found


def _by_geoms(draft: Draft, excluded: set[Names]) -> set[Names]:
    """Bodies of the file of which no two geoms touch; where some do, MuJoCo lets all touch."""
    geoms = draft.model.geoms
    on = Counter(_part(draft, geom) for geom in geoms)
    pairs = {(min(a, b), max(a, b)) for a, b in draft.model.excluded_geoms}
    counts = Counter(_names(draft, geoms[a], geoms[b]) for a, b in pairs)
    found = set()
    for (one, other), count in counts.items():
        if count == on[one] * on[other]:
            found.add((one, other))
        elif (one, other) not in excluded:
            draft.lose(f'bodies "{one}", "{other}"', f"{count} pairs of geoms that never touch")
    return found
