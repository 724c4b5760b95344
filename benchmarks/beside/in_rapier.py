"""Rapier, by its Python bindings in single precision: bodies in maximal coordinates, joints by impulses."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plain import WORLD, Frame, Geom, Motion, Scene, matrix, only_scenes, quaternion, xyzw
from .variant import Variant

IMPORT, PACKAGES = "rapier3d", ("rapier3d>=0.30", "numpy")
GUIDE = "https://docs.rs/rapier3d/latest/rapier3d/dynamics/struct.IntegrationParameters.html"
# More substeps, friction in each of them, no sleep. (Its round cone, friction_model COULOMB, lets a cube
# slide at 0.99 of the angle of friction.)
TUNED = {"num_solver_iterations": 40, "friction_in_bias_pass": True, "can_sleep": False}
VARIANTS = (Variant("Rapier", {}, GUIDE), Variant("Rapier, 40 substeps", TUNED, GUIDE, tuned=True))


def _isometry(frame: Frame) -> Any:
    import rapier3d

    return rapier3d.Isometry3(list(map(float, frame.position)), xyzw(frame.rotation))


def _shape(rapier: Any, g: Geom) -> Any:
    make = rapier.Collider
    if g.kind == "box":
        return make.cuboid(*g.size)
    if g.kind == "sphere":
        return make.ball(g.size[0])
    if g.kind == "capsule":
        return make.capsule_z(g.size[1], g.size[0])
    if g.kind == "plane":
        return make.halfspace([0.0, 0.0, 1.0])
    return make.convex_hull(g.points().astype(np.float32))


class _Rapier:
    def __init__(self, scene: Scene, dt: float, options: dict[str, Any]) -> None:
        import rapier3d as rapier

        only_scenes(scene)
        self.rapier, self.scene = rapier, scene
        self.world = rapier.PhysicsWorld(gravity=list(scene.gravity))
        self.world.set_num_threads(1)
        p = self.world.integration_parameters
        p.dt = dt
        self.can_sleep = options.get("can_sleep", True)
        for key, value in options.items():
            if key != "can_sleep":
                setattr(p, key, value)
        self.handles = [self._add(i) for i in range(len(scene.bodies))]
        if any(g.body == WORLD for g in scene.geoms) or any(j.b == WORLD for j in scene.joints):
            self.ground = self.world.add_body(rapier.RigidBody.fixed(), self._colliders(WORLD))
        for j in scene.joints:
            self._join(j)

    def _add(self, i: int) -> Any:
        b = self.scene.bodies[i]
        builder = self.rapier.RigidBody.dynamic() if b.moves else self.rapier.RigidBody.fixed()
        builder = builder.position(_isometry(b.frame))
        if b.moves:
            principal, axes = np.linalg.eigh(np.array(b.inertia))
            axes *= np.sign(np.linalg.det(axes))
            frame = xyzw(quaternion(axes))
            solid = self.rapier.MassProperties(list(b.centre), b.mass, principal.tolist(), frame)
            builder = (
                builder.additional_mass_properties(solid).can_sleep(self.can_sleep).gyroscopic_forces(True)
            )
            # The velocity is that of the centre of mass.
            arm = matrix(b.frame.rotation) @ np.array(b.centre)
            velocity = np.array(b.velocity) + np.cross(b.spin, arm)
            builder = builder.linvel(velocity.tolist()).angvel(list(map(float, b.spin)))
        return self.world.add_body(builder, self._colliders(i))

    def _colliders(self, body: int) -> list[Any]:
        found, masks = [], self.scene.both_masks()
        for g in self.scene.geoms:
            if g.body == body and (g.category or g.mask):
                groups = self.rapier.InteractionGroups(
                    self.rapier.Group(g.category), self.rapier.Group(masks[g.category, g.mask])
                )
                found.append(
                    _shape(self.rapier, g).position(_isometry(g.frame)).density(0.0).friction(g.friction)
                    .restitution(g.restitution).collision_groups(groups)
                )  # fmt: skip
        return found

    def _join(self, j: Any) -> None:
        other = self.handles[j.b] if j.b != WORLD else self.ground
        if j.kind == "ball":
            joint = self.rapier.SphericalJointBuilder()
        else:
            joint = self.rapier.RevoluteJointBuilder(list(j.axis_a))
            turn = self.scene.frame(j.b).inverse() @ self.scene.frame(j.a)
            axis = matrix(turn.rotation) @ np.array(j.axis_a)
            joint = joint.local_axis1(axis.tolist()).local_axis2(list(j.axis_a))
        joint = joint.local_anchor1(list(j.point_b)).local_anchor2(list(j.point_a)).contacts_enabled(False)
        self.world.impulse_joints.insert(other, self.handles[j.a], joint, True)

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self.world.step()

    def motion(self) -> Motion:
        found = Motion.start(self.scene)
        for i, handle in enumerate(self.handles):
            body = self.world.rigid_bodies[handle]
            at, spin = np.array(list(body.translation)), np.array(list(body.angvel))
            found.positions[i] = at
            found.orientations[i] = (body.rotation.w, body.rotation.i, body.rotation.j, body.rotation.k)
            arm = matrix(found.orientations[i]) @ np.array(self.scene.bodies[i].centre)
            found.linear[i] = np.array(list(body.linvel)) - np.cross(spin, arm)
            found.angular[i] = spin
        return found

    def save(self) -> None:
        self.saved = self.world.snapshot()

    def restore(self) -> None:
        self.world = self.rapier.PhysicsWorld.restore(self.saved)


start = _Rapier
