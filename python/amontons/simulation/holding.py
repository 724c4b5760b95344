"""Forces of some joints that hold a pose. The others are passive, and closed loops carry the rest."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .. import _core
from ..checks import Array, sequence, shown, suggestion, text
from ..errors import InputError
from ..model.coordinates import known
from ..model.model import Model

LEFT = 1e-8
"""Relative: forces of which so much is left are not held."""


def held_by(core: _core.Simulation, model: Model, joints: Iterable[str], forces: Array) -> Array:
    """The smallest forces along the named coordinates with the power of `forces` in every motion that closed
    loops and couplings allow.

    With the columns P of such motions and the entries S of the coordinates it is P' S tau = P' forces.
    """
    entries = _entries(model, joints)
    motions = _motions(core, model)
    wanted = motions.T @ forces
    found = np.linalg.lstsq(motions[entries].T, wanted, rcond=1e-10)[0]
    left = motions[entries].T @ found - wanted
    most = float(np.abs(forces).max(initial=0.0))
    if np.abs(left).max(initial=0.0) > LEFT * most:
        worst = model.qd_names[int(np.argmax(np.abs(motions @ left)))]
        raise InputError(
            f'these joints cannot hold "{worst}"; add the joint that moves it, or leave out joints= if '
            "contacts carry it"
        )
    tau = np.zeros(model.nv)
    tau[entries] = found
    return tau


def _entries(model: Model, joints: Iterable[str]) -> list[int]:
    """Where the coordinates of these names are in qd; of a joint's name all of its coordinates."""
    if isinstance(joints, str):
        raise InputError(f"joints is {shown(joints)}; give several names, as ({shown(joints)},)")
    found: set[int] = set()
    for name in sequence("joints", joints):
        text("joints: a name", name)
        own = [
            c
            for key, c in model.coordinates.items()
            if key == name or (c.joint >= 0 and model.joints[c.joint].name == name)
        ]
        if not own:
            near = suggestion(name, model.coordinates)
            raise InputError(
                f"joints: there is no coordinate {shown(name)}{near}; known are "
                f"{known(tuple(model.coordinates))}"
            )
        found.update(k for c in own for k in range(c.qd.start, c.qd.stop))
    return sorted(found)


def _motions(core: _core.Simulation, model: Model) -> Array:
    """(nv, nv): columns that span the velocities that closed loops and couplings allow."""
    probe, none = core.copy(), np.zeros(model.nv, np.uint8)
    columns = []
    for unit in np.eye(model.nv):
        model.tree.set_qd(probe, unit, none)
        columns.append(model.tree.coordinates(probe)[1])
    return np.array(columns).T
