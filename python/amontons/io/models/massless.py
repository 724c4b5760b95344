"""Links of a URDF without mass between two joints: no bodies, and their joints are one with several parts.

Writers of URDF, which has joints with one degree of freedom, make such links for joints that have more.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ...checks import listed
from ...model.model import Model
from ...model.parts import Coupling, Dof, Joint
from ...model.transforms import Transform, rotate
from .issues import Issues

STAND_IN = 1e-6
"""kg, kg m^2: what MuJoCo's compiler gets for them; the model has no trace of it"""
MOST = 6
"""Degrees of freedom of a joint"""


def stand_in(spec: Any, issues: Issues) -> frozenset[str]:
    """Gives such links a mass for the compiler. Returns their names."""
    found: list[str] = []
    parts: dict[str, int] = {}
    for body in spec.bodies[1:]:
        above = parts.get(body.parent.name, 0) if body.parent.name in found else 0
        parts[body.name] = above + len(list(body.joints))
        if _is_between(body) and parts[body.name] < MOST:
            body.explicitinertial, body.mass = True, STAND_IN
            body.fullinertia = [STAND_IN] * 3 + [0.0] * 3
            found.append(body.name)
    if found:
        issues.notes.append(
            "links without mass between two joints are no bodies, and the joints one with several parts: "
            + listed([f'"{name}"' for name in found])
        )
    return frozenset(found)


def _is_between(body: Any) -> bool:
    """Whether a link has no mass, hangs on a joint and holds one, and no more."""
    children = list(body.bodies)
    weighs = body.explicitinertial and body.mass > 0
    plain = _turns(body) and len(children) == 1 and _turns(children[0])
    return bool(plain and not weighs and not list(body.geoms) and body.name)


def _turns(body: Any) -> bool:
    """Whether it has joints, hinges and slides only."""
    joints = list(body.joints)
    return bool(joints) and all(str(joint.type).endswith(("HINGE", "SLIDE")) for joint in joints)


def without_massless(model: Model, names: frozenset[str]) -> Model:
    """The model without these bodies, each of which hangs on one joint and holds one."""
    for name in sorted(names):
        model = _without(model, model.body_index(name))
    return model


def _without(model: Model, body: int) -> Model:
    joints = list(model.joints)
    (upper,) = (k for k, joint in enumerate(joints) if joint.body_a == body)
    (lower,) = (k for k, joint in enumerate(joints) if joint.body_b == body)
    shift = len(joints[upper].dofs)
    joints[lower] = _in_a_row(joints[upper], joints[lower])

    def place(index: int) -> int:
        return index - (index > body)

    def end(joint: int, dof: int) -> tuple[int, int]:
        if joint == lower:
            dof += shift
        joint = lower if joint == upper else joint
        return joint - (joint > upper), dof

    def coupling(each: Coupling) -> Coupling:
        (joint_a, dof_a), (joint_b, dof_b) = end(each.joint_a, each.dof_a), end(each.joint_b, each.dof_b)
        if each.joint_b < 0:
            joint_b, dof_b = each.joint_b, each.dof_b
        return replace(each, joint_a=joint_a, dof_a=dof_a, joint_b=joint_b, dof_b=dof_b)

    moved = [
        replace(joint, body_a=place(int(joint.body_a)), body_b=place(int(joint.body_b)))  # type: ignore[arg-type]
        for k, joint in enumerate(joints)
        if k != upper
    ]
    return replace(
        model,
        bodies=tuple(each for k, each in enumerate(model.bodies) if k != body),
        joints=tuple(moved),
        couplings=tuple(map(coupling, model.couplings)),
        geoms=tuple(replace(geom, body=place(geom.body)) for geom in model.geoms),
        links=tuple(replace(link, body=place(link.body)) for link in model.links),
        visuals=tuple(replace(v, body=place(v.body)) for v in model.visuals if v.body != body),
        excluded_bodies=tuple((place(a), place(b)) for a, b in model.excluded_bodies if body not in (a, b)),
    )


def _in_a_row(upper: Joint, lower: Joint) -> Joint:
    """The motion by the upper joint, then by the lower one, as one joint.

    With the motions M of both, the lower body is at B_u M_u T M_l A_l^-1 in that which carries the upper one.
    T = A_u^-1 B_l stands in the body between them, and T M_l = (T M_l T^-1) T: the axes of the lower joint
    move by T.
    """
    between = upper.frame_a.inverse() @ lower.frame_b
    dofs = (*_named(upper), *(_seen(dof, between) for dof in _named(lower)))
    return replace(
        lower,
        name=f"{upper.name}+{lower.name}",
        body_b=upper.body_b,
        link_b=upper.link_b,
        frame_a=lower.frame_a @ between.inverse(),
        frame_b=upper.frame_b,
        dofs=dofs,
    )


def _named(joint: Joint) -> list[Dof]:
    """Its degrees of freedom, which keep the names of their coordinates."""
    return [replace(dof, name=dof.name or joint.name) for dof in joint.dofs]


def _seen(dof: Dof, frame: Transform) -> Dof:
    return replace(dof, axis=rotate(frame.rotation, dof.axis), anchor=frame(dof.anchor))
