"""What is left of Coulomb's law in the forces that an engine tells, by us."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plain import WORLD, Motion, Scene

Array = np.ndarray[Any, Any]


def on_cone(v: Array, mu: float) -> Array:
    """The nearest points of the friction cone; the normal part is the first of each row."""
    normal, tangent = v[:, 0], v[:, 1:]
    size = np.linalg.norm(tangent, axis=1)
    along = np.maximum((normal + mu * size) / (1 + mu**2), 0.0)
    beside = np.column_stack([along, tangent * (mu * along / np.maximum(size, 1e-300))[:, None]])
    return np.where((size <= mu * normal)[:, None], v, beside)


def law_left(scene: Scene, motion: Motion, contacts: Array, dt: float, unit: float) -> float:
    """The natural residual of Coulomb's law over all contacts of a step `dt`, over the weight of the bodies.

    A row of `contacts` is body a, body b, the point, the normal towards a, the force on a, and the gap (SI,
    world axes). The residual is |f - P(f - s (u + mu |u_t| n))| with the nearest point P of the cone and s =
    weight / `unit`; u is the velocity of a against b in the point, and a gap may close within the step.
    `unit` (m/s) is the speed of a step of free fall. `motion` is that after the step, and the point that
    before it.
    """
    weight = sum(b.mass for b in scene.bodies if b.moves) * float(np.linalg.norm(scene.gravity))
    if not len(contacts):
        return 0.0
    mu = scene.geoms[0].friction
    point, normal, force, gap = contacts[:, 2:5], contacts[:, 5:8], contacts[:, 8:11], contacts[:, 11]
    u = velocity(motion, contacts[:, 0], point, dt) - velocity(motion, contacts[:, 1], point, dt)
    frame = np.array(
        [np.linalg.svd(n[None, :])[2] for n in normal]
    )  # rows: the normal, or its opposite, and tangents
    frame[:, 0] = normal
    f, u = np.einsum("nij,nj->ni", frame, force), np.einsum("nij,nj->ni", frame, u)
    u[:, 0] += np.maximum(gap, 0.0) / dt + mu * np.linalg.norm(u[:, 1:], axis=1)
    return float(np.linalg.norm(f - on_cone(f - weight / unit * u, mu))) / weight


def velocity(motion: Motion, bodies: Array, points: Array, dt: float) -> Array:
    """Of points that move with bodies, from where these were `dt` ago; the world rests."""
    k = bodies.astype(int)
    arm = points - (motion.positions[k] - dt * motion.linear[k])
    found = motion.linear[k] + np.cross(motion.angular[k], arm)
    found[k == WORLD] = 0.0
    return found
