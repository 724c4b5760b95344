"""A scene of USD taken into a builder: bodies, colliders, masses, joints, and the pairs that never touch."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from ....checks import listed
from ....model.builder import ModelBuilder
from ....model.model import Model
from ....model.parts import WORLD
from ....model.transforms import ORIGIN, rotate
from .joints import Joints
from .mass import DENSITY, Part, body_mass
from .shapes import Colliders
from .stage import Scene

GRAVITY = 9.81
"""m/s^2, where the scene does not say"""


class Building:
    """Makes the parts of a model; names are those of the prims, or their paths where these are not unique."""

    def __init__(self, scene: Scene, prims: list[Any]) -> None:
        from pxr import UsdPhysics

        self.scene, self.prims = scene, prims
        self.reader = Colliders(scene)
        scenes = [p for p in prims if p.IsA(UsdPhysics.Scene)]
        for other in scenes[1:]:
            scene.refuse(other, "a second scene; the gravity is that of the first")
        self.fallback = None
        if scenes:
            bound = scene.targets(scenes[0], "material:binding:physics")
            self.fallback = bound[0] if bound else None
        self.gravity = self._gravity(scenes)
        self.builder = ModelBuilder(gravity=self.gravity, friction_rule="mean", trees="auto")
        self.index: dict[str, int] = {}
        self.scales: dict[str, Any] = {}
        self.parts: dict[str, list[Part]] = {}
        self.geoms: dict[str, tuple[int, str]] = {}
        """by the path of a collider: its geom, and the path of its body"""
        self.guessed: list[str] = []
        self.apart: set[tuple[int, int]] = set()
        self.made: dict[str, tuple[int, dict[str, int]]] = {}
        """by the path of a joint: its index, and its degrees of freedom by the name in USD"""

    def _gravity(self, scenes: list[Any]) -> tuple[float, ...]:
        scene = self.scene
        up = rotate(scene.upright, (0.0, 1.0, 0.0) if scene.upright != ORIGIN.rotation else (0.0, 0.0, 1.0))
        if not scenes:
            return tuple(-GRAVITY * x for x in up)
        size = scene.number(scenes[0], "physics:gravityMagnitude", -math.inf)
        size = size * scene.metre if math.isfinite(size) and size >= 0 else GRAVITY
        direction = np.array(scene.get(scenes[0], "physics:gravityDirection", (0, 0, 0)), dtype=np.float64)
        length = np.linalg.norm(direction)
        if not length > 0:
            return tuple(-size * x for x in up)
        return tuple(size * x for x in rotate(scene.upright, tuple((direction / length).tolist())))

    def name(self, kind: str, prim: Any) -> str:
        """The shortest end of the path that is unique."""
        words = str(prim.GetPath()).strip("/").split("/")
        taken = self.builder.names(kind)
        for count in range(1, len(words) + 1):
            name = "/".join(words[-count:])
            if name not in taken and name != "world":
                return name
        return f"{'/'.join(words)}_"

    def bodies(self, prims: list[Any]) -> None:
        scene = self.scene
        for prim in prims:
            if not scene.get(prim, "physics:rigidBodyEnabled", True):
                continue
            frame, scale = scene.frame(prim)
            kinematic = scene.get(prim, "physics:kinematicEnabled", False)
            floats = scene.get(prim, "physxRigidBody:disableGravity", False)
            path = str(prim.GetPath())
            above, _ = scene.matrix(prim.GetParent())
            above = above / np.linalg.norm(above, axis=0)
            speed = scene.metre * np.array(scene.get(prim, "physics:velocity", (0, 0, 0)), dtype=np.float64)
            spin = np.radians(
                np.array(scene.get(prim, "physics:angularVelocity", (0, 0, 0)), dtype=np.float64)
            )
            self.index[path] = self.builder.add_body(
                self.name("body", prim),
                position=frame.position,
                orientation=frame.rotation,
                motion="kinematic" if kinematic else "dynamic",
                gravity_scale=0.0 if floats else 1.0,
                linear_velocity=tuple((above @ speed).tolist()),
                angular_velocity=tuple((above @ spin).tolist()),
            )
            self.scales[path], self.parts[path] = scale, []

    def _body_of(self, prim: Any) -> str:
        """The path of the nearest body above, or of the prim itself; "" for the world."""
        while prim and not prim.IsPseudoRoot():
            if str(prim.GetPath()) in self.index:
                return str(prim.GetPath())
            prim = prim.GetParent()
        return ""

    def colliders(self, prims: list[Any]) -> None:
        for prim in prims:
            path = self._body_of(prim)
            body = self.index[path] if path else WORLD
            moves = body != WORLD and self.builder.part("body", body).motion == "dynamic"
            found = self.reader.read(prim, self.builder.pose(body), moves=moves)
            if found is None:
                continue
            shape, local = found
            material, density = self.reader.material(prim, self.fallback)
            rest = max(self.scene.number(prim, "physxCollision:restOffset"), 0.0)
            index = self.builder.add_geom(
                body,
                shape,
                position=local.position,
                orientation=local.rotation,
                material=replace(material, rest_offset=rest * self.scene.metre if rest < 1e30 else 0.0),
                name=self.name("geom", prim),
            )
            self.geoms[str(prim.GetPath())] = index, path
            if path and moves:
                self.parts[path].append(Part(prim, shape, local, density))

    def masses(self) -> None:
        for path, index in self.index.items():
            body, prim = self.builder.part("body", index), self.scene.stage.GetPrimAtPath(path)
            if body.motion != "dynamic":
                continue
            solid, guessed = body_mass(self.scene, prim, self.scales[path], self.parts[path])
            if guessed:
                self.guessed.append(f'"{body.name}" {solid.mass:.3g} kg')
            with self.scene.told(prim):
                self.builder.set_mass(index, solid)
        if self.guessed:
            self.scene.issues.notes.append(
                f"bodies without moments of inertia and shapes have those of a ball of {DENSITY:g} kg/m^3: "
                + listed(self.guessed)
            )

    def joints(self, prims: list[Any]) -> None:
        made = Joints(self.scene, self.builder, self.index, {})
        for prim in prims:
            made.read(prim, self.name("joint", prim))
        for prim in prims:
            made.couple(prim)
        self.made = made.made

    def _under(self, prim: Any) -> list[int]:
        """The geoms at and below a prim."""
        return [g for path, (g, _) in self.geoms.items() if _below(path, str(prim.GetPath()))]

    def exclusions(self) -> None:
        """Pairs that never touch: filtered ones, and those of an articulation without self-collisions."""
        from pxr import UsdPhysics

        for prim in self.prims:
            for other in self.scene.targets(prim, "physics:filteredPairs"):
                self._part(self._under(prim), self._under(other))
            if prim.HasAPI(UsdPhysics.ArticulationRootAPI) and not self.scene.get(
                prim, "physxArticulation:enabledSelfCollisions", True
            ):
                root = prim.GetParent() if prim.IsA(UsdPhysics.Joint) or self._body_of(prim) else prim
                for a, b in combinations(self._under(root), 2):
                    self._part([a], [b])
        self._groups([p for p in self.prims if p.IsA(UsdPhysics.CollisionGroup)])

    def _part(self, ones: list[int], others: list[int]) -> None:
        for a in ones:
            for b in others:
                if self.builder.part("geom", a).body != self.builder.part("geom", b).body:
                    self.apart.add((min(a, b), max(a, b)))

    def _groups(self, groups: list[Any]) -> None:
        """Groups that filter each other; those of one merge name are one group."""
        from pxr import Usd

        names, members, filtered = {}, {}, {}
        for group in groups:
            path = str(group.GetPath())
            names[path] = str(self.scene.get(group, "physics:mergeGroup", "") or path)
            query = Usd.CollectionAPI(group, "colliders").ComputeMembershipQuery()
            inside = {g for p, (g, _) in self.geoms.items() if query.IsPathIncluded(p)}
            members.setdefault(names[path], set()).update(inside)
        for group in groups:
            own = names[str(group.GetPath())]
            others = {
                names.get(str(o.GetPath())) for o in self.scene.targets(group, "physics:filteredGroups")
            }
            if self.scene.get(group, "physics:invertFilteredGroups", False):
                others = set(members) - others
            filtered.setdefault(own, set()).update(others - {None})
        for own, others in filtered.items():
            for other in others:
                self._part(sorted(members[own]), sorted(members[other]))

    def model(self) -> Model:
        """The model by UsdPhysics alone."""
        model = self.builder.build()
        apart = (*model.excluded_geoms, *sorted(self.apart))
        return replace(model, excluded_geoms=apart, unread=self.scene.issues.unread())


def _below(path: str, above: str) -> bool:
    return path == above or path.startswith(above.rstrip("/") + "/")
