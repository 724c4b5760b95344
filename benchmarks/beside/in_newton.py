"""Newton's Kamino, on the processor by Warp: maximal coordinates, Coulomb's law by a proximal ADMM."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plain import Frame, Geom, Motion, Scene, Unsupported, matrix, only_scenes, wxyz, xyzw
from .variant import Variant

IMPORT, PACKAGES = "newton", ("newton>=1.8",)
TUNE = "https://isaac-sim.github.io/IsaacLab/release/3.0.0/source/concepts/solver-tuning/tune_kamino.html"
ACCURATE = {"padmm.max_iterations": 1000}
VARIANTS = (
    Variant("Newton Kamino", {}, "https://newton-physics.github.io/newton/latest/api/newton_solvers.html"),
    Variant("Newton Kamino, 1000", ACCURATE, TUNE, tuned=True),
)


def _transform(wp: Any, frame: Frame) -> Any:
    return wp.transform(wp.vec3(*map(float, frame.position)), wp.quat(*xyzw(frame.rotation)))


class _Newton:
    def __init__(self, scene: Scene, dt: float, options: dict[str, Any]) -> None:
        import newton
        import warp as wp

        only_scenes(scene)
        wp.config.quiet = True
        wp.set_device("cpu")
        self.wp, self.newton, self.scene, self.dt = wp, newton, scene, dt
        builder = newton.ModelBuilder(up_axis=newton.Axis.Z)
        newton.solvers.SolverKamino.register_custom_attributes(builder)
        builder.default_shape_cfg.margin = builder.default_shape_cfg.gap = 0.0
        builder.begin_world(gravity=tuple(scene.gravity))
        self.bodies = {i: self._add(builder, i) for i, b in enumerate(scene.bodies) if b.moves}
        carried = {j.a for j in scene.joints}
        for i, b in self.bodies.items():
            if i not in carried:
                builder.add_joint_free(child=b)
        for j in scene.joints:
            self._join(builder, j)
        for g in scene.geoms:
            if g.category or g.mask:
                self._attach(builder, g)
        builder.end_world()
        self.model = builder.finalize(skip_validation_joints=True)
        config = newton.solvers.SolverKamino.Config.from_model(self.model)
        config.use_collision_detector = True
        for key, value in options.items():
            where, name = key.split(".")
            setattr(getattr(config, where), name, value)
        self.control = self.model.control()
        for trial in (True, False):  # the first step of the first one compiles kernels
            self.solver = newton.solvers.SolverKamino(model=self.model, config=config)
            self.now, self.next = self.model.state(), self.model.state()
            self._set_start()
            if trial:
                self.advance(1)

    def _add(self, builder: Any, i: int) -> int:
        b, wp = self.scene.bodies[i], self.wp
        return builder.add_link(
            xform=_transform(wp, b.frame), mass=b.mass, com=wp.vec3(*b.centre),
            inertia=wp.mat33(*np.ravel(b.inertia)), label=f"b{i}", lock_inertia=True,
        )  # fmt: skip

    def _attach(self, builder: Any, g: Geom) -> None:
        on = self.bodies.get(g.body, -1)
        at = _transform(self.wp, g.frame if on >= 0 else self.scene.placed(g))
        config = self.newton.ModelBuilder.ShapeConfig(
            density=0.0, mu=g.friction, restitution=g.restitution, margin=0.0, gap=0.0
        )
        if g.kind == "box":
            builder.add_shape_box(on, xform=at, hx=g.size[0], hy=g.size[1], hz=g.size[2], cfg=config)
        elif g.kind == "sphere":
            builder.add_shape_sphere(on, xform=at, radius=g.size[0], cfg=config)
        elif g.kind == "capsule":
            builder.add_shape_capsule(on, xform=at, radius=g.size[0], half_height=g.size[1], cfg=config)
        elif g.kind == "plane":
            builder.add_shape_plane(None, xform=at, body=on, width=0.0, length=0.0, cfg=config)
        else:
            raise Unsupported("collider of hulls in its own detector")

    def _join(self, builder: Any, j: Any) -> int:
        wp = self.wp
        parent = self.bodies.get(j.b, -1)
        child = self.bodies[j.a]
        on_child = Frame(j.point_a)
        on_parent = self.scene.frame(j.b).inverse() @ self.scene.frame(j.a) @ on_child
        frames = {"parent_xform": _transform(wp, on_parent), "child_xform": _transform(wp, on_child)}
        if j.kind == "ball":
            return builder.add_joint_ball(parent=parent, child=child, **frames)
        return builder.add_joint_revolute(parent=parent, child=child, axis=wp.vec3(*j.axis_a), **frames)

    def _set_start(self) -> None:
        poses, twists = self.now.body_q.numpy(), self.now.body_qd.numpy()
        for i, k in self.bodies.items():
            b = self.scene.bodies[i]
            arm = matrix(b.frame.rotation) @ np.array(b.centre)
            poses[k] = [*b.frame.position, *xyzw(b.frame.rotation)]
            twists[k] = [*(np.array(b.velocity) + np.cross(b.spin, arm)), *b.spin]
        self.now.body_q.assign(poses)
        self.now.body_qd.assign(twists)

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            self.solver.step(self.now, self.next, self.control, None, self.dt)
            self.now, self.next = self.next, self.now

    def motion(self) -> Motion:
        found = Motion.start(self.scene)
        poses, twists = self.now.body_q.numpy(), self.now.body_qd.numpy()
        for i, k in self.bodies.items():
            arm = matrix(wxyz(poses[k, 3:])) @ np.array(self.scene.bodies[i].centre)
            found.positions[i], found.orientations[i] = poses[k, :3], wxyz(poses[k, 3:])
            found.angular[i] = twists[k, 3:]
            found.linear[i] = twists[k, :3] - np.cross(twists[k, 3:], arm)
        return found


start = _Newton
