"""A model in its keyframes, and with servos that hold it at targets; for robot/run.py."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

import amontons
import mujoco
import numpy as np
from common import SHARE, random_controls

from robot.energy import Energy

KEYFRAME, DRIVEN = 0.1, 1.0  # s: how long they run
FREQUENCY = 20.0  # rad/s, of the servos that joints without any get, critically damped


def keyframes(model: amontons.Model, m: Any, until: float) -> dict[str, Any]:
    """How many keyframes there are, how far bodies in them are from MuJoCo's (m), how many steps after them
    miss the tolerance, and what fails."""
    facts: dict[str, Any] = {"keyframes": len(model.keyframes)}
    if not model.keyframes:
        return facts
    simulation = amontons.Simulation(model, on_failure="ignore")
    off, missed, steps, failed = 0.0, 0, 0, []
    for name in model.keyframe_names:
        try:
            simulation.reset(name)
            off = max(off, distance(simulation, m, name))
            for _ in range(math.ceil(KEYFRAME / simulation.dt)):
                missed += not simulation.step().converged
                steps += 1
        except (amontons.InputError, amontons.SimulationError) as error:
            failed.append(f"{name}: {error}"[:100])
        if perf_counter() > until:
            break
    return facts | {
        "keyframe_error": off, "keyframe_in_lengths": off / model.length,
        "keyframes_failed": "; ".join(failed),
        "keyframe_missed_percent": 100 * missed / max(steps, 1),
    }  # fmt: skip


def distance(simulation: amontons.Simulation, m: Any, name: str) -> float:
    """The largest of a body or link from where MuJoCo has it (m); 0 without MuJoCo's model."""
    if m is None or (k := mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_KEY, name)) < 0:
        return 0.0
    data = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, data, k)
    mujoco.mj_kinematics(m, data)
    found = 0.0
    for place, at in zip(simulation.model.link_names, simulation.kinematics.links["position"], strict=True):
        body = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, place)
        if body >= 0:
            found = max(found, float(np.linalg.norm(at - data.xpos[body])))
    return found


def driven(model: amontons.Model, until: float) -> dict[str, Any]:
    """A run with all actuators at random controls; where there are none, all joints get servos at targets."""
    rng = np.random.default_rng(1)
    servos = [] if model.actuators else [c for c in model.coordinates.values() if c.dof >= 0]
    if servos:
        model = with_servos(model, servos, rng)
    elif not model.actuators:
        return {"driven": ""}
    simulation = amontons.Simulation(model, on_failure="ignore")
    for name, value in random_controls(model, rng).items():
        simulation.set_control(name, value)
    energy, wanted = Energy(simulation), math.ceil(DRIVEN / simulation.dt)
    stopped, reports = "", []
    while len(reports) < wanted and perf_counter() < until:
        try:
            reports.append(simulation.step())
        except amontons.SimulationError as error:
            stopped = str(error)[:200]
            break
        energy.add(reports[-1])
    gained, worst = energy.facts(), worst_of(reports, model.length)
    return {
        "driven": "actuators" if model.actuators else "servos", "driven_time": len(reports) * simulation.dt,
        "driven_missed_percent": 100 * worst["missed"] / max(len(reports), 1),
        "driven_residual": worst["residual"], "driven_joint_error": worst["joint_error"] / model.length,
        "driven_gain": gained["energy_gain"], "driven_gain_relative": gained["energy_gain_relative"],
        "driven_stopped": stopped,
    }  # fmt: skip


def worst_of(reports: Sequence[amontons.Report], length: float) -> dict[str, float]:
    """Missed steps, the largest residual, and the largest error of a joint, angles times a length (m)."""
    apart = (max(r.joint_error, length * r.joint_angle_error) for r in reports)
    return {
        "missed": sum(not r.converged for r in reports),
        "residual": max((r.residual for r in reports), default=0.0), "joint_error": max(apart, default=0.0),
    }  # fmt: skip


def with_servos(
    model: amontons.Model, coordinates: list[amontons.model.coordinates.Coordinate], rng: np.random.Generator
) -> amontons.Model:
    """Every hinge and slide with a position motor: of the inertia that it moves alone, critically damped."""
    inertia = np.diag(amontons.Simulation(model).forces.mass_matrix())
    joints = list(model.joints)
    for c in coordinates:
        dofs = list(joints[c.joint].dofs)
        dof = dofs[c.dof]
        low, high = (dof.lower, dof.upper) if math.isfinite(dof.upper - dof.lower) else (-1.0, 1.0)
        gain = float(inertia[c.qd.start]) * FREQUENCY**2
        target = 0.5 * (low + high) + SHARE * (high - low) * rng.uniform(-1, 1)
        motor = amontons.Motor("position", control=target, kp=gain, kd=2 * gain / FREQUENCY)
        dofs[c.dof] = replace(dof, motor=replace(motor, max_effort=dof.motor.max_effort))
        joints[c.joint] = replace(joints[c.joint], dofs=tuple(dofs))
    return replace(model, joints=tuple(joints))
