"""Scenes of USD with physics (UsdPhysics, and what is common of PhysX), read into a builder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from ....errors import FileError, InputError
from ....limits import Limits
from ....model.model import Model
from ...files import told_at
from ..issues import Issues
from .building import Building
from .exact import restored
from .rules import judge
from .stage import Scene, open_scene
from .visuals import read_visuals


def read_usd(path: Path, issues: Issues, limits: Limits) -> Model:
    """The bodies, colliders and joints of a scene."""
    scene = open_scene(path, issues, limits)
    try:
        return _model(scene)
    except InputError:
        raise
    except (TypeError, ValueError, RuntimeError) as error:  # a value of another kind than its schema says
        reason = " ".join(str(error).split())[:200]
        raise FileError(f"{path}: a value is not of the kind that UsdPhysics asks for ({reason})") from None


def _model(scene: Scene) -> Model:
    from pxr import UsdPhysics

    prims = list(scene.prims())
    building = Building(scene, prims)
    bodies = [p for p in prims if p.HasAPI(UsdPhysics.RigidBodyAPI)]
    colliders = _colliders(scene, prims)
    joints = [p for p in prims if p.IsA(UsdPhysics.Joint) or _foreign_joint(p)]
    if not (bodies or colliders or joints):
        raise FileError(f"{scene.path}: holds no physics: no prim has RigidBodyAPI or CollisionAPI")
    building.bodies(bodies)
    building.colliders(colliders)
    building.masses()
    building.joints(joints)
    building.exclusions()
    judge(scene, prims)
    with told_at(scene.path):
        if (written := restored(building)) is not None:
            return replace(written, unread=(*written.unread, *scene.issues.unread()))
        return replace(building.model(), visuals=read_visuals(building, prims))


def _foreign_joint(prim: Any) -> bool:
    name = str(prim.GetTypeName())
    return name.startswith("Physx") and name.endswith("Joint")


def _colliders(scene: Scene, prims: list[Any]) -> list[Any]:
    """Gprims with CollisionAPI, and those below an Xform that has it."""
    from pxr import UsdGeom, UsdPhysics

    found, whole = [], []
    for prim in prims:
        if prim.HasAPI(UsdPhysics.CollisionAPI):
            if not scene.get(prim, "physics:collisionEnabled", True):
                continue
            if prim.IsA(UsdGeom.Gprim):
                found.append(prim)
            elif prim.GetTypeName() in ("Xform", "Scope", ""):
                whole.append(prim.GetPath())
            else:
                scene.refuse(prim, f"a collider of the kind {prim.GetTypeName()}", "large")
        elif prim.IsA(UsdGeom.Gprim) and any(prim.GetPath().HasPrefix(path) for path in whole):
            found.append(prim)
    return found
