"""Planar linkages out of hinges in space: closed loops, three redundant constraints each."""

from __future__ import annotations

import math

import numpy as np

from ..model.builder import ModelBuilder
from ..model.model import Model
from ..model.parts import Motor
from ..model.shapes import Box
from .geometry import Quaternion, Y, about, add_part, require
from .registry import scene

_DENSITY = 1000.0


def _bar(
    b: ModelBuilder, name: str, start: np.ndarray, end: np.ndarray, velocity: np.ndarray, spin: float
) -> int:
    """A bar between two points of the x-z plane; the velocity is that of its middle, the spin is about -y."""
    along = end - start
    length = float(np.hypot(*along))
    thickness = 0.02
    middle = (start + end) / 2
    return add_part(
        b,
        name,
        Box((length / 2, thickness, thickness)),
        density=_DENSITY,
        position=(middle[0], 0, middle[1]),
        orientation=_in_plane(math.atan2(along[1], along[0])),
        linear_velocity=(velocity[0], 0, velocity[1]),
        angular_velocity=(0, -spin, 0),
        category=0,
        mask=0,
    )


def _in_plane(angle: float) -> Quaternion:
    """x turned towards z by an angle, that is about -y."""
    return about(Y, -angle)


def four_bar_pose(
    angle: float, *, ground: float, crank: float, coupler: float, rocker: float
) -> tuple[float, float]:
    """The angles of coupler and rocker from the crank's (rad), open branch, by the cosine rule."""
    pin = crank * np.array([math.cos(angle), math.sin(angle)])
    pivot = np.array([ground, 0.0])
    diagonal = pivot - pin
    d = float(np.hypot(*diagonal))
    inner = math.acos((coupler**2 + d**2 - rocker**2) / (2 * coupler * d))
    coupler_angle = math.atan2(diagonal[1], diagonal[0]) + inner
    end = pin + coupler * np.array([math.cos(coupler_angle), math.sin(coupler_angle)])
    return coupler_angle, math.atan2(end[1], end[0] - ground)


@scene(dt=2e-3, duration=10.0)
def four_bar(
    *,
    speed: float = 2.0 * math.pi,
    driven: bool = True,
    gravity: float = 9.81,
    angle: float = 60.0,
    ground: float = 0.9,
    crank: float = 0.3,
    coupler: float = 1.0,
    rocker: float = 0.8,
) -> Model:
    """A crank-rocker: four links and four parallel hinges, closed in a loop with redundant constraints.

    Lengths in m; Grashof's condition holds by default, so the crank turns all the way. The crank starts at
    `angle` degrees with `speed` rad/s; `driven` keeps that speed with a motor, else the linkage is
    conservative.
    """
    lengths = sorted((ground, crank, coupler, rocker))
    require(lengths[3] < sum(lengths[:3]), "four_bar", "the links do not close")
    b = ModelBuilder(gravity=(0, 0, -gravity))
    sizes = {"ground": ground, "crank": crank, "coupler": coupler, "rocker": rocker}
    a = math.radians(angle)
    c, r = four_bar_pose(a, **sizes)

    def arm(length: float, direction: float) -> np.ndarray:
        return length * np.array([math.cos(direction), math.sin(direction)])

    def velocity(spin: float, along: np.ndarray) -> np.ndarray:
        return spin * np.array([-along[1], along[0]])

    # Speeds from the loop's derivative: w_a x crank + w_c x coupler = w_r x rocker.
    jacobian = np.column_stack([velocity(1, arm(coupler, c)), -velocity(1, arm(rocker, r))])
    coupler_spin, rocker_spin = np.linalg.solve(jacobian, -velocity(speed, arm(crank, a)))
    origin, pivot = np.zeros(2), np.array([ground, 0.0])
    pin = arm(crank, a)
    end = pivot + arm(rocker, r)
    v_pin = velocity(speed, pin)
    bars = (
        _bar(b, "crank", origin, pin, v_pin / 2, speed),
        _bar(b, "coupler", pin, end, v_pin + velocity(coupler_spin, end - pin) / 2, coupler_spin),
        _bar(b, "rocker", pivot, end, velocity(rocker_spin, end - pivot) / 2, rocker_spin),
    )
    axis = (0, -1, 0)
    motor = Motor(kind="velocity", control=speed) if driven else None
    b.add_revolute_joint(bars[0], None, point=(0, 0, 0), axis=axis, motor=motor, name="crank pivot")
    b.add_revolute_joint(bars[1], bars[0], point=(pin[0], 0, pin[1]), axis=axis, name="crank pin")
    b.add_revolute_joint(bars[2], bars[1], point=(end[0], 0, end[1]), axis=axis, name="rocker pin")
    b.add_revolute_joint(bars[2], None, point=(ground, 0, 0), axis=axis, name="rocker pivot")
    return b.build()


@scene(dt=2e-3, duration=5.0)
def slider_crank(*, speed: float = 2.0 * math.pi, crank: float = 0.2, rod: float = 0.6) -> Model:
    """A crank driven at constant speed moves a slider: x = r cos a + sqrt(l^2 - r^2 sin^2 a).

    Lengths in m, speed in rad/s; starts at a = 0. The loop of three hinges and a slide is redundant in space.
    """
    require(rod > crank > 0, "slider_crank", "rod must be longer than the crank")
    b = ModelBuilder()
    origin, pin = np.zeros(2), np.array([crank, 0.0])
    end = np.array([crank + rod, 0.0])
    # At a = 0 the slider is at rest, the pin moves with r w along z, the rod turns with -r w / l.
    v_pin = np.array([0.0, speed * crank])
    first = _bar(b, "crank", origin, pin, v_pin / 2, speed)
    second = _bar(b, "rod", pin, end, v_pin / 2, -speed * crank / rod)
    slider = add_part(
        b,
        "slider",
        Box((0.05, 0.05, 0.05)),
        density=_DENSITY,
        position=(end[0], 0, 0),
        category=0,
        mask=0,
    )
    axis = (0, -1, 0)
    b.add_revolute_joint(
        first,
        None,
        point=(0, 0, 0),
        axis=axis,
        motor=Motor(kind="velocity", control=speed),
        name="crank pivot",
    )
    b.add_revolute_joint(second, first, point=(crank, 0, 0), axis=axis, name="crank pin")
    b.add_revolute_joint(slider, second, point=(end[0], 0, 0), axis=axis, name="wrist pin")
    b.add_prismatic_joint(slider, None, axis=(1, 0, 0), name="slide")
    return b.build()
