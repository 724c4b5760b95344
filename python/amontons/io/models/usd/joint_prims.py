"""Joints as prims of USD: UsdPhysics' kinds, with drives for motors and springs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np

from ....model.drives import Actuator
from ....model.model import Model
from ....model.orientations import quaternion_of
from ....model.parts import WORLD, Dof, Joint, Motor
from ....model.transforms import ORIGIN, Transform, rotation_to_z
from ..losses import Lost
from .joints import AXES, DEGREES
from .names import identifiers
from .shape_prims import attribute

SQUARE = 1e-9
"""How far axes may be from perpendicular to be those of one frame"""


@dataclass
class JointWriter:
    """Writes the joints of a model, and lists what of them UsdPhysics cannot say."""

    stage: Any
    model: Model
    bodies: list[Any]
    lost: list[Lost]

    def write(self, above: str) -> list[Any]:
        drives = self._servos()
        names = identifiers(joint.name for joint in self.model.joints)
        made = [
            self._joint(f"{above}/{name}", joint, [drives.get((j, d)) for d in range(len(joint.dofs))])
            for j, (name, joint) in enumerate(zip(names, self.model.joints, strict=True))
        ]
        if self.model.couplings:
            self.lost.append(Lost("model", f"{len(self.model.couplings)} couplings of coordinates", "large"))
        return made

    def _servos(self) -> dict[tuple[int, int], Motor]:
        """Actuators that a drive can be: servos of one coordinate that no other actuator moves."""
        found: dict[tuple[int, int], list[Actuator]] = {}
        for actuator in self.model.actuators:
            moved = actuator.transmission
            if moved.kind == "dof":
                found.setdefault((moved.joint, moved.dof), []).append(actuator)
            else:
                self.lost.append(Lost(f'actuator "{actuator.name}"', "what it moves is no joint", "large"))
        motors = {}
        for place, actuators in found.items():
            motor = _servo(actuators[0]) if len(actuators) == 1 else None
            if motor is None or self.model.joints[place[0]].dofs[place[1]].motor.kind != "none":
                for actuator in actuators:
                    self.lost.append(
                        Lost(f'actuator "{actuator.name}"', "its law is that of no drive", "large")
                    )
            else:
                motors[place] = motor
        return motors

    def _joint(self, path: str, joint: Joint, servos: list[Motor | None]) -> Any:
        who = f'joint "{joint.name}"'
        kind, turn, keys = _kind_of(joint)
        if kind == "Unknown":
            self.lost.append(Lost(who, "axes that are no axes of one frame", "large"))
        prim = self.stage.DefinePrim(path, f"Physics{'' if kind == 'Unknown' else kind}Joint")
        self._ends(prim, joint, turn)
        if joint.collide:
            prim.GetAttribute("physics:collisionEnabled").Set(True)
        if joint.closes_loop:
            prim.GetAttribute("physics:excludeFromArticulation").Set(True)
        if kind == "Distance":
            prim.GetAttribute("physics:minDistance").Set(joint.lower_distance)
            if math.isfinite(joint.upper_distance):
                prim.GetAttribute("physics:maxDistance").Set(joint.upper_distance)
        if kind in ("Revolute", "Prismatic", "Spherical"):
            prim.GetAttribute("physics:axis").Set("Z")
        if kind == "":
            self._locks(prim, joint, keys)
        if kind != "Unknown":
            for key, dof, servo in zip(keys, joint.dofs, servos, strict=True):
                self._dof(prim, who, key, dof, servo, kind)
        if joint.compliance:
            self.lost.append(Lost(who, "its compliance", "small"))
        if any((joint.ball_stiffness, joint.ball_damping, joint.ball_friction, joint.ball_armature)):
            self.lost.append(Lost(who, "spring, damping and friction of a ball joint", "small"))
        if math.isfinite(joint.ball_limit):
            self.lost.append(Lost(who, "the largest angle of a ball joint", "large"))
        return prim

    def _ends(self, prim: Any, joint: Joint, turn: Transform) -> None:
        """Body 1 follows body 0: they are our A and B."""
        from pxr import Gf

        for number, body, frame in ((0, joint.body_b, joint.frame_b), (1, joint.body_a, joint.frame_a)):
            if body != WORLD:
                prim.GetRelationship(f"physics:body{number}").SetTargets([self.bodies[body].GetPath()])
            at = frame @ turn
            prim.GetAttribute(f"physics:localPos{number}").Set(Gf.Vec3f(*at.position))
            prim.GetAttribute(f"physics:localRot{number}").Set(Gf.Quatf(*at.rotation))

    def _locks(self, prim: Any, joint: Joint, keys: list[str]) -> None:
        """In a general joint a low limit above the high one locks."""
        turns = {f"rot{axis}" for axis in AXES} if joint.spherical else set()
        for key in (f"{kind}{axis}" for kind in ("trans", "rot") for axis in AXES):
            if key not in keys and key not in turns:
                self._limit(prim, key, 1.0, -1.0)

    def _limit(self, prim: Any, key: str, low: float, high: float) -> None:
        from pxr import UsdPhysics

        limit = UsdPhysics.LimitAPI.Apply(prim, key)
        limit.CreateLowAttr(low)
        limit.CreateHighAttr(high)

    def _dof(self, prim: Any, who: str, key: str, dof: Dof, servo: Motor | None, kind: str) -> None:
        unit = DEGREES if dof.kind == "hinge" else 1.0
        if math.isfinite(dof.lower) or math.isfinite(dof.upper):
            low, high = unit * dof.lower, unit * dof.upper
            if kind:
                prim.GetAttribute("physics:lowerLimit").Set(low)
                prim.GetAttribute("physics:upperLimit").Set(high)
            else:
                self._limit(prim, key, low, high)
        if dof.friction or dof.armature:
            prim.AddAppliedSchema("PhysxJointAPI")
        if dof.friction:
            attribute(prim, "physxJoint:jointFriction", "Float", dof.friction)
        if dof.armature:
            attribute(prim, "physxJoint:armature", "Float", dof.armature)
        self._drive(prim, who, key, dof, servo, unit)

    def _drive(self, prim: Any, who: str, key: str, dof: Dof, servo: Motor | None, unit: float) -> None:
        """A motor, or the spring and damper where there is none: they are one law in UsdPhysics."""
        from pxr import UsdPhysics

        motor = dof.motor if dof.motor.kind != "none" else servo
        held = motor is None or (motor.kind == "effort" and not motor.control)
        if held and (dof.stiffness or dof.damping):
            motor = Motor("position", dof.rest, kp=dof.stiffness, kd=dof.damping) if dof.stiffness else None
            motor = motor or Motor("velocity", 0.0, kd=dof.damping)
        elif dof.stiffness or dof.damping:
            self.lost.append(Lost(who, "the spring and damper beside its motor", "small"))
        if motor is None:
            return
        if motor.kind != "effort" and not (motor.kp or motor.kd):
            self.lost.append(Lost(who, "a motor that follows its control exactly", "large"))
            return
        drive = UsdPhysics.DriveAPI.Apply(prim, key)
        drive.CreateTypeAttr("force")
        drive.CreateStiffnessAttr(motor.kp / unit)
        drive.CreateDampingAttr(motor.kd / unit)
        if math.isfinite(motor.max_effort):
            drive.CreateMaxForceAttr(motor.max_effort)
        if motor.kind == "position":
            drive.CreateTargetPositionAttr(unit * motor.control)
        elif motor.kind == "velocity":
            drive.CreateTargetVelocityAttr(unit * motor.control)


def _kind_of(joint: Joint) -> tuple[str, Transform, list[str]]:
    """The kind in USD, the frame of its axes in ours, and the name of each degree of freedom."""
    if joint.kind == "distance":
        return "Distance", ORIGIN, []
    dofs = joint.dofs
    if not dofs:
        return ("Spherical" if joint.spherical else "Fixed"), ORIGIN, []
    if len(dofs) == 1 and not joint.spherical:
        turn = Transform(dofs[0].anchor, rotation_to_z(dofs[0].axis))
        return ("Revolute", turn, ["angular"]) if dofs[0].kind == "hinge" else ("Prismatic", turn, ["linear"])
    return _general(joint)


def _general(joint: Joint) -> tuple[str, Transform, list[str]]:
    """Slides and then turns about x, y and z of one frame; Unknown where the axes are others."""
    hinges = [dof for dof in joint.dofs if dof.kind == "hinge"]
    slides = [dof for dof in joint.dofs if dof.kind == "slide"]
    anchors = {dof.anchor for dof in hinges} or {(0.0, 0.0, 0.0)}
    ordered = joint.dofs[: len(slides)] == tuple(slides)
    none = "Unknown", ORIGIN, []
    if not ordered or len(anchors) > 1 or max(len(hinges), len(slides)) > 3 or (joint.spherical and hinges):
        return none
    for frame in _frames([np.array(dof.axis) for dof in joint.dofs]):
        keys = _keys(joint.dofs, frame)
        turns = keys[len(slides) :]
        if len(set(keys)) == len(joint.dofs) and turns == sorted(turns):
            return "", Transform(anchors.pop(), quaternion_of(frame)), keys
    return none


def _keys(dofs: tuple[Dof, ...], frame: Any) -> list[str]:
    """Names of degrees of freedom along and about the axes of a frame; none if one has another axis."""
    keys = []
    for dof in dofs:
        k = int(np.argmax(frame.T @ np.array(dof.axis)))
        if np.abs(frame[:, k] - dof.axis).max() > SQUARE:
            return []
        keys.append(f"{'rot' if dof.kind == 'hinge' else 'trans'}{'XYZ'[k]}")
    return keys


def _frames(axes: list[Any]) -> Any:
    """Right-handed frames whose axes are the given ones, in any order."""
    kinds: list[Any] = []
    for axis in axes:
        if not any(np.abs(axis - kind).max() < SQUARE for kind in kinds):
            kinds.append(axis)
    if len(kinds) > 3:
        return
    gram = np.array(kinds) @ np.array(kinds).T - np.eye(len(kinds))
    if np.abs(gram).max() > SQUARE:
        return
    if len(kinds) == 1:
        kinds.append(np.cross(kinds[0], np.eye(3)[int(np.argmin(np.abs(kinds[0])))]))
        kinds[1] /= np.linalg.norm(kinds[1])
    if len(kinds) == 2:
        third = np.cross(kinds[0], kinds[1])
        choices = [[*kinds, third], [*kinds, -third]]
    else:
        choices = [kinds]
    for chosen in choices:
        for order in permutations(chosen):
            frame = np.array(order).T
            if np.linalg.det(frame) > 0:
                yield frame


def _servo(actuator: Actuator) -> Motor | None:
    """The same law as a motor; None where it has another one."""
    gear = actuator.transmission.gear
    g, b = actuator.gain, actuator.bias
    same = -actuator.lower_force == actuator.upper_force
    if actuator.dynamics != "none" or not same or not gear or g[1:] != (0.0, 0.0) or b[0]:
        return None
    most, kp, kd = abs(gear) * actuator.upper_force, -b[1] * gear**2, -b[2] * gear**2
    control = actuator.clipped(actuator.control)
    if kp > 0 and kd >= 0 and g[0] == -b[1]:
        return Motor("position", control / gear, max_effort=most, kp=kp, kd=kd)
    if kp == 0 and kd > 0 and g[0] == -b[2]:
        return Motor("velocity", control / gear, max_effort=most, kd=kd)
    if kp == kd == 0 and not control:
        return Motor("effort", 0.0, max_effort=most)
    return None
