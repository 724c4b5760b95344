"""What is left of the law in the motion of any engine: overlap, creep, gaps of joints, energy."""

from __future__ import annotations

import math
from typing import Any

import amontons
import numpy as np

from .cases import Case
from .engine import WORLD, Motion

Array = np.ndarray[Any, Any]
LOST = 1e4
"""m: who is further away, or nowhere, is lost."""


class Judge:
    """Watches a run at equal times; all numbers are ours, from poses and velocities."""

    def __init__(self, case: Case, model: amontons.Model, samples: int) -> None:
        self.case, self.model, self.samples = case, model, samples
        self.start = Motion.start(model)
        self.mass = np.array([b.mass if b.motion == "dynamic" else 0.0 for b in model.bodies])
        self.inertia = np.array([b.inertia for b in model.bodies], dtype=float)
        self.centre = np.array([b.centre_of_mass for b in model.bodies], dtype=float)
        self.gravity = np.array(model.gravity, dtype=float)
        self.energies = [self.energy(self.start)[0]]
        self.kinetic = 0.0
        self.overlaps: list[float] = []
        self.gaps: list[float] = []
        self.settled = self.last = self.start
        self.lost = False

    def look(self, motion: Motion) -> None:
        poses = np.concatenate([motion.positions, motion.orientations], axis=1)
        if not (np.isfinite(poses).all() and np.abs(poses).max() < LOST):
            self.lost = True
            return
        energy, kinetic = self.energy(motion)
        self.energies.append(energy)
        self.kinetic = max(self.kinetic, kinetic)
        self.overlaps.append(overlap(self.model, motion))
        self.gaps.append(joint_gap(self.model, motion))
        if len(self.gaps) == self.samples // 2:
            self.settled = motion
        self.last = motion

    def energy(self, motion: Motion) -> tuple[float, float]:
        """Kinetic and potential, and the first alone (J); without springs."""
        turn = rotations(motion.orientations)
        arm = np.einsum("nij,nj->ni", turn, self.centre)
        velocity = motion.linear + np.cross(motion.angular, arm)
        local = np.einsum("nji,nj->ni", turn, motion.angular)
        moving = self.mass > 0
        kinetic = 0.5 * float(
            (self.mass * (velocity**2).sum(axis=1)).sum()
            + np.einsum("ni,nij,nj->n", local, self.inertia, local)[moving].sum()
        )
        potential = -float((self.mass * ((motion.positions + arm) @ self.gravity)).sum())
        return kinetic + potential, kinetic

    def verdict(self, done: float) -> dict[str, Any]:
        """`done`: the part of the run that was made."""
        complete = done == 1.0
        half = 0.5 * self.case.duration
        creep = float(np.linalg.norm(self.last.positions - self.settled.positions, axis=1).max()) / half
        rise = float(np.max(np.array(self.energies) - np.minimum.accumulate(self.energies)))
        # Files may begin with overlaps.
        counted = self.overlaps[self.samples // 2 :] if self.case.path else self.overlaps
        overlap_of_run = max(counted, default=0.0)
        off = max(overlap_of_run, max(self.gaps, default=0.0))
        drift = None
        if self.case.conserves:
            change = np.abs(np.array(self.energies) - self.energies[0]).max()
            drift = float(change / self.kinetic) if self.kinetic else math.inf
        if self.case.rests:
            off = max(off, creep * half)
        if self.case.slides is not None:
            way = float(np.linalg.norm(self.last.positions[0] - self.start.positions[0]))
            off = max(off, abs(way - self.case.slides))
        if self.lost:
            off = math.inf
        return {
            "complete": complete, "lost": self.lost,
            "penetration": overlap_of_run,
            "creep": creep if self.case.rests and complete else "",
            "joint_error": max(self.gaps, default=0.0) if self.model.joints else "",
            "energy_rise": "" if self.case.path else rise,
            "energy_drift": "" if drift is None else drift,
            "off": off,
        }  # fmt: skip


def rotations(q: Array) -> Array:
    """Matrices of quaternions, w first, of any length."""
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def overlap(model: amontons.Model, motion: Motion) -> float:
    """The deepest one in these poses (m)."""
    if not any(g.category or g.mask for g in model.geoms):
        return 0.0
    # The step is so short, and ends so early, that it does nothing but to look for contacts.
    simulation = amontons.Simulation(model, dt=1e-6, on_failure="ignore", max_iterations=1, threads=1)
    size = np.linalg.norm(motion.orientations, axis=1, keepdims=True)
    simulation.state.positions, simulation.state.orientations = motion.positions, motion.orientations / size
    return simulation.step().penetration


def joint_gap(model: amontons.Model, motion: Motion) -> float:
    """The largest distance of the two points of a joint that should coincide (m); slides have none."""
    largest = 0.0
    turn = rotations(motion.orientations)

    def point(body: int, frame: amontons.Transform, anchor: tuple[float, ...]) -> Array:
        local = np.array(frame(anchor))
        return local if body == WORLD else motion.positions[body] + turn[body] @ local

    for joint in model.joints:
        anchors = {dof.anchor for dof in joint.dofs}
        if joint.kind != "chain" or len(anchors) > 1 or any(dof.kind != "hinge" for dof in joint.dofs):
            continue
        (anchor,) = anchors or {(0.0, 0.0, 0.0)}
        ends = point(joint.body_a, joint.frame_a, anchor), point(joint.body_b, joint.frame_b, anchor)
        gap = float(np.linalg.norm(ends[0] - ends[1]))
        largest = max(largest, gap) if math.isfinite(gap) else math.inf
    return largest
