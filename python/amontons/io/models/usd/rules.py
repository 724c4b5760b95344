"""The schemas and attributes of USD's physics that are read; others are listed.

The names are those of UsdPhysics and of PhysX's schemas in Omniverse.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..rules import words
from .stage import Scene, applied

APIS = words(
    "PhysicsRigidBodyAPI PhysicsCollisionAPI PhysicsMeshCollisionAPI PhysicsMassAPI PhysicsMaterialAPI "
    "PhysicsFilteredPairsAPI PhysicsArticulationRootAPI PhysicsDriveAPI PhysicsLimitAPI PhysxRigidBodyAPI "
    "PhysxCollisionAPI PhysxMaterialAPI PhysxJointAPI PhysxArticulationAPI PhysxMimicJointAPI PhysxLimitAPI "
    "PhysicsJointStateAPI PhysxSceneAPI PhysxConvexHullCollisionAPI PhysxConvexDecompositionCollisionAPI "
    "PhysxTriangleMeshCollisionAPI PhysxTriangleMeshSimplificationCollisionAPI PhysxSDFMeshCollisionAPI "
    "PhysxContactReportAPI"
)
"""Applied schemas whose attributes are judged one by one"""
QUIET = words(
    "physics:dynamicFriction physics:staticFriction physics:restitution physics:density physics:axis "
    "physics:startsAsleep physics:simulationOwner physics:breakForce physics:breakTorque "
    "physics:jointEnabled physics:approximation physics:rigidBodyEnabled physics:kinematicEnabled "
    "physxCollision:contactOffset physxJoint:maxJointVelocity "
    "physxMaterial:improvePatchFriction physxRigidBody:enableCCD physxRigidBody:solverPositionIterationCount "
    "physxRigidBody:solverVelocityIterationCount physxRigidBody:sleepThreshold "
    "physxRigidBody:enableGyroscopicForces "
    "physxRigidBody:stabilizationThreshold physxRigidBody:maxDepenetrationVelocity "
    "physxRigidBody:maxLinearVelocity physxRigidBody:maxAngularVelocity physxRigidBody:maxContactImpulse "
    "physxRigidBody:retainAccelerations physxRigidBody:cfmScale physxRigidBody:contactSlopCoefficient"
)
"""Attributes that belong to the solver of PhysX, or change nothing here"""
QUIET_PARTS = (
    "physxScene:", "physxArticulation:", "state:", "physxConvex", "physxTriangle", "physxSDF",
    "physxContactReport", "physxVisual", "physics:tensor:", "physics:engine",
)  # fmt: skip
PARTS = ("physics:", "physx", "drive:", "limit:", "newton:", "mjc:")
"""Beginnings of names of attributes of physics"""


def judge(scene: Scene, prims: list[Any]) -> None:
    """Lists schemas that are not known, and attributes that are written and nobody asked for."""
    for prim in prims:
        if str(prim.GetPath()) in scene.idle:
            continue
        kind = str(prim.GetTypeName())
        effect = "none" if kind == "PhysicsScene" else "small"  # of a scene they are those of a solver
        if kind.startswith("Physx"):
            if not kind.endswith("Joint"):
                scene.refuse(prim, "this kind of prim", "large")
        elif kind == "PointInstancer" and _has_physics(prim):
            scene.refuse(prim, "bodies that a PointInstancer copies; write them as prims", "large")
        for schema in applied(prim):
            name = schema.partition(":")[0]
            if name.startswith(("Physics", "Physx", "Newton", "Mjc")) and name not in APIS:
                scene.refuse(prim, f"{name}: this schema", effect)
        for attribute in prim.GetAuthoredProperties():
            name = attribute.GetName()
            if name.startswith(PARTS) and not _known(scene, name) and _says_something(attribute):
                scene.refuse(prim, f"{name}: this attribute", effect)


def _known(scene: Scene, name: str) -> bool:
    return name in scene.read or name in QUIET or name.startswith(QUIET_PARTS)


def _says_something(attribute: Any) -> bool:
    """Whether it has a value that is not zero."""
    value = attribute.Get() if hasattr(attribute, "Get") else attribute.GetTargets()
    try:
        return value is not None and bool(np.any(np.array(value, dtype=np.float64)))
    except (TypeError, ValueError):
        pass
    try:
        return value is not None and bool(value)
    except (TypeError, ValueError):
        return True


def _has_physics(prim: Any) -> bool:
    return any(
        str(schema).startswith("Physics")
        for target in prim.GetRelationship("prototypes").GetForwardedTargets()
        if (found := prim.GetStage().GetPrimAtPath(target))
        for schema in applied(found)
    )
