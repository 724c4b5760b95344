"""A body pulled by a spring between a point of it and the pointer."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..checks import Array
from ..model.groups import connected
from ..model.model import Model
from ..model.turns import conjugate, rotate
from ..simulation.simulation import Simulation

FREQUENCY = 1.5
"""Frequency of the pulled bodies on the spring (Hz)."""
STABLE = 0.03
"""The spring changes a velocity of the point within a step by at most this part of what would overshoot."""


class Spring:
    """Force k d - c v at a point of a body, held as a load during each step.

    k follows from the mass M of all that joints connect with the body, k = M (2 pi f)^2, and c damps
    critically. Since a load is that of the start of the step, both stay below what the light body alone
    could take: m / dt^2 and m / dt, with m its effective mass at the point, in any direction. A held force is
    half a step late, which takes k dt / 2 from c: of c at its bound, a quarter.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._mass = connected_mass(simulation.model)
        self.body: int | None = None
        self._arm = np.zeros(3)  # of the point about the origin of the body frame, in body axes
        self._target = np.zeros(3)
        self._load = np.zeros(6)  # what of the held load is ours

    def grab(self, body: int, point: Array) -> None:
        """Take the body at a point of the world."""
        self.release()
        state = self._simulation.state
        self.body = body
        self._arm = rotate(conjugate(state.orientations[body]), point - state.positions[body])
        self._target = point.copy()

    def pull(self, target: Array) -> None:
        """Draw the point to where the pointer is now."""
        self._target = target.copy()

    def release(self) -> None:
        """Let go, and take the load back."""
        if self.body is not None:
            self._hold(np.zeros(6))
        self.body = None

    def ends(self) -> tuple[Array, Array] | None:
        """The point and where it is drawn to; None while nothing is held."""
        return None if self.body is None else (self._point(), self._target)

    def before_step(self, simulation: Simulation) -> None:
        """Renew the load; one of `Simulation.before_step`."""
        if self.body is None:
            return
        b, state, part = self.body, simulation.state, simulation.model.bodies[self.body]
        if part.motion != "dynamic":
            return
        arm, centre = rotate(state.orientations[b], (self._arm, part.centre_of_mass))
        velocity = state.linear_velocities[b] + np.cross(state.angular_velocities[b], arm)
        about_centre = arm - centre
        least = 1 / part.mass + float(about_centre @ about_centre) / np.linalg.eigvalsh(part.inertia)[0]
        omega = 2 * math.pi * FREQUENCY
        stiffness = min(self._mass[b] * omega**2, STABLE / 2 / least / simulation.dt**2)
        damping = min(2 * math.sqrt(stiffness * self._mass[b]), STABLE / least / simulation.dt)
        force = stiffness * (self._target - self._point()) - damping * velocity
        self._hold(np.concatenate((force, np.cross(about_centre, force))))

    def _point(self) -> Array:
        assert self.body is not None
        state = self._simulation.state
        return state.positions[self.body] + rotate(state.orientations[self.body], self._arm)

    def _hold(self, load: Array) -> None:
        """Beside what the user holds."""
        state = self._simulation.state
        state.forces[self.body] += load[:3] - self._load[:3]
        state.torques[self.body] += load[3:] - self._load[3:]
        self._load = load


def connected_mass(model: Model) -> Array:
    """By body, the mass of all dynamic bodies that joints connect with it (kg)."""
    dynamic = {b for b, body in enumerate(model.bodies) if body.motion == "dynamic"}
    ends: list[tuple[Any, Any]] = [(joint.body_a, joint.body_b) for joint in model.joints]
    roots = np.array(connected(len(model.bodies), (pair for pair in ends if dynamic.issuperset(pair))), int)
    masses = np.array([body.mass if b in dynamic else 0.0 for b, body in enumerate(model.bodies)])
    return np.bincount(roots, weights=masses, minlength=len(roots))[roots] if len(roots) else masses
