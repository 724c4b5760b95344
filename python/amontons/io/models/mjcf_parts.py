"""Bodies of MJCF with their masses, and their links as bodies without a joint, which MuJoCo welds to them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from xml.etree import ElementTree as ET

import numpy as np

from ...checks import Matrix3, Vector3
from ...model.links import Link
from ...model.mass import MassProperties
from ...model.model import Model
from ...model.parts import OWN, Body
from .mjcf_draft import Draft, placed, within, words
from .trees_out import Branch, Trees

NOTHING = 1e-9
"""Share of the mass of a body below which what is left without its links has none"""
LEAST = 1e-14
"""kg m^2: moments of inertia that MuJoCo refuses"""
TAKEN = 1e-12
"""kg m^2: those in place of smaller ones"""


def write_parts(draft: Draft, body: int) -> None:
    """The mass of a body, and its links with theirs; one solid where MuJoCo cannot have them apart."""
    whole = draft.model.bodies[body]
    links = [(k, link) for k, link in enumerate(draft.model.links) if link.body == body]
    own = divided(draft.model, body)
    element = draft.elements[body, OWN]
    if links and own is None:
        draft.lose(f'body "{whole.name}"', f"names of {len(links)} links that are parts of it", "none")
    _inertial(element, own if own is not None else _with_moments(draft, whole))
    _float(element, whole)
    for k, link in links if own is not None else []:
        above, frame = draft.at(body, link.carrier)
        made = placed(ET.SubElement(above, "body", name=link.name), within(frame, link.frame))
        draft.elements[body, k] = made
        _inertial(made, _solid(link))
        _float(made, whole)


def divided(model: Model, body: int) -> MassProperties | None:
    """A body without its links; None where it has none, or they and it are not all solids by themselves."""
    whole = model.bodies[body]
    links = [link for link in model.links if link.body == body]
    if not links or whole.motion != "dynamic" or any(_solid(link) is None for link in links):
        return None
    return _without(whole, links)


def _float(element: ET.Element, body: Body) -> None:
    if body.gravity_scale != 1:
        element.set("gravcomp", words(1 - body.gravity_scale))


def _inertial(element: ET.Element, solid: MassProperties | None) -> None:
    if solid is None or not (solid.mass > 0 or np.any(solid.inertia)):
        return
    m = np.array(solid.inertia)
    ET.SubElement(
        element, "inertial", pos=words(solid.centre_of_mass), mass=words(solid.mass),
        fullinertia=words(*np.diag(m), m[0, 1], m[0, 2], m[1, 2]),
    )  # fmt: skip


def _solid(part: Body | Link) -> MassProperties | None:
    """None of a link with moments of inertia that MuJoCo refuses."""
    solid = MassProperties(part.mass, part.centre_of_mass, part.inertia)
    return solid if isinstance(part, Body) or _is_solid(solid) else None


def _with_moments(draft: Draft, body: Body) -> MassProperties:
    """The solid of a body, with moments that MuJoCo takes: above zero, none larger than the sum of two."""
    solid = MassProperties(body.mass, body.centre_of_mass, body.inertia)
    if _is_solid(solid):
        return solid
    moments, axes = np.linalg.eigh(solid.inertia)
    taken = np.maximum(moments, TAKEN)
    taken[0] = max(taken[0], (taken[2] - taken[1]) * (1 + 1e-9))
    if body.motion == "dynamic" and np.any(taken - moments > 1e-6 * taken[2]):
        said = ", ".join(f"{x:.3g}" for x in moments)
        draft.lose(f'body "{body.name}"', f"moments of inertia {said}, which MuJoCo refuses", "small")
    return replace(solid, inertia=_matrix(axes @ np.diag(taken) @ axes.T))


def _is_solid(solid: MassProperties) -> bool:
    if not (solid.mass > 0 or np.any(solid.inertia)):
        return solid.mass == 0
    moments = np.linalg.eigvalsh(solid.inertia)
    return bool(moments[0] > LEAST and moments[0] + moments[1] > moments[2])


def _without(body: Body, links: list[Link]) -> MassProperties | None:
    """A body without its links; None if that is no solid."""
    rest = MassProperties(body.mass, body.centre_of_mass, body.inertia)
    if not links:
        return rest
    parts = [MassProperties(k.mass, k.centre_of_mass, k.inertia).moved(k.frame) for k in links]
    mass = body.mass - sum(part.mass for part in parts)
    if abs(mass) <= NOTHING * body.mass:
        return MassProperties(0.0, (0.0, 0.0, 0.0), ((0.0,) * 3,) * 3)
    if mass < 0:
        return None
    first = np.array(body.centre_of_mass) * body.mass
    for part in parts:
        first = first - part.mass * np.array(part.centre_of_mass)
    centre = first / mass
    about = np.array(rest.inertia) - mass * _spread(centre - np.array(rest.centre_of_mass))
    for part in parts:
        offset = np.array(part.centre_of_mass) - np.array(rest.centre_of_mass)
        about = about - np.array(part.inertia) - part.mass * _spread(offset)
    own = MassProperties(float(mass), _vector(centre), _matrix(about))
    return own if _is_solid(own) else None


def _spread(r: np.ndarray) -> np.ndarray:
    """Moments of a unit mass at r about the origin."""
    return float(r @ r) * np.eye(3) - np.outer(r, r)


def _vector(values: np.ndarray) -> Vector3:
    return tuple(values.tolist())  # type: ignore[return-value]


def _matrix(values: np.ndarray) -> Matrix3:
    return tuple(map(tuple, ((values + values.T) / 2).tolist()))  # type: ignore[return-value]


def nested(trees: Trees) -> list[Branch]:
    """The branches; fixed bodies stand in fixed ones where the order from top to bottom asks for it."""
    fixed = {k for k, body in enumerate(trees.model.bodies) if body.motion == "static"}
    top = {branch.body: branch.body for branch in trees.branches}
    last = dict(top)
    for branch in trees.branches:
        top[branch.body] = top.get(branch.parent, branch.body)
        last[top[branch.body]] = max(last[top[branch.body]], branch.body)
    found = []
    for branch in trees.branches:
        around = [a for a in fixed if a < branch.body < last[a]] if branch.body in fixed else []
        found.append(replace(branch, parent=max(around)) if around else branch)
    return sorted(found, key=lambda branch: branch.body not in fixed)


def in_order(draft: Draft) -> None:
    """Puts bodies and links in the order of the model, as MuJoCo counts both from top to bottom."""
    firsts = _firsts(draft)
    parts = {id(element): part for part, element in draft.elements.items()}
    for element in draft.elements.values():
        children = element.findall("body")
        links = sorted((e for e in children if parts[id(e)][1] != OWN), key=lambda e: parts[id(e)][1])
        bodies = sorted((e for e in children if parts[id(e)][1] == OWN), key=lambda e: firsts[id(e)].body)
        for child in children:
            element.remove(child)
        for body in bodies:
            while links and _comes_before(firsts[id(links[0])], firsts[id(body)]):
                element.append(links.pop(0))
            element.append(body)
        element.extend(links)


@dataclass
class _First:
    """The first body, link and geom of an element and all that is in it."""

    body: float = math.inf
    link: float = math.inf
    geom: float = math.inf


def _comes_before(link: _First, body: _First) -> bool:
    """By what both have: geoms, else links."""
    if math.isfinite(link.geom) and math.isfinite(body.geom):
        return link.geom < body.geom
    return link.link < body.link < math.inf


def _firsts(draft: Draft) -> dict[int, _First]:
    parts = {id(element): part for part, element in draft.elements.items()}
    geoms: dict[int, int] = {}
    for k, geom in enumerate(draft.model.geoms):
        geoms.setdefault(id(draft.at(geom.body, geom.link)[0]), k)
    found: dict[int, _First] = {}
    for element in reversed(list(draft.root.iter("body"))):  # what is inside comes first
        body, link = parts[id(element)]
        inside = [found[id(child)] for child in element.findall("body")]
        first = _First(body if link == OWN else math.inf, link if link != OWN else math.inf)
        first.geom = geoms.get(id(element), math.inf)
        for name in vars(first):
            setattr(first, name, min([getattr(first, name), *(getattr(other, name) for other in inside)]))
        found[id(element)] = first
    return found
