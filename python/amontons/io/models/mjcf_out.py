"""Models as MJCF, and a list of what MuJoCo has no element for."""

from __future__ import annotations

import math
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from numpy.polynomial import Polynomial

from ...model import shapes
from ...model.model import Model
from ...model.parts import WORLD, Dof, Geom, Joint, Motor
from ...model.transforms import IDENTITY, ORIGIN, Transform, conjugate, rotate
from .losses import Lost
from .trees_out import Branch, Trees, at_start

DIMENSIONS = ((6, "rolling_friction"), (4, "torsional_friction"), (3, "friction"))
"""condim by the first coefficient that is not zero"""


def words(*values: Any) -> str:
    """Numbers as text, with every digit."""
    return " ".join(repr(float(v)) for v in np.ravel(np.array(values, dtype=np.float64)))


def placed(element: ET.Element, frame: Transform) -> ET.Element:
    if any(frame.position):
        element.set("pos", words(frame.position))
    if frame.rotation != IDENTITY:
        element.set("quat", words(frame.rotation))
    return element


def mjcf_text(model: Model) -> tuple[str, list[Lost]]:
    """The text of a file, in the units and order of bodies of MuJoCo."""
    writer = _Writer(model)
    root = writer.written()
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n", writer.lost


class _Writer:
    def __init__(self, model: Model) -> None:
        self.model = model
        self.lost: list[Lost] = []
        self.trees = Trees(model)
        self.root = ET.Element("mujoco")
        self.names: dict[tuple[int, int], str] = {}
        """of the hinge or slide that is a degree of freedom of a joint"""
        self.meshes: dict[int, str] = {}
        self.sections = {
            tag: ET.Element(tag) for tag in ("asset", "contact", "tendon", "equality", "actuator")
        }
        self.elements: dict[int, ET.Element] = {}
        self.on: dict[int, list[Geom]] = {}
        for geom in model.geoms:
            self.on.setdefault(geom.body, []).append(geom)

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
        world = ET.SubElement(self.root, "worldbody")
        self.elements[WORLD] = world
        for geom in self.on.get(WORLD, []):
            self._geom(world, geom)
        for branch in self.trees.branches:
            self._body(branch)
        for site in self.model.sites:
            placed(ET.SubElement(self.elements[site.body], "site", name=site.name), site.frame)
        self._loops()
        self._contacts()
        self._tendons()
        self._drives()
        self._couplings()
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
        for what, things in (
            ("sensors", model.sensors), ("keyframes", model.keyframes), ("visuals", model.visuals),
            ("names of links that are parts of bodies", model.links),
        ):  # fmt: skip
            if things:
                self.lost.append(Lost("model", f"{len(things)} {what}", "none"))

    def _body(self, branch: Branch) -> None:
        body = self.model.bodies[branch.body]
        above = WORLD if branch.parent == WORLD else branch.parent
        pose = ORIGIN if above == WORLD else self.model.bodies[above].pose
        element = ET.SubElement(self.elements[above], "body", name=body.name)
        self.elements[branch.body] = placed(element, pose.inverse() @ body.pose)
        if body.motion == "kinematic":
            element.set("mocap", "true")
        if body.gravity_scale != 1:
            element.set("gravcomp", words(1 - body.gravity_scale))
        if body.motion == "dynamic":
            if branch.joint is None:
                ET.SubElement(element, "freejoint", name=f"{body.name} free")
            else:
                self._joint(element, branch)
            m = np.array(body.inertia)
            ET.SubElement(
                element, "inertial", pos=words(body.centre_of_mass), mass=words(body.mass),
                fullinertia=words(*np.diag(m), m[0, 1], m[0, 2], m[1, 2]),
            )  # fmt: skip
        for geom in self.on.get(branch.body, []):
            self._geom(element, geom)

    def _joint(self, element: ET.Element, branch: Branch) -> None:
        joint = self.model.joints[branch.joint or 0]
        if joint.compliance:
            self.lost.append(Lost(f'joint "{joint.name}"', "its compliance", "small"))
        for k, axis, anchor, ref in at_start(joint, self.trees.start[branch.joint or 0], branch.turned):
            dof = joint.dofs[k]
            name = dof.name or (
                joint.name if len(joint.dofs) == 1 and not joint.spherical else f"{joint.name}[{k}]"
            )
            self.names[branch.joint or 0, k] = name
            made = ET.SubElement(
                element, "joint", name=name, type=dof.kind, axis=words(axis), pos=words(anchor)
            )
            self._dof(made, dof, ref)
        if joint.spherical:
            frame = joint.frame_b if branch.turned else joint.frame_a
            made = ET.SubElement(
                element, "joint", name=f"{joint.name} ball", type="ball", pos=words(frame.position)
            )
            for name, value in (
                ("stiffness", joint.ball_stiffness), ("damping", joint.ball_damping),
                ("frictionloss", joint.ball_friction), ("armature", joint.ball_armature),
            ):  # fmt: skip
                if value:
                    made.set(name, words(value))
            if math.isfinite(joint.ball_limit):
                made.set("range", words(0, joint.ball_limit))

    def _dof(self, made: ET.Element, dof: Dof, ref: float) -> None:
        for name, value in (
            ("ref", ref), ("stiffness", dof.stiffness), ("springref", dof.rest), ("damping", dof.damping),
            ("frictionloss", dof.friction), ("armature", dof.armature),
        ):  # fmt: skip
            if value:
                made.set(name, words(value))
        self._range(made, "range", dof.lower, dof.upper)
        self._range(made, "actuatorfrcrange", dof.lower_effort, dof.upper_effort)

    def _range(self, made: ET.Element, name: str, lower: float, upper: float) -> None:
        """MuJoCo has no limit on one side: the other one is far away."""
        if math.isinf(lower) and math.isinf(upper):
            return
        far = 1e6 * max(1.0, *(abs(x) for x in (lower, upper) if math.isfinite(x)))
        made.set(name, words(max(lower, -far), min(upper, far)))

    def _geom(self, element: ET.Element, geom: Geom) -> None:
        material, who = geom.material, f'geom "{geom.name}"'
        made = placed(ET.SubElement(element, "geom", name=geom.name), geom.frame)
        if not self._shape(made, geom):
            self.lost.append(Lost(who, "a mesh, which MuJoCo fills to its convex hull", "large"))
        made.set("friction", words(material.friction, material.torsional_friction, material.rolling_friction))
        made.set("condim", str(next((n for n, name in DIMENSIONS if getattr(material, name) > 0), 1)))
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

    def _shape(self, made: ET.Element, geom: Geom) -> bool:
        """False where MuJoCo takes another one."""
        shape = geom.shape
        kinds: dict[type[shapes.Shape], tuple[str, tuple[str, ...]]] = {
            shapes.Sphere: ("sphere", ("radius",)), shapes.Capsule: ("capsule", ("radius", "half_length")),
            shapes.Cylinder: ("cylinder", ("radius", "half_length")), shapes.Box: ("box", ("half",)),
            shapes.Ellipsoid: ("ellipsoid", ("radii",)),
        }  # fmt: skip
        if type(shape) in kinds:
            kind, sizes = kinds[type(shape)]
            made.set("type", kind)
            made.set("size", words(*(x for name in sizes for x in np.ravel(getattr(shape, name)))))
        elif isinstance(shape, shapes.Plane):
            made.set("type", "plane")
            made.set("size", "0 0 1")
        elif isinstance(shape, shapes.HeightField):
            self._field(made, geom, shape)
        else:
            made.set("type", "mesh")
            made.set("mesh", self._mesh(shape))
            return isinstance(shape, shapes.Hull)
        return True

    def _mesh(self, shape: Any) -> str:
        if id(shape) not in self.meshes:
            name = self.meshes[id(shape)] = f"mesh_{len(self.meshes)}"
            # The mass is that of <inertial>; a hull does not need the triangles of a closed surface.
            ET.SubElement(
                self.sections["asset"], "mesh", name=name, vertex=words(shape.vertices), inertia="convex"
            )
        return self.meshes[id(shape)]

    def _field(self, made: ET.Element, geom: Geom, field: shapes.HeightField) -> None:
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
        made.set("pos", words(geom.frame((0.0, 0.0, low))))

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

    def _connect(self, joint: Joint, anchor: Any) -> None:
        ET.SubElement(self.sections["equality"], "connect", anchor=words(anchor), **self._ends(joint))

    def _weld(self, joint: Joint) -> None:
        between = joint.frame_a @ joint.frame_b.inverse()
        pose = words(between.position, between.rotation)
        ET.SubElement(self.sections["equality"], "weld", anchor="0 0 0", relpose=pose, **self._ends(joint))

    def _distance(self, joint: Joint) -> None:
        tendon = ET.SubElement(self.sections["tendon"], "spatial", name=joint.name)
        for end, body, frame in (("a", joint.body_a, joint.frame_a), ("b", joint.body_b, joint.frame_b)):
            name = f"{joint.name} {end}"
            placed(ET.SubElement(self.elements[int(body or 0)], "site", name=name), frame)  # type: ignore[call-overload]
            ET.SubElement(tendon, "site", site=name)
        self._range(tendon, "range", joint.lower_distance, joint.upper_distance)

    def _contacts(self) -> None:
        model, section = self.model, self.sections["contact"]
        name = ["world", *(body.name for body in model.bodies)]
        apart = {(min(a, b), max(a, b)) for a, b in model.excluded_bodies}
        apart |= {
            tuple(sorted((int(j.body_a), int(j.body_b))))
            for j in model.joints
            if not j.collide  # type: ignore[arg-type, misc]
        }
        geoms: dict[tuple[int, int], int] = {}
        for a, b in set(model.excluded_geoms):
            pair = tuple(sorted((model.geoms[a].body, model.geoms[b].body)))
            geoms[pair] = geoms.get(pair, 0) + 1  # type: ignore[index, arg-type]
        for pair, count in geoms.items():
            if count == len(self.on.get(pair[0], [])) * len(self.on.get(pair[1], [])):
                apart.add(pair)
            elif pair not in apart:
                what = f"{count} pairs of geoms that never touch"
                self.lost.append(Lost(f'bodies "{name[pair[0] + 1]}", "{name[pair[1] + 1]}"', what, "large"))
        for a, b in sorted(apart):
            ET.SubElement(section, "exclude", body1=name[a + 1], body2=name[b + 1])
        for pair in model.pair_materials:
            one, other = model.geoms[pair.geom_a], model.geoms[pair.geom_b]
            meet = one.category & other.mask or other.category & one.mask
            if not pair.always and (not meet or tuple(sorted((one.body, other.body))) in apart):
                continue
            m = pair.material
            ET.SubElement(
                section, "pair", geom1=one.name, geom2=other.name, margin=words(m.rest_offset),
                condim=str(next((n for n, key in DIMENSIONS if getattr(m, key) > 0), 1)),
                friction=words(*[m.friction] * 2, m.torsional_friction, *[m.rolling_friction] * 2),
            )  # fmt: skip

    def _tendons(self) -> None:
        for tendon in self.model.tendons:
            if any(stop.kind in ("sphere", "cylinder") for stop in tendon.path):
                self.lost.append(
                    Lost(f'tendon "{tendon.name}"', "a path around a sphere or cylinder", "large")
                )
                continue
            kind = "spatial" if tendon.path else "fixed"
            made = ET.SubElement(self.sections["tendon"], kind, name=tendon.name)
            for k, stop in enumerate(tendon.path):
                if stop.kind == "pulley":
                    ET.SubElement(made, "pulley", divisor=words(stop.divisor))
                    continue
                name = f"{tendon.name} {k}"
                placed(ET.SubElement(self.elements[int(stop.body)], "site", name=name), stop.frame)  # type: ignore[arg-type]
                ET.SubElement(made, "site", site=name)
            for term in tendon.terms:
                joint = self.names.get((int(term.joint), term.dof), "")
                ET.SubElement(made, "joint", joint=joint, coef=words(term.coefficient))
            made.set("springlength", words(tendon.rest_lower, tendon.rest_upper))
            for key, value in (
                ("stiffness", tendon.stiffness), ("damping", tendon.damping),
                ("frictionloss", tendon.friction), ("armature", tendon.armature),
            ):  # fmt: skip
                made.set(key, words(value))
            self._range(made, "range", tendon.lower, tendon.upper)

    def _drives(self) -> None:
        model, section = self.model, self.sections["actuator"]
        kept = {element.get("name") for element in self.sections["tendon"]}
        for actuator in model.actuators:
            moved = actuator.transmission
            made = ET.Element("general", name=actuator.name, gear=words(moved.gear))
            tendon = model.tendons[moved.tendon].name if moved.kind == "tendon" else ""
            if moved.kind == "dof" and (moved.joint, moved.dof) in self.names:
                made.set("joint", self.names[moved.joint, moved.dof])
            elif tendon in kept:
                made.set("tendon", tendon)
            else:
                self.lost.append(Lost(f'actuator "{actuator.name}"', "what it moves", "large"))
                continue
            made.set("gaintype", "affine" if any(actuator.gain[1:]) else "fixed")
            made.set("gainprm", words(actuator.gain))
            made.set("biastype", "affine")
            made.set("biasprm", words(actuator.bias))
            self._range(made, "forcerange", actuator.lower_force, actuator.upper_force)
            self._range(made, "ctrlrange", actuator.lower_control, actuator.upper_control)
            if actuator.dynamics != "none":
                made.set("dyntype", {"filter": "filterexact"}.get(actuator.dynamics, actuator.dynamics))
                made.set("dynprm", words(max(actuator.time_constant, 1e-9)))
                self._range(made, "actrange", actuator.lower_activation, actuator.upper_activation)
                made.set("actearly", str(actuator.early).lower())
            if actuator.control or actuator.activation:
                self.lost.append(Lost(f'actuator "{actuator.name}"', "its initial control", "small"))
            section.append(made)
        for (j, d), name in self.names.items():
            self._motor(name, model.joints[j].dofs[d].motor)

    def _motor(self, name: str, motor: Motor) -> None:
        if motor.kind == "none":
            return
        if motor.kind != "effort" and not (motor.kp or motor.kd):
            self.lost.append(Lost(f'joint "{name}"', "a motor that follows its control exactly", "large"))
            return
        gain = {"effort": 1.0, "position": motor.kp, "velocity": motor.kd}[motor.kind]
        taken = {made.get("name") for made in self.sections["actuator"]}
        made = ET.SubElement(
            self.sections["actuator"], "general", name=f"{name} motor" if name in taken else name, joint=name,
            gainprm=words(gain), biastype="affine", biasprm=words(0, -motor.kp, -motor.kd),
        )  # fmt: skip
        self._range(made, "forcerange", -motor.max_effort, motor.max_effort)
        if motor.control:
            self.lost.append(Lost(f'motor of "{name}"', "its initial control", "small"))

    def _couplings(self) -> None:
        for coupling in self.model.couplings:
            ends = [(coupling.joint_a, coupling.dof_a), (coupling.joint_b, coupling.dof_b)]
            known = ends[0] in self.names and (ends[1] in self.names or ends[1][0] < 0)
            if max(coupling.tendon_a, coupling.tendon_b) >= 0 or not known or len(coupling.coefficients) > 5:
                what = "a coupling of tendons, or of a degree above 4"
                self.lost.append(Lost(f'coupling "{coupling.name}"', what, "large"))
                continue
            # MuJoCo's polynomial is one of the displacements from the start.
            starts = [float(self.trees.start[j][d]) if j >= 0 else 0.0 for j, d in ends]
            moved = Polynomial(coupling.coefficients)(Polynomial([starts[1], 1.0])) - starts[0]
            made = ET.SubElement(self.sections["equality"], "joint", joint1=self.names[ends[0]])
            if ends[1][0] >= 0:
                made.set("joint2", self.names[ends[1]])
            made.set("polycoef", words(*moved.coef, *[0.0] * (5 - len(moved.coef))))
