"""Actuators on joints, tendons, sites and slider-cranks: affine laws, with or without an activation."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import Any

from ...model.drives import Actuator, Tendon, Transmission
from ...model.parts import Motor
from .bodies import Bodies
from .compiled import Compiled
from .joints import Joints
from .sites import site_frame

OTHER = "a drive of this kind; set forces in a callback"


def read_actuators(
    compiled: Compiled, bodies: Bodies, joints: Joints, tendons: list[Tendon], tendon_of: dict[int, int]
) -> tuple[list[Actuator], list[int]]:
    """The actuators, and MuJoCo's index of each; puts their dampers and armatures into dofs and tendons."""
    m = compiled.model
    reader = _Reader(compiled, bodies, joints, tendons, tendon_of)
    found: list[Actuator] = []
    ids: list[int] = []
    names = {compiled.name("actuator", i) for i in range(m.nactuator)}
    for i in range(m.nactuator if compiled.enabled("actuation") else 0):
        if 0 <= (group := int(m.actuator_group[i])) < 31 and int(m.opt.disableactuator) >> group & 1:
            continue
        actuator = reader.read(i)
        if isinstance(actuator, str):
            compiled.refuse("actuator", i, actuator, "large")
            continue
        name = compiled.name("actuator", i)
        if not name:
            name = f"actuator_{i}"
            while name in names:
                name += "_"
            names.add(name)
        found.append(replace(actuator, name=name))
        ids.append(i)
    reader.bound_sums()
    reader.limit_undriven()
    return found, ids


class _Reader:
    """Targets of actuators."""

    def __init__(
        self, compiled: Compiled, bodies: Bodies, joints: Joints, tendons: list[Tendon], of: dict[int, int]
    ) -> None:
        self.compiled, self.bodies, self.joints, self.tendons, self.tendon_of = (
            compiled, bodies, joints, tendons, of
        )  # fmt: skip
        m, trn = compiled.model, compiled.mujoco.mjtTrn
        self.on_joint = {int(trn.mjTRN_JOINT), int(trn.mjTRN_JOINTINPARENT)}
        self.of_joint = self._drives_of_joints()
        # How many act on each joint and tendon, whose limits of force are of the sum.
        self.drives = Counter(
            (int(m.actuator_trntype[i]) in self.on_joint, int(m.actuator_trnid[i, 0]))
            for i in range(m.nactuator)
        )

    def read(self, i: int) -> Actuator | str:
        """An actuator without its name, or why it is none."""
        m, c = self.compiled.model, self.compiled
        law = _law(c, i)
        if isinstance(law, str):
            return law
        moved = self._transmission(i)
        if isinstance(moved, str):
            return moved
        if _has_no_length(c, i):  # no bias of the length, as MuJoCo's length is zero
            law = {name: (p[0], 0.0, p[2]) for name, p in law.items()}
        self._add_drive(i, moved)
        if int(m.actuator_trntype[i]) not in self.on_joint and self._bounded_joint(i):
            what = "actuatorfrcrange of a joint does not bound what a tendon or site puts on it"
            self.compiled.refuse("actuator", i, what, "small")
        lower, upper = self._force_limits(i, moved.gear)
        limits = _control_limits(c, i)
        return Actuator(
            "", moved, **law, lower_force=lower, upper_force=upper, control=0.0, lower_control=limits[0],
            upper_control=limits[1], **_dynamics(c, i), early=bool(m.actuator_actearly[i]),
        )  # fmt: skip

    def _transmission(self, i: int) -> Transmission | str:
        m, trn = self.compiled.model, self.compiled.mujoco.mjtTrn
        kind, thing = int(m.actuator_trntype[i]), int(m.actuator_trnid[i, 0])
        gear = m.actuator_gear[i].tolist()
        if kind in self.on_joint:
            if thing in self.joints.dof:
                joint, dof = self.joints.dof[thing]
                return Transmission("dof", joint=joint, dof=dof, gear=gear[0])
            return self._whole_joint(thing, gear, in_parent=kind == trn.mjTRN_JOINTINPARENT)
        if kind == trn.mjTRN_TENDON:
            if thing not in self.tendon_of:
                return f'an actuator on the tendon "{self.compiled.name("tendon", thing)}", which is not read'
            return Transmission("tendon", tendon=self.tendon_of[thing], gear=gear[0])
        if kind not in (trn.mjTRN_SITE, trn.mjTRN_SLIDERCRANK):
            return OTHER
        body, frame = site_frame(self.compiled, self.bodies, thing)
        other = int(m.actuator_trnid[i, 1])
        there = {}
        if other >= 0:
            reference_body, reference = site_frame(self.compiled, self.bodies, other)
            there = {"reference_body": reference_body, "reference": reference}
        if kind == trn.mjTRN_SLIDERCRANK:
            rod = float(m.actuator_cranklength[i])
            return Transmission("slider_crank", body=body, frame=frame, **there, rod=rod, gear=gear[0])
        wrench = {"force": tuple(gear[:3]), "torque": tuple(gear[3:])}
        return Transmission("wrench", body=body, frame=frame, **there, **wrench, own_axes=other < 0)

    def _whole_joint(self, j: int, gear: list[float], *, in_parent: bool) -> Transmission | str:
        """Ball joint: a torque in the axes of the child or the parent, which takes the reaction. Free joint:
        a force in the axes of the world and a torque in those of the body or the world.
        """
        m, kinds = self.compiled.model, self.compiled.mujoco.mjtJoint
        own = int(m.jnt_bodyid[j])
        if m.jnt_type[j] == kinds.mjJNT_FREE:
            if any(gear[:3]) and any(gear[3:]) and not in_parent:
                return "a force and a torque on a free joint in different axes; use an actuator each"
            return Transmission(
                "wrench", body=self.bodies.at(own), frame=self.bodies.frame[own], force=tuple(gear[:3]),
                torque=tuple(gear[3:]), own_axes=any(gear[3:]) and not in_parent,
            )  # fmt: skip
        ours = self.bodies.at(own)
        joint = next((x for x in self.joints.joints if x.body_a == ours and x.spherical and not x.dofs), None)
        if joint is None:
            return "an actuator on a ball joint of a body with other joints"
        return Transmission(
            "wrench", body=joint.body_a, frame=joint.frame_a, reference_body=joint.body_b,
            reference=joint.frame_b, torque=tuple(gear[:3]), own_axes=not in_parent,
        )  # fmt: skip

    def _force_limits(self, i: int, gear: float) -> tuple[float, float]:
        """The limits of the actuator itself, within those of the joint or tendon that it acts on."""
        m = self.compiled.model
        lower, upper = (
            m.actuator_forcerange[i].tolist() if m.actuator_forcelimited[i] else (-math.inf, math.inf)
        )
        trn = self.compiled.mujoco.mjtTrn
        on_joint, thing = int(m.actuator_trntype[i]) in self.on_joint, int(m.actuator_trnid[i, 0])
        if on_joint and self._sums(thing):
            return lower, upper
        if on_joint and m.jnt_actfrclimited[thing] and thing in self.joints.dof and gear:
            ends = sorted(x / gear for x in m.jnt_actfrcrange[thing].tolist())
        elif m.actuator_trntype[i] == trn.mjTRN_TENDON and m.tendon_actfrclimited[thing]:
            ends = m.tendon_actfrcrange[thing].tolist()
        else:
            return lower, upper
        if self.drives[on_joint, thing] > 1:
            what = "actuatorfrcrange of what several actuators drive limits each of them, not their sum"
            self.compiled.refuse("actuator", i, what, "small")
        low, high = (min(max(x, ends[0]), ends[1]) for x in (lower, upper))
        return low, high

    def _bounded_joint(self, i: int) -> bool:
        """Whether an actuator that acts on no joint moves one whose effort is bounded."""
        m, kinds = self.compiled.model, self.compiled.mujoco.mjtWrap
        sites: list[int] = []
        joints: set[int] = set()
        if m.actuator_trntype[i] == self.compiled.mujoco.mjtTrn.mjTRN_TENDON:
            t = int(m.actuator_trnid[i, 0])
            for w in range(m.tendon_adr[t], m.tendon_adr[t] + m.tendon_num[t]):
                if m.wrap_type[w] == kinds.mjWRAP_JOINT:
                    joints.add(int(m.wrap_objid[w]))
                elif m.wrap_type[w] == kinds.mjWRAP_SITE:
                    sites.append(int(m.wrap_objid[w]))
        else:
            sites = [s for s in m.actuator_trnid[i].tolist() if s >= 0]
        for body in (int(m.site_bodyid[s]) for s in sites):
            while body > 0:
                joints.update(range(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body]))
                body = int(m.body_parentid[body])
        return any(m.jnt_actfrclimited[j] and not self._sums(j) for j in joints)

    def _drives_of_joints(self) -> dict[int, list[int]]:
        """The actuators on each hinge and slide, themselves or by a fixed tendon."""
        m, mujoco = self.compiled.model, self.compiled.mujoco
        found: dict[int, list[int]] = {}
        for i in range(m.nactuator):
            kind, thing = int(m.actuator_trntype[i]), int(m.actuator_trnid[i, 0])
            joints = [thing] if kind in self.on_joint else []
            if kind == mujoco.mjtTrn.mjTRN_TENDON:
                wraps = range(m.tendon_adr[thing], m.tendon_adr[thing] + m.tendon_num[thing])
                joints = [
                    int(m.wrap_objid[w]) for w in wraps if m.wrap_type[w] == mujoco.mjtWrap.mjWRAP_JOINT
                ]
            for j in joints:
                found.setdefault(j, []).append(i)
        return found

    def _sums(self, j: int) -> bool:
        """Whether the effort of a joint is bounded, and those of all that drives it do not depend on the
        motion, so that their sum can be."""
        drives = self.of_joint.get(j, [])
        if not self.compiled.model.jnt_actfrclimited[j] or j not in self.joints.dof or len(drives) < 1:
            return False
        alone = len(drives) == 1 and int(self.compiled.model.actuator_trntype[drives[0]]) in self.on_joint
        return not alone and all(_is_plain(_law(self.compiled, i)) for i in drives)

    def bound_sums(self) -> None:
        """Bounds the sum of efforts of those joints."""
        m = self.compiled.model
        for j, (joint, k) in self.joints.dof.items():
            if self._sums(j):
                lower, upper = m.jnt_actfrcrange[j].tolist()
                dofs = list(self.joints.joints[joint].dofs)
                dofs[k] = replace(dofs[k], lower_effort=lower, upper_effort=upper)
                self.joints.joints[joint] = replace(self.joints.joints[joint], dofs=tuple(dofs))

    def _add_drive(self, i: int, moved: Transmission) -> None:
        """Damping and armature of the actuator, along its length, as those of the dof or tendon: times the
        square of the gear."""
        m = self.compiled.model
        square = moved.gear * moved.gear
        added = {
            "damping": square * float(m.actuator_damping[i]) if self.compiled.enabled("damper") else 0.0,
            "armature": square * float(m.actuator_armature[i]),
        }
        if not any(added.values()):
            return
        if moved.kind == "tendon":
            self.tendons[moved.tendon] = _with(self.tendons[moved.tendon], added)
        elif moved.kind == "dof":
            joint = self.joints.joints[moved.joint]
            dofs = list(joint.dofs)
            dofs[moved.dof] = _with(dofs[moved.dof], added)
            self.joints.joints[moved.joint] = replace(joint, dofs=tuple(dofs))
        else:
            what = "damping and armature of an actuator that acts on neither a hinge, slide nor tendon"
            self.compiled.refuse("actuator", i, what, "small")

    def limit_undriven(self) -> None:
        """Keeps the largest effort of joints without actuators, URDF's <limit effort>, for later motors."""
        m = self.compiled.model
        for j, (joint, k) in self.joints.dof.items():
            if self.drives[True, j] or not m.jnt_actfrclimited[j] or m.jnt_actfrcrange[j, 1] <= 0:
                continue
            dofs = list(self.joints.joints[joint].dofs)
            dofs[k] = replace(dofs[k], motor=Motor(max_effort=float(m.jnt_actfrcrange[j, 1])))
            self.joints.joints[joint] = replace(self.joints.joints[joint], dofs=tuple(dofs))


def _with(thing: Any, added: dict[str, float]) -> Any:
    return replace(thing, **{name: getattr(thing, name) + value for name, value in added.items()})


def _has_no_length(compiled: Compiled, i: int) -> bool:
    """Whether MuJoCo gives the actuator no length: on a site alone, on a free joint."""
    m, trn, kinds = compiled.model, compiled.mujoco.mjtTrn, compiled.mujoco.mjtJoint
    kind, thing, other = int(m.actuator_trntype[i]), *map(int, m.actuator_trnid[i])
    if kind == trn.mjTRN_SITE:
        return other < 0
    return kind in (trn.mjTRN_JOINT, trn.mjTRN_JOINTINPARENT) and m.jnt_type[thing] == kinds.mjJNT_FREE


def _is_plain(law: dict[str, tuple[float, float, float]] | str) -> bool:
    """Whether an effort depends on its control alone."""
    return not isinstance(law, str) and not any((*law["gain"][1:], *law["bias"][1:]))


def _law(compiled: Compiled, i: int) -> dict[str, tuple[float, float, float]] | str:
    """Gain and bias, or why they are of another form."""
    m, gain, bias = compiled.model, compiled.mujoco.mjtGain, compiled.mujoco.mjtBias
    if m.actuator_ctrlnum[i] != 1 or m.actuator_outnum[i] != 1:
        return OTHER
    of_gain, of_bias = int(m.actuator_gaintype[i]), int(m.actuator_biastype[i])
    if of_gain not in (gain.mjGAIN_FIXED, gain.mjGAIN_AFFINE):
        return OTHER
    if of_bias not in (bias.mjBIAS_NONE, bias.mjBIAS_AFFINE):
        return OTHER
    dynamics = compiled.mujoco.mjtDyn
    known = (
        dynamics.mjDYN_NONE,
        dynamics.mjDYN_INTEGRATOR,
        dynamics.mjDYN_FILTER,
        dynamics.mjDYN_FILTEREXACT,
    )
    if int(m.actuator_dyntype[i]) not in known:
        return OTHER
    g, b = m.actuator_gainprm[i, :3].tolist(), m.actuator_biasprm[i, :3].tolist()
    return {
        "gain": (g[0], 0.0, 0.0) if of_gain == gain.mjGAIN_FIXED else tuple(g),
        "bias": (0.0, 0.0, 0.0) if of_bias == bias.mjBIAS_NONE else tuple(b),
    }


def _dynamics(compiled: Compiled, i: int) -> dict[str, Any]:
    m, kinds = compiled.model, compiled.mujoco.mjtDyn
    kind = int(m.actuator_dyntype[i])
    if kind == kinds.mjDYN_NONE:
        return {}
    found: dict[str, Any] = {"dynamics": "integrator" if kind == kinds.mjDYN_INTEGRATOR else "filter"}
    if found["dynamics"] == "filter":
        found["time_constant"] = max(0.0, float(m.actuator_dynprm[i, 0]))
    if m.actuator_actlimited[i]:
        found["lower_activation"], found["upper_activation"] = m.actuator_actrange[i].tolist()
    return found


def _control_limits(compiled: Compiled, i: int) -> tuple[float, float]:
    m = compiled.model
    c = int(m.actuator_ctrladr[i])
    if not m.actuator_ctrllimited[c] or not compiled.enabled("clampctrl"):
        return -math.inf, math.inf
    lower, upper = m.actuator_ctrlrange[c].tolist()
    return lower, upper
