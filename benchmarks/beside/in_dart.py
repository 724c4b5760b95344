"""DART: trees in generalised coordinates; its boxed LCP, and its solvers of Coulomb's law, NSGS and FBF."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plain import WORLD, Adapter, Frame, Geom, Link, Scene, Variant, matrix

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


class _DART(Adapter):
    def __init__(self, scene: Scene, dt: float, options: dict[str, Any]) -> None:
        import dartpy

        super().__init__(scene, dt, options)
        self.dart, d = dartpy, dartpy.dynamics
        self.makers = {
            "box": lambda *half: d.BoxShape(2 * np.array(half)), "sphere": d.SphereShape,
            "capsule": lambda radius, half: d.CapsuleShape(radius, 2 * half),
            # Of its planes and boxes only the latter meet in all of its detectors.
            "plane": lambda: d.BoxShape(np.array((200.0, 200.0, 20.0))),
        }  # fmt: skip
        self.world = dartpy.simulation.World("world")
        self.step = self.world.step
        self.world.setTimeStep(dt)
        self.world.setGravity(np.array(scene.gravity))
        self._settle(options)
        self.bodies = {}
        links, loops = scene.trees()
        skeletons: dict[int, Any] = {}
        for link in links:
            self._add(link, skeletons)
        self._add_fixed()
        for skeleton in {id(s): s for s in skeletons.values()}.values():
            self.world.addSkeleton(skeleton)
        solver = self.world.getConstraintSolver()
        for j in loops:
            at = scene.frame(j.a)(j.point_a)
            other = [self.bodies[j.b]] if j.b != WORLD else []
            # Its hinge constraint of two bodies holds too few directions to close a plane loop with a drift.
            solver.addConstraint(dartpy.constraint.BallJointConstraint(self.bodies[j.a], *other, at))
        for body, node in self.bodies.items():
            for g in scene.touching(body):
                self._attach(node, g, g.frame)

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
        if link.joint is None or link.parent not in self.bodies:
            skeleton = dynamics.Skeleton(f"s{link.body}")
            skeleton.disableSelfCollisionCheck()
        else:
            skeleton = skeletons[link.parent]
        skeletons[link.body] = skeleton
        parent = self.bodies.get(link.parent)
        if link.joint is None:
            joint, node = skeleton.createFreeJointAndBodyNodePair(
                None, dynamics.FreeJointProperties(), properties
            )
        else:
            on_child = Frame(link.anchor())
            hinge = link.joint.kind == "hinge"
            p = dynamics.RevoluteJointProperties() if hinge else dynamics.BallJointProperties()
            p.mName = f"j{link.body}"
            p.mT_ParentBodyToJoint = _isometry(scene.between(link.body, link.parent) @ on_child)
            p.mT_ChildBodyToJoint = _isometry(on_child)
            if hinge:
                p.mAxis = link.axis()
                joint, node = skeleton.createRevoluteJointAndBodyNodePair(parent, p, properties)
            else:
                joint, node = skeleton.createBallJointAndBodyNodePair(parent, p, properties)
        node.setInertia(dynamics.Inertia(body.mass, np.array(body.centre), np.array(body.inertia)))
        self.bodies[link.body] = node
        if link.joint is None:
            dynamics.FreeJoint.setTransformOf(joint, _isometry(body.frame))
            joint.setAngularVelocity(np.array(body.spin))
            joint.setLinearVelocity(np.array(body.velocity))
        else:
            spin = scene.relative_spin(link)
            joint.setVelocities(np.array([link.axis() @ spin]) if link.joint.kind == "hinge" else spin)

    def _add_fixed(self) -> None:
        """The world's shapes, each on a skeleton that cannot move."""
        dynamics = self.dart.dynamics
        for k, g in enumerate(self.scene.touching()):
            if g.body in self.bodies:
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

    def _attach(self, node: Any, g: Geom, frame: Frame) -> None:
        shape = node.createShapeNode(g.made(self.makers))
        shape.createCollisionAspect()
        shape.createDynamicsAspect()
        shape.getDynamicsAspect().setFrictionCoeff(g.friction)
        shape.getDynamicsAspect().setRestitutionCoeff(g.restitution)
        shape.setRelativeTransform(_isometry(frame))

    def tell(self, body: Any) -> tuple[Any, Any, Any, Any]:
        pose = body.getWorldTransform()
        q = self.dart.math.Quaternion(pose.rotation())
        wxyz = q.w(), q.x(), q.y(), q.z()
        return pose.translation(), wxyz, body.getLinearVelocity(), body.getAngularVelocity()

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
