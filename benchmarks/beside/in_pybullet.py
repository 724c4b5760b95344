"""PyBullet: a multibody per tree and per free body; loops closed by point-to-point constraints."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Iterator
from typing import Any

import amontons
import numpy as np
from amontons import shapes

from .engine import (
    WORLD,
    Engine,
    Link,
    Motion,
    Running,
    Subject,
    Unsupported,
    check_found,
    joint_kind,
    loop_points,
    relative_spin,
    trees,
    turned_back,
    world_pose,
)


def _xyzw(q: Any) -> list[float]:
    w, x, y, z = q
    return [x, y, z, w]


class _PyBullet:
    def __init__(self, subject: Subject, dt: float, iterations: int) -> None:
        import pybullet

        self.engine, self.model = pybullet, subject.model
        self.client = {"physicsClientId": pybullet.connect(pybullet.DIRECT)}
        pybullet.setGravity(*subject.model.gravity, **self.client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=dt, numSubSteps=0, numSolverIterations=iterations, **self.client
        )
        # Of each body of ours: the multibody, and the link in it, -1 for its base.
        self.where: dict[int, tuple[int, int]] = {}
        (_read if subject.path else _build)(self, subject)

    def close(self) -> None:
        self.engine.disconnect(**self.client)

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self.engine.stepSimulation(**self.client)

    def motion(self) -> Motion:
        found = Motion.start(self.model)
        for i, (body, link) in self.where.items():
            if link < 0:
                position, q = self.engine.getBasePositionAndOrientation(body, **self.client)
                velocity, spin = self.engine.getBaseVelocity(body, **self.client)
            else:
                state = self.engine.getLinkState(body, link, 1, 1, **self.client)
                position, q, velocity, spin = state[0], state[1], state[6], state[7]
            # These are the centre of mass and its frame, whose axes are ours.
            arm = np.array(self.model.bodies[i].centre_of_mass, dtype=float)
            if arm.any():
                arm = np.array(amontons.Transform(rotation=(q[3], *q[:3]))(arm))
            found.positions[i] = np.array(position) - arm
            found.orientations[i] = q[3], *q[:3]
            found.linear[i] = np.array(velocity) - np.cross(spin, arm)
            found.angular[i] = spin
        return found


def _shape(p: _PyBullet, g: amontons.Geom, offset: Any) -> int:
    engine, s = p.engine, g.shape
    frame = {
        "collisionFramePosition": list(np.array(g.frame.position) - offset),
        "collisionFrameOrientation": _xyzw(g.frame.rotation),
        **p.client,
    }
    if isinstance(s, shapes.Box):
        return engine.createCollisionShape(engine.GEOM_BOX, halfExtents=s.half, **frame)
    if isinstance(s, shapes.Sphere):
        return engine.createCollisionShape(engine.GEOM_SPHERE, radius=s.radius, **frame)
    if isinstance(s, shapes.Capsule):
        height = 2 * s.half_length
        return engine.createCollisionShape(engine.GEOM_CAPSULE, radius=s.radius, height=height, **frame)
    if isinstance(s, shapes.Plane):
        return engine.createCollisionShape(engine.GEOM_PLANE, **p.client)
    raise Unsupported(f"a {type(s).__name__}")


def _build(p: _PyBullet, subject: Subject) -> None:
    model = subject.model
    geoms: dict[int, list[amontons.Geom]] = {}
    for g in model.geoms:
        geoms.setdefault(g.body, []).append(g)
        if g.body != WORLD and len(geoms[g.body]) > 1:
            raise Unsupported("a body of several shapes")
    masks = _masks(model)
    for g in geoms.pop(WORLD, []):
        frame = g.frame if isinstance(g.shape, shapes.Plane) else amontons.Transform()
        base = p.engine.createMultiBody(
            0, _shape(p, g, 0), -1, list(frame.position), _xyzw(frame.rotation), **p.client
        )
        _dress(p, base, -1, g, masks)
    links, loops = trees(model)
    roots = [link for link in links if link.parent == WORLD]
    below: dict[int, list[Link]] = {link.body: [link] for link in roots}
    root_of = {link.body: link.body for link in roots}
    for link in links:
        if link.parent != WORLD:
            root_of[link.body] = root_of[link.parent]
            below[root_of[link.body]].append(link)
    for tree in below.values():
        _add_tree(p, model, tree, geoms)
    for i, body in enumerate(model.bodies):
        base, link = p.where[i]
        for g in geoms.get(i, []):
            _dress(p, base, link, g, masks)
        inertia = np.asarray(body.inertia)
        if np.abs(inertia - np.diag(np.diag(inertia))).max() > 1e-9 * inertia.max():
            raise Unsupported("an inertia that is not diagonal in the axes of the body")
        p.engine.changeDynamics(
            base, link, localInertiaDiagonal=[float(v) for v in np.diag(inertia)], linearDamping=0,
            angularDamping=0, jointDamping=0, **p.client,
        )  # fmt: skip
    for joint in loops:
        for point_a, point_b in loop_points(joint):
            _close(p, model, joint, point_a, point_b)


def _masks(model: amontons.Model) -> dict[tuple[int, int], int]:
    """Bullet lets two shapes touch if each one's mask has the other's group; one is enough for us."""
    kinds = {(g.category, g.mask) for g in model.geoms}
    return {(category, mask): mask | sum({c for c, m in kinds if m & category}) for category, mask in kinds}


def _dress(p: _PyBullet, body: int, link: int, g: amontons.Geom, masks: dict[tuple[int, int], int]) -> None:
    # The coefficients of two bodies are multiplied.
    p.engine.changeDynamics(
        body, link, lateralFriction=math.sqrt(g.material.friction), rollingFriction=0, spinningFriction=0,
        **p.client,
    )  # fmt: skip
    p.engine.setCollisionFilterGroupMask(body, link, g.category, masks[g.category, g.mask], **p.client)


def _add_tree(
    p: _PyBullet, model: amontons.Model, tree: list[Link], geoms: dict[int, list[amontons.Geom]]
) -> None:
    """Links stand at their joints, with the axes of their bodies."""
    root = tree[0]
    free = root.joint is None
    body = model.bodies[root.body]

    def shape(i: int, offset: Any) -> int:
        return _shape(p, geoms[i][0], np.array(offset)) if geoms.get(i) else -1

    def link_frame(link: Link) -> amontons.Transform:
        return model.bodies[link.body].pose @ amontons.Transform(position=link.anchor())

    links = tree[1:] if free else tree
    place = {link.body: k for k, link in enumerate(links)}
    frames = {link.body: link_frame(link) for link in tree}
    lists: dict[str, list[Any]] = {name: [] for name in (
        "linkMasses", "linkCollisionShapeIndices", "linkVisualShapeIndices", "linkPositions",
        "linkOrientations", "linkInertialFramePositions", "linkInertialFrameOrientations",
        "linkParentIndices", "linkJointTypes", "linkJointAxis",
    )}  # fmt: skip
    for link in links:
        assert link.joint
        b = model.bodies[link.body]
        parent = frames.get(link.parent, amontons.Transform())
        relative = parent.inverse() @ frames[link.body]
        hinge = joint_kind(link.joint) == "hinge"
        values = (
            b.mass, shape(link.body, link.anchor()), -1, list(relative.position), _xyzw(relative.rotation),
            list(np.array(b.centre_of_mass) - link.anchor()), [0, 0, 0, 1], place.get(link.parent, -1) + 1,
            p.engine.JOINT_REVOLUTE if hinge else p.engine.JOINT_SPHERICAL,
            list(link.axis()) if hinge else [0, 0, 1],
        )  # fmt: skip
        for entries, value in zip(lists.values(), values, strict=True):
            entries.append(value)
    pose = body.pose if free else amontons.Transform()
    if free and any(body.centre_of_mass):
        raise Unsupported("a base whose centre of mass is not its origin")
    base = p.engine.createMultiBody(
        body.mass if free else 0, shape(root.body, (0, 0, 0)) if free else -1, -1, list(pose.position),
        _xyzw(pose.rotation), **(lists if links else {}), **p.client,
    )  # fmt: skip
    if base < 0:
        raise Unsupported(f"a tree of {len(links)} links")
    if free:
        p.where[root.body] = (base, -1)
        p.engine.resetBaseVelocity(base, body.linear_velocity, body.angular_velocity, **p.client)
    for link in links:
        p.where[link.body] = (base, place[link.body])
        _start_joint(p, model, link, base, place[link.body])


def _start_joint(p: _PyBullet, model: amontons.Model, link: Link, base: int, k: int) -> None:
    """Its velocity, and without the motor that every joint has at first."""
    engine = p.engine
    spin = turned_back(model.bodies[link.body].pose.rotation, relative_spin(model, link))
    assert link.joint
    if joint_kind(link.joint) == "hinge":
        engine.resetJointState(base, k, 0, float(link.axis() @ spin), **p.client)
        engine.setJointMotorControl2(base, k, engine.VELOCITY_CONTROL, force=0, **p.client)
    else:
        engine.resetJointStateMultiDof(base, k, [0, 0, 0, 1], list(spin), **p.client)
        engine.setJointMotorControlMultiDof(
            base, k, engine.POSITION_CONTROL, targetPosition=[0, 0, 0, 1], force=[0, 0, 0], **p.client
        )


def _close(p: _PyBullet, model: amontons.Model, joint: amontons.Joint, a: Any, b: Any) -> None:
    """Points of a constraint are told from the centres of mass."""

    def end(body: int, point: Any) -> tuple[int, int, list[float]]:
        if body == WORLD:
            return -1, -1, list(world_pose(model, body)(point))
        return *p.where[body], list(np.array(point) - model.bodies[body].centre_of_mass)

    first, link, at = end(joint.body_a, a)
    second, other, there = end(joint.body_b, b)
    p.engine.createConstraint(
        first, link, second, other, p.engine.JOINT_POINT2POINT, [0, 0, 0], at, there, **p.client
    )


def _read(p: _PyBullet, subject: Subject) -> None:
    """The file as PyBullet reads it, without the motors that it adds to joints."""
    engine, path = p.engine, str(subject.path)
    if not path.endswith(".urdf"):
        raise Unsupported("reader for defaults and free joints of MJCF")
    fixed = not any(c.kind == "free" for c in subject.model.coordinates.values())
    try:
        body = engine.loadURDF(path, useFixedBase=fixed, **p.client)
    except engine.error as error:
        raise Unsupported(f"reader for this file: {error}") from None
    if subject.floor is not None:
        ground = engine.createCollisionShape(engine.GEOM_PLANE, **p.client)
        engine.createMultiBody(0, ground, -1, [0, 0, subject.floor], **p.client)
    names = {name: i for i, name in enumerate(subject.model.body_names)}
    base = engine.getBodyInfo(body, **p.client)[0].decode()
    if base in names:
        p.where[names[base]] = (body, -1)
    for k in range(engine.getNumJoints(body, **p.client)):
        facts = engine.getJointInfo(body, k, **p.client)
        if facts[12].decode() in names:
            p.where[names[facts[12].decode()]] = (body, k)
        if facts[2] in (engine.JOINT_REVOLUTE, engine.JOINT_PRISMATIC):
            engine.setJointMotorControl2(body, k, engine.VELOCITY_CONTROL, force=0, **p.client)
    check_found(subject.model, p.where)


def _engine(name: str, iterations: int) -> Engine:
    def start(subject: Subject, dt: float) -> Running:
        return _PyBullet(subject, dt, iterations)

    return Engine(name, iterations > 50, start)


def engines() -> Iterator[Engine]:
    if importlib.util.find_spec("pybullet"):
        yield _engine("PyBullet", 50)
        yield _engine("PyBullet, tuned", 500)
