"""A model as a part of another one: its parts, moved to where they are put, and their keyframes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from .. import _core
from ..checks import changed
from .collection import LISTS, NAMED, KeyframePart, Parts
from .groups import connected
from .links import Link
from .model import Model
from .parts import OWN, WORLD, Body, Bond, Geom, Joint
from .presets import Keyframe
from .references import Place, rewired
from .sensing import Sensor
from .shapes import Plane
from .transforms import ORIGIN, Transform, multiply, rotate

T = TypeVar("T")


@dataclass(frozen=True)
class Added:
    """Where `ModelBuilder.add_model` put the parts of a model: their indices, in the order of the model."""

    bodies: tuple[int, ...]
    """a body without mass that was fixed to the world of the model is a link of the parent"""
    geoms: range
    joints: range
    couplings: range
    tendons: range
    actuators: range


@dataclass(frozen=True)
class Seat:
    """Where the world of a model comes to lie: `frame` in a body of the builder, or in its world."""

    parent: int
    frame: Transform
    in_world: Transform
    """the same in the world, at the initial pose of the parent"""
    carries: bool
    """whether the parent is a body that may move, so that what is fixed to the world must hold on to it"""
    link: int = OWN
    """the link of the parent that takes the place of the world, of the builder"""


TURNED = {
    Geom: ("body", ("surface_velocity", "surface_spin", "friction_direction")),
    Bond: ("body_b", ("normal",)),
}
"""Vectors of parts, in the axes of the body that the first field names."""


class Move:
    """How indices and frames of a model change on its way into a builder."""

    def __init__(self, model: Model, seat: Seat, before: Parts) -> None:
        merged = merged_bodies(model, seat)
        self.first = {kind: len(getattr(before, name)) for kind, name in NAMED.items()}
        """how many of each kind the builder had"""
        self.first_dof = sum(len(joint.dofs) for joint in before.joints)
        self.seat = seat
        self.parts = {b: self.first["link"] + len(model.links) + i for i, b in enumerate(sorted(merged))}
        """the links that merged bodies become"""
        self.kept = [b for b in range(len(model.bodies)) if b not in merged]
        """the bodies of the model that stay bodies"""
        self.where = {WORLD: seat.frame, **{b: seat.frame @ model.bodies[b].pose for b in merged}}
        """the frames, in the parent, of what becomes part of it"""
        self.body = {b: self.first["body"] + i for i, b in enumerate(self.kept)}
        self.body |= dict.fromkeys(self.where, seat.parent)

    def place(self, body: int, link: int) -> Place:
        """Where a body and a link of it go; without a link, what the body is without its links."""
        if link != OWN:
            link += self.first["link"]
        else:
            link = self.seat.link if body == WORLD else self.parts.get(body, OWN)
        return self.body[body], self.where.get(body), link

    def index(self, kind: str, index: int) -> int:
        return index if index < 0 else self.first[kind] + index

    def moved(self, things: Iterable[T], prefix: str = "") -> list[T]:
        """Parts with the references that they have in the builder, and their names after the prefix."""
        return named(prefix, (self.turned(thing, rewired(thing, self.place, self.index)) for thing in things))

    def turned(self, former: T, part: T) -> T:
        """The part with its vectors turned as its body was."""
        body, vectors = TURNED.get(type(part), ("", ()))
        if not body or getattr(former, body) not in self.where:
            return part
        turn = self.where[getattr(former, body)].rotation
        given = {name: getattr(part, name) for name in vectors}
        return changed(part, **{name: value and rotate(turn, value) for name, value in given.items()})

    def part(self, b: int, body: Body, joint: str) -> Link:
        """The link that a merged body becomes."""
        return Link(body.name, self.seat.parent, self.where[b], carrier=self.seat.link, joint=joint)

    def sensor(self, former: Sensor, sensor: Sensor, prefix: str) -> Sensor:
        """The sensor with the names and the lists of bodies and links that it has in the builder."""
        links = [self.first["link"] + k for k in former.links]
        links += [self.parts[b] for b in former.bodies if b in self.parts]
        return changed(
            sensor,
            source=sensor.source and prefix + sensor.source,
            bodies=tuple(sorted(self.body[b] for b in former.bodies if b not in self.where)),
            links=tuple(sorted(links)),
        )


def parts_of(
    model: Model, seat: Seat, prefix: str, before: Parts, new_name: Callable[[str], str]
) -> tuple[Parts, Added]:
    """The parts of a model in their seat. new_name: of the joint that fixes the body of this name."""
    move = Move(model, seat, before)
    mounts = [
        hold(seat, new_name(prefix + model.bodies[b].name), model.bodies[b], move.body[b])
        for b in held(model, seat)
        if b in move.kept
    ]
    parts = Parts(**{
        name: move.moved(getattr(model, name), prefix) for name in LISTS.values() if name != "bodies"
    })  # fmt: skip
    parts.bodies = named(prefix, (moved_body(model.bodies[b], seat) for b in move.kept))
    parts.links = [changed(link, joint=prefix + link.joint) for link in parts.links]
    for b in move.parts:
        parts.links += named(prefix, [move.part(b, model.bodies[b], new_name(prefix + model.bodies[b].name))])
    parts.joints = [*(with_dofs_named(prefix, joint) for joint in parts.joints), *mounts]
    pairs = zip(model.sensors, parts.sensors, strict=True)
    parts.sensors = [move.sensor(former, sensor, prefix) for former, sensor in pairs]
    excluded = ((move.body[a], move.body[b]) for a, b in model.excluded_bodies)
    parts.excluded_bodies = [(a, b) for a, b in excluded if a != b]
    first = move.first["geom"]
    parts.excluded_geoms = [(first + a, first + b) for a, b in model.excluded_geoms]
    parts.unread = list(model.unread)
    for keyframe in model.keyframes:
        parts.keyframes[prefix + keyframe.name] = [keyframe_part(model, keyframe, seat, move)]
    ranges = {
        name: range(move.first[kind], move.first[kind] + len(getattr(parts, name)))
        for kind, name in NAMED.items()
        if name in ("geoms", "joints", "couplings", "tendons", "actuators")
    }
    return parts, Added(tuple(move.body[b] for b in range(len(model.bodies))), **ranges)


def named(prefix: str, things: Iterable[Any]) -> list[Any]:
    return [changed(t, name=prefix + t.name) if prefix and hasattr(t, "name") else t for t in things]


def with_dofs_named(prefix: str, joint: Joint) -> Joint:
    return changed(joint, dofs=tuple(changed(d, name=d.name and prefix + d.name) for d in joint.dofs))


def merged_bodies(model: Model, seat: Seat) -> set[int]:
    """Fixed bodies without mass on a parent that may move: they cannot be bodies of their own there."""
    if not seat.carries:
        return set()
    return {b for b, body in enumerate(model.bodies) if body.motion == "static" and body.mass == 0}


def moved_body(body: Body, seat: Seat) -> Body:
    turn = seat.in_world.rotation
    return changed(
        body,
        motion="dynamic" if seat.carries and body.motion == "static" else body.motion,
        pose=seat.in_world @ body.pose,
        linear_velocity=rotate(turn, body.linear_velocity),
        angular_velocity=rotate(turn, body.angular_velocity),
    )


def held(model: Model, seat: Seat) -> list[int]:
    """The bodies that a fixed joint must hold on the parent.

    Those that were fixed to the world, and the first one of every group of bodies that joints join to each
    other, but neither to the world nor to a fixed one.
    """
    if seat.parent == WORLD:
        return []
    ends = [(joint.body_a, joint.body_b) for joint in model.joints]
    leader = connected(len(model.bodies), (pair for pair in ends if WORLD not in pair))
    bound = {max(pair) for pair in ends if WORLD in pair}
    still = {b for b, body in enumerate(model.bodies) if body.motion != "dynamic"}
    held_by_others = {leader[b] for b in bound | still}
    free = [b for b in range(len(model.bodies)) if leader[b] == b and b not in held_by_others]
    fixed = [b for b in still if model.bodies[b].motion == "static" and seat.carries]
    return sorted({*free, *fixed})


def hold(seat: Seat, name: str, body: Body, index: int) -> Joint:
    """The joint that fixes a body of the model to the parent as it stands."""
    return Joint(
        name=name, body_a=index, body_b=seat.parent, frame_b=seat.frame @ body.pose, link_b=seat.link
    )


def keyframe_part(model: Model, keyframe: Keyframe, seat: Seat, move: Move) -> KeyframePart:
    turn = seat.in_world.rotation
    moved = replace(
        keyframe,
        positions=tuple(seat.in_world(keyframe.positions[b]) for b in move.kept),
        orientations=tuple(multiply(turn, keyframe.orientations[b]) for b in move.kept),
        linear_velocities=tuple(rotate(turn, keyframe.linear_velocities[b]) for b in move.kept),
        angular_velocities=tuple(rotate(turn, keyframe.angular_velocities[b]) for b in move.kept),
    )
    first = move.first_dof
    motors = {
        first + model.core.first_dof(joint) + dof: control
        for (actuator, joint, dof), control in zip(model.core.controls, keyframe.controls, strict=False)
        if actuator < 0
    }
    bodies = tuple(move.body[b] for b in move.kept)
    return KeyframePart(bodies, first, move.first["actuator"], len(model.actuators), motors, moved)


def whole_keyframe(name: str, model: Model, parts: Sequence[KeyframePart]) -> Keyframe:
    """The initial state of a model with some of its parts as keyframes have them."""
    start = _core.Simulation(model.core, _core.SimulationOptions())
    by_body = {
        name: np.array(getattr(start, name))
        for name in ("positions", "orientations", "linear_velocities", "angular_velocities")
    }
    coordinates, controls, activations = (
        np.array(getattr(start, name)) for name in ("joint_coordinates", "controls", "activations")
    )
    motors = {
        model.core.first_dof(joint) + dof: k
        for k, (actuator, joint, dof) in enumerate(model.core.controls)
        if actuator < 0
    }
    for part in parts:
        frame = part.keyframe
        for field, values in by_body.items():
            if part.bodies:
                values[list(part.bodies)] = getattr(frame, field)
        coordinates[part.first_dof : part.first_dof + len(frame.joint_coordinates)] = frame.joint_coordinates
        first, given = part.first_actuator, frame.controls[: part.actuators]
        controls[first : first + len(given)] = given
        activations[first : first + len(frame.activations)] = frame.activations
        for dof, control in part.motors.items():
            if dof in motors:
                controls[motors[dof]] = control
    rows = {field: tuple(map(tuple, values.tolist())) for field, values in by_body.items()}
    numbers = (tuple(values.tolist()) for values in (coordinates, controls, activations))
    return Keyframe(name, parts[0].keyframe.time, *rows.values(), *numbers)  # type: ignore[arg-type]


def top(geoms: Iterable[Geom], bodies: Sequence[Body]) -> float:
    """The highest z of shapes at the initial poses (m), -inf without any; of a plane, that of its origin."""
    return max((extent(geom, bodies)[1] for geom in geoms), default=-math.inf)


def bottom(geoms: Iterable[Geom], bodies: Sequence[Body]) -> float:
    """The lowest z of shapes of bodies that may touch something (m), inf without any."""
    solid = (geom for geom in geoms if geom.body != WORLD and (geom.category or geom.mask))
    return min((extent(geom, bodies)[0] for geom in solid), default=math.inf)


def extent(geom: Geom, bodies: Sequence[Body]) -> tuple[float, float]:
    frame = (ORIGIN if geom.body == WORLD else bodies[geom.body].pose) @ geom.frame
    if isinstance(geom.shape, Plane):
        return frame.position[2], frame.position[2]
    lower, upper = geom.shape.core.bounds(frame.position, frame.rotation)
    return lower[2], upper[2]
