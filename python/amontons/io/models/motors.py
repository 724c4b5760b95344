"""Motors for the joints of a URDF, which tells only how strong they may be."""

from __future__ import annotations

from dataclasses import replace

from ...checks import changed, shown
from ...errors import InputError
from ...model.model import Model
from ...model.parts import Joint, Motor


def checked_motor(motors: object) -> Motor:
    if not isinstance(motors, Motor) or motors.kind == "none":
        raise InputError(
            f'load_model: motors is {shown(motors)}; give a Motor, as Motor("position", kp=100, kd=10)'
        )
    return motors


def with_motors(model: Model, motor: Motor) -> Model:
    """The model with a motor on every joint, but those that follow another one (<mimic>).

    The largest effort is motor.max_effort or <limit effort> of the joint, whichever is smaller.
    """
    follow = {(c.joint_a, c.dof_a) for c in model.couplings}
    joints = (_driven(joint, j, motor, follow) for j, joint in enumerate(model.joints))
    return replace(model, joints=tuple(joints))


def _driven(joint: Joint, j: int, motor: Motor, follow: set[tuple[int, int]]) -> Joint:
    if joint.spherical:  # a base that moves freely
        return joint
    dofs = []
    for k, dof in enumerate(joint.dofs):
        most = min(motor.max_effort, dof.motor.max_effort)
        driven = (j, k) not in follow
        dofs.append(replace(dof, motor=replace(motor, max_effort=most)) if driven else dof)
    return changed(joint, dofs=tuple(dofs))
