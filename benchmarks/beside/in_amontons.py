"""Our own engine, on one thread, with the shapes and joints of the plain scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plain import Adapter, Geom, Motion, Scene, Variant

IMPORT, PACKAGES = "amontons", ()
MANUAL = "choosing.md"  # beside the page that shows it
THREADS = True
VARIANTS = (
    Variant("amontons, 1e-6", {"tolerance": 1e-6}, MANUAL),
    Variant("amontons, 1e-3", {"tolerance": 1e-3}, MANUAL, tuned=True),
)


class _Ours(Adapter):
    READS = True

    def __init__(self, scene: Scene, dt: float, options: dict[str, Any]) -> None:
        import warnings

        import amontons

        super().__init__(scene, dt, options)
        warnings.simplefilter("ignore", amontons.StepWarning)
        model = amontons.load_model(scene.path) if scene.path else _model(scene)
        self.simulation = amontons.Simulation(model, dt=dt, on_failure="ignore", **({"threads": 1} | options))
        if scene.keyframe:
            self.simulation.apply_keyframe(scene.keyframe)

    def advance(self, steps: int) -> None:
        self.simulation.run(steps * self.simulation.dt)

    def motion(self) -> Motion:
        s = self.simulation.state
        return Motion(
            s.positions.copy(), s.orientations.copy(), s.linear_velocities.copy(), s.angular_velocities.copy()
        )

    def contacts(self) -> list[list[float]]:
        found = self.simulation.contacts
        columns = ("body_a", "body_b", "point", "normal", "force", "gap")
        return np.column_stack([found[c] for c in columns]).tolist()

    def save(self) -> None:
        self.saved = self.simulation.copy()

    def restore(self) -> None:
        self.simulation = self.saved.copy()


start = _Ours


def _shape(g: Geom) -> Any:
    from amontons import shapes

    return g.made({"sphere": shapes.Sphere, "capsule": shapes.Capsule, "plane": shapes.Plane,
                   "hull": shapes.Hull, "box": lambda *half: shapes.Box(half)})  # fmt: skip


def _model(scene: Scene) -> Any:
    import amontons

    b = amontons.ModelBuilder(gravity=scene.gravity, friction_rule="maximum")
    for body in scene.bodies:
        b.add_body(
            position=body.frame.position, orientation=body.frame.rotation, mass=body.mass,
            inertia=body.inertia, centre_of_mass=body.centre, motion="dynamic" if body.moves else "static",
            linear_velocity=body.velocity, angular_velocity=body.spin,
        )  # fmt: skip
    for g in scene.geoms:
        b.add_geom(
            g.body if g.body >= 0 else None, _shape(g),
            position=g.frame.position, orientation=g.frame.rotation,
            material=amontons.Material(friction=g.friction, restitution=g.restitution),
            category=g.category, mask=g.mask,
        )  # fmt: skip
    for j in scene.joints:
        frame, other = scene.frame(j.a), j.b if j.b >= 0 else None
        if j.kind == "ball":
            b.add_ball_joint(j.a, other, point=frame(j.point_a))
        else:
            axis = frame(j.axis_a) - frame((0, 0, 0))
            b.add_revolute_joint(j.a, other, point=frame(j.point_a), axis=axis)
    return b.build()
