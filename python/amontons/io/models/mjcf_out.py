"""Models as MJCF, and a list of what MuJoCo has no element for."""

from __future__ import annotations

import math
from typing import Any
from xml.etree import ElementTree as ET

from ...model import shapes
from ...model.coordinates import is_floating
from ...model.model import Model
from ...model.parts import OWN, WORLD, Dof, Geom, Joint
from ...model.transforms import ORIGIN, Transform, conjugate, rotate
from .geoms import thick
from .losses import Lost
from .mjcf_contacts import condim, write_contacts
from .mjcf_draft import Draft, placed, ranged, sized, within, words
from .mjcf_drives import write_couplings, write_drives, write_tendons
from .mjcf_keyframes import write_keyframes
from .mjcf_parts import in_order, nested, write_parts
from .mjcf_sensors import write_sensors
from .mjcf_visuals import write_visuals
from .trees_out import Branch, at_start


def mjcf_text(model: Model) -> tuple[str, list[Lost]]:
    """The text of a file, in the units and order of bodies of MuJoCo."""
    writer = _Writer(model)
    root = writer.written()
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n", writer.lost


class _Writer(Draft):
    def __init__(self, model: Model) -> None:
        super().__init__(model)
        self.meshes: dict[int, str] = {}
        self.on: dict[int, list[int]] = {}
        self.geoms: dict[int, ET.Element] = {}
        for k, geom in enumerate(model.geoms):
            self.on.setdefault(geom.body, []).append(k)

    def written(self) -> ET.Element:
        ET.SubElement(self.root, "compiler", angle="radian", autolimits="true", balanceinertia="false")
        option = ET.SubElement(self.root, "option", gravity=words(self.model.gravity))
        # Pairs that do not touch are excluded by name below. The rule of parents has nothing left to do.
        ET.SubElement(option, "flag", filterparent="disable")
        fluid = self.model.fluid
        if self.model.fluid_boxes:
            for name, value in (
                ("density", fluid.density),
                ("viscosity", fluid.viscosity),
                ("wind", fluid.wind),
            ):
                option.set(name, words(value))
        self.elements[WORLD, OWN] = ET.SubElement(self.root, "worldbody")
        self._shapes(WORLD)
        for branch in nested(self.trees):
            self._body(branch)
        write_visuals(self, self.geoms)
        in_order(self)
        self.model_sites()
        self._loops()
        write_contacts(self)
        write_tendons(self)
        write_drives(self)
        write_couplings(self)
        write_sensors(self, option)
        write_keyframes(self)
        self._tell()
        self.root.extend(section for section in self.sections.values() if len(section))
        return self.root

    def _tell(self) -> None:
        model = self.model
        rule = model.friction_rule
        if rule != "maximum" and len({geom.material.friction for geom in model.geoms}) > 1:
            self.lost.append(Lost("model", f'friction_rule="{rule}"; MuJoCo takes the larger one', "small"))
        if any(any(body.linear_velocity) or any(body.angular_velocity) for body in model.bodies):
            self.lost.append(Lost("model", "initial velocities", "small"))

    def _body(self, branch: Branch) -> None:
        body = self.model.bodies[branch.body]
        pose = ORIGIN if branch.parent == WORLD else self.model.bodies[branch.parent].pose
        above, own = self.at(branch.parent, self._carrier(branch))
        element = ET.SubElement(above, "body", name=body.name)
        self.elements[branch.body, OWN] = placed(element, (pose @ own).inverse() @ body.pose)
        if body.motion == "kinematic":
            element.set("mocap", "true")
        if body.motion == "dynamic":
            if branch.joint is None:
                self._name(ET.SubElement(element, "freejoint"), f"{body.name} free", branch.body, -1)
            else:
                self._joint(element, branch)
        write_parts(self, branch.body)
        self._shapes(branch.body)

    def _carrier(self, branch: Branch) -> int:
        """The link of its parent that holds a body."""
        if branch.joint is None:
            return OWN
        joint = self.model.joints[branch.joint]
        return joint.link_a if branch.turned else joint.link_b

    def _shapes(self, body: int) -> None:
        """The geoms of a body and of its links."""
        for k in self.on.get(body, []):
            geom = self.model.geoms[k]
            element, own = self.at(body, geom.link)
            made = self.geoms[k] = self._geom(element, geom, within(own, geom.frame))
            if body != WORLD and element.find("inertial") is None:
                made.set("mass", "0")  # else MuJoCo takes one from the shapes

    def _joint(self, element: ET.Element, branch: Branch) -> None:
        j = branch.joint or 0
        joint = self.model.joints[j]
        if joint.compliance:
            self.lose(f'joint "{joint.name}"', "its compliance", "small")
        if not branch.turned and _is_free(joint):
            made = ET.SubElement(element, "joint", type="free")
            self._name(made, joint.name, branch.body, j)
            self._resistance(made, joint)
            return
        for k, axis, anchor, ref in at_start(joint, self.trees.start[j], branch.turned):
            dof = joint.dofs[k]
            made = ET.SubElement(element, "joint", type=dof.kind, axis=words(axis), pos=words(anchor))
            self._name(made, self.joint_name(joint, k), branch.body, j)
            self.names[j, k] = made.get("name", "")
            self._dof(made, dof, ref)
            if dof.lower == dof.upper:
                self.hold("joint", self.names[j, k], dof.lower - ref)
        if joint.spherical:
            frame = joint.frame_b if branch.turned else joint.frame_a
            made = ET.SubElement(element, "joint", type="ball", pos=words(frame.position))
            self._name(made, self.joint_name(joint, -1), branch.body, j)
            self.names[j, -1] = made.get("name", "")
            self._resistance(made, joint)
            if math.isfinite(joint.ball_limit):
                made.set("range", words(0, joint.ball_limit))

    def _name(self, made: ET.Element, name: str, body: int, joint: int) -> None:
        while name in self.placed:
            name += "_"
        made.set("name", name)
        self.placed[name] = body, joint

    def _resistance(self, made: ET.Element, joint: Joint) -> None:
        for name, value in (
            ("stiffness", joint.ball_stiffness), ("damping", joint.ball_damping),
            ("frictionloss", joint.ball_friction), ("armature", joint.ball_armature),
        ):  # fmt: skip
            if value:
                made.set(name, words(value))

    def _dof(self, made: ET.Element, dof: Dof, ref: float) -> None:
        for name, value in (
            ("ref", ref), ("stiffness", dof.stiffness), ("springref", dof.rest), ("damping", dof.damping),
            ("frictionloss", dof.friction), ("armature", dof.armature),
        ):  # fmt: skip
            if value:
                made.set(name, words(value))
        ranged(made, "range", dof.lower, dof.upper)
        # Without a motor its largest effort is that of one which a reader may add, as of a URDF.
        most = dof.motor.max_effort if dof.motor.kind == "none" else math.inf
        ranged(made, "actuatorfrcrange", max(dof.lower_effort, -most), min(dof.upper_effort, most))

    def _geom(self, element: ET.Element, geom: Geom, frame: Transform) -> ET.Element:
        material, who = geom.material, f'geom "{geom.name}"'
        made = placed(ET.SubElement(element, "geom", name=geom.name), frame)
        if not self._shape(made, geom, frame):
            self.lost.append(Lost(who, "a mesh, which MuJoCo fills to its convex hull", "large"))
        made.set("friction", words(material.friction, material.torsional_friction, material.rolling_friction))
        made.set("condim", condim(material))
        if material.rest_offset:
            made.set("margin", words(material.rest_offset))
        # MuJoCo's are 32 bits with a sign.
        for name, bits in (("contype", geom.category), ("conaffinity", geom.mask)):
            made.set(name, str(bits - 2**32 if bits >= 2**31 else bits))
        if any(geom.surface_velocity) or any(geom.surface_spin):
            back = conjugate(geom.frame.rotation)
            made.set(
                "surfacevel", words(*(rotate(back, v) for v in (geom.surface_velocity, geom.surface_spin)))
            )
        if material.restitution or material.compliance:
            self.lost.append(Lost(who, "restitution and compliance; MuJoCo's solref is another law", "small"))
        if geom.friction_direction is not None:
            self.lost.append(Lost(who, "friction that depends on the direction", "small"))
        return made

    def _shape(self, made: ET.Element, geom: Geom, frame: Transform) -> bool:
        """False where MuJoCo takes another one."""
        shape = geom.shape
        if sized(made, shape):
            return True
        if isinstance(shape, shapes.Plane):
            made.set("type", "plane")
            made.set("size", "0 0 1")
        elif isinstance(shape, shapes.HeightField):
            self._field(made, frame, shape)
        else:
            made.set("type", "mesh")
            made.set("mesh", self._mesh(shape))
            return isinstance(shape, shapes.Hull)
        return True

    def _mesh(self, shape: Any) -> str:
        if id(shape) not in self.meshes:
            name = self.meshes[id(shape)] = f"mesh_{len(self.meshes)}"
            # The mass is that of <inertial>; a hull does not need the triangles of a closed surface.
            made = ET.SubElement(self.sections["asset"], "mesh", name=name, inertia="convex")
            # MuJoCo refuses a flat one, which a hull never is.
            points = shape.vertices if isinstance(shape, shapes.Hull) else thick(shape.vertices)
            made.set("vertex", words(points))
        return self.meshes[id(shape)]

    def _field(self, made: ET.Element, frame: Transform, field: shapes.HeightField) -> None:
        """MuJoCo's heights are from 0 to 1 of the elevation."""
        low, high = float(field.heights.min()), float(field.heights.max())
        span = max(high - low, 1e-6)
        name = f"field_{len(self.sections['asset'])}"
        ET.SubElement(
            self.sections["asset"], "hfield", name=name, nrow=str(field.heights.shape[0]),
            ncol=str(field.heights.shape[1]), elevation=words((field.heights - low) / span),
            size=words(field.size_x / 2, field.size_y / 2, span, span),
        )  # fmt: skip
        made.set("type", "hfield")
        made.set("hfield", name)
        made.set("pos", words(frame((0.0, 0.0, low))))

    def _loops(self) -> None:
        for j in self.trees.loops:
            joint = self.model.joints[j]
            anchor = joint.frame_a.position
            if joint.kind == "distance":
                self._distance(joint)
            elif joint.spherical and not joint.dofs:
                self._connect(joint, anchor)
            elif not joint.dofs:
                self._weld(joint)
            elif len(joint.dofs) == 1 and joint.dofs[0].kind == "hinge" and not joint.spherical:
                dof = joint.dofs[0]  # two points of the axis stay together
                self._connect(joint, joint.frame_a(dof.anchor))
                self._connect(
                    joint, joint.frame_a(tuple(a + b for a, b in zip(dof.anchor, dof.axis, strict=True)))
                )
            else:
                self.lost.append(
                    Lost(f'joint "{joint.name}"', "a loop that MuJoCo has no equality for", "large")
                )

    def _ends(self, joint: Joint) -> dict[str, str]:
        ends = {"body1": joint.body_a, "body2": joint.body_b}
        return {key: self.model.bodies[b].name for key, b in ends.items() if b != WORLD}  # type: ignore[index]

    def _equality(self, tag: str, joint: Joint, **attributes: str) -> None:
        made = ET.SubElement(self.sections["equality"], tag, attributes | self._ends(joint))
        taken = {other.get("name") for other in self.sections["equality"]}
        if joint.name and joint.name not in taken:  # the second one of a hinge has none
            made.set("name", joint.name)

    def _connect(self, joint: Joint, anchor: Any) -> None:
        self._equality("connect", joint, anchor=words(anchor))

    def _weld(self, joint: Joint) -> None:
        between = joint.frame_a @ joint.frame_b.inverse()
        pose = words(*between.position, *between.rotation)
        self._equality("weld", joint, anchor=words(joint.frame_b.position), relpose=pose)

    def _distance(self, joint: Joint) -> None:
        tendon = ET.SubElement(self.sections["tendon"], "spatial", name=joint.name)
        for end, body, frame in (("a", joint.body_a, joint.frame_a), ("b", joint.body_b, joint.frame_b)):
            ET.SubElement(tendon, "site", site=self.site(int(body), frame, f"{joint.name} {end}"))  # type: ignore[arg-type]
        ranged(tendon, "range", joint.lower_distance, joint.upper_distance)
        if joint.lower_distance == joint.upper_distance:
            self.hold("tendon", joint.name, joint.lower_distance - self._distance_at_start(joint))

    def _distance_at_start(self, joint: Joint) -> float:
        ends = ((joint.body_a, joint.frame_a), (joint.body_b, joint.frame_b))
        a, b = (
            (ORIGIN if body == WORLD else self.model.bodies[int(body or 0)].pose)(frame.position)
            for body, frame in ends
        )
        return math.dist(a, b)


def _is_free(joint: Joint) -> bool:
    """Whether MuJoCo's free joint says all of a floating base on a joint: it has one number for all six."""
    if not is_floating(joint) or joint.ball_stiffness or math.isfinite(joint.ball_limit):
        return False
    usual = (0.0, joint.ball_damping, joint.ball_friction, joint.ball_armature)
    bounds = (-math.inf, math.inf) * 2
    return all(
        (dof.stiffness, dof.damping, dof.friction, dof.armature) == usual
        and (dof.lower, dof.upper, dof.lower_effort, dof.upper_effort) == bounds
        and dof.motor.kind == "none"
        for dof in joint.dofs
    )
