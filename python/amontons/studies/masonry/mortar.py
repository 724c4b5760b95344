"""Mortar in time: the tension of a verdict as bonds of a model, which break for good."""

from __future__ import annotations

from dataclasses import replace

from ...model.model import Model
from ...model.parts import WORLD, Bond
from ...model.transforms import ORIGIN, conjugate, rotate
from .statics import Statics

OPENING = 1e-4
"""Default of the distance (m) at which mortar breaks. With a tensile strength of 0.1 MPa a break then takes
10 J/m^2"""


def bonded(statics: Statics, model: Model, *, opening: float) -> Model:
    """The model of the assembly with a bond at each corner of its joints, of the share of area of the corner.

    So joints resist what they resist in the verdict, until two sides are `opening` (m) apart.
    """
    points, owner = statics.corners
    tension = statics.shift[: 3 * len(owner) : 3]
    body = {name: index for index, name in enumerate(model.body_names)}
    names = statics.assembly.names
    bonds = []
    for point, k, pull in zip(points, owner.tolist(), tension.tolist(), strict=True):
        if not pull > 0:
            continue
        joint = statics.joints[k]
        ends = [body.get(names[block], WORLD) for block in (joint.a, joint.b)]
        poses = [ORIGIN if end == WORLD else model.bodies[end].pose for end in ends]
        places = [pose.inverse()(point) for pose in poses]
        normal = rotate(conjugate(poses[1].rotation), tuple(joint.normal))  # type: ignore[arg-type]
        bonds.append(Bond(*ends, *places, normal, pull, opening))
    return replace(model, bonds=(*model.bonds, *bonds))
