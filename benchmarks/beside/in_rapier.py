"""Rapier, by its Python bindings in single precision: bodies in maximal coordinates, joints by impulses."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plain import WORLD, Adapter, Frame, Scene, Variant, matrix, quaternion, xyzw

IMPORT, PACKAGES = "rapier3d", ("rapier3d>=0.30", "numpy")
GUIDE = "https://docs.rs/rapier3d/latest/rapier3d/dynamics/struct.IntegrationParameters.html"
# More substeps, friction in each of them, no sleep. (Its round cone, friction_model COULOMB, lets a cube
# slide at 0.99 of the angle of friction.)
TUNED = {"num_solver_iterations": 40, "friction_in_bias_pass": True, "can_sleep": False}
VARIANTS = (Variant("Rapier", {}, GUIDE), Variant("Rapier, 40 substeps", TUNED, GUIDE, tuned=True))


def _isometry(frame: Frame) -> Any:
    import rapier3d

    return rapier3d.Isometry3(list(map(float, frame.position)), xyzw(frame.rotation))


class _Rapier(Adapter):
    def __init__(self, scene: Scene, dt: float, options: dict[str, Any]) -> None:
        import rapier3d as rapier

        super().__init__(scene, dt, options)
        self.rapier = rapier
        collider = rapier.Collider
        self.makers = {
            "box": collider.cuboid, "sphere": collider.ball,
            "capsule": lambda radius, half: collider.capsule_z(half, radius),
            "plane": lambda: collider.halfspace([0.0, 0.0, 1.0]),
            "hull": lambda points: collider.convex_hull(points.astype(np.float32)),
        }  # fmt: skip
        self.world = rapier.PhysicsWorld(gravity=list(scene.gravity))
        self.world.set_num_threads(1)
        self.step = self.world.step
        self.world.integration_parameters.dt = dt
        for key, value in options.items():
            if key != "can_sleep":
                setattr(self.world.integration_parameters, key, value)
        self.handles = [self._add(i) for i in range(len(scene.bodies))]
        self.bodies = {i: (i, handle) for i, handle in enumerate(self.handles)}
        if any(part.body == WORLD for part in scene.geoms) or any(j.b == WORLD for j in scene.joints):
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
            builder = builder.additional_mass_properties(solid).gyroscopic_forces(True)
            builder = builder.can_sleep(self.options.get("can_sleep", True))
            builder = builder.linvel(b.velocity_of_centre().tolist()).angvel(list(map(float, b.spin)))
        return self.world.add_body(builder, self._colliders(i))

    def _colliders(self, body: int) -> list[Any]:
        masks, group = self.scene.both_masks(), self.rapier.Group
        return [
            g.made(self.makers).position(_isometry(g.frame)).density(0.0).friction(g.friction)
            .restitution(g.restitution).collision_groups(
                self.rapier.InteractionGroups(group(g.category), group(masks[g.category, g.mask])))
            for g in self.scene.touching(body)
        ]  # fmt: skip

    def _join(self, j: Any) -> None:
        other = self.handles[j.b] if j.b != WORLD else self.ground
        if j.kind == "ball":
            joint = self.rapier.SphericalJointBuilder()
        else:
            joint = self.rapier.RevoluteJointBuilder(list(j.axis_a))
            axis = matrix(self.scene.between(j.a, j.b).rotation) @ np.array(j.axis_a)
            joint = joint.local_axis1(axis.tolist()).local_axis2(list(j.axis_a))
        joint = joint.local_anchor1(list(j.point_b)).local_anchor2(list(j.point_a)).contacts_enabled(False)
        self.world.impulse_joints.insert(other, self.handles[j.a], joint, True)

    def tell(self, body: Any) -> tuple[Any, Any, Any, Any]:
        i, found = body[0], self.world.rigid_bodies[body[1]]
        q, spin = [getattr(found.rotation, key) for key in "wijk"], np.array(list(found.angvel))
        return list(found.translation), q, np.array(list(found.linvel)) - np.cross(spin, self.arm(i, q)), spin

    def save(self) -> None:
        self.saved = self.world.snapshot()

    def restore(self) -> None:
        self.world = self.rapier.PhysicsWorld.restore(self.saved)
        self.step = self.world.step


start = _Rapier
