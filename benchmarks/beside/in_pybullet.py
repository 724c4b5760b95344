"""PyBullet: a multibody per tree and per free body; loops closed by point-to-point constraints."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from .plain import WORLD, Adapter, Frame, Geom, Joint, Link, Scene, Unsupported, Variant, wxyz, xyzw

IMPORT, PACKAGES = "pybullet", ("pybullet>=3.2", "numpy")
GUIDE = "https://github.com/bulletphysics/bullet3/blob/master/docs/pybullet_quickstartguide.pdf"
# Of the guide's setPhysicsEngineParameter: more iterations, no early end, the friction cone instead of a
# pyramid.
TUNED = {"numSolverIterations": 500, "solverResidualThreshold": 0.0, "enableConeFriction": 1}
VARIANTS = (Variant("PyBullet", {}, GUIDE), Variant("PyBullet, cone, 500", TUNED, GUIDE, tuned=True))


class _PyBullet(Adapter):
    def __init__(self, scene: Scene, dt: float, options: dict[str, Any]) -> None:
        import pybullet

        super().__init__(scene, dt, options)
        self.engine = pybullet
        self.client = {"physicsClientId": pybullet.connect(pybullet.DIRECT)}
        pybullet.setGravity(*scene.gravity, **self.client)
        pybullet.setPhysicsEngineParameter(fixedTimeStep=dt, numSubSteps=0, **options, **self.client)
        self.step = partial(pybullet.stepSimulation, **self.client)
        # Of each body of ours: the multibody, and the link in it, -1 for its base.
        self.where: dict[int, tuple[int, int]] = {}
        _build(self)
        self.bodies = {i: (i, *where) for i, where in self.where.items()}

    def close(self) -> None:
        self.engine.disconnect(**self.client)

    def tell(self, body: Any) -> tuple[Any, Any, Any, Any]:
        i, body, link = body
        if link < 0:
            position, q = self.engine.getBasePositionAndOrientation(body, **self.client)
            velocity, spin = self.engine.getBaseVelocity(body, **self.client)
        else:
            state = self.engine.getLinkState(body, link, 1, 1, **self.client)
            position, q, velocity, spin = state[0], state[1], state[6], state[7]
        # These are the centre of mass and its frame, whose axes are ours.
        arm = self.arm(i, wxyz(q))
        return np.array(position) - arm, wxyz(q), np.array(velocity) - np.cross(spin, arm), spin

    def contacts(self) -> list[list[float]]:
        numbers = {where: i for i, where in self.where.items()}
        found = []
        for c in self.engine.getContactPoints(**self.client):
            on, by = (numbers.get(where, WORLD) for where in (c[1:4:2], c[2:5:2]))
            normal = np.array(c[7])
            force = c[9] * normal + c[10] * np.array(c[11]) + c[12] * np.array(c[13])
            found.append([on, by, *c[5], *normal, *force, c[8]])
        return found

    def save(self) -> None:
        self.saved = self.engine.saveState(**self.client)

    def restore(self) -> None:
        self.engine.restoreState(self.saved, **self.client)


start = _PyBullet


def _shape(p: _PyBullet, g: Geom, offset: Any) -> int:
    engine = p.engine
    frame = {
        "collisionFramePosition": list(np.array(g.frame.position) - offset),
        "collisionFrameOrientation": xyzw(g.frame.rotation), **p.client,
    }  # fmt: skip
    make = engine.createCollisionShape
    return g.made({
        "box": lambda *half: make(engine.GEOM_BOX, halfExtents=half, **frame),
        "sphere": lambda radius: make(engine.GEOM_SPHERE, radius=radius, **frame),
        "capsule": lambda r, half: make(engine.GEOM_CAPSULE, radius=r, height=2 * half, **frame),
        "hull": lambda points: make(engine.GEOM_MESH, vertices=points.tolist(), **frame),
        "plane": lambda: make(engine.GEOM_PLANE, **p.client),
    })  # fmt: skip


def _build(p: _PyBullet) -> None:
    scene = p.scene
    geoms: dict[int, list[Geom]] = {}
    for g in scene.geoms:
        geoms.setdefault(g.body, []).append(g)
        if g.body != WORLD and len(geoms[g.body]) > 1:
            raise Unsupported("a body of several shapes")
    masks = scene.both_masks()
    for g in geoms.pop(WORLD, []):
        frame = g.frame if g.kind == "plane" else Frame()
        base = p.engine.createMultiBody(
            0, _shape(p, g, 0), -1, list(frame.position), xyzw(frame.rotation), **p.client
        )
        _dress(p, base, -1, g, masks)
    links, loops = scene.trees()
    roots = [link for link in links if link.parent == WORLD]
    below: dict[int, list[Link]] = {link.body: [link] for link in roots}
    root_of = {link.body: link.body for link in roots}
    for link in links:
        if link.parent != WORLD:
            root_of[link.body] = root_of[link.parent]
            below[root_of[link.body]].append(link)
    for tree in below.values():
        _add_tree(p, scene, tree, geoms)
    for i, body in enumerate(scene.bodies):
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
        for point_a, point_b in scene.loop_points(joint):
            _close(p, scene, joint, point_a, point_b)


def _dress(p: _PyBullet, body: int, link: int, g: Geom, masks: dict[tuple[int, int], int]) -> None:
    # The coefficients of two bodies are multiplied.
    p.engine.changeDynamics(
        body, link, lateralFriction=math.sqrt(g.friction), rollingFriction=0, spinningFriction=0,
        **p.client,
    )  # fmt: skip
    p.engine.setCollisionFilterGroupMask(body, link, g.category, masks[g.category, g.mask], **p.client)


def _add_tree(p: _PyBullet, scene: Scene, tree: list[Link], geoms: dict[int, list[Geom]]) -> None:
    """Links stand at their joints, with the axes of their bodies."""
    root = tree[0]
    free = root.joint is None
    body = scene.bodies[root.body]

    def shape(i: int, offset: Any) -> int:
        return _shape(p, geoms[i][0], np.array(offset)) if geoms.get(i) else -1

    def link_frame(link: Link) -> Frame:
        return scene.bodies[link.body].frame @ Frame(link.anchor())

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
        b = scene.bodies[link.body]
        parent = frames.get(link.parent, Frame())
        relative = parent.inverse() @ frames[link.body]
        hinge = link.joint.kind == "hinge"
        values = (
            b.mass, shape(link.body, link.anchor()), -1, list(relative.position), xyzw(relative.rotation),
            list(np.array(b.centre) - link.anchor()), [0, 0, 0, 1], place.get(link.parent, -1) + 1,
            p.engine.JOINT_REVOLUTE if hinge else p.engine.JOINT_SPHERICAL,
            list(link.axis()) if hinge else [0, 0, 1],
        )  # fmt: skip
        for entries, value in zip(lists.values(), values, strict=True):
            entries.append(value)
    pose = body.frame if free else Frame()
    if free and any(body.centre):
        raise Unsupported("a base whose centre of mass is not its origin")
    base = p.engine.createMultiBody(
        body.mass if free else 0, shape(root.body, (0, 0, 0)) if free else -1, -1, list(pose.position),
        xyzw(pose.rotation), **(lists if links else {}), **p.client,
    )  # fmt: skip
    if base < 0:
        raise Unsupported(f"a tree of {len(links)} links")
    if free:
        p.where[root.body] = (base, -1)
        p.engine.resetBaseVelocity(base, body.velocity, body.spin, **p.client)
    for link in links:
        p.where[link.body] = (base, place[link.body])
        _start_joint(p, scene, link, base, place[link.body])


def _start_joint(p: _PyBullet, scene: Scene, link: Link, base: int, k: int) -> None:
    """Its velocity, and without the motor that every joint has at first."""
    engine = p.engine
    spin = scene.relative_spin(link)
    assert link.joint
    if link.joint.kind == "hinge":
        engine.resetJointState(base, k, 0, float(link.axis() @ spin), **p.client)
        engine.setJointMotorControl2(base, k, engine.VELOCITY_CONTROL, force=0, **p.client)
    else:
        engine.resetJointStateMultiDof(base, k, [0, 0, 0, 1], list(spin), **p.client)
        engine.setJointMotorControlMultiDof(
            base, k, engine.POSITION_CONTROL, targetPosition=[0, 0, 0, 1], force=[0, 0, 0], **p.client
        )


def _close(p: _PyBullet, scene: Scene, joint: Joint, a: Any, b: Any) -> None:
    """Points of a constraint are told from the centres of mass."""

    def end(body: int, point: Any) -> tuple[int, int, list[float]]:
        if body == WORLD:
            return -1, -1, list(scene.frame(body)(point))
        return *p.where[body], list(np.array(point) - scene.bodies[body].centre)

    first, link, at = end(joint.a, a)
    second, other, there = end(joint.b, b)
    p.engine.createConstraint(
        first, link, second, other, p.engine.JOINT_POINT2POINT, [0, 0, 0], at, there, **p.client
    )
