"""Velocities in the middle of steps, with which bodies move and which impulses change.

Those of the state are of the instant of the poses. Where velocities jump, or a body turns by a large part of
a turn within a step, sums of their energy and momentum over steps are not those of the motion.
"""

from __future__ import annotations

import amontons
import numpy as np
from amontons.model.transforms import rotation_matrix


def middle(sim: amontons.Simulation) -> amontons.Simulation:
    """A copy that has the velocities of the middle of the last step.

    Impulses change them: over the kick, which a first step begins with the velocities of the state.
    """
    other = sim.copy()
    other._core.show_middle()
    return other


def kick(sim: amontons.Simulation) -> float:
    """The time (s) over which the impulses of the last step acted."""
    return float(sim._core.impulse_step)


def energies_in_the_middle(sim: amontons.Simulation) -> tuple[float, float]:
    """Kinetic energy and that of gravity (J), of the bodies in the middle of the last step.

    The sum is exact for a projectile, impacts or not.
    """
    s, kinetic, potential = middle(sim).state, 0.0, 0.0
    for i, body in enumerate(sim.model.bodies):
        R = np.array(rotation_matrix(tuple(s.orientations[i])))
        arm, spin = R @ np.array(body.centre_of_mass), R.T @ s.angular_velocities[i]
        v = s.linear_velocities[i] + np.cross(s.angular_velocities[i], arm)
        kinetic += 0.5 * (body.mass * v @ v + spin @ np.array(body.inertia) @ spin)
        potential -= body.mass * np.array(sim.model.gravity) @ (s.positions[i] + arm - 0.5 * sim.dt * v)
    return float(kinetic), float(potential)
