"""Models as URDF, with meshes beside it, and a list of what URDF has no element for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from ...errors import InputError
from ...model import shapes
from ...model.model import Model
from ...model.parts import WORLD, Dof, Geom, Material
from ...model.transforms import ORIGIN, Transform, rotation_matrix
from .losses import Lost
from .mjcf_out import words
from .trees_out import Branch, Trees, at_start, moved

GRAVITY = (0.0, 0.0, -9.81)
"""m/s^2, what readers of URDF take"""
ZERO = 1e-9
"""m, rad: coordinates below it are rounding"""


def urdf_text(model: Model, path: Path) -> tuple[str, dict[Path, bytes], list[Lost]]:
    """The text of a file, the meshes beside it, and what is lost. InputError for what is no tree of links."""
    writer = _Writer(model, path)
    root = writer.written()
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n", writer.files, writer.lost


class _Writer:
    def __init__(self, model: Model, path: Path) -> None:
        self.model, self.path = model, path
        self.lost: list[Lost] = []
        self.files: dict[Path, bytes] = {}
        self.known: dict[int, str] = {}
        self.trees = Trees(model)
        self.root = ET.Element("robot", name=path.stem)
        self.rooted = False
        """whether there is a link that stands for the world"""
        self.frames = {WORLD: ORIGIN}
        """of the link in the body: the origin of a link lies on the axis of its joint"""

    def written(self) -> ET.Element:
        self._require_hinges()
        roots = sum(branch.parent == WORLD for branch in self.trees.branches)
        held = any(branch.joint is not None and branch.parent == WORLD for branch in self.trees.branches)
        self.rooted = held or roots > 1 or any(geom.body == WORLD for geom in self.model.geoms)
        if self.rooted:
            self._link("world", WORLD)
        for branch in self.trees.branches:
            self._branch(branch)
        self._mimics()
        self._tell()
        return self.root

    def _require_hinges(self) -> None:
        for branch in self.trees.branches:
            joint = None if branch.joint is None else self.model.joints[branch.joint]
            if joint is not None and (joint.spherical or len(joint.dofs) > 1):
                raise InputError(
                    f'{self.path}: joint "{joint.name}" has {len(joint.dofs) + 3 * joint.spherical} degrees '
                    "of freedom; URDF has joints with one: write .xml or .usda"
                )

    def _tell(self) -> None:
        model = self.model
        if model.gravity != GRAVITY:
            self.lost.append(Lost("model", f"gravity={model.gravity}", "large"))
        if self.trees.loops:
            self.lost.append(Lost("model", f"{len(self.trees.loops)} joints that close loops", "large"))
        if any(np.any(np.abs(q) > ZERO) for q in self.trees.start):
            self.lost.append(Lost("model", "the initial pose; links stand at zero coordinates", "small"))
        joined = {tuple(sorted((b.body, b.parent))) for b in self.trees.branches}
        apart = [pair for pair in model.excluded_bodies if tuple(sorted(pair)) not in joined]
        for what, things, effect in (
            ("actuators", model.actuators, "large"), ("tendons", model.tendons, "large"),
            ("boxes in a fluid", model.fluid_boxes, "large"), ("sites", model.sites, "none"),
            ("pairs of geoms with a material of their own", model.pair_materials, "small"),
            ("sensors", model.sensors, "none"), ("keyframes", model.keyframes, "none"),
            ("visuals", model.visuals, "none"), ("links that are parts of bodies", model.links, "none"),
            ("pairs that never touch", (*apart, *model.excluded_geoms), "large"),
        ):  # fmt: skip
            if things:
                self.lost.append(Lost("model", f"{len(things)} {what}", effect))

    def _branch(self, branch: Branch) -> None:
        body = self.model.bodies[branch.body]
        self.frames[branch.body] = ORIGIN
        if branch.joint is not None:
            self._joint(branch)
        elif self.rooted:  # several roots, or scenery: all hang on one link
            kind = "floating" if body.motion == "dynamic" else "fixed"
            made = ET.SubElement(self.root, "joint", name=f"{body.name} free", type=kind)
            ET.SubElement(made, "parent", link="world")
            ET.SubElement(made, "child", link=body.name)
            self._origin(made, body.pose)
        self._link(body.name, branch.body)

    def _joint(self, branch: Branch) -> None:
        j = branch.joint or 0
        joint, start = self.model.joints[j], self.trees.start[j]
        child, parent = (b if b == WORLD else self.model.bodies[b] for b in (branch.body, branch.parent))
        above = ORIGIN if branch.parent == WORLD else self.model.bodies[branch.parent].pose
        pose = above.inverse() @ self.model.bodies[branch.body].pose
        made = ET.SubElement(self.root, "joint", name=joint.name)
        own = ORIGIN
        for k, axis, anchor, q in at_start(joint, start, branch.turned):
            dof = joint.dofs[k]
            own = Transform(anchor)
            back = Dof(dof.kind, axis, anchor)
            pose = pose @ moved(back, -q)  # at zero
            ET.SubElement(made, "axis", xyz=words(axis))
            self._dof(made, dof, joint.name)
        if not joint.dofs:
            made.set("type", "fixed")
        self.frames[branch.body] = own
        ET.SubElement(made, "parent", link="world" if parent == WORLD else parent.name)  # type: ignore[union-attr]
        ET.SubElement(made, "child", link=child.name)  # type: ignore[union-attr]
        self._origin(made, self.frames[branch.parent].inverse() @ pose @ own)
        pair = tuple(sorted((branch.body, branch.parent)))
        if joint.collide and branch.parent != WORLD and pair not in self.model.excluded_bodies:
            self.lost.append(Lost(f'joint "{joint.name}"', "that its two links touch", "small"))

    def _dof(self, made: ET.Element, dof: Dof, name: str) -> None:
        free = math.isinf(dof.lower) and math.isinf(dof.upper)
        made.set("type", "prismatic" if dof.kind == "slide" else "continuous" if free else "revolute")
        effort = min(dof.motor.max_effort, dof.upper_effort, -dof.lower_effort)
        limit = ET.SubElement(
            made, "limit", effort=words(effort if math.isfinite(effort) else 0), velocity="0"
        )
        if not free or dof.kind == "slide":  # without a range a joint of URDF stays where it is
            limit.set("lower", words(max(dof.lower, -1e6)))
            limit.set("upper", words(min(dof.upper, 1e6)))
        ET.SubElement(made, "dynamics", damping=words(dof.damping), friction=words(dof.friction))
        if dof.stiffness or dof.armature:
            self.lost.append(Lost(f'joint "{name}"', "its spring or armature", "small"))
        if dof.motor.kind != "none":
            self.lost.append(Lost(f'joint "{name}"', "its motor; give load_model(motors=)", "large"))

    def _origin(self, above: ET.Element, frame: Transform) -> None:
        ET.SubElement(above, "origin", xyz=words(frame.position), rpy=words(roll_pitch_yaw(frame)))

    def _link(self, name: str, body: int) -> None:
        link = ET.SubElement(self.root, "link", name=name)
        back = self.frames[body].inverse()
        if body != WORLD:
            part = self.model.bodies[body]
            if part.gravity_scale != 1:
                self.lost.append(Lost(f'body "{name}"', f"gravity_scale={part.gravity_scale:g}", "large"))
            inertial = ET.SubElement(link, "inertial")
            self._origin(inertial, Transform(back(part.centre_of_mass)))
            ET.SubElement(inertial, "mass", value=words(part.mass))
            m = part.inertia
            names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
            ET.SubElement(inertial, "inertia", {key: words(m[r][c]) for key, (r, c) in names.items()})
        geoms = [geom for geom in self.model.geoms if geom.body == body]
        for geom in geoms:
            self._geom(link, geom, back)
        self._contact(link, name, [geom.material for geom in geoms])

    def _contact(self, link: ET.Element, name: str, materials: Sequence[Material]) -> None:
        """Bullet's <contact>: one material for all of a link."""
        if not materials:
            return
        material = materials[0]
        if len(set(materials)) > 1:
            self.lost.append(Lost(f'link "{name}"', "all materials but the first one", "small"))
        contact = ET.SubElement(link, "contact")
        for tag, value in (
            ("lateral_friction", material.friction), ("spinning_friction", material.torsional_friction),
            ("rolling_friction", material.rolling_friction), ("restitution", material.restitution),
        ):  # fmt: skip
            ET.SubElement(contact, tag, value=words(value))
        if material.compliance:
            ET.SubElement(contact, "stiffness", value=words(1 / material.compliance))
            damping = material.relaxation_time / material.compliance
            ET.SubElement(contact, "damping", value=words(damping))

    def _geom(self, link: ET.Element, geom: Geom, back: Transform) -> None:
        shape, who = geom.shape, f'geom "{geom.name}"'
        geometry = ET.Element("geometry")
        if isinstance(shape, shapes.Sphere):
            ET.SubElement(geometry, "sphere", radius=words(shape.radius))
        elif isinstance(shape, shapes.Box):
            ET.SubElement(geometry, "box", size=words(2 * np.array(shape.half)))
        elif isinstance(shape, shapes.Cylinder | shapes.Capsule):
            tag = type(shape).__name__.lower()
            ET.SubElement(geometry, tag, radius=words(shape.radius), length=words(2 * shape.half_length))
        elif isinstance(shape, shapes.Hull):
            ET.SubElement(geometry, "mesh", filename=self._mesh(shape))
        else:
            self.lost.append(Lost(who, f"a {type(shape).__name__}, which URDF has no shape for", "large"))
            return
        collision = ET.SubElement(link, "collision", name=geom.name)
        self._origin(collision, back @ geom.frame)
        collision.append(geometry)
        if any(geom.surface_velocity) or any(geom.surface_spin) or (geom.category, geom.mask) != (1, 1):
            self.lost.append(Lost(who, "the velocity of its surface, category or mask", "large"))

    def _mesh(self, shape: Any) -> str:
        """A file .obj, which has every digit; a .stl has single precision."""
        if id(shape) not in self.known:
            name = self.known[id(shape)] = f"{self.path.stem}_{len(self.known)}.obj"
            lines = [f"v {words(vertex)}" for vertex in shape.vertices]
            lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in shape.triangles.tolist()]
            self.files[self.path.with_name(name)] = ("\n".join(lines) + "\n").encode()
        return self.known[id(shape)]

    def _mimics(self) -> None:
        by_name = {made.get("name"): made for made in self.root if made.tag == "joint"}
        for coupling in self.model.couplings:
            names = [
                self.model.joints[j].name if j >= 0 else "" for j in (coupling.joint_a, coupling.joint_b)
            ]
            made = by_name.get(names[0])
            if made is None or names[1] not in by_name or len(coupling.coefficients) > 2:
                what = "a coupling that is no line between two joints"
                self.lost.append(Lost(f'coupling "{coupling.name}"', what, "large"))
                continue
            offset, multiplier = (*coupling.coefficients, 0.0)[:2]
            ET.SubElement(made, "mimic", joint=names[1], multiplier=words(multiplier), offset=words(offset))


def roll_pitch_yaw(frame: Transform) -> tuple[float, float, float]:
    """The angles about the fixed axes x, y and z, one after the other (rad)."""
    m = rotation_matrix(frame.rotation)
    pitch = math.atan2(-m[2][0], math.hypot(m[0][0], m[1][0]))
    if math.hypot(m[0][0], m[1][0]) > 1e-9:
        return math.atan2(m[2][1], m[2][2]), pitch, math.atan2(m[1][0], m[0][0])
    return math.atan2(-m[1][2], m[1][1]), pitch, 0.0  # roll and yaw turn about one axis
