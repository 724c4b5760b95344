"""DART: trees in generalised coordinates; its boxed LCP, and its solvers of Coulomb's law, NSGS and FBF."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plain import (
    WORLD,
    Frame,
    Geom,
    Link,
    Motion,
    Scene,
    Unsupported,
    matrix,
    only_scenes,
    relative_spin,
    trees,
)
from .variant import Variant

IMPORT, PACKAGES = "dartpy", ("dartpy>=6.20",)
RELEASE = "https://github.com/dartsim/dart/blob/main/CHANGELOG.md"
# Its own detector finds the most even points of faces; twice the iterations of its default, no sleep.
EXACT = {"detector": "dart", "deactivation": False, "tolerance": 1e-6, "iterations": 200}
VARIANTS = (
    Variant("DART", {}, "https://docs.dartsim.org/"),
    Variant("DART, NSGS", EXACT | {"solver": "nsgs"}, RELEASE, tuned=True),
    Variant("DART, FBF", EXACT | {"solver": "fbf"}, RELEASE, tuned=True),
)


def _isometry(frame: Frame) -> Any:
    import dartpy

    found = dartpy.math.Isometry3()
    found.set_translation(np.array(frame.position))
    found.set_rotation(matrix(frame.rotation))
    return found


def _shape(dynamics: Any, g: Geom) -> Any:
    if g.kind == "box":
        return dynamics.BoxShape(2 * np.array(g.size))
    if g.kind == "sphere":
        return dynamics.SphereShape(g.size[0])
    if g.kind == "capsule":
        return dynamics.CapsuleShape(g.size[0], 2 * g.size[1])
    if g.kind == "plane":
        # Of its planes and boxes only the latter meet in all of its detectors.
        return dynamics.BoxShape(np.array((200.0, 200.0, 20.0)))
    raise Unsupported("hull without a mesh file")


class _DART:
    def __init__(self, scene: Scene, dt: float, options: dict[str, Any]) -> None:
        import dartpy

        only_scenes(scene)
        self.dart, self.scene = dartpy, scene
        self.world = dartpy.simulation.World("world")
        self.world.setTimeStep(dt)
        self.world.setGravity(np.array(scene.gravity))
        self._settle(options)
        self.nodes: dict[int, Any] = {}
        links, loops = trees(scene)
        skeletons: dict[int, Any] = {}
        for link in links:
            self._add(link, skeletons)
        self._add_fixed()
        for skeleton in {id(s): s for s in skeletons.values()}.values():
            self.world.addSkeleton(skeleton)
        solver = self.world.getConstraintSolver()
        for j in loops:
            at = scene.frame(j.a)(j.point_a)
            other = [self.nodes[j.b]] if j.b != WORLD else []
            # Its hinge constraint of two bodies holds too few directions to close a plane loop with a drift.
            solver.addConstraint(dartpy.constraint.BallJointConstraint(self.nodes[j.a], *other, at))
        for body, node in self.nodes.items():
            self._dress(body, node)

    def _settle(self, options: dict[str, Any]) -> None:
        constraint, collision = self.dart.constraint, self.dart.collision
        solver = self.world.getConstraintSolver()
        if options.get("detector") == "dart":
            solver.setCollisionDetector(collision.DARTCollisionDetector())
        solver.getCollisionOption().maxNumContacts = 100000
        if options.get("deactivation") is False:
            rest = self.world.getDeactivationOptions()
            rest.mEnabled = False
            self.world.setDeactivationOptions(rest)
        if options.get("solver") == "nsgs":
            exact = constraint.NsgsFrictionSolver.Options()
            exact.tolerance, exact.maxSweeps = options["tolerance"], options["iterations"]
            exact.law = constraint.NsgsFrictionSolver.Law.Coulomb
            solver.setBoxedLcpSolver(constraint.NsgsFrictionSolver(exact))
        if options.get("solver") == "fbf":
            exact = constraint.FbfFrictionSolver.Options()
            exact.tolerance, exact.maxOuterIterations = options["tolerance"], options["iterations"]
            solver.setBoxedLcpSolver(constraint.FbfFrictionSolver(exact))

    def _add(self, link: Link, skeletons: dict[int, Any]) -> None:
        """A link: frames of joints coincide at the start, in the axes of the body."""
        dynamics, scene, body = self.dart.dynamics, self.scene, self.scene.bodies[link.body]
        properties = dynamics.BodyNodeProperties(dynamics.BodyNodeAspectProperties(f"b{link.body}"))
        if link.joint is None or link.parent not in self.nodes:
            skeleton = dynamics.Skeleton(f"s{link.body}")
            skeleton.disableSelfCollisionCheck()
        else:
            skeleton = skeletons[link.parent]
        skeletons[link.body] = skeleton
        parent = self.nodes.get(link.parent)
        if link.joint is None:
            joint, node = skeleton.createFreeJointAndBodyNodePair(
                None, dynamics.FreeJointProperties(), properties
            )
        else:
            on_child = Frame(link.anchor())
            hinge = link.joint.kind == "hinge"
            p = dynamics.RevoluteJointProperties() if hinge else dynamics.BallJointProperties()
            p.mName = f"j{link.body}"
            p.mT_ParentBodyToJoint = _isometry(scene.frame(link.parent).inverse() @ body.frame @ on_child)
            p.mT_ChildBodyToJoint = _isometry(on_child)
            if hinge:
                p.mAxis = link.axis()
                joint, node = skeleton.createRevoluteJointAndBodyNodePair(parent, p, properties)
            else:
                joint, node = skeleton.createBallJointAndBodyNodePair(parent, p, properties)
        node.setInertia(dynamics.Inertia(body.mass, np.array(body.centre), np.array(body.inertia)))
        self.nodes[link.body] = node
        if link.joint is None:
            dynamics.FreeJoint.setTransformOf(joint, _isometry(body.frame))
            joint.setAngularVelocity(np.array(body.spin))
            joint.setLinearVelocity(np.array(body.velocity))
        else:
            spin = relative_spin(scene, link)
            joint.setVelocities(np.array([link.axis() @ spin]) if link.joint.kind == "hinge" else spin)

    def _add_fixed(self) -> None:
        """The world's shapes, each on a skeleton that cannot move."""
        dynamics = self.dart.dynamics
        for k, g in enumerate(self.scene.geoms):
            if g.body in self.nodes or not (g.category or g.mask):
                continue
            ground = dynamics.Skeleton(f"g{k}")
            joint, node = ground.createWeldJointAndBodyNodePair()
            frame = self.scene.placed(g)
            if g.kind == "plane":
                frame = frame @ Frame((0.0, 0.0, -10.0))
            joint.setTransformFromParentBodyNode(_isometry(frame))
            self._attach(node, g, Frame())
            ground.setMobile(False)
            self.world.addSkeleton(ground)

    def _dress(self, body: int, node: Any) -> None:
        for g in self.scene.geoms:
            if g.body == body and (g.category or g.mask):
                self._attach(node, g, g.frame)

    def _attach(self, node: Any, g: Geom, frame: Frame) -> None:
        shape = node.createShapeNode(_shape(self.dart.dynamics, g))
        shape.createCollisionAspect()
        shape.createDynamicsAspect()
        shape.getDynamicsAspect().setFrictionCoeff(g.friction)
        shape.getDynamicsAspect().setRestitutionCoeff(g.restitution)
        shape.setRelativeTransform(_isometry(frame))

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self.world.step()

    def motion(self) -> Motion:
        found = Motion.start(self.scene)
        for i, node in self.nodes.items():
            pose = node.getWorldTransform()
            q = self.dart.math.Quaternion(pose.rotation())
            found.positions[i] = pose.translation()
            found.orientations[i] = q.w(), q.x(), q.y(), q.z()
            found.linear[i], found.angular[i] = node.getLinearVelocity(), node.getAngularVelocity()
        return found

    def contacts(self) -> list[list[float]]:
        found = []
        for c in self.world.getLastCollisionResult().getContacts():
            on, by = (self._number(o) for o in (c.collisionObject1, c.collisionObject2))
            found.append([on, by, *c.point, *c.normal, *c.force, -c.penetrationDepth])
        return found

    def _number(self, thing: Any) -> int:
        name = thing.getShapeFrame().getBodyNodePtr().getName()
        return int(name[1:]) if name.startswith("b") and name[1:].isdigit() else WORLD


start = _DART
