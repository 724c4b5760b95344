"""Joints as an engineer reads them: the force of each, where it acts, and how much of the joint it uses."""

from __future__ import annotations

import numpy as np

from ...checks import Array
from .joints import Joint
from .polygons import outwards
from .statics import Equilibrium, Statics

JOINTS = np.dtype(
    [
        ("a", np.int32),
        ("b", np.int32),
        ("point", np.float64, 3),
        ("normal", np.float64, 3),
        ("force", np.float64, 3),
        ("compression", np.float64),
        ("shear", np.float64),
        ("friction_used", np.float64),
        ("eccentricity", np.float64),
        ("area", np.float64),
    ]
)
"""Rows of `Stability.joint_forces`. a, b: indices of the blocks. point: where the force acts (m, world).
normal: from b to a. force: on block a (N, world). compression, shear: along the normal and across it (N).
friction_used: shear over what friction and cohesion bear, 1 slides. eccentricity: of the point from the
centroid of the face, 1 on its edge, where the joint opens as a hinge. area: m^2. Without compression point is
the centroid, and eccentricity 0."""


def joint_rows(statics: Statics, equilibrium: Equilibrium) -> np.ndarray:
    """(j,) rows of JOINTS for the forces of an equilibrium."""
    forces, _ = statics.sums(equilibrium)
    points, owner = statics.corners
    pressed = np.maximum(equilibrium.forces[:, 0], 0.0)
    rows = np.zeros(len(statics.joints), dtype=JOINTS)
    shear_at = np.linalg.norm(equilibrium.forces[:, 1:], axis=1)
    borne_at = statics.mu * (equilibrium.forces[:, 0] + statics.shift[: 3 * len(owner)].reshape(-1, 3)[:, 0])
    scale = float(np.linalg.norm(statics.weights[:, :3], axis=1).max(initial=0.0))
    for k, joint in enumerate(statics.joints):
        mine = owner == k
        compression = float(forces[k] @ joint.normal)
        shear = float(np.linalg.norm(forces[k] - compression * joint.normal))
        total = float(pressed[mine].sum())
        middle = _centroid(joint)
        acts = total > 1e-9 * scale
        point = pressed[mine] @ points[mine] / total if acts else middle
        borne = float(borne_at[mine].sum())
        used = float(shear_at[mine].sum()) / borne if borne > 1e-9 * scale else 0.0
        far = 0.0
        if acts and len(joint.polygon) > 2:
            far = outwards(joint.flat, point @ joint.axes.T)
        rows[k] = (
            joint.a,
            joint.b,
            point,
            joint.normal,
            forces[k],
            compression,
            shear,
            used,
            far,
            joint.area,
        )
    return rows


def _centroid(joint: Joint) -> Array:
    return joint.polygon.mean(axis=0)
