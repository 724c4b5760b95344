"""Readings of sensors: what MuJoCo's sensor of the same name measures, over the last step where it is a force
or an acceleration."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import Array
from ..model.parts import WORLD, Body
from ..model.sensing import Sensor
from ..model.transforms import Transform
from .coordinates import rotation_matrix
from .outcome import Table

if TYPE_CHECKING:
    from .simulation import Simulation


class Readings(Mapping[str, Array]):
    """The values of all sensors, (size,) each by name; `values_array` is all of them one after the other."""

    def __init__(self, values: Array, slices: Mapping[str, slice]) -> None:
        self.values_array = values
        self._slices = slices

    def __getitem__(self, name: str) -> Array:
        return self.values_array[self._slices[name]]

    def __iter__(self) -> Iterator[str]:
        return iter(self._slices)

    def __len__(self) -> int:
        return len(self._slices)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(self.values_array, dtype=dtype)

    def __repr__(self) -> str:
        return f"amontons.Readings({', '.join(f'{name}: {value}' for name, value in self.items())})"


def read(simulation: Simulation) -> Readings:
    """The readings of all sensors of the model."""
    sensors = simulation.model.sensors
    now = Moment(simulation)
    values, slices, first = [], {}, 0
    for sensor in sensors:
        value = np.atleast_1d(KINDS[sensor.kind](now, sensor))
        if sensor.cutoff > 0:
            value = np.clip(value, -sensor.cutoff, sensor.cutoff)
        values.append(value)
        slices[sensor.name] = slice(first, first + sensor.size)
        first += sensor.size
    return Readings(np.concatenate(values) if values else np.zeros(0), slices)


class Moment:
    """A simulation between two steps, with what several sensors need worked out once."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation, self.model, self.core = simulation, simulation.model, simulation._core

    @cached_property
    def rotations(self) -> Array:
        """(n, 3, 3), of all bodies."""
        return np.array([rotation_matrix(q) for q in self.core.orientations]).reshape(-1, 3, 3)

    @cached_property
    def motion(self) -> Array:
        """(n, 12): velocity and acceleration of the frames' origins and angular ones, world axes."""
        tree = self.model.tree
        return tree.motion(self.core, tree.rates(self.core))

    @cached_property
    def coordinates(self) -> tuple[Array, Array]:
        return self.model.tree.coordinates(self.core)

    @cached_property
    def contacts(self) -> Table:
        return self.simulation.contacts

    @cached_property
    def gravity(self) -> Array:
        return np.array(self.model.gravity)

    def place(self, body: int, frame: Transform) -> tuple[Array, Array]:
        """Position and axes (columns) of a frame in the world."""
        position, axes = np.array(frame.position), rotation_matrix(frame.rotation)
        if body == WORLD:
            return position, axes
        R = self.rotations[body]
        return self.core.positions[body] + R @ position, R @ axes

    def velocity(self, body: int, point: Array) -> tuple[Array, Array]:
        """Of a point of a body, and angular."""
        if body == WORLD or self.model.bodies[body].motion == "fixed":
            return np.zeros(3), np.zeros(3)
        w = self.core.angular_velocities[body]
        return self.core.linear_velocities[body] + np.cross(w, point - self.core.positions[body]), w

    def acceleration(self, body: int, point: Array) -> tuple[Array, Array]:
        """Of a point of a body against free fall, and angular: what a mass on a spring there feels."""
        if body == WORLD:
            return -self.gravity, np.zeros(3)
        w, a, turning = self.motion[body, 3:6], self.motion[body, 6:9], self.motion[body, 9:]
        arm = point - self.core.positions[body]
        return a + np.cross(turning, arm) + np.cross(w, np.cross(w, arm)) - self.gravity, turning

    def centre(self, body: int) -> Array:
        return self.core.positions[body] + self.rotations[body] @ np.array(
            self.model.bodies[body].centre_of_mass
        )

    def inertia(self, body: int) -> Array:
        """About the centre of mass, world axes."""
        R = self.rotations[body]
        return R @ np.array(self.model.bodies[body].inertia) @ R.T


Kind = Callable[[Moment, Sensor], Any]


def _at_site(vector: Callable[[Moment, Sensor, Array], Array]) -> Kind:
    """A vector of the world in the axes of the site."""

    def reading(now: Moment, sensor: Sensor) -> Array:
        position, axes = now.place(sensor.body, sensor.frame)
        return axes.T @ vector(now, sensor, position)

    return reading


def _interaction(now: Moment, sensor: Sensor, point: Array) -> tuple[Array, Array]:
    """Force and torque about a point on a body, and all that hangs on it, from what carries it.

    By its change of momentum: what it needs to move as it does, less loads, contacts and loops.
    """
    force, torque = np.zeros(3), np.zeros(3)

    def add(f: Array, at: Array, t: Array) -> None:
        nonlocal force, torque
        force, torque = force + f, torque + t + np.cross(at - point, f)

    for body in sensor.bodies:
        own: Body = now.model.bodies[body]
        centre = now.centre(body)
        a, turning = now.acceleration(body, centre)
        w, inertia = now.motion[body, 3:6], now.inertia(body)
        add(own.mass * a, centre, inertia @ turning + np.cross(w, inertia @ w))
        if own.motion == "dynamic":
            add(-now.core.forces[body], centre, -now.core.torques[body])
    inside = np.isin(now.contacts["body_a"], sensor.bodies).astype(int)
    inside -= np.isin(now.contacts["body_b"], sensor.bodies)
    for contact, sign in zip(now.contacts[inside != 0], inside[inside != 0], strict=True):
        add(-sign * contact["force"], contact["point"], -sign * contact["torque"])
    reactions = now.simulation.joint_reactions if len(now.model.tree.loops) else ()
    for j in now.model.tree.loops:
        joint, reaction = now.model.joints[j], reactions[j]
        sign = int(joint.body_a in sensor.bodies) - int(joint.body_b in sensor.bodies)
        if sign:
            add(-sign * reaction["force"], reaction["point"], -sign * reaction["torque"])
    return force, torque


def _touch(now: Moment, sensor: Sensor) -> float:
    """The sum of normal forces on the body whose line into it passes through the sensor's volume."""
    position, axes = now.place(sensor.body, sensor.frame)
    total = 0.0
    for contact in now.contacts:
        sides = contact["body_a"], contact["body_b"]
        if sensor.body not in sides:
            continue
        if sensor.shape is not None:
            inwards = contact["normal"] if sensor.body == sides[0] else -contact["normal"]
            start, along = axes.T @ (contact["point"] - position), axes.T @ inwards
            if not np.isfinite(sensor.shape.core.cast_ray(tuple(start), tuple(along))[0]):
                continue
        total += float(contact["force"] @ contact["normal"])
    return total


def _rangefinder(now: Moment, sensor: Sensor) -> float:
    """The distance along the z axis of the site to the first geom of another body; -1 if there is none."""
    position, axes = now.place(sensor.body, sensor.frame)
    hit = now.simulation.ray(position, axes[:, 2], exclude=(sensor.body,))
    return hit.distance if hit.geom >= 0 else -1.0


def _entry(which: int) -> Kind:
    """Of q or qd."""

    def reading(now: Moment, sensor: Sensor) -> Array:
        coordinate = now.model.coordinates[sensor.source]
        return now.coordinates[which][coordinate.qd if which else coordinate.q]

    return reading


def _effort(column: int) -> Kind:
    """Of what acts along a degree of freedom: 1 the motor, 3 the limit."""

    def reading(now: Moment, sensor: Sensor) -> float:
        coordinate = now.model.coordinates[sensor.source]
        dof = now.model.dof_index(coordinate.joint, coordinate.dof)
        return float(now.core.dof_impulses[dof, column]) / (now.core.impulse_step or 1.0)

    return reading


def _limit(now: Moment, sensor: Sensor) -> tuple[float, float]:
    """The gap to the nearer limit and the side on which it is, (0, 0) within the limits."""
    coordinate = now.model.coordinates[sensor.source]
    dof = now.model.joints[coordinate.joint].dofs[coordinate.dof]
    q = float(now.coordinates[0][coordinate.q][0])
    gap, side = min((q - dof.lower, 1.0), (dof.upper - q, -1.0))
    return (gap, side) if gap < 0 else (0.0, 0.0)


def _limit_velocity(now: Moment, sensor: Sensor) -> float:
    return _limit(now, sensor)[1] * float(_entry(1)(now, sensor)[0])


def _frame_position(now: Moment, sensor: Sensor) -> Array:
    position, _ = now.place(sensor.body, sensor.frame)
    if sensor.reference is None:
        return position
    origin, axes = now.place(sensor.reference, sensor.reference_frame)
    return axes.T @ (position - origin)


def _frame_rotation(now: Moment, sensor: Sensor) -> Array:
    def quaternion(body: int, frame: Transform) -> Array:
        own = np.array(frame.rotation)
        return own if body == WORLD else _product(now.core.orientations[body], own)

    q = quaternion(sensor.body, sensor.frame)
    if sensor.reference is None:
        return q
    return _product(quaternion(sensor.reference, sensor.reference_frame) * (1, -1, -1, -1), q)


def _product(a: Array, b: Array) -> Array:
    scalar = a[0] * b[0] - a[1:] @ b[1:]
    return np.array([scalar, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


def _axis(k: int) -> Kind:
    def reading(now: Moment, sensor: Sensor) -> Array:
        axis = now.place(sensor.body, sensor.frame)[1][:, k]
        if sensor.reference is None:
            return axis
        return now.place(sensor.reference, sensor.reference_frame)[1].T @ axis

    return reading


def _frame_velocity(angular: bool) -> Kind:
    """Seen from the reference: its own motion and turning are taken off."""

    def reading(now: Moment, sensor: Sensor) -> Array:
        position, _ = now.place(sensor.body, sensor.frame)
        v, w = now.velocity(sensor.body, position)
        if sensor.reference is None:
            return w if angular else v
        _, axes = now.place(sensor.reference, sensor.reference_frame)
        v_there, w_there = now.velocity(sensor.reference, position)
        return axes.T @ (w - w_there if angular else v - v_there)

    return reading


def _frame_acceleration(angular: bool) -> Kind:
    def reading(now: Moment, sensor: Sensor) -> Array:
        return now.acceleration(sensor.body, now.place(sensor.body, sensor.frame)[0])[angular]

    return reading


def _subtree(now: Moment, sensor: Sensor) -> tuple[Array, Array, float]:
    """Centre of mass, its velocity, and the mass."""
    masses = np.array([now.model.bodies[b].mass for b in sensor.bodies])
    mass = masses.sum()
    if mass == 0:
        return now.place(sensor.body, sensor.frame)[0], np.zeros(3), 0.0
    centres = np.array([now.centre(b) for b in sensor.bodies])
    speeds = np.array([now.velocity(b, c)[0] for b, c in zip(sensor.bodies, centres, strict=True)])
    return masses @ centres / mass, masses @ speeds / mass, float(mass)


def _angular_momentum(now: Moment, sensor: Sensor) -> Array:
    """About the centre of mass of the subtree."""
    centre, velocity, _ = _subtree(now, sensor)
    total = np.zeros(3)
    for b in sensor.bodies:
        own = now.centre(b)
        v, w = now.velocity(b, own)
        total += now.model.bodies[b].mass * np.cross(own - centre, v - velocity) + now.inertia(b) @ w
    return total


KINDS: dict[str, Kind] = {
    "accelerometer": _at_site(lambda now, s, p: now.acceleration(s.body, p)[0]),
    "velocimeter": _at_site(lambda now, s, p: now.velocity(s.body, p)[0]),
    "gyro": _at_site(lambda now, s, p: now.velocity(s.body, p)[1]),
    "magnetometer": _at_site(lambda now, s, p: np.array(s.field)),
    "force": _at_site(lambda now, s, p: _interaction(now, s, p)[0]),
    "torque": _at_site(lambda now, s, p: _interaction(now, s, p)[1]),
    "touch": _touch,
    "rangefinder": _rangefinder,
    "jointpos": _entry(0),
    "jointvel": _entry(1),
    "jointactuatorfrc": _effort(1),
    "ballquat": _entry(0),
    "ballangvel": _entry(1),
    "jointlimitpos": lambda now, s: _limit(now, s)[0],
    "jointlimitvel": _limit_velocity,
    "jointlimitfrc": lambda now, s: abs(_effort(3)(now, s)),
    "framepos": _frame_position,
    "framequat": _frame_rotation,
    "framexaxis": _axis(0),
    "frameyaxis": _axis(1),
    "framezaxis": _axis(2),
    "framelinvel": _frame_velocity(False),
    "frameangvel": _frame_velocity(True),
    "framelinacc": _frame_acceleration(False),
    "frameangacc": _frame_acceleration(True),
    "subtreecom": lambda now, s: _subtree(now, s)[0],
    "subtreelinvel": lambda now, s: _subtree(now, s)[1],
    "subtreeangmom": _angular_momentum,
    "clock": lambda now, s: now.simulation.time,
}
