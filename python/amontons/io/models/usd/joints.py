"""Joints of USD: UsdPhysics' kinds, and the general one of six degrees of freedom."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....model.builder import ModelBuilder
from ....model.parts import WORLD, Dof, Joint, Motor
from ....model.transforms import ORIGIN, Transform, Vector3
from .shapes import TO_AXIS
from .stage import Scene, applied, quaternion

AXES: dict[str, Vector3] = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
KINDS = ("Fixed", "Revolute", "Prismatic", "Spherical", "Distance", "")
DEGREES = 180 / math.pi
FREE = 1e30
"""Limits that are no limits: files write the largest number that there is"""


@dataclass
class Joints:
    """Reads joints into a builder whose bodies are there, by the path of their prims."""

    scene: Scene
    builder: ModelBuilder
    bodies: dict[str, int]
    made: dict[str, tuple[int, dict[str, int]]]
    """by the path of the prim: the joint, and its degree of freedom by the name in USD"""

    def read(self, prim: Any, name: str) -> None:
        scene = self.scene
        kind = str(prim.GetTypeName()).removeprefix("Physics").removesuffix("Joint")
        if kind not in KINDS:
            scene.refuse(prim, "this kind of joint", "large")
            return
        if not scene.get(prim, "physics:jointEnabled", True):
            scene.pass_over(prim)
            return
        (b, frame_b), (a, frame_a) = (self._end(prim, number) for number in (0, 1))
        if a == b:
            if a != WORLD:
                scene.refuse(prim, "a joint whose two ends are parts of one body", "none")
            scene.pass_over(prim)
            return
        if all(self.builder.is_fixed(end) for end in (a, b)):
            scene.pass_over(prim)
            return
        swapped = self.builder.is_fixed(a)
        if swapped:  # the first body of a joint moves
            a, b, frame_a, frame_b = b, a, frame_b, frame_a
        if float(scene.get(prim, "physics:breakForce", math.inf)) < FREE:
            scene.refuse(prim, "breakForce: joints do not break")
        with scene.told(prim):
            self._fields(prim, kind, name, Joint(name, "chain", a, b, frame_a, frame_b), swapped)

    def _fields(self, prim: Any, kind: str, name: str, joint: Joint, swapped: bool) -> None:
        scene, sign = self.scene, -1.0 if swapped else 1.0
        fields: dict[str, Any] = {
            "collide": bool(scene.get(prim, "physics:collisionEnabled", False)),
            "closes_loop": bool(scene.get(prim, "physics:excludeFromArticulation", False)),
        }
        dofs: dict[str, Dof] = {}
        if kind == "Distance":
            fields |= {"kind": "distance", **self._distances(prim)}
        elif kind in ("Revolute", "Prismatic"):
            dofs = self._one(prim, kind, sign)
        elif kind == "Spherical":
            fields |= {"spherical": True, **self._cone(prim)}
            turn = Transform(rotation=TO_AXIS[self._axis(prim)])
            fields |= {"frame_a": joint.frame_a @ turn, "frame_b": joint.frame_b @ turn}
        elif kind == "":
            dofs = self._six(prim, sign)
            free = [key for key in dofs if key.startswith("rot")]
            if len(free) == 3 and all(_plain(dofs[key]) for key in free):
                dofs = {key: dof for key, dof in dofs.items() if key not in free}
                fields["spherical"] = True
            if len(dofs) == 3 and fields.get("spherical") and all(map(_plain, dofs.values())):
                return  # it holds nothing
        if swapped:
            dofs = dict(reversed(dofs.items()))
        made = Joint(**{**vars(joint), "dofs": tuple(dofs.values()), **fields})
        index = self.builder.add_joint(made)
        self.made[str(prim.GetPath())] = index, {key: k for k, key in enumerate(dofs)}

    def _end(self, prim: Any, number: int) -> tuple[int, Transform]:
        """The body and the frame in it of one end; without a body it is the world."""
        scene = self.scene
        at = np.array(scene.get(prim, f"physics:localPos{number}", (0, 0, 0)), dtype=np.float64)
        turn = scene.get(prim, f"physics:localRot{number}")
        rotation = ORIGIN.rotation if turn is None else quaternion(turn)
        targets = scene.targets(prim, f"physics:body{number}")
        if not targets:
            world = Transform((0.0, 0.0, 0.0), scene.upright)
            return WORLD, world @ Transform(tuple((scene.metre * at).tolist()), rotation)
        frame, scale = scene.frame(targets[0])
        local = Transform(tuple((scene.metre * scale * at).tolist()), rotation)
        body = self._carrier(targets[0])
        return body, self.builder.pose(body).inverse() @ frame @ local

    def _carrier(self, prim: Any) -> int:
        while prim and not prim.IsPseudoRoot():
            if str(prim.GetPath()) in self.bodies:
                return self.bodies[str(prim.GetPath())]
            prim = prim.GetParent()
        return WORLD

    def _axis(self, prim: Any) -> str:
        axis = str(self.scene.get(prim, "physics:axis", "X"))
        if axis not in AXES:
            raise self.scene.error(prim, f'physics:axis = "{axis}"; it must be X, Y or Z')
        return axis

    def _one(self, prim: Any, kind: str, sign: float) -> dict[str, Dof]:
        turns = kind == "Revolute"
        unit = 1 / DEGREES if turns else self.scene.metre
        bounds = (
            float(self.scene.get(prim, f"physics:{end}Limit", default))
            for end, default in (("lower", -math.inf), ("upper", math.inf))
        )
        key = "angular" if turns else "linear"
        return {
            key: self._dof(prim, key, self._axis(prim), turns, tuple(unit * _far(x) for x in bounds), sign)
        }

    def _six(self, prim: Any, sign: float) -> dict[str, Dof]:
        """Those that no limit locks: slides along x, y and z, then turns about x, y and z."""
        found = {}
        for kind in ("trans", "rot"):
            for axis in AXES:
                key = f"{kind}{axis}"
                unit = 1 / DEGREES if kind == "rot" else self.scene.metre
                lower = float(self.scene.get(prim, f"limit:{key}:physics:low", -math.inf))
                upper = float(self.scene.get(prim, f"limit:{key}:physics:high", math.inf))
                if lower > upper or lower == upper == 0:
                    continue
                bounds = unit * _far(lower), unit * _far(upper)
                found[key] = self._dof(prim, key, axis, kind == "rot", bounds, sign)
        return found

    def _dof(
        self, prim: Any, key: str, axis: str, turns: bool, limits: tuple[float, ...], sign: float
    ) -> Dof:
        lower, upper = limits
        if lower > upper:
            self.scene.refuse(prim, f"the lower limit {lower:g} is above {upper:g}; it moves without limits")
            lower, upper = -math.inf, math.inf
        direction = tuple(sign * x for x in AXES[axis])
        k, m = self.scene.kilogram, self.scene.metre
        force = k * m**2 if turns else k * m
        number = self.scene.number
        limit = f"limit:{key}" if key[:3] in ("tra", "rot") else f"physxLimit:{key}"
        if number(prim, f"{limit}:stiffness") > 0 or number(prim, f"physxLimit:{key}:stiffness") > 0:
            self.scene.refuse(prim, "limits that yield; they are hard here")
        return Dof(
            "hinge" if turns else "slide",
            direction,  # type: ignore[arg-type]
            lower=lower,
            upper=upper,
            friction=max(number(prim, "physxJoint:jointFriction"), 0.0) * force,
            armature=max(number(prim, "physxJoint:armature"), 0.0) * (k * m**2 if turns else k),
            motor=self._drive(prim, key, turns, force),
        )

    def _drive(self, prim: Any, key: str, turns: bool, force: float) -> Motor:
        """force = stiffness (target - q) + damping (target speed - q'), at most maxForce."""
        if f"PhysicsDriveAPI:{key}" not in applied(prim):
            return Motor()
        get = self.scene.get
        said = {
            name: float(get(prim, f"drive:{key}:physics:{name}", default))
            for name, default in (
                ("stiffness", 0.0), ("damping", 0.0), ("targetPosition", 0.0), ("targetVelocity", 0.0),
                ("maxForce", math.inf),
            )
        }  # fmt: skip
        unit = 1 / DEGREES if turns else self.scene.metre
        gain = force / unit
        stiffness, damping = gain * said["stiffness"], gain * said["damping"]
        position, speed = unit * said["targetPosition"], unit * said["targetVelocity"]
        if str(get(prim, f"drive:{key}:physics:type", "force")) == "acceleration" and (stiffness or damping):
            self.scene.refuse(prim, f"drive:{key}: gains of an acceleration; they are those of a force here")
        most = said["maxForce"] * force
        most = most if 0 < most < FREE else math.inf
        if stiffness > 0:
            control = position + damping * speed / stiffness
            return Motor("position", control, max_effort=most, kp=stiffness, kd=damping)
        if damping > 0:
            return Motor("velocity", speed, max_effort=most, kd=damping)
        return Motor("effort", 0.0, max_effort=most)

    def _distances(self, prim: Any) -> dict[str, float]:
        """m; negative ones in the file are no bounds."""
        low, high = (float(self.scene.get(prim, f"physics:{end}Distance", -1.0)) for end in ("min", "max"))
        metre = self.scene.metre
        return {
            "lower_distance": metre * max(low, 0.0),
            "upper_distance": metre * high if 0 <= high < FREE else math.inf,
        }

    def _cone(self, prim: Any) -> dict[str, float]:
        angles = [float(self.scene.get(prim, f"physics:coneAngle{k}Limit", -1.0)) for k in (0, 1)]
        if any(0 <= angle < 180 for angle in angles):
            self.scene.refuse(
                prim, f"a cone of {angles[0]:g} and {angles[1]:g} degrees; the joint turns freely"
            )
        return {}

    def couple(self, prim: Any) -> None:
        """PhysX's mimic: q + gearing q_other + offset = 0."""
        for schema in applied(prim):
            if not schema.startswith("PhysxMimicJointAPI:"):
                continue
            key = schema.partition(":")[2]
            base = f"physxMimicJoint:{key}"
            other = self.scene.targets(prim, f"{base}:referenceJoint")
            own = self.made.get(str(prim.GetPath()))
            lead = self.made.get(str(other[0].GetPath())) if other else None
            if own is None or lead is None:
                self.scene.refuse(prim, "a mimic of a joint that is not there", "large")
                continue
            gearing = self.scene.number(prim, f"{base}:gearing", 1.0)
            offset = self.scene.number(prim, f"{base}:offset")
            unit = 1 / DEGREES if key.startswith("rot") else self.scene.metre
            self.scene.get(prim, f"{base}:referenceJointAxis")
            coefficients = (-offset * unit, -gearing)
            self.builder.add_coupling(own[0], lead[0], coefficients=coefficients)


def _plain(dof: Dof) -> bool:
    """Whether it is free: without limits, drive, friction."""
    return dof == Dof(dof.kind, dof.axis)


def _far(value: float) -> float:
    return math.copysign(math.inf, value) if abs(value) >= FREE else value
