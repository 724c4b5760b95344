"""Actuators on hinges and slides: motor, position, velocity, and general ones of the same form."""

from __future__ import annotations

import math
from dataclasses import replace

from ...model.parts import Dof, Motor
from ...model.presets import Actuator
from .compiled import Compiled
from .joints import Joints

KINDS = "motor, position and velocity actuators on hinge and slide joints are supported"


def read_actuators(compiled: Compiled, joints: Joints) -> dict[str, Actuator]:
    """Puts motors, dampers and armatures of actuators into the dofs; returns how to command them by name."""
    m = compiled.model
    found: dict[str, Actuator] = {}
    driven: set[int] = set()
    for i in range(m.nactuator if compiled.enabled("actuation") else 0):
        if 0 <= (group := int(m.actuator_group[i])) < 31 and int(m.opt.disableactuator) >> group & 1:
            continue
        reason = _reason(compiled, i, joints, driven)
        if reason:
            compiled.refuse("actuator", i, reason, "large")
            continue
        j = int(m.actuator_trnid[i, 0])
        driven.add(j)
        joint, k = joints.dof[j]
        actuator, dof = _drive(compiled, i, joint, k, joints.joints[joint].dofs[k])
        dofs = joints.joints[joint].dofs
        joints.joints[joint] = replace(joints.joints[joint], dofs=(*dofs[:k], dof, *dofs[k + 1 :]))
        found[compiled.name("actuator", i) or f"actuator_{i}"] = actuator
    _limit_undriven(compiled, joints, driven)
    return found


def _reason(compiled: Compiled, i: int, joints: Joints, driven: set[int]) -> str:
    """Why an actuator is not supported; empty if it is."""
    m, trn, dyn = compiled.model, compiled.mujoco.mjtTrn, compiled.mujoco.mjtDyn
    gain, bias = compiled.mujoco.mjtGain, compiled.mujoco.mjtBias
    j = int(m.actuator_trnid[i, 0])
    if int(m.actuator_trntype[i]) not in (trn.mjTRN_JOINT, trn.mjTRN_JOINTINPARENT):
        return f"an actuator that acts on no joint; {KINDS}"
    if j not in joints.dof:
        return f'an actuator on the ball or free joint "{compiled.name("jnt", j)}"; {KINDS}'
    if m.actuator_dyntype[i] != dyn.mjDYN_NONE:
        return f"an actuator with an internal state; {KINDS}"
    if m.actuator_gaintype[i] != gain.mjGAIN_FIXED or int(m.actuator_biastype[i]) not in (
        bias.mjBIAS_NONE, bias.mjBIAS_AFFINE
    ):  # fmt: skip
        return f"this law of force; {KINDS}"
    if j in driven:
        return f'a second actuator on the joint "{compiled.name("jnt", j)}"; put both laws into one'
    _, k, d = _bias(compiled, i)
    if k < 0 or d < 0:
        return "a force that grows with the position or speed"
    if m.actuator_gear[i, 0] == 0:
        return "gear 0"
    symmetric = m.actuator_forcerange[i, 0] == -m.actuator_forcerange[i, 1]
    if m.actuator_forcelimited[i] and not symmetric and (k > 0 or d > 0):
        return "a servo whose forcerange is not symmetric"
    if m.jnt_actfrclimited[j] and m.jnt_actfrcrange[j, 0] != -m.jnt_actfrcrange[j, 1]:
        return "an actuator on a joint whose actuatorfrcrange is not symmetric"
    return ""


def _bias(compiled: Compiled, i: int) -> tuple[float, float, float]:
    """b, k, d of the force gain * control + b - k length - d length'."""
    m = compiled.model
    if m.actuator_biastype[i] == compiled.mujoco.mjtBias.mjBIAS_NONE:
        return 0.0, 0.0, 0.0
    b, k, d = m.actuator_biasprm[i, :3].tolist()
    return b, -k, -d


def _drive(compiled: Compiled, i: int, joint: int, k: int, dof: Dof) -> tuple[Actuator, Dof]:
    """The motor of an actuator. With the gear G the effort on the joint is G (g c + b - k G q - d G q'), so a
    position motor has the gain G^2 k and the target (g c + b) / (G k), and a speed motor likewise with d."""
    m = compiled.model
    gear, gain = float(m.actuator_gear[i, 0]), float(m.actuator_gainprm[i, 0])
    b, spring, damper = _bias(compiled, i)
    lower, upper = _control_limits(compiled, i)
    largest = math.inf
    if m.actuator_forcelimited[i]:
        largest = abs(gear) * float(m.actuator_forcerange[i, 1])
    j = int(m.actuator_trnid[i, 0])
    if m.jnt_actfrclimited[j]:
        largest = min(largest, float(m.jnt_actfrcrange[j, 1]))
    if spring > 0:
        kind, per_force = "position", 1 / (gear * spring)
        gains = {"gain": gear * gear * spring, "damping_gain": gear * gear * damper}
    elif damper > 0:
        kind, per_force, gains = "speed", 1 / (gear * damper), {"gain": gear * gear * damper}
    else:
        kind, per_force, gains = "effort", gear, {}
        if m.actuator_forcelimited[i] and gain:  # the force is a function of the control alone: limit that
            ends = sorted((force - b) / gain for force in m.actuator_forcerange[i].tolist())
            lower, upper = max(lower, ends[0]), min(upper, ends[1])
        ends = [abs(gear * (gain * c + b)) for c in (lower, upper)] if gain else [abs(gear * b)]
        largest = min([x for x in (max(ends), float(m.jnt_actfrcrange[j, 1]) if m.jnt_actfrclimited[j] else 0)
                       if x > 0], default=math.inf)  # fmt: skip
    actuator = Actuator(joint, k, per_force * gain, per_force * b, lower, upper)
    damping = float(m.actuator_damping[i]) if compiled.enabled("damper") else 0.0
    return actuator, replace(
        dof,
        damping=dof.damping + gear * gear * damping,
        armature=dof.armature + gear * gear * float(m.actuator_armature[i]),
        motor=Motor(kind, actuator.target(0.0), largest, **gains),
    )


def _control_limits(compiled: Compiled, i: int) -> tuple[float, float]:
    m = compiled.model
    c = int(m.actuator_ctrladr[i])
    if not m.actuator_ctrllimited[c] or not compiled.enabled("clampctrl"):
        return -math.inf, math.inf
    lower, upper = m.actuator_ctrlrange[c].tolist()
    return lower, upper


def _limit_undriven(compiled: Compiled, joints: Joints, driven: set[int]) -> None:
    """Keeps the largest effort of joints without an actuator, URDF's <limit effort>, for motors set later."""
    m = compiled.model
    for j, (joint, k) in joints.dof.items():
        if j in driven or not m.jnt_actfrclimited[j] or m.jnt_actfrcrange[j, 1] <= 0:
            continue
        dofs = list(joints.joints[joint].dofs)
        dofs[k] = replace(dofs[k], motor=Motor(max_effort=float(m.jnt_actfrcrange[j, 1])))
        joints.joints[joint] = replace(joints.joints[joint], dofs=tuple(dofs))
