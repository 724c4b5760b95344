"""What an engine is to the comparison, and joints as the trees that engines with joint coordinates take."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import amontons
import numpy as np

Array = np.ndarray[Any, Any]
WORLD = -1


class Unsupported(Exception):
    """What an engine, or our way into it, does not have."""


@dataclass
class Motion:
    """Of the bodies of our model, in its order: frames (m; unit quaternions, w first), and their velocities
    (m/s of the origins, rad/s, world axes)."""

    positions: Array
    orientations: Array
    linear: Array
    angular: Array

    @staticmethod
    def start(model: amontons.Model) -> Motion:
        bodies = model.bodies
        return Motion(
            *(
                np.array(values, dtype=float)
                for values in (
                    [b.pose.position for b in bodies],
                    [b.pose.rotation for b in bodies],
                    [b.linear_velocity for b in bodies],
                    [b.angular_velocity for b in bodies],
                )
            )
        )


class Running(Protocol):
    """A scene under way."""

    def advance(self, steps: int) -> None: ...

    def motion(self) -> Motion: ...

    def close(self) -> None: ...


@dataclass(frozen=True)
class Subject:
    """What an engine is given: our model, and for robots the file that each reads by itself."""

    model: amontons.Model
    path: Path | None = None
    floor: float | None = None
    """the height of a floor that the file does not have (m)"""


@dataclass(frozen=True)
class Engine:
    """An engine with settings; `start` raises Unsupported where it has no such thing."""

    name: str
    tuned: bool
    start: Callable[[Subject, float], Running] = field(compare=False)


def check_found(model: amontons.Model, found: Collection[int]) -> None:
    """Raises Unsupported unless every body that moves was found by its name."""
    for i, body in enumerate(model.bodies):
        if body.motion == "dynamic" and i not in found:
            raise Unsupported(f'body "{body.name}" of this file')


def joint_kind(joint: amontons.Joint) -> str:
    """ball | hinge"""
    if joint.kind == "chain" and joint.spherical and not joint.dofs:
        return "ball"
    if joint.kind == "chain" and not joint.spherical and [d.kind for d in joint.dofs] == ["hinge"]:
        (dof,) = joint.dofs
        if dof.motor.kind == "none" and not any(dof.anchor):
            return "hinge"
    raise Unsupported(f'a joint like "{joint.name}"')


@dataclass(frozen=True)
class Link:
    """A body that moves, and the joint that carries it; none if it is free."""

    body: int
    parent: int
    joint: amontons.Joint | None

    def anchor(self) -> tuple[float, ...]:
        """In the body frame (m)."""
        return self.joint.frame_a.position if self.joint else (0.0, 0.0, 0.0)

    def axis(self) -> Array:
        """Of a hinge, in the body frame."""
        assert self.joint
        turned = amontons.Transform(rotation=self.joint.frame_a.rotation)
        return np.array(turned(self.joint.dofs[0].axis))


def trees(model: amontons.Model) -> tuple[list[Link], list[amontons.Joint]]:
    """All bodies that move, parents before children, and the joints that close loops between them."""
    placed = {WORLD} | {i for i, b in enumerate(model.bodies) if b.motion != "dynamic"}
    left = list(model.joints)
    carried = {joint.body_a for joint in left}
    links = [Link(i, WORLD, None) for i in range(len(model.bodies)) if i not in placed and i not in carried]
    placed |= {link.body for link in links}
    while left:
        ready = [j for j in left if j.body_b in placed and j.body_a not in placed]
        if not ready:
            break
        joint = ready[0]
        left.remove(joint)
        links.append(Link(joint.body_a, joint.body_b, joint))
        placed.add(joint.body_a)
    if missing := [j.name for j in left if not {j.body_a, j.body_b} <= placed]:
        raise Unsupported(f"the joints {missing}, which carry no body")
    return links, left


def loop_points(joint: amontons.Joint) -> Iterator[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Points of A and B that coincide, one of a ball joint, two of a hinge, in the frames of the bodies."""
    reach = 0.1 if joint_kind(joint) == "hinge" else 0.0
    along = [joint.dofs[0].axis] if reach else [(0.0, 0.0, 0.0)]
    for side in (-reach, reach) if reach else (0.0,):
        point = tuple(side * x for x in along[0])
        yield joint.frame_a(point), joint.frame_b(point)


def world_pose(model: amontons.Model, body: int) -> amontons.Transform:
    return model.bodies[body].pose if body != WORLD else amontons.Transform()


def relative_spin(model: amontons.Model, link: Link) -> Array:
    """The angular velocity of a body at the start from that of its parent (rad/s, world axes)."""
    spin = np.array(model.bodies[link.body].angular_velocity, dtype=float)
    return spin - np.array(model.bodies[link.parent].angular_velocity) if link.parent != WORLD else spin


def turned_back(rotation: tuple[float, ...], vector: Array) -> Array:
    """World to body axes."""
    return np.array(amontons.Transform(rotation=rotation).inverse()(tuple(vector)))
