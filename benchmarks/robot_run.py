"""One model file beside MuJoCo, in a process of its own: the worker of robots.py.

    python benchmarks/robot_run.py FILE --duration 2 --dt 5e-3 --limit 60

Prints a JSON object per stage, each with all that is known so far, so that a stall or a crash leaves what
came before it.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from time import perf_counter, thread_time
from typing import Any

import amontons
import mujoco
import numpy as np

Array = np.ndarray[Any, Any]
COMPARED, STEP = 0.5, 2e-3  # s: how long motions are compared, and with which step
FINER = 8  # MuJoCo's step over that of its reference
START = 0.2  # s, after which overlaps of the initial pose should be gone


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--duration", type=float, default=2.0)
    parser.add_argument("--dt", type=float)
    parser.add_argument("--limit", type=float, default=60.0)
    options = parser.parse_args()
    warnings.simplefilter("ignore", amontons.StepWarning)
    row: dict[str, Any] = {}
    for facts in stages(options):
        row |= facts
        print(json.dumps(row), flush=True)


def stages(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """What is known after each stage; one that runs out of its share of the limit leaves the rest theirs."""
    start = perf_counter()
    model, facts = our_model(options.file)
    yield {**facts, "load_time": perf_counter() - start}
    floor = None
    if model is not None and options.file.suffix == ".urdf":
        model, floor = with_floor(model)
    theirs, refusal = their_model(options.file, floor)
    yield {"mujoco_refuses": refusal, "floor": floor}
    if theirs is not None:
        yield their_run(theirs, options.duration)
    if model is None:
        return
    dt = {} if options.dt is None else {"dt": options.dt}
    simulation = amontons.Simulation(model, on_failure="ignore", **dt)
    yield from our_run(simulation, options.duration, start + 0.5 * options.limit)
    yield {"finished": True, "compared": theirs is None}
    if theirs is None:
        return
    ends = Ends.of(model, theirs)
    yield free_motion(model, theirs, ends, start + 0.75 * options.limit)
    yield as_it_is(model, theirs, ends, start + 0.95 * options.limit)
    yield {"compared": True}


# Loading


def their_model(path: Path, floor: float | None) -> tuple[Any, str]:
    """MuJoCo's model, or None with what it says; a URDF with the base, meshes and floor that ours has."""
    try:
        if path.suffix == ".urdf":
            return compiled_urdf(path, floor), ""
        return mujoco.MjModel.from_xml_path(str(path)), ""
    except (ValueError, mujoco.FatalError, amontons.InputError, OSError) as error:
        return None, " ".join(str(error).split())[:300]


def compiled_urdf(path: Path, floor: float | None) -> Any:
    """MuJoCo's own reader knows neither packages nor free bases, so the preparation is ours."""
    from amontons.io.models import Issues, compile_file, expand_includes, read_xml

    root = read_xml(path)
    expand_includes(root, path.parent)
    compiled = compile_file(path, root, Issues(path), None)
    if floor is None:
        return compiled.model
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    compiled.spec.worldbody.add_geom(type=plane, size=(0, 0, 1), pos=(0, 0, floor))
    return compiled.spec.compile()


def our_model(path: Path) -> tuple[amontons.Model | None, dict[str, Any]]:
    """The model as it loads by default, or None if it is refused; and what of the file was not read."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the model has the list
        try:
            model = amontons.load_model(path)
        except (amontons.InputError, OSError) as error:
            return None, {"load": "refused", "what": " ".join(str(error).split())[:1000]}
    what = [re.sub(r"^\S*/", "", str(entry)) for entry in model.unread]  # the file without its folders
    changes = sum(entry.changes_motion for entry in model.unread)
    facts = {"load": "ok", "not_read": len(what), "changes_motion": changes, "bodies": len(model.bodies)}
    return model, {**facts, "what": "; ".join(what)[:1000]}


def with_floor(model: amontons.Model) -> tuple[amontons.Model, float | None]:
    """A robot that floats, on a plane at its lowest point, and where that is: URDF has no floors."""
    if not any(c.kind == "free" for c in model.coordinates.values()):
        return model, None
    try:
        standing = amontons.on_floor(model)
    except amontons.InputError:  # nothing that could touch it
        return model, None
    height = model.bodies[0].pose.position[2] - standing.bodies[0].pose.position[2]
    builder = amontons.ModelBuilder(gravity=model.gravity, friction_rule=model.friction_rule)
    builder.add_model(model)
    builder.add_floor(height=height, material=amontons.Material(friction=1.0))  # MuJoCo's default
    return builder.build(), height


# Runs


def their_run(m: Any, duration: float) -> dict[str, Any]:
    """Contacts and speed of MuJoCo with the file's own step and integrator."""
    data, most, steps = mujoco.MjData(m), 0, math.ceil(duration / m.opt.timestep)
    before = thread_time()
    for _ in range(steps):
        mujoco.mj_step(m, data)
        most = max(most, data.ncon)
    rate = steps / max(thread_time() - before, 1e-9)
    return {"mujoco_contacts": most, "mujoco_steps_per_second": rate}


def our_run(simulation: amontons.Simulation, duration: float, until: float) -> Iterator[dict[str, Any]]:
    """A run as a user has it. Times are of the processor, so that what else runs does not count."""
    steps = max(1, math.ceil(duration / simulation.dt - 1e-9))
    energy, times, said = Energy(simulation), [], perf_counter()
    worst = {"missed": 0, "residual": 0.0, "contacts": 0, "penetration_start": 0.0, "penetration": 0.0}
    for k in range(1, steps + 1):
        before = thread_time()
        try:
            report = simulation.step()
        except amontons.SimulationError as error:
            yield {"stopped": str(error)[:300], "steps": k - 1}
            return
        times.append(thread_time() - before)
        energy.add(report)
        worst["missed"] += not report.converged
        worst["residual"] = max(worst["residual"], report.residual)
        worst["contacts"] = max(worst["contacts"], report.contacts)
        depth = "penetration_start" if report.time <= START else "penetration"
        worst[depth] = max(worst[depth], report.penetration)
        if k == steps or perf_counter() > said + 1.0 or perf_counter() > until:
            said = perf_counter()
            yield {
                **worst, **energy.facts(), "steps": k, "wanted_steps": steps, "simulated": simulation.time,
                "missed_percent": 100 * worst["missed"] / k, "step_median": median(times),
                "longest_in_medians": max(times) / median(times), "steps_per_second": k / sum(times),
            }  # fmt: skip
        if perf_counter() > until:
            return


class Energy:
    """Gains of a step that no load, motor or spring explains, from what the simulation tells of itself.

    The energy of a step is kinetic (armatures included), of gravity and of springs; the work of motors is
    their effort over the coordinate's way, all else that acts along coordinates only takes. Blank where
    surfaces or kinematic bodies drive, whose work is not told.
    """

    def __init__(self, simulation: amontons.Simulation) -> None:
        model = simulation.model
        self.simulation = simulation
        self.armature = np.array([d.armature for joint in model.joints for d in joint.dofs])
        self.driven = any(any(g.surface_velocity) for g in model.geoms) or any(
            b.motion == "kinematic" and any(b.linear_velocity + b.angular_velocity) for b in model.bodies
        )
        # Plus the largest kinetic energy so far; without gravity, that of a thousandth of a length in 1 s.
        weight = float(np.linalg.norm(model.gravity)) + 1e-6 * model.length
        self.scale = model.total_mass * weight * model.length
        self.coordinates = simulation.state.joint_coordinates.copy()
        self.last: float | None = None
        self.gain, self.gain_relative, self.above, self.rise, self.largest = 0.0, 0.0, 0.0, 0.0, 0.0

    def add(self, report: amontons.Report) -> None:
        moved = self.simulation.state.joint_coordinates - self.coordinates
        self.coordinates += moved
        efforts = self.simulation.joint_efforts
        work = float(efforts["motor"] @ moved)
        energy = report.energy + 0.5 * float(self.armature @ (moved / self.simulation.dt) ** 2)
        self.largest = max(self.largest, report.kinetic_energy)
        if self.last is not None:
            gain = energy - self.last - work
            scale = max(self.scale + self.largest, 1e-300)
            self.gain, self.gain_relative = max(self.gain, gain), max(self.gain_relative, gain / scale)
            # How far it climbs above the lowest value so far: what many small gains add up to.
            self.above = max(0.0, self.above + gain)
            self.rise = max(self.rise, self.above)
        self.last = energy

    def facts(self) -> dict[str, Any]:
        if self.driven:
            return {"energy_gain": None, "energy_gain_relative": None, "energy_rise": None}
        return {
            "energy_gain": self.gain, "energy_gain_relative": self.gain_relative, "energy_rise": self.rise,
        }  # fmt: skip


# Motion


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

    def distance(self, a: Motion, b: Motion) -> float:
        """The largest distance of a body at equal times, its rotation times `length` added (m)."""
        n = min(len(a.positions), len(b.positions))
        if not n or not self.ours:
            return math.nan
        shift = np.linalg.norm(a.positions[:n] - b.positions[:n], axis=-1)
        cosine = np.abs((a.orientations[:n] * b.orientations[:n]).sum(axis=-1))
        # |p - q| or |p + q| of unit quaternions is 2 sin(angle / 4), exact also where the angle is tiny.
        chord = np.sqrt(np.maximum(0.0, 2 - 2 * np.minimum(cosine, 1.0)))
        total = shift + self.length * 4 * np.arcsin(np.minimum(0.5 * chord, 1.0))
        return float(total.max()) if np.isfinite(total).all() else math.inf


@dataclass(frozen=True)
class Motion:
    """Of some bodies at multiples of STEP."""

    positions: Array  # (times, bodies, 3)
    orientations: Array  # (times, bodies, 4)


def our_motion(model: amontons.Model, ends: Ends, parts: int, until: float) -> Motion:
    """With `parts` steps in each STEP; shorter if the time is up or the simulation fails."""
    simulation = amontons.Simulation(model, dt=STEP / parts, on_failure="ignore")
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


def their_motion(m: Any, ends: Ends, parts: int) -> Motion:
    data = mujoco.MjData(m)
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
    """Without contacts and limits on both sides, against MuJoCo's implicit integrator with a finer step.

    Both methods are of first order, so that the error of a step is about twice what halving it changes (for
    MuJoCo, 8/7 of what the finer one changes). The larger of both errors is what a difference is measured by.
    """
    flags, integrator = int(m.opt.disableflags), int(m.opt.integrator)
    m.opt.disableflags = flags | mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    m.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICIT
    finer, coarse = their_motion(m, ends, FINER), their_motion(m, ends, 1)
    m.opt.disableflags, m.opt.integrator = flags, integrator
    loose = without_limits(model)
    ours = our_motion(loose, ends, 1, until)
    halved = our_motion(loose, ends, 2, until)
    error = max(
        2 * ends.distance(ours, halved),
        FINER / (FINER - 1) * ends.distance(coarse, finer),
        1e-9 * ends.length,
    )
    difference = ends.distance(ours, finer)
    return {
        "free_time": STEP * min(len(ours.positions), len(halved.positions)), "free": difference,
        "free_error": error, "free_in_errors": difference / error,
    }  # fmt: skip


def without_limits(model: amontons.Model) -> amontons.Model:
    joints = [
        replace(
            joint,
            ball_limit=math.inf,
            dofs=tuple(replace(d, lower=-math.inf, upper=math.inf) for d in joint.dofs),
        )
        for joint in model.joints
    ]
    geoms = [replace(geom, category=0, mask=0) for geom in model.geoms]
    # Pairs with a material of their own touch whatever the masks say.
    return replace(model, joints=tuple(joints), geoms=tuple(geoms), pair_materials=())


def as_it_is(model: amontons.Model, m: Any, ends: Ends, until: float) -> dict[str, Any]:
    ours = our_motion(model, ends, 1, until)
    difference = ends.distance(ours, their_motion(m, ends, 1))
    return {"motion_time": STEP * len(ours.positions), "motion": difference}


if __name__ == "__main__":
    main()
