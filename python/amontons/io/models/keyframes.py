"""Keyframes: states of MuJoCo's coordinates as states of ours."""

from __future__ import annotations

import numpy as np

from ...model.presets import Keyframe
from .bodies import Bodies
from .compiled import Compiled
from .joints import Joints


def read_keyframes(
    compiled: Compiled, bodies: Bodies, joints: Joints, actuators: list[int]
) -> tuple[Keyframe, ...]:
    """Keyframes in their order, called key_0 and so on for those without one."""
    m, mujoco = compiled.model, compiled.mujoco
    found: list[Keyframe] = []
    data = mujoco.MjData(m)
    for k in range(m.nkey):
        mujoco.mj_resetDataKeyframe(m, data, k)
        mujoco.mj_kinematics(m, data)
        mujoco.mj_comPos(m, data)
        mujoco.mj_comVel(m, data)
        name = compiled.name("key", k) or f"key_{k}"
        found.append(_keyframe(name, compiled, data, bodies, joints, actuators))
    return tuple(found)


def _keyframe(
    name: str, compiled: Compiled, data: object, bodies: Bodies, joints: Joints, actuators: list[int]
) -> Keyframe:
    m, mujoco = compiled.model, compiled.mujoco
    kept = [i for i in bodies.index if i > 0]
    velocity = np.zeros((len(kept), 6))  # angular, linear
    for row, body in zip(velocity, kept, strict=True):
        mujoco.mj_objectVelocity(m, data, mujoco.mjtObj.mjOBJ_XBODY, body, row, 0)
    first = np.cumsum([0, *(len(joint.dofs) for joint in joints.joints)])
    coordinates = np.zeros(first[-1])
    for j, (joint, dof) in joints.dof.items():
        coordinates[first[joint] + dof] = data.qpos[m.jnt_qposadr[j]]
    for j, joint in joints.free.items():
        coordinates[first[joint] : first[joint] + 3] = data.qpos[m.jnt_qposadr[j] : m.jnt_qposadr[j] + 3]
    address = [int(a) for a in m.actuator_actadr]
    orientations = data.xquat[kept] / np.linalg.norm(data.xquat[kept], axis=1, keepdims=True)
    return Keyframe(
        name,
        float(data.time),
        _rows(data.xpos[kept]),
        _rows(orientations),
        _rows(velocity[:, 3:]),
        _rows(velocity[:, :3]),
        tuple(coordinates.tolist()),
        tuple(float(data.ctrl[m.actuator_ctrladr[i]]) for i in actuators),
        tuple(float(data.act[address[i]]) if address[i] >= 0 else 0.0 for i in actuators),
    )


def _rows(array: np.ndarray) -> tuple:
    return tuple(map(tuple, array.tolist()))
