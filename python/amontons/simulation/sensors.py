"""Readings of sensors: what MuJoCo's sensor of the same name measures, over the last step where it is a force
or an acceleration. Sensors of one kind are read together, as arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .. import _core
from ..checks import Array, shown, suggestion
from ..errors import InputError
from ..model.drives import Tendon
from ..model.links import frame_rows, place_index
from ..model.model import Model
from ..model.parts import WORLD, Dof
from ..model.sensing import Sensor
from ..model.transforms import Transform
from ..model.turns import conjugate, product
from .rays import cast_rays
from .step_report import Table
from .tables import actuator_table, contact_table, effort_table, reaction_table, tendon_table


class UnknownSensor(InputError, KeyError):
    """No sensor of the model has that name."""


class Readings(Mapping[str, Array]):
    """The values of all sensors, (size,) each by name; `array` is all of them one after the other."""

    def __init__(self, values: Array, slices: Mapping[str, slice]) -> None:
        self.array = values
        self._slices = slices

    def __getitem__(self, name: str) -> Array:
        if name not in self._slices:
            known = ", ".join(self._slices) or "none"
            raise UnknownSensor(
                f"unknown sensor {shown(name)}{suggestion(name, self._slices)}; known are {known}"
            )
        return self.array[self._slices[name]]

    def __iter__(self) -> Iterator[str]:
        return iter(self._slices)

    def __len__(self) -> int:
        return len(self._slices)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(self.array, dtype=dtype)

    def __repr__(self) -> str:
        return f"amontons.Readings({', '.join(f'{name}: {value}' for name, value in self.items())})"


@dataclass
class Group:
    """The sensors of one kind."""

    sensors: list[Sensor]
    rows: Array
    """of each among all sensors"""
    entries: Array
    """(k, size): where their values go"""
    inside: Array
    """(k, bodies and links): 1 for those that a sum of theirs is about, links of other bodies alone"""
    places: Array
    """of each the link or body of its frame, an index of `Model.link_names`; -1 is the world"""


@dataclass
class Plan:
    """How the sensors of a model are read: what does not change."""

    groups: dict[str, Group]
    slices: dict[str, slice]
    size: int
    bodies: Array
    """of the frames of all sensors, of their references, and of the centres of mass of all links"""
    frames: Array
    """(2 n + links, 7)"""


def plan_of(model: Model) -> Plan:
    """The plan for all sensors of a model."""
    sensors = model.sensors
    ends = np.cumsum([0, *(sensor.size for sensor in sensors)])
    groups: dict[str, Group] = {}
    for kind in dict.fromkeys(sensor.kind for sensor in sensors):
        rows = np.array([i for i, sensor in enumerate(sensors) if sensor.kind == kind])
        own = [sensors[i] for i in rows]
        inside = np.zeros((len(own), len(model.link_names)))
        for row, sensor in zip(inside, own, strict=True):
            row[list(sensor.bodies)] = 1
            row[[len(model.bodies) + k for k in sensor.links]] = 1
        places = np.array([place_index(len(model.bodies), sensor.body, sensor.link) for sensor in own])
        groups[kind] = Group(own, rows, ends[rows, None] + np.arange(own[0].size), inside, places)
    references = [WORLD if sensor.reference is None else sensor.reference for sensor in sensors]
    frames = [sensor.frame for sensor in sensors] + [sensor.reference_frame for sensor in sensors]
    frames += [link.frame @ Transform(link.centre_of_mass) for link in model.links]
    carriers = [link.body for link in model.links]
    return Plan(
        groups,
        {s.name: slice(a, b) for s, a, b in zip(sensors, ends[:-1].tolist(), ends[1:].tolist(), strict=True)},
        int(ends[-1]),
        np.array([sensor.body for sensor in sensors] + references + carriers, dtype=np.int32),
        frame_rows(frames),
    )


def read(core: _core.Simulation, model: Model, plan: Plan, qdd: Array) -> Readings:
    """The readings of all sensors of the model at the generalised accelerations qdd, (nv,)."""
    values = np.zeros(plan.size)
    if plan.size:
        now = Moment(core, model, plan, qdd)
        for kind, group in plan.groups.items():
            found = KINDS[kind](now, group)
            values[group.entries] = np.reshape(found, group.entries.shape)
    for sensor in model.sensors:
        if sensor.cutoff > 0:
            own = plan.slices[sensor.name]
            values[own] = np.clip(values[own], -sensor.cutoff, sensor.cutoff)
    return Readings(values, plan.slices)


class Frames:
    """The columns of Tree.observe for some frames, a row each."""

    def __init__(self, rows: Array) -> None:
        self.position = rows[:, :3]
        self.axes = rows[:, 3:12].reshape(-1, 3, 3)
        """the columns of each matrix"""
        self.orientation = rows[:, 12:16]
        self.velocity, self.angular_velocity = rows[:, 16:19], rows[:, 19:22]
        self.acceleration, self.angular_acceleration = rows[:, 22:25], rows[:, 25:28]

    def local(self, vectors: Array) -> Array:
        """Vectors of the world in the axes of the frames."""
        return np.einsum("kij,ki->kj", self.axes, vectors)


class Moment:
    """A simulation between two steps, with what several sensors need worked out once."""

    def __init__(self, core: _core.Simulation, model: Model, plan: Plan, qdd: Array) -> None:
        self.core, self.model = core, model
        self.gravity = np.array(self.model.gravity)
        self.rows, of_bodies = model.tree.observe(core, qdd, plan.bodies, plan.frames)
        self.sensors = len(model.sensors)
        self.momenta = np.concatenate([of_bodies, self._of_links()])
        """(bodies and links, 15): centre of mass, momentum and its moment, force and its moment"""

    def _of_links(self) -> Array:
        links, at = self.model.links, Frames(self.rows[2 * self.sensors :])
        mass = np.array([link.mass for link in links]).reshape(-1, 1)
        inertia = np.array([link.inertia for link in links]).reshape(-1, 3, 3)
        weight = np.array([self.model.bodies[link.body].gravity_scale for link in links]).reshape(-1, 1)

        def turning(vectors: Array) -> Array:
            """Inertia times vectors, in world axes."""
            return np.einsum("kij,kjl,kl->ki", at.axes, inertia, at.local(vectors))

        momentum, spin = mass * at.velocity, turning(at.angular_velocity)
        force = mass * (at.acceleration - weight * self.gravity)
        torque = turning(at.angular_acceleration) + np.cross(at.angular_velocity, spin)
        moments = np.cross(at.position, momentum) + spin, np.cross(at.position, force) + torque
        return np.concatenate([at.position, momentum, moments[0], force, moments[1]], axis=1)

    def frames(self, group: Group) -> Frames:
        return Frames(self.rows[group.rows])

    def references(self, group: Group) -> Frames:
        return Frames(self.rows[self.sensors + group.rows])

    @cached_property
    def coordinates(self) -> tuple[Array, Array]:
        return self.model.tree.coordinates(self.core)

    @cached_property
    def contacts(self) -> Table:
        return contact_table(self.core, self.model)

    @cached_property
    def actuators(self) -> Table:
        return actuator_table(self.core)

    @cached_property
    def tendons(self) -> Table:
        return tendon_table(self.core)

    @cached_property
    def from_carriers(self) -> Array:
        """(bodies and links, 6): what the motion of each asks for less loads, contacts and loops, about the
        origin.

        Loads belong to bodies; links have none.
        """
        left = self.momenta[:, 9:].copy()
        moving = [k for k, body in enumerate(self.model.bodies) if body.motion == "dynamic"]
        forces = self.core.forces[moving]
        left[moving, :3] -= forces
        left[moving, 3:] -= self.core.torques[moving] + np.cross(self.momenta[moving, :3], forces)
        table = self.contacts
        moments = np.cross(table["point"], table["force"]) + table["torque"]
        self._subtract(left, table, table["link_a"], table["link_b"], moments)
        if loops := self.model.tree.loops:
            held = reaction_table(self.core)[loops]
            moments = np.cross(held["point"], held["force"]) + held["torque"]
            joints, count = [self.model.joints[j] for j in loops], len(self.model.bodies)
            place_a = np.array([place_index(count, joint.body_a, joint.link_a) for joint in joints])
            place_b = np.array([place_index(count, joint.body_b, joint.link_b) for joint in joints])
            self._subtract(left, held, place_a, place_b, moments)
        return left

    def _subtract(self, left: Array, table: Table, place_a: Array, place_b: Array, moments: Array) -> None:
        """Takes forces on A and, opposite, on B off the rows of the bodies and links that feel them."""
        wrench = np.concatenate([table["force"], moments], axis=1)
        for body, place, sign in ((table["body_a"], place_a, -1), (table["body_b"], place_b, 1)):
            part = place >= len(self.model.bodies)
            np.add.at(left, body[body != WORLD], sign * wrench[body != WORLD])
            np.add.at(left, place[part], sign * wrench[part])


Kind = Callable[[Moment, Group], Any]


def _feeling(now: Moment, group: Group) -> Array:
    """Acceleration against free fall: what a mass on a spring feels."""
    return now.frames(group).acceleration - now.gravity


def _in_frame(vectors: Callable[[Moment, Group], Array]) -> Kind:
    return lambda now, group: now.frames(group).local(vectors(now, group))


def _force(now: Moment, group: Group) -> Array:
    return now.frames(group).local(group.inside @ now.from_carriers[:, :3])


def _torque(now: Moment, group: Group) -> Array:
    """About the site."""
    frames, sums = now.frames(group), group.inside @ now.from_carriers
    return frames.local(sums[:, 3:] - np.cross(frames.position, sums[:, :3]))


def _touch(now: Moment, group: Group) -> list[float]:
    """Sums of normal forces on the link whose line into it passes through the sensor's volume."""
    frames, table = now.frames(group), now.contacts
    normal_force = np.einsum("ij,ij->i", table["force"], table["normal"])
    totals = [0.0] * len(group.sensors)
    for k, sensor in enumerate(group.sensors):
        sign = (table["link_a"] == group.places[k]).astype(float) - (table["link_b"] == group.places[k])
        for i in np.flatnonzero((sign != 0) & (normal_force > 0)):
            start = (table["point"][i] - frames.position[k]) @ frames.axes[k]
            along = sign[i] * table["normal"][i] @ frames.axes[k]
            seen = sensor.shape is None or np.isfinite(
                sensor.shape.core.cast_ray(tuple(start.tolist()), tuple(along.tolist()))[0]
            )
            totals[k] += float(normal_force[i]) if seen else 0.0
    return totals


def _rangefinder(now: Moment, group: Group) -> Array:
    """Distances along the z axes of sites to the first geom of another link; -1 if there is none."""
    frames, found = now.frames(group), np.empty(len(group.sensors))
    for place in set(group.places.tolist()):
        own = group.places == place
        starts, along = frames.position[own], frames.axes[own, :, 2]
        hidden = np.array(now.model.geom_links) == place
        found[own], geoms, _ = cast_rays(now.core, starts, along, hidden)
        found[own] = np.where(geoms < 0, -1.0, found[own])
    return found


def _entries(which: int) -> Kind:
    """Entries of q or qd."""

    def reading(now: Moment, group: Group) -> list[Array]:
        coordinates = [now.model.coordinates[sensor.source] for sensor in group.sensors]
        return [now.coordinates[which][c.qd if which else c.q] for c in coordinates]

    return reading


def _efforts(field: str) -> Kind:
    """A field of the efforts along degrees of freedom."""

    def reading(now: Moment, group: Group) -> Array:
        coordinates = [now.model.coordinates[sensor.source] for sensor in group.sensors]
        dofs = [now.model.dof_index(c.joint, c.dof) for c in coordinates]
        return effort_table(now.core)[field][dofs]

    return reading


def _of_actuators(field: str) -> Kind:
    def reading(now: Moment, group: Group) -> Array:
        return now.actuators[field][[now.model.actuator_index(sensor.source) for sensor in group.sensors]]

    return reading


def _of_tendons(field: str) -> Kind:
    def reading(now: Moment, group: Group) -> Array:
        return now.tendons[field][[now.model.tendon_index(sensor.source) for sensor in group.sensors]]

    return reading


def _on_tendons(now: Moment, group: Group) -> list[float]:
    """Sums of the efforts of the actuators on tendons, without their gears, as in MuJoCo."""
    efforts = now.actuators["effort"]
    totals = [0.0] * len(now.model.tendons)
    for actuator, effort in zip(now.model.actuators, efforts, strict=True):
        if (t := actuator.transmission).kind == "tendon":
            totals[t.tendon] += float(effort)
    return [totals[now.model.tendon_index(sensor.source)] for sensor in group.sensors]


def _tendon_limits(now: Moment, group: Group) -> Array:
    """(k, 2), as _limits()."""
    found = np.zeros((len(group.sensors), 2))
    for row, sensor in zip(found, group.sensors, strict=True):
        t = now.model.tendon_index(sensor.source)
        row[:] = _gap(float(now.tendons["length"][t]), now.model.tendons[t])
    return found


def _gap(value: float, limited: Dof | Tendon) -> tuple[float, float]:
    """To the nearer limit, and the side on which it is; (0, 0) within the limits."""
    gap, side = min((value - limited.lower, 1.0), (limited.upper - value, -1.0))
    return (gap, side) if gap < 0 else (0.0, 0.0)


def _limits(now: Moment, group: Group) -> Array:
    """(k, 2): the gap to the nearer limit and the side on which it is, (0, 0) within the limits."""
    found = np.zeros((len(group.sensors), 2))
    for row, sensor in zip(found, group.sensors, strict=True):
        coordinate = now.model.coordinates[sensor.source]
        dof = now.model.joints[coordinate.joint].dofs[coordinate.dof]
        row[:] = _gap(float(now.coordinates[0][coordinate.q][0]), dof)
    return found


def _positions(now: Moment, group: Group) -> Array:
    there = now.references(group)
    return there.local(now.frames(group).position - there.position)


def _orientations(now: Moment, group: Group) -> Array:
    """conj(a) b of the reference a and the frame b."""
    return product(conjugate(now.references(group).orientation), now.frames(group).orientation)


def _axis(k: int) -> Kind:
    return lambda now, group: now.references(group).local(now.frames(group).axes[:, :, k])


def _velocities(now: Moment, group: Group) -> Array:
    """Seen from the reference: its own motion and turning are taken off."""
    frames, there = now.frames(group), now.references(group)
    carried = there.velocity + np.cross(there.angular_velocity, frames.position - there.position)
    return there.local(frames.velocity - carried)


def _angular_velocities(now: Moment, group: Group) -> Array:
    there = now.references(group)
    return there.local(now.frames(group).angular_velocity - there.angular_velocity)


def _inside(now: Moment, group: Group) -> list[bool]:
    """Whether points are in the volumes of sites: there a ray meets the surface where it leaves."""
    found = []
    for sensor, point in zip(group.sensors, _positions(now, group).tolist(), strict=True):
        distance, normal = sensor.shape.core.cast_ray(tuple(point), (0.0, 0.0, 1.0))  # type: ignore[union-attr]
        found.append(bool(np.isfinite(distance)) and normal[2] >= 0)
    return found


def _sums(now: Moment, group: Group) -> tuple[Array, Array, Array]:
    """Mass (k, 1), centre of mass and momentum of the bodies of each sensor."""
    masses = np.array([part.mass for part in (*now.model.bodies, *now.model.links)])
    mass = (group.inside @ masses)[:, None]
    with np.errstate(invalid="ignore"):
        centre = group.inside @ (masses[:, None] * now.momenta[:, :3]) / mass
    centre = np.where(mass > 0, centre, now.frames(group).position)
    return mass, centre, group.inside @ now.momenta[:, 3:6]


def _sum_velocity(now: Moment, group: Group) -> Array:
    mass, _, momentum = _sums(now, group)
    return momentum / np.where(mass > 0, mass, 1.0)


def _angular_momentum(now: Moment, group: Group) -> Array:
    """About the centres of mass: sum m (c - c0) x (v - v0) + I omega = L - c0 x p."""
    _, centre, momentum = _sums(now, group)
    return group.inside @ now.momenta[:, 6:9] - np.cross(centre, momentum)


KINDS: dict[str, Kind] = {
    "accelerometer": _in_frame(_feeling),
    "velocimeter": _in_frame(lambda now, group: now.frames(group).velocity),
    "gyro": _in_frame(lambda now, group: now.frames(group).angular_velocity),
    "magnetometer": _in_frame(lambda now, group: np.array([sensor.field for sensor in group.sensors])),
    "force": _force,
    "torque": _torque,
    "touch": _touch,
    "rangefinder": _rangefinder,
    "jointpos": _entries(0),
    "jointvel": _entries(1),
    "jointactuatorfrc": _efforts("motor"),
    "ballquat": _entries(0),
    "ballangvel": _entries(1),
    "jointlimitpos": lambda now, group: _limits(now, group)[:, 0],
    "jointlimitvel": lambda now, group: _limits(now, group)[:, 1] * np.ravel(_entries(1)(now, group)),
    "jointlimitfrc": lambda now, group: np.abs(_efforts("limit")(now, group)),
    "actuatorpos": _of_actuators("length"),
    "actuatorvel": _of_actuators("rate"),
    "actuatorfrc": _of_actuators("effort"),
    "tendonpos": _of_tendons("length"),
    "tendonvel": _of_tendons("rate"),
    "tendonactuatorfrc": _on_tendons,
    "tendonlimitpos": lambda now, group: _tendon_limits(now, group)[:, 0],
    "tendonlimitvel": lambda now, group: _tendon_limits(now, group)[:, 1] * _of_tendons("rate")(now, group),
    "tendonlimitfrc": lambda now, group: np.abs(_of_tendons("limit")(now, group)),
    "framepos": _positions,
    "framequat": _orientations,
    "framexaxis": _axis(0),
    "frameyaxis": _axis(1),
    "framezaxis": _axis(2),
    "framelinvel": _velocities,
    "frameangvel": _angular_velocities,
    "framelinacc": _feeling,
    "frameangacc": lambda now, group: now.frames(group).angular_acceleration,
    "insidesite": _inside,
    "subtreecom": lambda now, group: _sums(now, group)[1],
    "subtreelinvel": _sum_velocity,
    "subtreeangmom": _angular_momentum,
    "clock": lambda now, group: [now.core.time] * len(group.sensors),
}
"""A function that reads all sensors of a kind, (k, size) or (k,)."""
