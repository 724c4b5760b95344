"""A four-bar linkage with clearance in three bearings, beside the trajectory that Siconos computed.

A controller turns the crank after 6 sin(3/4 pi t) rad with the inverse dynamics of the linkage without
clearance (Akhadkar, Acary and Brogliato, Multibody System Dynamics 38, 2016). The parameters are those of
FourBarLinkageWith3clearance of siconos-tutorials: impacts without rebound, steps of 0.1 ms.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import amontons
import numpy as np

Array = np.ndarray[Any, Any]
BASE, CRANK, COUPLER, ROCKER = 3.0, 1.0, 4.0, 2.5  # lengths (m); each bar has 1 kg
JOURNAL, CLEARANCE, FRICTION, G = 0.055, 0.005, 0.1, 9.81  # m, m, 1, m/s^2
GAIN, RATE = 200.0, 10.0  # of the controller: N m s, 1/s
SWING, TURN = 6.0, 0.75 * math.pi  # of the wanted angle: rad, rad/s
STEPS = (1e-3, 1e-4, 1e-5)  # s
POSES = slice(1, 8)
"""Columns: angles of crank, coupler and rocker (rad), centres of coupler and rocker (m), those of the rocker
from its own pivot."""
RATE_OF_CRANK, TORQUE = 8, 35
"""Columns: rad/s, and the controller's torque with the other sign (N m)"""
BARS = ("crank", "coupler", "rocker")


def wanted(t: float) -> tuple[float, float, float]:
    """Angle of the crank and its first two derivatives."""
    sine, cosine = math.sin(TURN * t), math.cos(TURN * t)
    return SWING * sine, SWING * TURN * cosine, -SWING * TURN**2 * sine


def closed(crank: float) -> tuple[float, float]:
    """Angles of coupler and rocker without clearance, the joint between them above the base."""
    x, y = BASE - CRANK * math.cos(crank), -CRANK * math.sin(crank)  # from the crank to the rocker's pivot
    far = math.hypot(x, y)
    inner = math.acos((COUPLER**2 + far**2 - ROCKER**2) / (2 * COUPLER * far))
    coupler = math.atan2(y, x) + inner
    rocker = math.atan2(COUPLER * math.sin(coupler) - y, COUPLER * math.cos(coupler) - x)
    return coupler, rocker


def torque(t: float, crank: float, rate: float) -> float:
    """The controller of Slotine and Li on the crank of the linkage without clearance (N m)."""
    coupler, rocker = closed(crank)
    # Angles of coupler and rocker change by so much per angle of the crank, and that changes so.
    bend = math.sin(coupler - rocker)
    a = CRANK * math.sin(rocker - crank) / (COUPLER * bend)
    b = CRANK * math.sin(coupler - crank) / (ROCKER * bend)
    turn = (a - b) * math.cos(coupler - rocker) / bend
    a_next = CRANK * math.cos(rocker - crank) * (b - 1) / (COUPLER * bend) - a * turn
    b_next = CRANK * math.cos(coupler - crank) * (a - 1) / (ROCKER * bend) - b * turn
    near, near_next = math.cos(crank - coupler), math.sin(coupler - crank) * (1 - a)
    inertia = (CRANK**2 * 4 + COUPLER**2 * a * a + ROCKER**2 * b * b) / 3 + CRANK * COUPLER * near * a
    # The reference has a rocker of a quarter of its inertia in this term.
    change = COUPLER**2 / 3 * a * a_next + ROCKER**2 / 6 * b * b_next
    change += 0.5 * CRANK * COUPLER * (near * a_next + a * near_next)
    weight = 1.5 * CRANK * math.cos(crank) + 0.5 * COUPLER * a * math.cos(coupler)
    weight += 0.5 * ROCKER * b * math.cos(rocker)
    goal, goal_rate, goal_change = wanted(t)
    late, slow = crank - goal, rate - goal_rate
    moved = inertia * (goal_change - RATE * slow) + change * rate * (rate - RATE * late)
    return moved - GAIN * (slow + RATE * late) + G * weight


def linkage(poses: Array) -> amontons.Model:
    """In the plane of x and y, at the columns POSES."""
    builder = amontons.ModelBuilder(gravity=(0, -G, 0))
    middle = (0.5 * CRANK * math.cos(poses[0]), 0.5 * CRANK * math.sin(poses[0]))
    bars = (
        ("crank", CRANK, poses[0], middle), ("coupler", COUPLER, poses[1], poses[3:5]),
        ("rocker", ROCKER, poses[2], (BASE + poses[5], poses[6])),
    )  # fmt: skip
    for name, length, angle, centre in bars:
        builder.add_body(
            name, mass=1, inertia=(length**2 / 12,) * 3, position=(*centre, 0),
            orientation=(math.cos(angle / 2), 0, 0, math.sin(angle / 2)),
        )  # fmt: skip
    builder.add_revolute_joint("crank", point=(0, 0, 0), axis=(0, 0, 1), name="drive")
    ends = (
        ("crank", CRANK / 2, "coupler", -COUPLER / 2), ("coupler", COUPLER / 2, "rocker", ROCKER / 2),
        ("rocker", -ROCKER / 2, None, BASE),
    )  # fmt: skip
    for a, journal, b, bearing in ends:
        builder.add_joint(amontons.Joint(
            f"{a} bearing", body_a=a, body_b=b, frame_a=amontons.Transform((journal, 0, 0)),
            frame_b=amontons.Transform((bearing, 0, 0)), clearance=CLEARANCE, journal_radius=JOURNAL,
            clearance_friction=FRICTION,
            dofs=(amontons.Dof("slide", (1, 0, 0)), amontons.Dof("slide", (0, 1, 0)),
                  amontons.Dof("hinge", (0, 0, 1))),
        ))  # fmt: skip
    return builder.build()


def run(poses: Array, dt: float, seconds: float, every: float) -> dict[str, Array]:
    """At each multiple of `every`: angles of the bars (rad), and how far the journals are from the middle of
    their bearings (m)."""
    simulation = amontons.Simulation(linkage(poses), dt=dt)
    turned, each, angles, places = poses[:3].copy(), round(every / dt), [], []
    drive = simulation.model.coordinates["drive"].q.start
    start = poses[0] - simulation.q[drive]
    for k in range(round(seconds / dt)):
        crank, rate = start + simulation.q[drive], simulation.qd[drive]
        simulation.state.joint_forces[drive] = torque(k * dt, crank, rate)
        simulation.step()
        if (k + 1) % each == 0:
            w, _, _, z = simulation.state.orientations.T
            turned = turned + np.mod(2 * np.arctan2(z, w) - turned + math.pi, 2 * math.pi) - math.pi
            angles.append(turned)
            bearings = simulation.state.joint_coordinates[1:].reshape(3, 3)
            places.append(np.hypot(bearings[:, 0], bearings[:, 1]))
    return {"angles": np.array(angles), "places": np.array(places)}


def rows(folder: Path, quick: bool) -> Iterator[dict[str, Any]]:
    for path in sorted(folder.glob("four_bar*.ref")):
        theirs = np.loadtxt(path, skiprows=1)
        poses, every = theirs[0, POSES], float(theirs[1, 0])
        own = [torque(*row[[0, 1, RATE_OF_CRANK]].tolist()) for row in theirs]
        unlike = float(np.abs(own + theirs[:, TORQUE]).max() / np.abs(theirs[:, TORQUE]).max())
        print(f"{path.stem}: our controller differs from theirs by {unlike:.1g} at their states")
        for dt in STEPS[:2] if quick else STEPS:
            found = run(poses, dt, float(theirs[-1, 0]), every)
            apart = 1e3 * np.abs(found["angles"] - theirs[1:, 1:4])
            rms = np.sqrt(np.mean(apart**2, axis=0))
            yield {
                "mechanism": path.stem, "step_ms": 1e3 * dt, "seconds": float(theirs[-1, 0]),
                **{f"rms_{name}_mrad": float(x) for name, x in zip(BARS, rms, strict=True)},
                "largest_mrad": float(apart.max()),
                "deepest_mm": 1e3 * float(found["places"].max() - CLEARANCE),
            }  # fmt: skip
