"""What is left of the law in the motion of any engine, by us, from poses and velocities alone."""

from __future__ import annotations

import math
from typing import Any

import amontons
import numpy as np

from .law import law_left
from .plain import WORLD, Motion, Scene, matrix
from .scenes import Case

Array = np.ndarray[Any, Any]
LOST = 1e4
"""m, or m/s, or rad/s: who is further away or faster, or nowhere, is lost."""


def start_of(model: amontons.Model) -> Motion:
    bodies = model.bodies
    columns = (
        [b.pose.position for b in bodies], [b.pose.rotation for b in bodies],
        [b.linear_velocity for b in bodies], [b.angular_velocity for b in bodies],
    )  # fmt: skip
    return Motion(*(np.array(values, dtype=float) for values in columns))


class Measure:
    def __init__(self, case: Case, model: amontons.Model, scene: Scene, samples: int) -> None:
        self.case, self.model, self.scene, self.samples = case, model, scene, samples
        self.start = start_of(model)
        self.mass = np.array([b.mass if b.motion == "dynamic" else 0.0 for b in model.bodies])
        self.inertia = np.array([b.inertia for b in model.bodies], dtype=float)
        self.centre = np.array([b.centre_of_mass for b in model.bodies], dtype=float)
        self.gravity = np.array(model.gravity, dtype=float)
        self.energies = [self.energy(self.start)[0]]
        self.spins = [self.angular_momentum(self.start)]
        self.kinetic = 0.0
        self.overlaps: list[float] = []
        self.gaps: list[float] = []
        self.laws: list[float] = []
        self.lift = 0.0
        self.settled = self.last = self.start
        self.measured = case.follows() if case.follows else None
        self.missed: list[float] = []
        self.lost = False

    def look(self, motion: Motion) -> None:
        state = np.concatenate([motion.positions, motion.orientations, motion.linear, motion.angular], axis=1)
        if not np.abs(state).max() < LOST:  # nor is a number that is none
            self.lost = True
            return
        energy, kinetic = self.energy(motion)
        self.energies.append(energy)
        self.spins.append(self.angular_momentum(motion))
        self.kinetic = max(self.kinetic, kinetic)
        self.overlaps.append(overlap(self.model, motion))
        self.gaps.append(joint_gap(self.scene, motion))
        self.lift = max(self.lift, float((motion.positions - self.start.positions)[0, 2]))
        if self.measured is not None:
            place = self.measured[len(self.measured) * len(self.gaps) // self.samples - 1]
            self.missed.append(float(np.linalg.norm(motion.positions - place, axis=1).mean()))
        if len(self.gaps) == self.samples // 2:
            self.settled = motion
        self.last = motion

    def judge(self, motion: Motion, contacts: Array, dt: float) -> None:
        """The forces of a step of `dt`, and the motion after it."""
        unit = float(np.linalg.norm(self.gravity)) * self.case.dt
        self.laws.append(law_left(self.scene, motion, contacts, dt, unit))

    def energy(self, motion: Motion) -> tuple[float, float]:
        """Kinetic and potential, and the first alone (J); without springs."""
        turn, arm, velocity = self._centres(motion)
        local = np.einsum("nji,nj->ni", turn, motion.angular)
        moving = self.mass > 0
        kinetic = 0.5 * float(
            (self.mass * (velocity**2).sum(axis=1)).sum()
            + np.einsum("ni,nij,nj->n", local, self.inertia, local)[moving].sum()
        )
        potential = -float((self.mass * ((motion.positions + arm) @ self.gravity)).sum())
        return kinetic + potential, kinetic

    def angular_momentum(self, motion: Motion) -> Array:
        """About the world's origin (N m s)."""
        turn, arm, velocity = self._centres(motion)
        own = np.einsum("nij,njk,nlk,nl->ni", turn, self.inertia, turn, motion.angular)
        orbit = self.mass[:, None] * np.cross(motion.positions + arm, velocity)
        return (own[self.mass > 0].sum(axis=0) + orbit.sum(axis=0)) if len(own) else np.zeros(3)

    def _centres(self, motion: Motion) -> tuple[Array, Array, Array]:
        turn = rotations(motion.orientations)
        arm = np.einsum("nij,nj->ni", turn, self.centre)
        return turn, arm, motion.linear + np.cross(motion.angular, arm)

    def verdict(self, done: float) -> dict[str, Any]:
        """`done`: the part of the run that was made. `error`: see `distances`."""
        complete = done == 1.0
        case, half = self.case, 0.5 * self.case.duration
        creep = float(np.linalg.norm(self.last.positions - self.settled.positions, axis=1).max()) / half
        rise = float(np.max(np.array(self.energies) - np.minimum.accumulate(self.energies)))
        # Files may begin with overlaps.
        counted = self.overlaps[self.samples // 2 :] if case.path else self.overlaps
        deepest, gap = max(counted, default=0.0), max(self.gaps, default=0.0)
        drift = turning = ""
        if case.conserves:
            change = np.abs(np.array(self.energies) - self.energies[0]).max()
            drift = float(change / self.kinetic) if self.kinetic else math.inf
        if case.conserves and not self.gravity.any():
            size = float(np.linalg.norm(self.spins[0]))
            turning = float(np.linalg.norm(np.array(self.spins) - self.spins[0], axis=1).max() / size)
        lengths = self.distances(rise)
        return {
            "complete": complete, "lost": self.lost,
            "penetration": deepest,
            "creep": creep if case.rests and complete else "",
            "lift": self.lift if case.lifts else "",
            "law": float(np.mean(self.laws)) if self.laws else "",
            "joint_error": gap if self.scene.joints else "",
            "energy_rise": "" if case.path else rise,
            "energy_drift": drift,
            "momentum_drift": turning,
            "measured": float(np.mean(self.missed)) if self.missed else "",
            "error": math.inf if self.lost and lengths else max(lengths, default=""),
        }  # fmt: skip

    def distances(self, rise: float) -> list[float]:
        """How far the run is from what the scene is about, each as a length (m): from the place where bodies
        rest, from a closed form, from a measured path; gaps of joints; energy over the weight, which is a
        height. An overlap is none: soft contacts have one by design. Empty where the scene has no answer.

        rise: of the energy (J).
        """
        case, start, last = self.case, self.start, self.last
        weight = float(self.mass.sum() * np.linalg.norm(self.gravity))  # N
        found = [max(self.gaps, default=0.0)] if self.scene.joints else []
        if case.rests:
            # A robot settles first: its file makes its feet soft.
            place = self.settled if case.keyframe else start
            found.append(float(np.linalg.norm(last.positions - place.positions, axis=1).max()))
        if case.goes is not None:
            found.append(abs(float(np.linalg.norm(last.positions[0] - start.positions[0])) - case.goes))
        if case.ends is not None:
            found.append(abs(float(np.linalg.norm(last.linear[0])) - case.ends) * case.duration)
        if case.turns is not None:
            # A quaternion cannot tell more than half a turn.
            turn = 2 * math.acos(min(1.0, abs(float(start.orientations[0] @ last.orientations[0]))))
            found.append(abs(turn - case.turns[0]) * case.turns[1])
        if case.lifts:
            found.append(self.lift)
        if case.conserves and weight:
            found.append(float(np.abs(np.array(self.energies) - self.energies[0]).max()) / weight)
        elif case.conserves:
            # Of a free body, as the way of a point at the radius of gyration: dL / L is an angle.
            spins = np.array(self.spins)
            radius = math.sqrt(float(self.inertia.trace(axis1=1, axis2=2).sum()) / 2 / self.mass.sum())
            turned = np.linalg.norm(spins - spins[0], axis=1).max() / np.linalg.norm(spins[0])
            energies = np.abs(np.array(self.energies) / self.energies[0] - 1).max()
            found.append(radius * float(max(turned, energies)))
        if case.dissipates:
            found.append(rise / weight)
        if self.missed:
            found.append(float(np.mean(self.missed)))
        return found


def rotations(q: Array) -> Array:
    """Matrices of quaternions, w first, of any length."""
    return np.array([matrix(one) for one in q])


def overlap(model: amontons.Model, motion: Motion) -> float:
    """The deepest one in these poses (m)."""
    if not any(g.category or g.mask for g in model.geoms):
        return 0.0
    # The step is so short, and ends so early, that it does nothing but to look for contacts.
    simulation = amontons.Simulation(model, dt=1e-6, on_failure="ignore", max_iterations=1, threads=1)
    size = np.linalg.norm(motion.orientations, axis=1, keepdims=True)
    simulation.state.positions, simulation.state.orientations = motion.positions, motion.orientations / size
    return simulation.step().penetration


def joint_gap(scene: Scene, motion: Motion) -> float:
    """The largest distance of the two points of a joint that should coincide (m)."""
    largest = 0.0

    def point(body: int, local: tuple[float, ...]) -> Array:
        if body == WORLD:
            return np.array(local)
        return motion.positions[body] + matrix(motion.orientations[body]) @ np.array(local)

    for joint in scene.joints:
        gap = float(np.linalg.norm(point(joint.a, joint.point_a) - point(joint.b, joint.point_b)))
        largest = max(largest, gap) if math.isfinite(gap) else math.inf
    return largest
