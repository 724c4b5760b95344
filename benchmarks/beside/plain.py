"""A scene as plain data, which every engine gets: bodies, shapes, joints. NumPy only: it runs in the
environments of all engines."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
WORLD = -1


class Unsupported(Exception):
    """What an engine, or our way into it, does not have."""


@dataclass(frozen=True)
class Variant:
    """Settings of an engine: options of the adapter, and the page of the manual that advises them."""

    name: str
    options: Mapping[str, Any] = field(default_factory=dict, compare=False)
    manual: str = ""
    tuned: bool = False


@dataclass(frozen=True)
class Frame:
    """Position (m) and rotation (unit quaternion, w first) in another frame."""

    position: tuple[float, ...] = (0.0, 0.0, 0.0)
    rotation: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)

    def __call__(self, point: Any) -> Array:
        return np.array(self.position) + matrix(self.rotation) @ np.asarray(point, dtype=float)

    def __matmul__(self, inner: Frame) -> Frame:
        return Frame(tuple(self(inner.position)), tuple(product(self.rotation, inner.rotation)))

    def inverse(self) -> Frame:
        w, x, y, z = self.rotation
        back = (w, -x, -y, -z)
        return Frame(tuple(-matrix(back) @ np.array(self.position)), back)


def product(p: Any, q: Any) -> Array:
    """Of quaternions: first q, then p."""
    (a, b, c, d), (e, f, g, h) = p, q
    return np.array(
        (a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
         a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e)
    )  # fmt: skip


def matrix(q: Any) -> Array:
    """Of a quaternion of any length."""
    w, x, y, z = np.asarray(q, dtype=float) / np.linalg.norm(q)
    return np.array(
        ((1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
         (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
         (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)))
    )  # fmt: skip


def quaternion(m: Any) -> Array:
    """w first, of a rotation matrix: the eigenvector of Bar-Itzhack's symmetric matrix."""
    k = np.array(
        ((m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0),
         (m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], 0, 0),
         (m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], 0),
         (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], np.trace(m)))
    )  # fmt: skip
    x, y, z, w = np.linalg.eigh(k)[1][:, -1]
    return np.array((w, x, y, z))


@dataclass(frozen=True)
class Body:
    """`inertia` is about the centre of mass, `centre` is that in the body frame; both in body axes. The
    velocity is that of the frame's origin, in world axes, and so is the spin."""

    name: str
    moves: bool
    mass: float
    inertia: tuple[tuple[float, ...], ...]
    centre: tuple[float, ...]
    frame: Frame
    velocity: tuple[float, ...]
    spin: tuple[float, ...]

    def velocity_of_centre(self) -> Array:
        arm = matrix(self.frame.rotation) @ np.array(self.centre)
        return np.array(self.velocity) + np.cross(self.spin, arm)


@dataclass(frozen=True)
class Geom:
    """`kind` and `size`: box, half lengths; sphere, radius; capsule (along z), radius and half length of its
    cylinder; plane (z up), nothing; hull, all its points in a row. The frame is that in the body."""

    body: int
    kind: str
    size: tuple[float, ...]
    frame: Frame
    friction: float
    restitution: float
    category: int
    mask: int

    def made(self, makers: Mapping[str, Callable[..., Any]]) -> Any:
        """What one of the functions makes of the size: of all points of a hull, (n, 3)."""
        if self.kind not in makers:
            raise Unsupported(f"{self.kind} in this adapter")
        size = (np.array(self.size).reshape(-1, 3),) if self.kind == "hull" else self.size
        return makers[self.kind](*size)


@dataclass(frozen=True)
class Joint:
    """ball | hinge of two bodies; `a` is not the world. Points and axes in the frames of the bodies."""

    name: str
    kind: str
    a: int
    b: int
    point_a: tuple[float, ...]
    point_b: tuple[float, ...]
    axis_a: tuple[float, ...]


@dataclass(frozen=True)
class Scene:
    gravity: tuple[float, ...] = (0.0, 0.0, -9.81)
    bodies: tuple[Body, ...] = ()
    geoms: tuple[Geom, ...] = ()
    joints: tuple[Joint, ...] = ()
    path: str = ""
    """of a robot in MJCF, which each engine reads by itself; then there are only the names of its bodies"""
    names: tuple[str, ...] = field(default=())
    keyframe: str = ""
    """of the file: the robot starts from it, and its controls hold; an engine that has none raises"""

    def frame(self, body: int) -> Frame:
        return self.bodies[body].frame if body != WORLD else Frame()

    def touching(self, body: int | None = None) -> list[Geom]:
        """The geoms that can touch others: all, or those of a body."""
        return [g for g in self.geoms if (g.category or g.mask) and body in (None, g.body)]

    def between(self, a: int, b: int) -> Frame:
        """The frame of a body in that of another at the start."""
        return self.frame(b).inverse() @ self.frame(a)

    def placed(self, geom: Geom) -> Frame:
        """In the world at the start."""
        return self.frame(geom.body) @ geom.frame

    def both_masks(self) -> dict[tuple[int, int], int]:
        """Masks for engines where two shapes touch if each one's mask has the other's category; by our rule
        one of the two is enough."""
        kinds = {(g.category, g.mask) for g in self.geoms}
        return {
            (category, mask): mask | sum({c for c, m in kinds if m & category}) for category, mask in kinds
        }

    def trees(self) -> tuple[list[Link], list[Joint]]:
        """All bodies that move, parents before children, and the joints that close loops between them."""
        placed = {WORLD} | {i for i, b in enumerate(self.bodies) if not b.moves}
        left = list(self.joints)
        carried = {joint.a for joint in left}
        links = [Link(i, WORLD, None) for i in range(len(self.bodies)) if i not in placed | carried]
        placed |= {link.body for link in links}
        while left:
            ready = [j for j in left if j.b in placed and j.a not in placed]
            if not ready:
                break
            joint = ready[0]
            left.remove(joint)
            links.append(Link(joint.a, joint.b, joint))
            placed.add(joint.a)
        if missing := [j.name for j in left if not {j.a, j.b} <= placed]:
            raise Unsupported(f"the joints {missing}, which carry no body")
        return links, left

    def loop_points(self, joint: Joint) -> Iterator[tuple[Array, Array]]:
        """Points of A and B, in their frames, that coincide: one of a ball joint, two of a hinge."""
        reach = 0.1 if joint.kind == "hinge" else 0.0
        for side in (-reach, reach) if reach else (0.0,):
            point = np.array(joint.point_a) + side * np.array(joint.axis_a)
            yield point, self.frame(joint.b).inverse()(self.frame(joint.a)(point))

    def relative_spin(self, link: Link) -> Array:
        """The angular velocity of a body at the start from that of its parent (rad/s, axes of the body)."""
        spin = np.array(self.bodies[link.body].spin, dtype=float)
        if link.parent != WORLD:
            spin = spin - np.array(self.bodies[link.parent].spin)
        return matrix(self.bodies[link.body].frame.rotation).T @ spin

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> Scene:
        return Scene(
            tuple(data["gravity"]),
            tuple(Body(**{**b, "frame": Frame(**b["frame"])}) for b in data["bodies"]),
            tuple(Geom(**{**g, "frame": Frame(**g["frame"])}) for g in data["geoms"]),
            tuple(Joint(**j) for j in data["joints"]),
            data["path"], tuple(data["names"]), data["keyframe"],
        )  # fmt: skip


@dataclass
class Motion:
    """Of the bodies of a scene, in its order: frames (m; unit quaternions, w first), and their velocities
    (m/s of the origins, rad/s, world axes)."""

    positions: Array
    orientations: Array
    linear: Array
    angular: Array

    @staticmethod
    def start(scene: Scene) -> Motion:
        columns = zip(*((b.frame.position, b.frame.rotation, b.velocity, b.spin) for b in scene.bodies),
                      strict=True)  # fmt: skip
        return Motion(*(np.array(values, dtype=float) for values in columns))

    @staticmethod
    def empty(count: int) -> Motion:
        still = np.zeros((count, 3))
        return Motion(still, np.tile((1.0, 0, 0, 0), (count, 1)), still.copy(), still.copy())


@dataclass(frozen=True)
class Link:
    """A body that moves, and the joint that carries it; none if it is free."""

    body: int
    parent: int
    joint: Joint | None

    def anchor(self) -> tuple[float, ...]:
        """In the body frame (m)."""
        return self.joint.point_a if self.joint else (0.0, 0.0, 0.0)

    def axis(self) -> Array:
        """Of a hinge, in the body frame."""
        assert self.joint
        return np.array(self.joint.axis_a)


def xyzw(q: Any) -> list[float]:
    w, x, y, z = q
    return [float(v) for v in (x, y, z, w)]


def wxyz(q: Any) -> list[float]:
    x, y, z, w = q
    return [float(v) for v in (w, x, y, z)]


def serve(answer: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
    """Answers each line of the input, a JSON object. What an engine prints goes to the error output."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        try:
            found = answer(json.loads(line))
        except Unsupported as missing:
            found = {"unsupported": str(missing)}
        except Exception as error:
            found = {"unsupported": f"way on: {type(error).__name__}: {' '.join(str(error).split())[:160]}"}
        print(json.dumps(found), file=out, flush=True)


class Adapter:
    """A scene under way in an engine. A subclass begins it, and has `step`, a function of the engine, and
    `bodies`, by our numbers what the engine calls those that move."""

    READS = False
    """whether the engine gets model files"""
    step: Callable[[], Any]
    bodies: dict[int, Any]

    def __init__(self, scene: Scene, dt: float, options: Mapping[str, Any]) -> None:
        if scene.path and not self.READS:
            raise Unsupported("reader for this file (none is tried)")
        self.scene, self.dt, self.options = scene, dt, options

    def advance(self, steps: int) -> None:
        step = self.step
        for _ in range(steps):
            step()

    def tell(self, body: Any) -> tuple[Any, Any, Any, Any]:
        """Position, quaternion (w first), velocity of the origin and spin of a body of the engine."""
        raise NotImplementedError

    def motion(self) -> Motion:
        found = Motion.start(self.scene) if not self.scene.path else Motion.empty(len(self.scene.names))
        for i, body in self.bodies.items():
            found.positions[i], found.orientations[i], found.linear[i], found.angular[i] = self.tell(body)
        return found

    def arm(self, body: int, q: Any) -> Array:
        """From the origin of a body to its centre of mass, in world axes (m)."""
        return matrix(q) @ np.array(self.scene.bodies[body].centre, dtype=float)

    def contacts(self) -> list[list[float]]:
        raise Unsupported("forces to tell")

    def save(self) -> None:
        raise Unsupported("state to save and restore")

    restore = save

    def close(self) -> None:
        """Ends it."""
