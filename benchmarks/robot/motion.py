"""The motion of a model beside MuJoCo's, of bases and end effectors; for robot/run.py."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import amontons
import mujoco
import numpy as np

Array = np.ndarray[Any, Any]
COMPARED, STEP = 0.5, 2e-3  # s: how long motions are compared, and with which step
FINER = 8  # MuJoCo's step over that of its reference
SPEED = 0.5  # rad/s, m/s: of the velocities at the start, one standard deviation
# Of equalities: MuJoCo raises the time constant to two steps, and lowers what an impedance may be.
HARD_SOLREF, HARD_SOLIMP = (1e-9, 1.0), (1.0, 1.0, 1e-3, 0.5, 2.0)
CONTROL = 0.1  # of the range of a control, above its middle or zero


@dataclass(frozen=True)
class Ends:
    """Bases and end effectors: bodies whose parent does not move, and those without children."""

    ours: list[int]
    theirs: list[int]
    length: float
    """by which an angle is a distance (m)"""

    @staticmethod
    def of(model: amontons.Model, m: Any) -> Ends:
        number = {}  # MuJoCo's by ours; what has no name there is called body_<index>
        for i, name in enumerate(model.body_names):
            k = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, name)
            unnamed = re.fullmatch(r"body_(\d+)_*", name)
            number[i] = int(unnamed[1]) if k < 0 and unnamed else k
        moving = {i: k for i, k in number.items() if k > 0 and m.body_weldid[k] != 0}
        inner: set[int] = set()
        for k in moving.values():
            while k := int(m.body_parentid[k]):
                inner.add(k)
        chosen = {i: k for i, k in moving.items() if k not in inner or m.body_weldid[m.body_parentid[k]] == 0}
        return Ends(list(chosen), list(chosen.values()), model.length)

    def distances(self, a: Motion, b: Motion) -> Array:
        """The largest distance of each body at equal times, its rotation times `length` added (m)."""
        n = min(len(a.positions), len(b.positions))
        if not n:
            return np.full(len(self.ours), math.nan)
        shift = np.linalg.norm(a.positions[:n] - b.positions[:n], axis=-1)
        cosine = np.abs((a.orientations[:n] * b.orientations[:n]).sum(axis=-1))
        # |p - q| or |p + q| of unit quaternions is 2 sin(angle / 4), exact also where the angle is tiny.
        chord = np.sqrt(np.maximum(0.0, 2 - 2 * np.minimum(cosine, 1.0)))
        total = shift + self.length * 4 * np.arcsin(np.minimum(0.5 * chord, 1.0))
        return np.where(np.isfinite(total), total, math.inf).max(axis=0)


@dataclass(frozen=True)
class Motion:
    """Of some bodies at multiples of STEP."""

    positions: Array  # (times, bodies, 3)
    orientations: Array  # (times, bodies, 4)


@dataclass(frozen=True)
class Kick:
    """What sets a model in motion, in the order that both have.

    Coordinates to add at the start, which close what is open there (MuJoCo would pull it together within its
    time constant, ours does within a tenth of a second); velocities, as far as loops allow them; controls.
    """

    closing: Array | None
    velocities: Array | None
    controls: dict[str, float]

    @staticmethod
    def of(model: amontons.Model, m: Any) -> Kick:
        start = amontons.Simulation(model)
        closing = velocities = None
        if (model.nq, model.nv) == (m.nq, m.nv):  # else bodies became one, or something was not read
            open_q = start.q.copy()
            start.q = open_q
            closing = start.q - open_q
            start.qd = SPEED * np.random.default_rng(0).normal(size=model.nv)
            velocities = start.qd.copy()
        controls = {}
        for name in model.actuator_names:
            k = mujoco_actuator(m, name)
            low, high = m.actuator_ctrlrange[k] if m.actuator_ctrllimited[k] else (-1.0, 1.0)
            controls[name] = float(min(max(0.0, low), high) + CONTROL * (high - low))
        return Kick(closing, velocities, controls)


def mujoco_actuator(m: Any, name: str) -> int:
    k = mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
    return int(name.rpartition("_")[2].strip("_")) if k < 0 else k


def our_motion(
    model: amontons.Model, ends: Ends, parts: int, until: float, kick: Kick | None = None
) -> Motion:
    """With `parts` steps in each STEP; shorter if the time is up or the simulation fails."""
    simulation = amontons.Simulation(model, dt=STEP / parts, on_failure="ignore")
    if kick is not None:
        if kick.velocities is not None:
            simulation.q = simulation.q + kick.closing
            simulation.qd = kick.velocities
        for name, value in kick.controls.items():
            simulation.set_control(name, value)
    positions, orientations = [], []
    for _ in range(round(COMPARED / STEP)):
        try:
            for _ in range(parts):
                simulation.step()
        except amontons.SimulationError:
            break
        positions.append(simulation.state.positions[ends.ours])
        orientations.append(simulation.state.orientations[ends.ours])
        if perf_counter() > until:
            break
    return Motion(np.array(positions), np.array(orientations))


def their_motion(m: Any, ends: Ends, parts: int, kick: Kick | None = None) -> Motion:
    data = mujoco.MjData(m)
    if kick is not None:
        if kick.velocities is not None:
            data.qpos += kick.closing
            data.qvel[:] = kick.velocities
        for name, value in kick.controls.items():
            data.ctrl[mujoco_actuator(m, name)] = value
    before = m.opt.timestep
    m.opt.timestep = STEP / parts
    positions, orientations = [], []
    for _ in range(round(COMPARED / STEP)):
        for _ in range(parts):
            mujoco.mj_step(m, data)
        mujoco.mj_kinematics(m, data)
        positions.append(data.xpos[ends.theirs])
        orientations.append(data.xquat[ends.theirs])
    m.opt.timestep = before
    return Motion(np.array(positions), np.array(orientations))


def free_motion(model: amontons.Model, m: Any, ends: Ends, until: float) -> dict[str, Any]:
    """Without contacts, limits and dry friction on both sides, against MuJoCo's implicit integrator.

    What is left out is soft in MuJoCo and hard here: where dry friction holds a joint, MuJoCo's creeps. So
    are equalities, which are made as hard as its step lets them be. All joints start with some velocity, all
    actuators have a control: a robot that falls freely would show nothing.

    Both methods are of first order, so that the error of a step is about twice what halving it changes (for
    MuJoCo, 8/7 of what the finer one changes). The larger of both errors of a body is what its difference is
    measured by; a millionth of a length is none.
    """
    if not ends.ours:
        return {"free": None}
    flags, integrator, off = int(m.opt.disableflags), int(m.opt.integrator), mujoco.mjtDisableBit
    m.opt.disableflags = flags | off.mjDSBL_CONTACT | off.mjDSBL_LIMIT | off.mjDSBL_FRICTIONLOSS
    m.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICIT
    softness = m.eq_solref.copy(), m.eq_solimp.copy()
    m.eq_solref[:], m.eq_solimp[:] = HARD_SOLREF, HARD_SOLIMP
    loose = free_of_constraints(model)
    kick = Kick.of(loose, m)
    finer, coarse = their_motion(m, ends, FINER, kick), their_motion(m, ends, 1, kick)
    m.opt.disableflags, m.opt.integrator = flags, integrator
    m.eq_solref[:], m.eq_solimp[:] = softness
    ours = our_motion(loose, ends, 1, until, kick)
    halved = our_motion(loose, ends, 2, until, kick)
    error = np.maximum(2 * ends.distances(ours, halved), FINER / (FINER - 1) * ends.distances(coarse, finer))
    difference = ends.distances(ours, finer)
    return {
        "free_time": STEP * min(len(ours.positions), len(halved.positions)),
        "free_kicked": kick.velocities is not None,
        "free": float(difference.max()),
        "free_error": float(error.max()),
        "free_in_errors": float((difference / np.maximum(error, 1e-6 * ends.length)).max()),
    }


def free_of_constraints(model: amontons.Model) -> amontons.Model:
    joints = [
        replace(
            joint,
            ball_limit=math.inf,
            ball_friction=0.0,
            dofs=tuple(replace(d, lower=-math.inf, upper=math.inf, friction=0.0) for d in joint.dofs),
        )
        for joint in model.joints
    ]
    tendons = [replace(t, lower=-math.inf, upper=math.inf, friction=0.0) for t in model.tendons]
    geoms = [replace(geom, category=0, mask=0) for geom in model.geoms]
    # Pairs with a material of their own touch whatever the masks say.
    return replace(model, joints=tuple(joints), tendons=tuple(tendons), geoms=tuple(geoms), pair_materials=())
