"""Numbers of a model by name: "friction:foot", "mass:link2", "damping:elbow".

A quantity is a kind of number and the things that have it. It reads and writes copies of the lists of a
model, so that `variants` can change many numbers and compile the model once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from ..checks import chosen, number, shown, suggestion
from ..errors import InputError
from .coordinates import coordinate_name, known
from .mass import MassProperties, as_matrix
from .parts import Body, Joint, Material

Model = Any
"""amontons.Model, which is made of what is here."""
LISTS = ("bodies", "geoms", "joints", "actuators", "pair_materials", "links")
Draft = dict[str, list[Any]]
"""The lists of a model that quantities change."""


@dataclass(frozen=True)
class Quantity:
    """A kind of number that some parts of a model have."""

    of: str
    """what has it, as messages call it"""
    unit: str
    names: Callable[[Model], Sequence[str]]
    read: Callable[[Model, Draft, int], float]
    write: Callable[[Model, Draft, int, float], None]
    owners: Callable[[Model], Sequence[str]]
    """of each thing what it is a part of, "" where names of its own are enough"""


def draft_of(model: Model) -> Draft:
    return {name: list(getattr(model, name)) for name in LISTS}


def places(what: str, model: Model, pattern: object) -> list[int]:
    """Where the things of a quantity are whose name is `pattern`, or else matches it, as "foot*" does.

    The name of a joint stands for all its degrees of freedom, that of a body or link for its geoms. Raises
    InputError if there is none.
    """
    quantity = QUANTITIES[what]
    names = quantity.names(model)
    if not isinstance(pattern, str):
        raise InputError(f"{what}: {shown(pattern)} is no name; give names or patterns, as {{'foot*': 0.4}}")
    owners = quantity.owners(model)
    found = [k for k, name in enumerate(names) if name == pattern]
    found = found or [k for k, owner in enumerate(owners) if owner == pattern]
    both = list(zip(names, owners, strict=True))
    found = found or [k for k, pair in enumerate(both) if any(fnmatchcase(name, pattern) for name in pair)]
    if not found:
        listed = [*dict.fromkeys([*names, *filter(None, owners)])]
        raise InputError(
            f'{what}: there is no {quantity.of} "{pattern}"{suggestion(pattern, listed)}; known are '
            f"{known(tuple(listed))}"
        )
    return found


def parameter(model: Model, name: object) -> tuple[str, list[int]]:
    """The quantity and the places of "friction:foot*"; InputError if there are none."""
    if not isinstance(name, str) or ":" not in name:
        raise InputError(f"parameter {shown(name)}: give a quantity and a name, as 'damping:elbow'")
    what, pattern = name.split(":", 1)
    chosen("quantity", what, QUANTITIES)
    return what, places(what, model, pattern)


def _degrees(model: Model) -> list[tuple[int, int]]:
    """(joint, dof) of all degrees of freedom; a ball is -1, after the others of its joint."""
    return [
        (j, d)
        for j, joint in enumerate(model.joints)
        for d in (*range(len(joint.dofs)), *([-1] if joint.spherical else []))
    ]


def _degree_names(model: Model) -> list[str]:
    return [coordinate_name(model.joints[j], d) for j, d in _degrees(model)]


def _joints_of_degrees(model: Model) -> list[str]:
    return [model.joints[j].name for j, _ in _degrees(model)]


def _no_owners(names: Callable[[Model], Sequence[str]]) -> Callable[[Model], Sequence[str]]:
    return lambda model: [""] * len(names(model))


def _of_degrees(field: str, ball: str) -> tuple[Any, Any]:
    """Reading and writing of a field of degrees of freedom, which balls have by another name."""

    def read(model: Model, draft: Draft, k: int) -> float:
        j, d = _degrees(model)[k]
        joint = draft["joints"][j]
        return getattr(joint, ball) if d < 0 else getattr(joint.dofs[d], field)

    def write(model: Model, draft: Draft, k: int, value: float) -> None:
        j, d = _degrees(model)[k]
        joint: Joint = draft["joints"][j]
        if d < 0:
            draft["joints"][j] = replace(joint, **{ball: value})
        else:
            dofs = (*joint.dofs[:d], replace(joint.dofs[d], **{field: value}), *joint.dofs[d + 1 :])
            draft["joints"][j] = replace(joint, dofs=dofs)

    return read, write


def _read_mass(model: Model, draft: Draft, k: int) -> float:
    bodies = len(draft["bodies"])
    return (draft["bodies"][k] if k < bodies else draft["links"][k - bodies]).mass


def _write_mass(model: Model, draft: Draft, k: int, value: float) -> None:
    """Mass and inertia in proportion: of a body with all its links, or of a link and so of its body."""
    old = _read_mass(model, draft, k)
    if not (old > 0 and value > 0):
        raise InputError(
            f'mass of "{model.link_names[k]}": {value:g} kg in place of {old:g} kg; both must be positive'
        )
    factor, bodies = value / old, len(draft["bodies"])
    if k < bodies:
        draft["bodies"][k] = _heavier(draft["bodies"][k], factor)
        for i, link in enumerate(draft["links"]):
            if link.body == k:
                draft["links"][i] = _heavier(link, factor)
        return
    link = draft["links"][k - bodies]
    body: Body = draft["bodies"][link.body]
    part = MassProperties(link.mass, link.centre_of_mass, link.inertia).moved(link.frame)
    whole = MassProperties(body.mass, body.centre_of_mass, body.inertia) + part.scaled(factor - 1)
    inertia = whole.inertia
    draft["bodies"][link.body] = replace(
        body, mass=whole.mass, centre_of_mass=whole.centre_of_mass, inertia=inertia
    )
    draft["links"][k - bodies] = _heavier(link, factor)


def _heavier(solid: Any, factor: float) -> Any:
    return replace(solid, mass=factor * solid.mass, inertia=as_matrix(factor * np.array(solid.inertia)))


def _read_gain(model: Model, draft: Draft, k: int) -> float:
    actuator, joint, dof = model.core.controls[k]
    if actuator >= 0:
        return draft["actuators"][actuator].gain[0]
    motor = draft["joints"][joint].dofs[dof].motor
    return motor.kp if motor.kind == "position" else motor.kd


def _write_gain(model: Model, draft: Draft, k: int, value: float) -> None:
    """The gain on the control; terms of the bias that are the same gain, as those of servos, go with it."""
    actuator, joint, dof = model.core.controls[k]
    if actuator >= 0:
        drive = draft["actuators"][actuator]
        old = drive.gain[0]
        bias = tuple(-value if old and term == -old else term for term in drive.bias)
        draft["actuators"][actuator] = replace(drive, gain=(value, *drive.gain[1:]), bias=bias)
        return
    owner: Joint = draft["joints"][joint]
    motor = owner.dofs[dof].motor
    field = {"position": "kp", "velocity": "kd"}.get(motor.kind)
    if field is None or not getattr(motor, field):
        raise InputError(
            f'gain: the motor "{model.control_names[k]}" has none; its kind is {motor.kind} without kp and kd'
        )
    moved = replace(owner.dofs[dof], motor=replace(motor, **{field: value}))
    draft["joints"][joint] = replace(owner, dofs=(*owner.dofs[:dof], moved, *owner.dofs[dof + 1 :]))


def material_with(material: Material, field: str, value: float) -> Material:
    """A material with another number; static friction changes in proportion to `friction`."""
    static = material.friction_static
    if field == "friction" and static is not None:
        static = value * static / material.friction if material.friction > 0 else max(value, static)
        return replace(material, friction=value, friction_static=static)
    return replace(material, **{field: value})


def _of_geoms(field: str) -> tuple[Any, Any]:
    def read(model: Model, draft: Draft, k: int) -> float:
        return getattr(draft["geoms"][k].material, field)

    def write(model: Model, draft: Draft, k: int, value: float) -> None:
        geom = draft["geoms"][k]
        draft["geoms"][k] = replace(geom, material=material_with(geom.material, field, value))

    return read, write


def _geom_names(model: Model) -> Sequence[str]:
    return model.geom_names


def _bodies_of_geoms(model: Model) -> list[str]:
    return ["" if k < 0 else model.link_names[k] for k in model.geom_links]


def _links(model: Model) -> Sequence[str]:
    return model.link_names


def _controls(model: Model) -> Sequence[str]:
    return model.control_names


FRICTION = Quantity("geom or body", "", _geom_names, *_of_geoms("friction"), _bodies_of_geoms)
RESTITUTION = Quantity("geom or body", "", _geom_names, *_of_geoms("restitution"), _bodies_of_geoms)
MASS = Quantity("body or link", "kg", _links, _read_mass, _write_mass, _no_owners(_links))
DAMPING = Quantity(
    "degree of freedom",
    "N s/m or N m s/rad",
    _degree_names,
    *_of_degrees("damping", "ball_damping"),
    _joints_of_degrees,
)
ARMATURE = Quantity(
    "degree of freedom",
    "kg or kg m^2",
    _degree_names,
    *_of_degrees("armature", "ball_armature"),
    _joints_of_degrees,
)
GAIN = Quantity("control", "", _controls, _read_gain, _write_gain, _no_owners(_controls))
QUANTITIES = {
    "friction": FRICTION,
    "restitution": RESTITUTION,
    "mass": MASS,
    "damping": DAMPING,
    "armature": ARMATURE,
    "gain": GAIN,
}


def values_of(what: str, model: Model, at: Iterable[int]) -> list[float]:
    """The present values of a quantity at some places."""
    draft = draft_of(model)
    return [float(QUANTITIES[what].read(model, draft, k)) for k in at]


def checked(what: str, pattern: object, value: Any) -> float:
    return number(f'{what} of "{pattern}"', value)
