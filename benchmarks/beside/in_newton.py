"""Newton's Kamino, on the processor by Warp: maximal coordinates, Coulomb's law by a proximal ADMM."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plain import Adapter, Frame, Geom, Motion, Scene, Variant, wxyz, xyzw

IMPORT, PACKAGES = "newton", ("newton>=1.8",)
TUNE = "https://isaac-sim.github.io/IsaacLab/release/3.0.0/source/concepts/solver-tuning/tune_kamino.html"
ACCURATE = {"padmm.max_iterations": 1000}
VARIANTS = (
    Variant("Newton Kamino", {}, "https://newton-physics.github.io/newton/latest/api/newton_solvers.html"),
    Variant("Newton Kamino, 1000", ACCURATE, TUNE, tuned=True),
)


def _transform(wp: Any, frame: Frame) -> Any:
    return wp.transform(wp.vec3(*map(float, frame.position)), wp.quat(*xyzw(frame.rotation)))


class _Newton(Adapter):
    def __init__(self, scene: Scene, dt: float, options: dict[str, Any]) -> None:
        import newton
        import warp as wp

        super().__init__(scene, dt, options)
        wp.config.quiet = True
        wp.set_device("cpu")
        self.wp, self.newton = wp, newton
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
        for g in scene.touching():
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
        shape = {"xform": at, "cfg": config}
        g.made({
            "box": lambda x, y, z: builder.add_shape_box(on, hx=x, hy=y, hz=z, **shape),
            "sphere": lambda radius: builder.add_shape_sphere(on, radius=radius, **shape),
            "capsule": lambda r, half: builder.add_shape_capsule(on, radius=r, half_height=half, **shape),
            "plane": lambda: builder.add_shape_plane(None, body=on, width=0.0, length=0.0, **shape),
        })  # fmt: skip

    def _join(self, builder: Any, j: Any) -> int:
        wp = self.wp
        parent = self.bodies.get(j.b, -1)
        child = self.bodies[j.a]
        on_child = Frame(j.point_a)
        on_parent = self.scene.between(j.a, j.b) @ on_child
        frames = {"parent_xform": _transform(wp, on_parent), "child_xform": _transform(wp, on_child)}
        if j.kind == "ball":
            return builder.add_joint_ball(parent=parent, child=child, **frames)
        return builder.add_joint_revolute(parent=parent, child=child, axis=wp.vec3(*j.axis_a), **frames)

    def _set_start(self) -> None:
        poses, twists = self.now.body_q.numpy(), self.now.body_qd.numpy()
        for i, k in self.bodies.items():
            b = self.scene.bodies[i]
            poses[k] = [*b.frame.position, *xyzw(b.frame.rotation)]
            twists[k] = [*b.velocity_of_centre(), *b.spin]
        self.now.body_q.assign(poses)
        self.now.body_qd.assign(twists)

    def step(self) -> None:
        self.solver.step(self.now, self.next, self.control, None, self.dt)
        self.now, self.next = self.next, self.now

    def motion(self) -> Motion:
        found = Motion.start(self.scene)
        poses, twists = self.now.body_q.numpy(), self.now.body_qd.numpy()
        for i, k in self.bodies.items():
            q, spin = wxyz(poses[k, 3:]), twists[k, 3:]
            found.positions[i], found.orientations[i], found.angular[i] = poses[k, :3], q, spin
            found.linear[i] = twists[k, :3] - np.cross(spin, self.arm(i, q))
        return found


start = _Newton
