"""Mechanisms that Adams has computed: our motion and reactions beside its own."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import amontons
import numpy as np
from amontons import Transform

from .adams_files import Array, Case, Connection, G, Part, Rotation, read_cases

STEPS = (5e-3, 5e-4)
"""s: the step of everyday work, and that of the other engine's tolerances."""
POSITION, REACTION = 1e-3, 1e-3
"""Targets at the first step: rms error of positions (m), of reactions over the largest of the case."""


def quaternion(rotation: Rotation) -> tuple[float, ...]:
    return tuple(rotation.as_quat(scalar_first=True).tolist())


def model(case: Case) -> amontons.Model:
    builder = amontons.ModelBuilder(gravity=(0, 0, -G))
    for name, part in case.parts.items():
        builder.add_body(
            name, mass=part.mass, inertia=part.moments, position=part.position,
            orientation=quaternion(part.rotation), linear_velocity=part.velocity,
        )  # fmt: skip
    for name, joint in case.connections.items():
        if joint.kind == "rack":
            hinge, slide = (_holds(case, part) for part in (joint.other, joint.part))
            builder.add_coupling(slide, hinge, coefficients=(0, joint.numbers["diameter"] / 2))
        else:
            _connect(builder, name, joint, case.parts[joint.part])
    return builder.build()


def _holds(case: Case, part: str) -> str:
    """The joint of a part with the ground."""
    return next(name for name, joint in case.connections.items() if joint.part == part and not joint.other)


def _connect(builder: amontons.ModelBuilder, name: str, joint: Connection, part: Part) -> None:
    a, b, point = joint.part, joint.other or None, joint.point
    x, y, z = (joint.rotation.apply(axis) for axis in np.eye(3))
    spring = {key: joint.numbers[key] for key in ("stiffness", "damping") if key in joint.numbers}
    speed = joint.numbers.get("speed")
    motor = amontons.Motor() if speed is None else amontons.Motor("velocity", control=speed)
    given: dict[str, dict[str, Any]] = {
        "revolute": {"axis": z, **spring}, "cylindrical": {"axis": z}, "ball": {},
        "prismatic": {"axis": z, "motor": motor}, "universal": {"axis_1": x, "axis_2": y},
    }  # fmt: skip
    if joint.kind == "rod":
        _add_rod(builder, name, joint, part)
    elif joint.kind == "spring":
        _add_spring(builder, name, joint, part)
    elif joint.kind == "distance":
        length = joint.numbers["length"]
        builder.add_distance_joint(a, b, point_a=point, point_b=joint.far, length=length, name=name)
    else:
        add = getattr(builder, f"add_{joint.kind}_joint")
        add(a, b, point=point, name=name, **given[joint.kind])


def _add_rod(builder: amontons.ModelBuilder, name: str, joint: Connection, part: Part) -> None:
    """A hinge of the ground about `far`, then a ball at `point` of the part."""
    frame_b = Transform(tuple(joint.point), quaternion(joint.rotation))
    anchor = frame_b.inverse()(tuple(joint.far))
    frame_a = Transform(tuple(part.position), quaternion(part.rotation)).inverse() @ frame_b
    hinge = amontons.Dof("hinge", (0.0, 0.0, 1.0), anchor)
    builder.add_joint(amontons.Joint(
        name, body_a=joint.part, body_b=None, frame_a=frame_a, frame_b=frame_b, dofs=(hinge,), spherical=True
    ))  # fmt: skip


def _add_spring(builder: amontons.ModelBuilder, name: str, joint: Connection, part: Part) -> None:
    """A tendon between the two points. Where they coincide at first it has no direction: a slide along the
    vertical, on which such a part falls."""
    stiffness, damping = joint.numbers["stiffness"], joint.numbers["damping"]
    rest = float(np.linalg.norm(joint.point - joint.far))
    if rest:
        inside = part.rotation.inv().apply(joint.point - part.position)
        path = [(None, joint.far), (joint.part, inside)]
        builder.add_tendon(name, path=path, stiffness=stiffness, damping=damping, rest=rest)
    else:
        builder.add_prismatic_joint(
            joint.part, axis=(0, 0, 1), point=joint.point, name=name, stiffness=stiffness, damping=damping
        )


@dataclass
class Record:
    """What a run of ours says, by quantity of Adams and number of the part or reaction: times (s), values."""

    times: dict[tuple[str, int], list[float]] = field(default_factory=dict)
    values: dict[tuple[str, int], list[Array]] = field(default_factory=dict)

    def add(self, quantity: str, number: int, time: float, value: Any) -> None:
        self.times.setdefault((quantity, number), []).append(time)
        self.values.setdefault((quantity, number), []).append(np.array(value))


WORDS = {"": 0, "p": 0, "a": 1, "pinion": 0, "rack": 1}
"""Number of the part or reaction by the word behind a quantity: RforceA, Pos_Rack; Body2 has its number."""


def place(quantity: str) -> tuple[str, int] | None:
    """The quantity of Adams and the number of the part or reaction; None if it is none of ours."""
    found = re.fullmatch(r"(Pos|Quat|Vel|Avel|Rforce|Rtorque)_?([A-Za-z]*)(\d*)", quantity)
    if found is None:
        return None
    number = int(found[3]) - 1 if found[3] else WORDS.get(found[2].lower())
    return None if number is None else (found[1], number)


def run(case: Case, dt: float) -> Record:
    """Motion of the parts and what their connections put on the ground, over the time of the results."""
    simulation = amontons.Simulation(model(case), dt=dt, tolerance=1e-10)
    record = Record()
    name, first = next(iter(case.connections.items()))
    times = case.results["Pos"][:, 0]
    every = max(1, round((times[1] - times[0]) / dt))
    for k in range(round(times[-1] / dt) + 1):
        if k % every == 0:
            state = simulation.state
            for body in range(len(case.parts)):
                record.add("Pos", body, simulation.time, state.positions[body])
                record.add("Quat", body, simulation.time, state.orientations[body])
                record.add("Vel", body, simulation.time, state.linear_velocities[body])
                record.add("Avel", body, simulation.time, state.angular_velocities[body])
        if "stiffening" in first.numbers:
            angle = simulation.kinematics.coordinate(name)
            simulation.state.joint_forces[0] = -first.numbers["stiffening"] * abs(angle) * angle
        simulation.step()
        if k % every == 0:
            joints = case.connections.items()
            reactions = [pair for other, joint in joints for pair in loads(simulation, other, joint)]
            for number, (force, torque) in enumerate(reactions):
                record.add("Rforce", number, simulation.forces.instant.time, force)
                record.add("Rtorque", number, simulation.forces.instant.time, torque)
    return record


def loads(simulation: amontons.Simulation, name: str, joint: Connection) -> list[tuple[Array, Array]]:
    """Forces (N) and torques about `far` (N m) of a connection in the last step: on the ground, and then on
    the part where Adams tells both."""
    if joint.kind == "rack":
        return []
    if name in simulation.model.tendon_names:
        return [(_tension(simulation, joint), np.zeros(3))]
    reaction, along = simulation.forces.reaction(name), joint.rotation.apply([0, 0, 1])
    force = -np.array(reaction.force)
    torque = -np.array(reaction.torque) + np.cross(np.array(reaction.point) - joint.far, force)
    if joint.kind == "rod":
        return [(force, torque), (-force, np.array(reaction.torque))]
    if "speed" in joint.numbers:
        return [(force, torque), (simulation.forces.effort(name).motor * along, np.zeros(3))]
    if joint.kind in ("revolute", "spring"):
        effort = simulation.forces.effort(name).passive
        if "stiffening" in joint.numbers:
            effort += float(simulation.state.joint_forces[0])
        if joint.kind == "spring":
            force = force - effort * np.array([0, 0, 1])
        else:
            torque = torque - effort * along
    return [(force, torque)]


def _tension(simulation: amontons.Simulation, joint: Connection) -> Array:
    """Force of a spring on the ground: towards the part where it pulls."""
    pull = -float(simulation.forces.tendon_efforts["passive"][0])
    way = np.array(simulation.state.positions[0]) - joint.far
    return pull * way / np.linalg.norm(way)


def compare(case: Case, record: Record, dt: float) -> Iterator[dict[str, Any]]:
    """A row for each quantity: the largest rms error of its columns."""
    for quantity in case.results:
        key = place(quantity)
        if key not in record.values:
            continue
        ours, theirs = np.array(record.values[key]), case.at(quantity, np.array(record.times[key]))
        if quantity.startswith("Quat"):  # the nearer of q and -q
            ours = ours * np.sign(np.sum(ours * theirs, axis=1))[:, None]
        rms = float(np.sqrt(np.mean((ours - theirs) ** 2, axis=0)).max())
        limit = _limit(quantity, dt, case)
        yield {
            "case": case.name, "dt_ms": dt * 1e3, "quantity": quantity, "rms": rms,
            "peak": _peak(case, quantity), "limit": "" if limit is None else limit,
            "met": "" if limit is None else "yes" if rms <= limit else "no",
            "their_step_ms": "" if case.their_step is None else 1e3 * case.their_step,
        }  # fmt: skip


def _peak(case: Case, start: str) -> float:
    """The largest value of the quantities that begin so."""
    return max(float(np.abs(t[:, 1:]).max()) for q, t in case.results.items() if q.startswith(start))


def _limit(quantity: str, dt: float, case: Case) -> float | None:
    """At the first step our targets, else the tolerances that Chrono's authors ask of their engine. A torque
    is judged beside the largest torque, or beside the largest force at a metre if that is larger."""
    if dt != STEPS[0]:
        return case.tolerances.get(quantity)
    if quantity.startswith("Pos"):
        return POSITION
    if quantity.startswith("Rforce"):
        return REACTION * _peak(case, "Rforce")
    if quantity.startswith("Rtorque"):
        return REACTION * max(_peak(case, "Rtorque"), _peak(case, "Rforce"))
    return None


def rows(folder: Path, quick: bool) -> Iterator[dict[str, Any]]:
    cases, unread = read_cases(folder)
    for why in unread:
        print(f"not run: {why}")
    warnings.simplefilter("ignore", amontons.StepWarning)
    for case in cases:
        for dt in STEPS[:1] if quick else STEPS:
            yield from compare(case, run(case, dt), dt)
