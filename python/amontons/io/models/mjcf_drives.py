"""Tendons, actuators, motors and couplings of a model as elements of MJCF."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree as ET

from numpy.polynomial import Polynomial

from ...model import shapes
from ...model.drives import Actuator, PathElement, Tendon, Transmission
from ...model.parts import WORLD, Coupling, Motor
from ...model.transforms import ORIGIN
from .mjcf_draft import Draft, placed, ranged, words


def write_tendons(draft: Draft) -> None:
    for index, tendon in enumerate(draft.model.tendons):
        if tendon.closed or any(stop.turns for stop in tendon.path):
            draft.lose(f'tendon "{tendon.name}"', "a belt, or full turns around a drum")
            continue
        made = ET.SubElement(
            draft.sections["tendon"], "spatial" if tendon.path else "fixed", name=tendon.name
        )
        for k, stop in enumerate(tendon.path):
            _stop(draft, made, stop, f"{tendon.name} {k}")
        for term in tendon.terms:
            joint = draft.names.get((int(term.joint), term.dof), "")
            ET.SubElement(made, "joint", joint=joint, coef=words(term.coefficient))
        _properties(made, tendon)
        if tendon.lower == tendon.upper:
            start = float(draft.trees.lengths[index])
            draft.hold("tendon", tendon.name, tendon.lower - start)


def _stop(draft: Draft, made: ET.Element, stop: PathElement, name: str) -> None:
    body = int(stop.body)  # type: ignore[arg-type]
    if stop.kind == "pulley":
        ET.SubElement(made, "pulley", divisor=words(stop.divisor))
    elif stop.kind == "point":
        ET.SubElement(made, "site", site=draft.site(body, stop.frame, name))
    else:
        around = ET.SubElement(made, "geom", geom=_obstacle(draft, body, stop, name))
        if stop.side is not None:
            side = draft.point(int(stop.side_body), stop.side, f"{name} side")  # type: ignore[arg-type]
            around.set("sidesite", side)


def _obstacle(draft: Draft, body: int, stop: PathElement, name: str) -> str:
    """The geom that a tendon goes around: one that is there, or a new one that touches nothing."""
    kind = shapes.Sphere if stop.kind == "sphere" else shapes.Cylinder
    for geom in draft.model.geoms:
        solid: Any = geom.shape
        there = (geom.body, geom.frame) == (body, stop.frame)
        if there and isinstance(solid, kind) and solid.radius == stop.radius:
            return geom.name
    taken = {geom.name for geom in draft.model.geoms}
    while name in taken:
        name += "_"
    made = ET.SubElement(
        draft.at(body)[0], "geom", name=name, type=stop.kind, contype="0", conaffinity="0", group="3"
    )
    # The length of a cylinder has no meaning for a tendon.
    made.set("size", words(stop.radius, *([stop.radius] if stop.kind == "cylinder" else [])))
    placed(made, stop.frame)
    return name


def _properties(made: ET.Element, tendon: Tendon) -> None:
    made.set("springlength", words(tendon.rest_lower, tendon.rest_upper))
    for key, value in (
        ("stiffness", tendon.stiffness), ("damping", tendon.damping),
        ("frictionloss", tendon.friction), ("armature", tendon.armature),
    ):  # fmt: skip
        made.set(key, words(value))
    ranged(made, "range", tendon.lower, tendon.upper)


def write_drives(draft: Draft) -> None:
    """Actuators, then the motors of all joints: the order of the controls."""
    model, section = draft.model, draft.sections["actuator"]
    for index, actuator in enumerate(model.actuators):
        made = ET.Element("general", name=actuator.name)
        if not _moves(draft, made, actuator):
            draft.lose(f'actuator "{actuator.name}"', "what it moves")
            continue
        _law(made, actuator)
        if actuator.control or actuator.activation:
            draft.lose(f'actuator "{actuator.name}"', "its initial control", "small")
        section.append(made)
        draft.drives[index, -1, 0] = made
    for (j, d), name in sorted(draft.names.items()):
        if d >= 0:
            _motor(draft, j, d, name, model.joints[j].dofs[d].motor)


def _moves(draft: Draft, made: ET.Element, actuator: Actuator) -> bool:
    """Sets what an actuator moves; False where MJCF has no words for it."""
    moved = actuator.transmission
    made.set("gear", words(moved.gear))
    if moved.kind == "dof":
        if (moved.joint, moved.dof) not in draft.names:
            return False
        made.set("joint", draft.names[moved.joint, moved.dof])
        return True
    if moved.kind == "tendon":
        name = draft.model.tendons[moved.tendon].name
        made.set("tendon", name)
        return any(element.get("name") == name for element in draft.sections["tendon"])
    body, other = int(moved.body), int(moved.reference_body)  # type: ignore[arg-type]
    if moved.kind == "slider_crank":
        made.set("cranksite", draft.site(body, moved.frame, f"{actuator.name} crank"))
        made.set("slidersite", draft.site(other, moved.reference, f"{actuator.name} slider"))
        made.set("cranklength", words(moved.rod))
        return True
    made.set("gear", words(*moved.force, *moved.torque))
    has_length = actuator.gain[1] or actuator.bias[1]
    if moved.own_axes and (ball := _ball(draft, moved)):
        made.set("joint", ball)
        made.set("gear", words(moved.torque))
        return True
    if not has_length and (free := _free(draft, moved)):
        made.set("joint" if moved.own_axes or not any(moved.torque) else "jointinparent", free)
        return True
    # In axes of its own MuJoCo's actuator has no length, and its reaction is on the world.
    if moved.own_axes and (has_length or (other, moved.reference) != (-1, ORIGIN)):
        return False
    made.set("site", draft.site(body, moved.frame, f"{actuator.name} site"))
    if not moved.own_axes:
        made.set("refsite", draft.site(other, moved.reference, f"{actuator.name} reference"))
    return True


def _ball(draft: Draft, moved: Transmission) -> str:
    """The ball joint between the two frames of a torque, if there is one."""
    for (j, d), name in draft.names.items():
        joint = draft.model.joints[j]
        ends = (joint.body_a, joint.frame_a, joint.body_b, joint.frame_b)
        acts_on = (moved.body, moved.frame, moved.reference_body, moved.reference)
        if d < 0 and not any(moved.force) and not joint.dofs and ends == acts_on:
            return name
    return ""


def _free(draft: Draft, moved: Transmission) -> str:
    """The free joint that a force on the frame of a body is one of; its forces are in axes of the world."""
    at_frame = (moved.frame, moved.reference_body, moved.reference) == (ORIGIN, WORLD, ORIGIN)
    if not at_frame or (moved.own_axes and any(moved.force)):
        return ""
    with_parts = {j for j, _ in draft.names}
    found = (n for n, (body, j) in draft.placed.items() if body == moved.body and j not in with_parts)
    return next(found, "")


def _law(made: ET.Element, actuator: Actuator) -> None:
    made.set("gaintype", "affine" if any(actuator.gain[1:]) else "fixed")
    made.set("gainprm", words(actuator.gain))
    made.set("biastype", "affine")
    made.set("biasprm", words(actuator.bias))
    ranged(made, "forcerange", actuator.lower_force, actuator.upper_force)
    ranged(made, "ctrlrange", actuator.lower_control, actuator.upper_control)
    if actuator.dynamics != "none":
        made.set("dyntype", {"filter": "filterexact"}.get(actuator.dynamics, actuator.dynamics))
        made.set("dynprm", words(max(actuator.time_constant, 1e-9)))
        ranged(made, "actrange", actuator.lower_activation, actuator.upper_activation)
    if actuator.early:
        made.set("actearly", "true")


def _motor(draft: Draft, j: int, d: int, name: str, motor: Motor) -> None:
    if motor.kind == "none":
        return
    if motor.kind != "effort" and not (motor.kp or motor.kd):
        draft.lose(f'joint "{name}"', "a motor that follows its control exactly")
        return
    gain = {"effort": 1.0, "position": motor.kp, "velocity": motor.kd}[motor.kind]
    taken = {made.get("name") for made in draft.sections["actuator"]}
    made = ET.SubElement(
        draft.sections["actuator"], "general", name=f"{name} motor" if name in taken else name, joint=name,
        gainprm=words(gain), biastype="affine", biasprm=words(0, -motor.kp, -motor.kd),
    )  # fmt: skip
    ranged(made, "forcerange", -motor.max_effort, motor.max_effort)
    draft.drives[-1, j, d] = made
    if motor.control:
        draft.lose(f'motor of "{name}"', "its initial control", "small")


def write_couplings(draft: Draft) -> None:
    for coupling in draft.model.couplings:
        if len(coupling.coefficients) > 5:
            draft.lose(f'coupling "{coupling.name}"', "a polynomial of a degree above 4")
        elif coupling.tendon_a >= 0 or coupling.tendon_b >= 0:
            _of_tendons(draft, coupling)
        else:
            _of_joints(draft, coupling)


def _of_joints(draft: Draft, coupling: Coupling) -> None:
    ends = [(coupling.joint_a, coupling.dof_a), (coupling.joint_b, coupling.dof_b)]
    if ends[0] not in draft.names or (ends[1][0] >= 0 and ends[1] not in draft.names):
        draft.lose(f'coupling "{coupling.name}"', "a coupling of joints that are none here")
        return
    start = draft.trees.start
    starts = [float(start[j][d]) if j >= 0 else 0.0 for j, d in ends]
    names = [draft.names[end] for end in ends if end[0] >= 0]
    _polynomial(draft, coupling, "joint", names, starts)


def _of_tendons(draft: Draft, coupling: Coupling) -> None:
    ends = [coupling.tendon_a, coupling.tendon_b]
    written = {element.get("name") for element in draft.sections["tendon"]}
    names = [draft.model.tendons[t].name for t in ends if t >= 0]
    mixed = coupling.tendon_a < 0 or coupling.joint_b >= 0
    if mixed or not written.issuperset(names):
        draft.lose(f'coupling "{coupling.name}"', "a coupling of a tendon with a joint or a lost tendon")
        return
    lengths = draft.trees.lengths
    _polynomial(draft, coupling, "tendon", names, [float(lengths[t]) if t >= 0 else 0.0 for t in ends])


def _polynomial(draft: Draft, coupling: Coupling, tag: str, names: list[str], starts: list[float]) -> None:
    """MuJoCo's polynomial is one of the displacements from the start."""
    moved = Polynomial(coupling.coefficients)(Polynomial([starts[1], 1.0])) - starts[0]
    made = ET.SubElement(draft.sections["equality"], tag)
    if coupling.name:
        made.set("name", coupling.name)
    for k, name in enumerate(names, 1):
        made.set(f"{tag}{k}", name)
    made.set("polycoef", words(*moved.coef, *[0.0] * (5 - len(moved.coef))))
