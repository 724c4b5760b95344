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
from ...model.coordinates import coordinate_name
from ...model.links import Link
from ...model.mass import MassProperties
from ...model.model import Model
from ...model.parts import OWN, WORLD, Dof, Geom, Material
from ...model.shapes import Shape
from ...model.transforms import ORIGIN, Transform, rotation_matrix
from ...model.visuals import TriangleMesh, Visual
from .losses import Lost
from .mjcf_draft import words
from .mjcf_parts import divided
from .trees_out import Branch, Trees, at_start

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
        self.names: dict[tuple[int, int], str] = {}
        """of joints by those of the model and their degrees of freedom"""
        self.rooted = False
        """whether there is a link that stands for the world"""
        self.frames = {WORLD: ORIGIN}
        """of the link in the body: the origin of a link lies on the axis of its joint"""
        own = {k: divided(model, k) for k in range(len(model.bodies))}
        self.divided = {k: solid for k, solid in own.items() if solid is not None and solid.mass > 0}
        """bodies without their links, of those whose links are links of the file"""

    def written(self) -> ET.Element:
        self._require_axes()
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

    def _require_axes(self) -> None:
        for branch in self.trees.branches:
            joint = None if branch.joint is None else self.model.joints[branch.joint]
            if joint is not None and joint.spherical:
                raise InputError(
                    f'{self.path}: joint "{joint.name}" turns about a point; URDF has joints with axes: '
                    "write .xml or .usda"
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
        merged = [link for link in model.links if link.body not in self.divided]
        for what, things, effect in (
            ("actuators", model.actuators, "large"), ("tendons", model.tendons, "large"),
            ("boxes in a fluid", model.fluid_boxes, "large"), ("sites", model.sites, "none"),
            ("pairs of geoms with a material of their own", model.pair_materials, "small"),
            ("sensors", model.sensors, "none"), ("keyframes", model.keyframes, "none"),
            ("links that are parts of bodies", merged, "none"),
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
        """The joint of a body; one of several degrees of freedom is a row of joints and massless links."""
        j = branch.joint or 0
        joint, model_links = self.model.joints[j], self.model.links
        child, parent = (
            "world" if b == WORLD else self.model.bodies[b].name for b in (branch.body, branch.parent)
        )
        ends = (joint.frame_b, joint.frame_a)
        pose = ends[branch.turned] @ ends[not branch.turned].inverse()  # at zero coordinates
        carrier = joint.link_a if branch.turned else joint.link_b
        if branch.parent in self.divided and carrier != OWN:
            parent, place = model_links[carrier].name, model_links[carrier].frame.inverse() @ pose
        else:
            place = self.frames[branch.parent].inverse() @ pose
        parts = list(at_start(joint, np.zeros(len(joint.dofs)), branch.turned))
        own = ORIGIN
        for k, axis, anchor, _ in parts:
            dof, name = joint.dofs[k], coordinate_name(joint, k)
            frame = Transform(anchor)
            link = child if k == parts[-1][0] else self._massless(f"{name} link")
            made = self._between(name, parent, link, place @ frame)
            place, parent = frame.inverse(), link
            ET.SubElement(made, "axis", xyz=words(axis))
            self._dof(made, dof, name)
            self.names[j, k] = name
            own = frame
        if not parts:
            self._between(joint.name, parent, child, place).set("type", "fixed")
        self.frames[branch.body] = own
        pair = tuple(sorted((branch.body, branch.parent)))
        if joint.collide and branch.parent != WORLD and pair not in self.model.excluded_bodies:
            self.lost.append(Lost(f'joint "{joint.name}"', "that its two links touch", "small"))

    def _between(self, name: str, parent: str, child: str, place: Transform) -> ET.Element:
        made = ET.SubElement(self.root, "joint", name=name)
        ET.SubElement(made, "parent", link=parent)
        ET.SubElement(made, "child", link=child)
        self._origin(made, place)
        return made

    def _massless(self, name: str) -> str:
        taken = {link.get("name") for link in self.root if link.tag == "link"}
        while name in taken or any(body.name == name for body in self.model.bodies):
            name += "_"
        ET.SubElement(self.root, "link", name=name)
        return name

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
            whole = MassProperties(part.mass, part.centre_of_mass, part.inertia)
            self._inertial(link, self.divided.get(body, whole), back)
        self._looks(link, name, body, OWN, back)
        for k, own_link in enumerate(self.model.links if body in self.divided else ()):
            if own_link.body == body:
                self._part(k, own_link, name)

    def _part(self, k: int, part: Link, body: str) -> None:
        """A link that a fixed joint holds on its carrier."""
        above, frame = body, self.frames[part.body]
        if part.carrier != OWN:
            above, frame = self.model.links[part.carrier].name, self.model.links[part.carrier].frame
        name = part.joint or f"{part.name}_fixed"
        self._between(name, above, part.name, frame.inverse() @ part.frame).set("type", "fixed")
        link = ET.SubElement(self.root, "link", name=part.name)
        # Without <inertial> its shapes would give it a mass.
        self._inertial(link, MassProperties(part.mass, part.centre_of_mass, part.inertia), ORIGIN)
        self._looks(link, part.name, part.body, k, part.frame.inverse())

    def _inertial(self, link: ET.Element, solid: MassProperties, back: Transform) -> None:
        """back: from the frame of the solid to that of the link, which are parallel."""
        inertial = ET.SubElement(link, "inertial")
        self._origin(inertial, Transform(back(solid.centre_of_mass)))
        ET.SubElement(inertial, "mass", value=words(solid.mass))
        m = solid.inertia
        names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
        ET.SubElement(inertial, "inertia", {key: words(m[r][c]) for key, (r, c) in names.items()})

    def _looks(self, link: ET.Element, name: str, body: int, part: int, back: Transform) -> None:
        """The geoms and visuals of a link, or of a body with all its links where they are one."""

        def is_on(thing: Geom | Visual) -> bool:
            return thing.body == body and (body not in self.divided or thing.link == part)

        geoms = [geom for geom in self.model.geoms if is_on(geom)]
        for geom in geoms:
            self._geom(link, geom, back)
        self._contact(link, name, [geom.material for geom in geoms])
        for visual in self.model.visuals:
            if is_on(visual):
                self._visual(link, visual, back)

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
        geometry = self._geometry(shape)
        if geometry is None or isinstance(shape, shapes.Mesh):
            self.lost.append(Lost(who, f"a {type(shape).__name__}, which URDF has no shape for", "large"))
            return
        collision = ET.SubElement(link, "collision", name=geom.name)
        self._origin(collision, back @ geom.frame)
        collision.append(geometry)
        if any(geom.surface_velocity) or any(geom.surface_spin) or (geom.category, geom.mask) != (1, 1):
            self.lost.append(Lost(who, "the velocity of its surface, category or mask", "large"))

    def _visual(self, link: ET.Element, visual: Visual, back: Transform) -> None:
        geometry = self._geometry(visual.shape)
        if geometry is None:
            what = f"a {type(visual.shape).__name__}, which URDF has no shape for"
            self.lost.append(Lost(f'visual "{visual.name}"', what, "none"))
            return
        made = ET.SubElement(link, "visual", {"name": visual.name} if visual.name else {})
        self._origin(made, back @ visual.frame)
        made.append(geometry)
        if visual.colour is not None:
            rgba = words(*visual.colour)
            ET.SubElement(ET.SubElement(made, "material", name=f"rgba {rgba}"), "color", rgba=rgba)

    def _geometry(self, shape: Shape | TriangleMesh) -> ET.Element | None:
        geometry = ET.Element("geometry")
        if isinstance(shape, shapes.Sphere):
            ET.SubElement(geometry, "sphere", radius=words(shape.radius))
        elif isinstance(shape, shapes.Box):
            ET.SubElement(geometry, "box", size=words(2 * np.array(shape.half)))
        elif isinstance(shape, shapes.Cylinder | shapes.Capsule):
            tag = type(shape).__name__.lower()
            ET.SubElement(geometry, tag, radius=words(shape.radius), length=words(2 * shape.half_length))
        elif isinstance(shape, shapes.Hull | shapes.Mesh | TriangleMesh):
            ET.SubElement(geometry, "mesh", filename=self._mesh(shape))
        else:
            return None
        return geometry

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
            ends = ((coupling.joint_a, coupling.dof_a), (coupling.joint_b, coupling.dof_b))
            names = [self.names.get(end, "") for end in ends]
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
