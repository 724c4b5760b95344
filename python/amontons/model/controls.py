"""Controls of a model: their order, names and limits. Actuators come first, then the motors of all joints."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .. import _core
from ..checks import shown
from ..errors import InputError
from .coordinates import coordinate_name
from .drives import Actuator
from .parts import Joint

Places = Sequence[tuple[int, int, int]]
"""(actuator, joint, dof) of every control; actuator -1 is that of a motor"""


def control_names_of(core: _core.Model, actuators: Sequence[Actuator], joints: Sequence[Joint]) -> list[str]:
    """Names by index: of a motor that of its coordinate, with " motor" behind it where an actuator has it."""
    taken = {actuator.name for actuator in actuators}
    names = []
    for actuator, joint, dof in core.controls:
        if actuator >= 0:
            names.append(actuators[actuator].name)
        else:
            name = coordinate_name(joints[joint], dof)
            names.append(f"{name} motor" if name in taken else name)
    return names


def control_limits_of(
    core: _core.Model, actuators: Sequence[Actuator], joints: Sequence[Joint]
) -> tuple[tuple[float, float], ...]:
    """(lower, upper) by index, infinite without a bound; of an effort motor its largest effort."""
    limits = []
    for actuator, joint, dof in core.controls:
        if actuator >= 0:
            limits.append((actuators[actuator].lower_control, actuators[actuator].upper_control))
        else:
            motor = joints[joint].dofs[dof].motor
            most = motor.max_effort if motor.kind == "effort" else math.inf
            limits.append((-most, most))
    return tuple(limits)


def no_control(
    key: str, core: _core.Model, actuators: Sequence[Actuator], joints: Sequence[Joint], names: Sequence[str]
) -> InputError | None:
    """Message for a joint without a control; None if the name is not that of a joint."""
    index = next((j for j, joint in enumerate(joints) if joint.name == key), None)
    if index is None:
        return None
    if motors := [names[k] for k, (a, j, _) in enumerate(core.controls) if a < 0 and j == index]:
        return InputError(f'the motors of joint "{key}" have the controls {", ".join(motors)}; name one')
    by = [a.name for a in actuators if a.transmission.kind == "dof" and a.transmission.joint == index]
    if by:
        return InputError(f'joint "{key}" has no motor; the actuator "{by[0]}" drives it: give its name')
    return InputError(
        f'joint "{key}" has no motor; give it one by builder.set_motor({shown(key)}, Motor("position", '
        "kp=...)), or all joints of a URDF by load_model(path, motors=Motor(...)); forces without a motor "
        "are in simulation.state.joint_forces"
    )
