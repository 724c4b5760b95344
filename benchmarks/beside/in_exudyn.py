"""Exudyn: bodies in maximal coordinates, joints as algebraic constraints, implicit integration. Its contacts
of rigid bodies are penalties of spheres and triangles: it gets scenes of joints alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plain import WORLD, Adapter, Scene, Unsupported, Variant, matrix, quaternion

IMPORT, PACKAGES = "exudyn", ("exudyn>=1.9",)
GUIDE = "https://exudyn.readthedocs.io/en/v1.9.0/docs/RST/structures/SimulationSettings.html"
# The rule of trapezoids keeps energy where the default, a generalised alpha method, has damping.
ACCURATE = {"solver": "TrapezoidalIndex2", "relativeTolerance": 1e-10}
VARIANTS = (Variant("Exudyn", {}, GUIDE), Variant("Exudyn, trapezoids", ACCURATE, GUIDE, tuned=True))


class _Exudyn(Adapter):
    def __init__(self, scene: Scene, dt: float, options: dict[str, Any]) -> None:
        import exudyn
        from exudyn.utilities import RigidBodyInertia

        super().__init__(scene, dt, options)
        if scene.touching():
            raise Unsupported("contacts of rigid boxes and planes by Coulomb's law")
        self.time, self.kind = 0.0, exudyn.OutputVariableType
        self.system = exudyn.SystemContainer()
        self.mbs = self.system.AddSystem()
        self.ground = self.mbs.CreateGround()
        self.bodies = {}
        for i, b in enumerate(scene.bodies):
            if b.moves:
                if any(b.centre):
                    raise Unsupported("a centre of mass off the origin, in this adapter")
                solid = RigidBodyInertia(b.mass, np.array(b.inertia))
                self.bodies[i] = self.mbs.CreateRigidBody(
                    inertia=solid, referencePosition=list(b.frame.position),
                    referenceRotationMatrix=matrix(b.frame.rotation), initialVelocity=list(b.velocity),
                    initialAngularVelocity=list(b.spin), gravity=list(scene.gravity),
                )  # fmt: skip
        for j in scene.joints:
            self._join(j)
        self.mbs.Assemble()
        s = self.settings = exudyn.SimulationSettings()
        s.timeIntegration.verboseMode = 0
        s.solutionSettings.writeSolutionToFile = False
        # Closed loops in space have more rows of joints than they need.
        s.linearSolverType = exudyn.LinearSolverType.EigenDense
        s.linearSolverSettings.ignoreSingularJacobian = True
        kinds = exudyn.DynamicSolverType
        self.solver = getattr(kinds, options.get("solver", "GeneralizedAlpha"))
        if options:
            s.timeIntegration.newton.relativeTolerance = options["relativeTolerance"]

    def _join(self, j: Any) -> None:
        frame = self.scene.frame(j.a)
        where = [self.bodies[j.b] if j.b != WORLD else self.ground, self.bodies[j.a]]
        at = frame(j.point_a).tolist()
        if j.kind == "ball":
            self.mbs.CreateSphericalJoint(bodyNumbers=where, position=at, useGlobalFrame=True)
        else:
            axis = (matrix(frame.rotation) @ np.array(j.axis_a)).tolist()
            self.mbs.CreateRevoluteJoint(bodyNumbers=where, position=at, axis=axis, useGlobalFrame=True)

    def advance(self, steps: int) -> None:
        s = self.settings.timeIntegration
        s.startTime, s.endTime, s.numberOfSteps = self.time, self.time + steps * self.dt, steps
        self.mbs.SolveDynamic(self.settings, solverType=self.solver, updateInitialValues=True)
        self.time = s.endTime

    def tell(self, body: Any) -> tuple[Any, Any, Any, Any]:
        kinds = (self.kind.Position, self.kind.RotationMatrix, self.kind.Velocity, self.kind.AngularVelocity)
        at, turn, velocity, spin = (
            self.mbs.GetObjectOutputBody(body, kind, localPosition=[0, 0, 0]) for kind in kinds
        )
        return at, quaternion(np.array(turn).reshape(3, 3)), velocity, spin


start = _Exudyn
