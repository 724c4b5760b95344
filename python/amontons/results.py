"""Types of what functions and properties return, for annotations: nobody has to make one."""

from typing import TYPE_CHECKING as _TYPE_CHECKING

from .lazy import later as _later
from .model.presets import Unread as Unread
from .simulation.events import ContactEvents as ContactEvents
from .simulation.forces import Effort as Effort
from .simulation.forces import Forces as Forces
from .simulation.forces import Instant as Instant
from .simulation.forces import Reaction as Reaction
from .simulation.kinematics import Kinematics as Kinematics
from .simulation.kinematics import RayHit as RayHit
from .simulation.rollout import Rollout as Rollout

if _TYPE_CHECKING:
    from .io import Lost as Lost
    from .simulation.derivative import Derivative as Derivative
    from .simulation.derivative import Pullback as Pullback
    from .simulation.derivative import StepGradient as StepGradient
    from .simulation.inverse_kinematics import IkSolution as IkSolution
    from .simulation.linearise import Linearisation as Linearisation
    from .simulation.loads import Loads as Loads
    from .simulation.tape import Gradient as Gradient
    from .studies.identify import Fit as Fit
else:
    _HOMES = {
        "Fit": "studies.identify",
        "Lost": "io",
        "Derivative": "simulation.derivative",
        "Pullback": "simulation.derivative",
        "StepGradient": "simulation.derivative",
        "IkSolution": "simulation.inverse_kinematics",
        "Linearisation": "simulation.linearise",
        "Loads": "simulation.loads",
        "Gradient": "simulation.tape",
    }
    __getattr__ = _later(__name__, _HOMES)

__all__ = [
    "ContactEvents",
    "Derivative",
    "Effort",
    "Fit",
    "Forces",
    "Gradient",
    "IkSolution",
    "Instant",
    "Kinematics",
    "Linearisation",
    "Loads",
    "Lost",
    "Pullback",
    "RayHit",
    "Reaction",
    "Rollout",
    "StepGradient",
    "Unread",
]
