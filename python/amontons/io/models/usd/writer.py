"""Models as scenes of USD: UsdPhysics for other programs, `amontons:` for what it cannot hold."""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from ....model.model import Model
from ....model.orientations import quaternion_of
from ....model.parts import WORLD, Body, Geom, Material
from ...recordings.model_json import model_parts
from ..losses import Lost
from .exact import LISTS, keep_arrays, stamp
from .joint_prims import JointWriter
from .names import identifiers
from .shape_prims import attribute, define, place
from .stage import new_stage

OWN_NAMES = ("gravity", "materials", "joints", "groups")
"""Prims below the root that are no bodies"""


def write_usd(model: Model, path: Path) -> list[Lost]:
    """A .usda, .usdc or .usd file; returns what programs other than amontons will not find in it."""
    with new_stage(path) as stage:
        writer = _Writer(stage, model)
        writer.write()
    return writer.lost


class _Writer:
    def __init__(self, stage: Any, model: Model) -> None:
        from pxr import UsdGeom, UsdPhysics

        UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
        self.stage, self.model = stage, model
        self.root = UsdGeom.Xform.Define(stage, "/model").GetPrim()
        stage.SetDefaultPrim(self.root)
        self.names = identifiers([body.name for body in model.bodies], OWN_NAMES)
        self.parts = model_parts(model)
        self.shapes = set[int]()
        """indices of those that a prim holds"""
        self.materials: dict[Material, Any] = {}
        self.lost: list[Lost] = []

    def write(self) -> None:
        self._gravity()
        bodies = [self._body(k, body) for k, body in enumerate(self.model.bodies)]
        self.bodies = bodies
        geoms = self._geoms()
        self._visuals()
        joints = JointWriter(self.stage, self.model, bodies, self.lost).write("/model/joints")
        self._pairs(bodies, geoms)
        self._groups(geoms)
        # Last: a digest is that of the finished prim.
        for name, prims in zip(LISTS, (bodies, geoms, joints), strict=True):
            for k, prim in enumerate(prims):
                fields = self.parts[name][k]
                if name == "geoms":
                    fields = {**fields, "shape": self._shape(prim, fields["shape"])}
                stamp(prim, self.root, {"list": name, "index": k, "fields": fields})
        for material, prim in self.materials.items():
            stamp(prim, self.root, {"material": vars(material)})
        self._rest()

    def _rest(self) -> None:
        """All that has no prim; of shapes on prims only their places in the list."""
        rest = {key: value for key, value in self.parts.items() if key not in LISTS}
        rest["shapes"] = [None if k in self.shapes else s for k, s in enumerate(rest["shapes"])]
        rest["counts"] = {name: len(self.parts[name]) for name in LISTS}
        stamp(self.root, self.root, {"rest": rest})
        self._tell()

    def _tell(self) -> None:
        model = self.model
        for what, things in (
            ("pairs of geoms with a material of their own", model.pair_materials),
            ("tendons", model.tendons), ("boxes in a fluid", model.fluid_boxes), ("sites", model.sites),
            ("sensors", model.sensors), ("keyframes", model.keyframes),
            ("links that are parts of bodies", model.links),
        ):  # fmt: skip
            if things:
                quiet = what.split()[0] in ("sites", "sensors", "keyframes", "links")
                effect = "none" if quiet else "large"
                self.lost.append(Lost("model", f"{len(things)} {what}", effect))

    def _shape(self, prim: Any, index: int) -> Any:
        """Fields of the shape on the first prim that has it, its index on the others."""
        if index in self.shapes:
            return index
        self.shapes.add(index)
        return {"index": index, **keep_arrays(prim, self.parts["shapes"][index])}

    def _gravity(self) -> None:
        from pxr import Gf, UsdPhysics

        scene = UsdPhysics.Scene.Define(self.stage, "/model/gravity")
        size = math.hypot(*self.model.gravity)
        down = [x / size for x in self.model.gravity] if size else (0.0, 0.0, -1.0)
        scene.CreateGravityDirectionAttr(Gf.Vec3f(*down))
        scene.CreateGravityMagnitudeAttr(size)
        stamp(scene.GetPrim(), self.root, {"gravity": self.model.gravity})

    def _body(self, k: int, body: Body) -> Any:
        from pxr import Gf, UsdGeom, UsdPhysics

        xform = UsdGeom.Xform.Define(self.stage, f"/model/{self.names[k]}")
        prim = xform.GetPrim()
        place(xform, body.pose)
        rigid = UsdPhysics.RigidBodyAPI.Apply(prim)
        if body.motion != "dynamic":
            rigid.CreateKinematicEnabledAttr(True)
        if any(body.linear_velocity):
            rigid.CreateVelocityAttr(Gf.Vec3f(*body.linear_velocity))
        if any(body.angular_velocity):
            rigid.CreateAngularVelocityAttr(Gf.Vec3f(*map(math.degrees, body.angular_velocity)))
        if body.gravity_scale == 0:
            prim.AddAppliedSchema("PhysxRigidBodyAPI")
            attribute(prim, "physxRigidBody:disableGravity", "Bool", True)
        elif body.gravity_scale != 1:
            self.lost.append(Lost(f'body "{body.name}"', f"gravity_scale={body.gravity_scale:g}", "small"))
        if body.mass > 0:
            mass = UsdPhysics.MassAPI.Apply(prim)
            mass.CreateMassAttr(body.mass)
            mass.CreateCenterOfMassAttr(Gf.Vec3f(*body.centre_of_mass))
            moments, axes = np.linalg.eigh(np.array(body.inertia))
            axes[:, 2] *= np.linalg.det(axes)
            mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*np.maximum(moments, 0).tolist()))
            mass.CreatePrincipalAxesAttr(Gf.Quatf(*quaternion_of(axes)))
        return prim

    def _geoms(self) -> list[Any]:
        from pxr import UsdGeom, UsdPhysics, UsdShade

        model, prims = self.model, []
        names = identifiers([geom.name for geom in model.geoms], (*OWN_NAMES, *self.names))
        self.taken = (*OWN_NAMES, *self.names, *names)
        seen = {visual.body for visual in model.visuals}
        for name, geom in zip(names, model.geoms, strict=True):
            above = "/model" if geom.body == WORLD else f"/model/{self.names[geom.body]}"
            prim = define(self.stage, f"{above}/{name}", geom.shape, geom.frame)
            UsdPhysics.CollisionAPI.Apply(prim)
            UsdShade.MaterialBindingAPI.Apply(prim).Bind(
                self._material(geom.material), UsdShade.Tokens.weakerThanDescendants, "physics"
            )
            self._surface(prim, geom)
            if geom.body in seen:
                UsdGeom.Imageable(prim).CreatePurposeAttr(UsdGeom.Tokens.guide)
            prims.append(prim)
        return prims

    def _visuals(self) -> None:
        """Prims without physics; pictures of a body with visuals do not show its colliders."""
        from pxr import Gf, UsdGeom

        names = identifiers([v.name or f"visual_{k}" for k, v in enumerate(self.model.visuals)], self.taken)
        for name, visual in zip(names, self.model.visuals, strict=True):
            above = "/model" if visual.body == WORLD else f"/model/{self.names[visual.body]}"
            prim = define(self.stage, f"{above}/{name}", visual.shape, visual.frame, collides=False)
            if visual.colour is not None:
                seen = UsdGeom.Gprim(prim)
                seen.CreateDisplayColorAttr([Gf.Vec3f(*visual.colour[:3])])
                seen.CreateDisplayOpacityAttr([visual.colour[3]])

    def _surface(self, prim: Any, geom: Geom) -> None:
        if geom.material.rest_offset:
            prim.AddAppliedSchema("PhysxCollisionAPI")
            attribute(prim, "physxCollision:restOffset", "Float", geom.material.rest_offset)
        who = f'geom "{geom.name}"'
        if any(geom.surface_velocity) or any(geom.surface_spin):
            self.lost.append(Lost(who, "the velocity of its surface", "large"))
        if geom.friction_direction is not None:
            self.lost.append(Lost(who, "friction that depends on the direction", "small"))

    def _material(self, material: Material) -> Any:
        """One for all geoms that share it; compliance as PhysX has it."""
        from pxr import UsdPhysics, UsdShade

        if material not in self.materials:
            path = f"/model/materials/material_{len(self.materials)}"
            prim = UsdShade.Material.Define(self.stage, path).GetPrim()
            surface = UsdPhysics.MaterialAPI.Apply(prim)
            static = material.friction_static
            surface.CreateStaticFrictionAttr(material.friction if static is None else static)
            surface.CreateDynamicFrictionAttr(material.friction)
            surface.CreateRestitutionAttr(material.restitution)
            if material.compliance:
                prim.AddAppliedSchema("PhysxMaterialAPI")
                stiffness = 1 / material.compliance
                attribute(prim, "physxMaterial:compliantContactStiffness", "Float", stiffness)
                damping = material.relaxation_time * stiffness
                attribute(prim, "physxMaterial:compliantContactDamping", "Float", damping)
            if material.torsional_friction or material.rolling_friction:
                self.lost.append(Lost("model", "torsional and rolling friction", "small"))
            self.materials[material] = prim
        return UsdShade.Material(self.materials[material])

    def _pairs(self, bodies: list[Any], geoms: list[Any]) -> None:
        from pxr import UsdPhysics

        for prims, pairs in ((bodies, self.model.excluded_bodies), (geoms, self.model.excluded_geoms)):
            for a, b in pairs:
                if WORLD not in (a, b):
                    api = UsdPhysics.FilteredPairsAPI.Apply(prims[a])
                    api.CreateFilteredPairsRel().AddTarget(prims[b].GetPath())
                    continue
                other = prims[max(a, b)]
                api = UsdPhysics.FilteredPairsAPI.Apply(other)
                for geom, prim in zip(self.model.geoms, geoms, strict=True):
                    if geom.body == WORLD:
                        api.CreateFilteredPairsRel().AddTarget(prim.GetPath())

    def _groups(self, geoms: list[Any]) -> None:
        """Geoms of one category and mask are a group, which filters those that it may not touch."""
        from pxr import UsdPhysics

        bits = [(geom.category, geom.mask) for geom in self.model.geoms]
        kinds = list(dict.fromkeys(bits))
        if kinds in ([], [(1, 1)]):
            return
        groups = {
            kind: UsdPhysics.CollisionGroup.Define(self.stage, f"/model/groups/group_{k}")
            for k, kind in enumerate(kinds)
        }
        for kind, prim in zip(bits, geoms, strict=True):
            groups[kind].GetCollidersCollectionAPI().CreateIncludesRel().AddTarget(prim.GetPath())
        for one, other in product(kinds, kinds):
            if not (one[0] & other[1] or other[0] & one[1]):
                groups[one].CreateFilteredGroupsRel().AddTarget(groups[other].GetPath())
