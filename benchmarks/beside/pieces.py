"""How far an engine comes from tiny steps within a short piece of a motion, begun anew from its start.

A whole run tells little of this where the motion is chaotic: there all errors grow to the size of the scene.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import amontons
import numpy as np

from .engine import Engine
from .measure import rotations
from .plain import Frame, Motion, Scene, Unsupported
from .scenes import Case

COUNT, STEPS = 4, 10
"""Pieces of a run, and time steps of the scene in each."""
FINE = 100
"""Steps of the reference per time step of the scene; its own error is so much smaller, or its square."""
ARM = 0.1
"""m: turns count by the way of a point so far from the origin of its body."""


@cache
def reference(case: Case) -> tuple[tuple[Motion, Motion], ...]:
    """The motion at both ends of each piece, from our own engine at tiny steps and a tight tolerance."""
    simulation = amontons.Simulation(
        case.make(), dt=case.dt / FINE, tolerance=1e-9, on_failure="ignore", threads=1
    )
    found = []
    for k in range(COUNT):
        if k:
            simulation.run(k * case.duration / COUNT - simulation.time)
        begin = motion_of(simulation)
        simulation.run(STEPS * case.dt)
        found.append((begin, motion_of(simulation)))
    return tuple(found)


def motion_of(simulation: amontons.Simulation) -> Motion:
    s = simulation.state
    columns = (s.positions, s.orientations, s.linear_velocities, s.angular_velocities)
    return Motion(*(np.array(values) for values in columns))


def moved(scene: Scene, motion: Motion) -> Scene:
    """The scene with its bodies as they are in a motion."""
    columns = zip(*(getattr(motion, key).tolist() for key in Motion.__annotations__), strict=True)
    bodies = [
        replace(body, frame=Frame(tuple(position), tuple(turn)), velocity=tuple(velocity), spin=tuple(spin))
        for body, (position, turn, velocity, spin) in zip(scene.bodies, columns, strict=True)
    ]
    return replace(scene, bodies=tuple(bodies))


def deviation(engine: Engine, scene: Scene, case: Case, steps_per_dt: int) -> float | str:
    """The largest distance of a point at the end of a piece, the mean over pieces (m); blank where the engine
    cannot begin from there, or loses its bodies."""
    found = []
    for begin, end in reference(case):
        try:
            running = engine.start(moved(scene, begin), case.dt / steps_per_dt)
            running.advance(STEPS * steps_per_dt)
            found.append(apart(running.motion(), end))
            running.close()
        except Unsupported:
            return ""
    mean = float(np.mean(found))
    return mean if math.isfinite(mean) else ""


def apart(one: Motion, other: Motion) -> float:
    """The largest distance between points of bodies in two motions (m)."""
    a, b = (m.positions[:, None] + ARM * rotations(m.orientations).transpose(0, 2, 1) for m in (one, other))
    return float(np.linalg.norm(a - b, axis=-1).max())
