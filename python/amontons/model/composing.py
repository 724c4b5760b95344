"""A model as a part of another one: its parts, moved to where they are put, and their keyframes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from .. import _core
from ..checks import changed
from .drives import Actuator, PathElement, Tendon, Transmission
from .links import Link
from .model import Model
from .parts import OWN, WORLD, Body, Bond, Coupling, FluidBox, Geom, Joint, PairMaterial
from .presets import Keyframe
from .sensing import Sensor, Site
from .shapes import Plane
from .transforms import IDENTITY, ORIGIN, Transform, multiply, rotate
from .visuals import Visual

T = TypeVar("T", Body, Geom, Joint, Coupling, Tendon, Actuator, Site, Sensor, Link)


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


NAMED = {
    "body": "bodies", "geom": "geoms", "joint": "joints", "coupling": "couplings", "site": "sites",
    "sensor": "sensors", "tendon": "tendons", "actuator": "actuators", "link": "links",
}  # fmt: skip
"""Kinds of parts that have names, and their lists in `Parts`, in `Model` and, after a _, in the builder."""
NAMELESS = ("pair_materials", "excluded_bodies", "excluded_geoms", "fluid_boxes", "bonds", "visuals")
"""Lists of the others."""


@dataclass(frozen=True)
class Counts:
    """Numbers of parts of the builder before the model was added."""

    bodies: int
    geoms: int
    joints: int
    couplings: int
    tendons: int
    actuators: int
    links: int
    dofs: int


@dataclass(frozen=True)
class Parts:
    """The parts that a model adds to a builder; indices are those of the builder, after its former parts."""

    bodies: list[Body]
    geoms: list[Geom]
    joints: list[Joint]
    couplings: list[Coupling]
    pair_materials: list[PairMaterial]
    excluded_bodies: list[tuple[int, int]]
    excluded_geoms: list[tuple[int, int]]
    fluid_boxes: list[FluidBox]
    bonds: list[Bond]
    tendons: list[Tendon]
    actuators: list[Actuator]
    keyframes: dict[str, KeyframePart]
    sites: list[Site]
    sensors: list[Sensor]
    visuals: list[Visual]
    links: list[Link]
    added: Added


@dataclass(frozen=True)
class KeyframePart:
    """The keyframe of a model for the bodies and degrees of freedom that came from it."""

    bodies: tuple[int, ...]
    first_dof: int
    first_actuator: int
    actuators: int
    """how many"""
    motors: Mapping[int, float]
    """controls of motors by degree of freedom, of all joints together"""
    keyframe: Keyframe


class Move:
    """How indices and frames of a model change on its way into a builder."""

    def __init__(self, model: Model, seat: Seat, before: Counts) -> None:
        merged = merged_bodies(model, seat)
        self.before = before
        self.seat = seat
        self.parts = {b: before.links + len(model.links) + i for i, b in enumerate(sorted(merged))}
        """the links that merged bodies become"""
        self.kept = [b for b in range(len(model.bodies)) if b not in merged]
        """the bodies of the model that stay bodies"""
        self.where = {WORLD: seat.frame, **{b: seat.frame @ model.bodies[b].pose for b in merged}}
        """the frames, in the parent, of what becomes part of it"""
        self.index = {b: before.bodies + i for i, b in enumerate(self.kept)}
        self.index |= dict.fromkeys(self.where, seat.parent)

    def frame(self, body: int, local: Transform) -> Transform:
        return self.where[body] @ local if body in self.where else local

    def link_index(self, body: int, link: int) -> int:
        """Where a link of a body goes, or what the body is without its links."""
        if link != OWN:
            return self.before.links + link
        return self.seat.link if body == WORLD else self.parts.get(body, OWN)

    def link(self, link: Link) -> Link:
        return changed(
            link,
            body=self.index[link.body],
            frame=self.frame(link.body, link.frame),
            carrier=self.link_index(link.body, link.carrier),
        )

    def part(self, b: int, body: Body, joint: str) -> Link:
        """The link that a merged body becomes."""
        return Link(body.name, self.seat.parent, self.where[b], carrier=self.seat.link, joint=joint)

    def geom(self, geom: Geom) -> Geom:
        link = self.link_index(geom.body, geom.link)
        moved = changed(geom, body=self.index[geom.body], link=link)
        if geom.body not in self.where:
            return moved
        turn = self.where[geom.body].rotation
        along = geom.friction_direction
        return changed(
            moved,
            frame=self.frame(geom.body, geom.frame),
            surface_velocity=rotate(turn, geom.surface_velocity),
            surface_spin=rotate(turn, geom.surface_spin),
            friction_direction=along and rotate(turn, along),
        )

    def visual(self, visual: Visual) -> Visual:
        frame = self.frame(visual.body, visual.frame)
        link = self.link_index(visual.body, visual.link)
        return changed(visual, body=self.index[visual.body], frame=frame, link=link)

    def joint(self, joint: Joint) -> Joint:
        return changed(
            joint,
            body_a=self.index[joint.body_a],
            body_b=self.index[joint.body_b],
            frame_a=self.frame(joint.body_a, joint.frame_a),
            frame_b=self.frame(joint.body_b, joint.frame_b),
            link_a=self.link_index(joint.body_a, joint.link_a),
            link_b=self.link_index(joint.body_b, joint.link_b),
        )

    def site(self, site: Site) -> Site:
        return changed(site, body=self.index[site.body], frame=self.frame(site.body, site.frame))

    def sensor(self, sensor: Sensor, prefix: str) -> Sensor:
        there = sensor.reference
        return changed(
            sensor,
            body=self.index[sensor.body],
            frame=self.frame(sensor.body, sensor.frame),
            reference=self.index.get(there, WORLD) if there is not None else None,
            reference_frame=sensor.reference_frame
            if there is None
            else self.frame(there, sensor.reference_frame),
            source=sensor.source and prefix + sensor.source,
            bodies=tuple(sorted(self.index[b] for b in sensor.bodies if b not in self.where)),
            link=self.link_index(sensor.body, sensor.link),
            links=tuple(
                sorted(
                    [self.before.links + k for k in sensor.links]
                    + [self.parts[b] for b in sensor.bodies if b in self.parts]
                )
            ),
        )

    def joint_index(self, joint: int) -> int:
        return WORLD if joint == WORLD else self.before.joints + joint

    def coupling(self, coupling: Coupling) -> Coupling:
        a, b = map(self.joint_index, (coupling.joint_a, coupling.joint_b))
        lines = map(self.tendon_index, (coupling.tendon_a, coupling.tendon_b))
        return changed(
            coupling, joint_a=a, joint_b=b, **dict(zip(("tendon_a", "tendon_b"), lines, strict=True))
        )

    def tendon_index(self, tendon: int) -> int:
        return tendon if tendon < 0 else self.before.tendons + tendon

    def stop(self, stop: PathElement) -> PathElement:
        """A stop of a tendon's path, whose bodies may have become parts of others."""
        side = stop.side and self.frame(stop.side_body, Transform(stop.side)).position
        return changed(
            stop,
            body=self.index[stop.body],
            frame=self.frame(stop.body, stop.frame),
            side=side,
            side_body=self.index[stop.side_body],
        )

    def tendon(self, tendon: Tendon) -> Tendon:
        terms = tuple(changed(t, joint=self.joint_index(t.joint)) for t in tendon.terms)
        return changed(tendon, terms=terms, path=tuple(map(self.stop, tendon.path)))

    def actuator(self, actuator: Actuator) -> Actuator:
        moved: Transmission = actuator.transmission
        moved = changed(
            moved,
            joint=self.joint_index(moved.joint),
            tendon=self.tendon_index(moved.tendon),
            body=self.index[moved.body],
            reference_body=self.index[moved.reference_body],
            frame=self.frame(moved.body, moved.frame),
            reference=self.frame(moved.reference_body, moved.reference),
        )
        return changed(actuator, transmission=moved)

    def bond(self, bond: Bond) -> Bond:
        a, b = (
            self.frame(body, Transform(place)).position
            for body, place in ((bond.body_a, bond.point_a), (bond.body_b, bond.point_b))
        )
        turn = self.where[bond.body_b].rotation if bond.body_b in self.where else IDENTITY
        return changed(
            bond, body_a=self.index[bond.body_a], body_b=self.index[bond.body_b], point_a=a, point_b=b,
            normal=rotate(turn, bond.normal),
        )  # fmt: skip

    def pair(self, pair: PairMaterial) -> PairMaterial:
        first = self.before.geoms
        return changed(pair, geom_a=first + pair.geom_a, geom_b=first + pair.geom_b)


def parts_of(model: Model, seat: Seat, prefix: str, before: Counts, new_name: Callable[[str], str]) -> Parts:
    """The parts of a model in their seat. new_name: of the joint that fixes the body of this name."""
    move = Move(model, seat, before)
    mounts = [
        hold(seat, new_name(prefix + model.bodies[b].name), model.bodies[b], move.index[b])
        for b in held(model, seat)
        if b in move.kept
    ]
    excluded = [(move.index[a], move.index[b]) for a, b in model.excluded_bodies]
    links = [changed(link, joint=prefix + link.joint) for link in map(move.link, model.links)]
    links += [move.part(b, model.bodies[b], new_name(prefix + model.bodies[b].name)) for b in move.parts]
    return Parts(
        bodies=named(prefix, (moved_body(model.bodies[b], seat) for b in move.kept)),
        geoms=named(prefix, map(move.geom, model.geoms)),
        joints=[*named(prefix, (with_dofs_named(prefix, move.joint(j)) for j in model.joints)), *mounts],
        couplings=named(prefix, map(move.coupling, model.couplings)),
        pair_materials=list(map(move.pair, model.pair_materials)),
        excluded_bodies=[(a, b) for a, b in excluded if a != b],
        excluded_geoms=[(before.geoms + a, before.geoms + b) for a, b in model.excluded_geoms],
        fluid_boxes=[
            replace(box, body=move.index[box.body], frame=move.frame(box.body, box.frame))
            for box in model.fluid_boxes
        ],
        bonds=list(map(move.bond, model.bonds)),
        tendons=named(prefix, map(move.tendon, model.tendons)),
        actuators=named(prefix, map(move.actuator, model.actuators)),
        keyframes={
            prefix + keyframe.name: keyframe_part(model, keyframe, seat, move) for keyframe in model.keyframes
        },
        sites=named(prefix, map(move.site, model.sites)),
        sensors=named(prefix, (move.sensor(sensor, prefix) for sensor in model.sensors)),
        visuals=named(prefix, map(move.visual, model.visuals)),
        links=named(prefix, links),
        added=Added(
            tuple(move.index[b] for b in range(len(model.bodies))),
            range(before.geoms, before.geoms + len(model.geoms)),
            range(before.joints, before.joints + len(model.joints) + len(mounts)),
            range(before.couplings, before.couplings + len(model.couplings)),
            range(before.tendons, before.tendons + len(model.tendons)),
            range(before.actuators, before.actuators + len(model.actuators)),
        ),
    )


def named(prefix: str, things: Iterable[T]) -> list[T]:
    return [changed(thing, name=prefix + thing.name) if prefix else thing for thing in things]


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
    leader = list(range(len(model.bodies)))

    def find(b: int) -> int:
        while leader[b] != b:
            b = leader[b]
        return b

    bound = set()
    for joint in model.joints:
        ends = (joint.body_a, joint.body_b)
        if WORLD in ends:
            bound.add(max(ends))
        else:
            low, high = sorted(map(find, ends))
            leader[high] = low
    still = {b for b, body in enumerate(model.bodies) if body.motion != "dynamic"}
    held_by_others = {find(b) for b in bound | still}
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
    first = move.before.dofs
    motors = {
        first + model.core.first_dof(joint) + dof: control
        for (actuator, joint, dof), control in zip(model.core.controls, keyframe.controls, strict=False)
        if actuator < 0
    }
    bodies = tuple(move.index[b] for b in move.kept)
    return KeyframePart(bodies, first, move.before.actuators, len(model.actuators), motors, moved)


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
