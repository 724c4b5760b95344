"""Generalised coordinates of a simulation: how values are given, and where a joint's are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, shown, suggestion
from ..errors import InputError
from ..model.coordinates import known
from ..model.model import Model

Values = ArrayLike | Mapping[str, Any]
"""All entries, or some by the names of their coordinates."""


def spread(core: _core.Simulation, model: Model, values: Values, what: str) -> tuple[Array, Any]:
    """All entries of q or qd, and which velocities are held."""
    tree, coordinates = model.tree, model.coordinates
    held = np.zeros(tree.nv, np.uint8)
    size = tree.nq if what == "q" else tree.nv
    if not isinstance(values, Mapping):
        return entries(what, values, size), held
    full = tree.coordinates(core)[what == "qd"]
    for name, value in values.items():
        if name not in coordinates:
            near = suggestion(name, coordinates)
            raise InputError(f'there is no coordinate "{name}"{near}; known are {known(tuple(coordinates))}')
        part = getattr(coordinates[name], what)
        full[part] = entries(f'{what} of "{name}"', value, part.stop - part.start)
        held[coordinates[name].qd] = 1
    return full, held


def entry(model: Model, joint: int | str, dof: int) -> int:
    """Where a degree of freedom is in qd."""
    joint, dof = degree(model, joint, dof)
    model.dof_index(joint, dof)
    j = model.joint_index(joint)
    for _, _, own, _, _, _, first, _ in model.tree.links:
        if own == j:
            return first + dof
    raise InputError(
        f'joint "{model.joints[j].name}" closes a loop and has no entry in qd; its rate follows '
        "from the others: read simulation.kinematics.rate"
    )


def degree(model: Model, joint: int | str, dof: int) -> tuple[int | str, int]:
    """A joint and its degree of freedom, which may be given by the name of the latter."""
    if isinstance(joint, str) and joint not in model.joint_names:
        named = model.coordinates.get(joint)
        if named is not None and named.dof >= 0:
            return named.joint, named.dof
    return joint, dof


def entries(what: str, values: Any, size: int) -> Array:
    try:
        array = np.array(values, dtype=np.float64)
    except Exception:  # NumPy asks the object, which may raise anything
        raise InputError(f"{what} is {shown(values)}; it must be numbers") from None
    if array.ndim == 0 and size == 1:
        array = array[None]
    if array.shape != (size,):
        raise InputError(f"{what} has the shape {array.shape}; the model asks for ({size},)")
    if not np.isfinite(array).all():
        raise InputError(f"{what}[{int(np.argmin(np.isfinite(array)))}] is not finite")
    return array


def read_only(array: Array) -> Array:
    array.flags.writeable = False
    return array
