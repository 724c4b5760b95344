"""The state of a simulation, as users see it."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array
from ..errors import InputError


class State:
    """The state of a simulation, as writable views of its memory: written values hold for the next step.

    positions (n, 3) and linear_velocities (n, 3) of the origins of the body frames, orientations (n, 4)
    (unit quaternions w, x, y, z), angular_velocities (n, 3), forces and torques (n, 3) at the centres of
    mass, held until changed; all in world axes, SI units. joint_forces (nv,) along `Simulation.qd`, held
    until changed (N, N m). controls of all actuators and motors (`Model.control_names`), activations of all
    actuators. bond_openings, the largest distance that both sides of each bond have had (m): more than its
    `opening`, and it is broken. Assigning to an attribute copies into the view.
    joint_coordinates, of every degree of freedom at the start of the last step, follow from the poses and are
    read only: `Simulation.q` sets coordinates.

    A copy (`copy.copy`, `copy.deepcopy`, `pickle`) has arrays of its own and belongs to no simulation; what a
    simulation needs to go on bit for bit is in its own copies.
    """

    positions: Array
    orientations: Array
    linear_velocities: Array
    angular_velocities: Array
    forces: Array
    torques: Array
    joint_coordinates: Array
    joint_forces: Array
    controls: Array
    activations: Array
    bond_openings: Array
    __slots__ = (
        "activations",
        "angular_velocities",
        "bond_openings",
        "controls",
        "forces",
        "joint_coordinates",
        "joint_forces",
        "linear_velocities",
        "orientations",
        "positions",
        "torques",
    )

    def __init__(self, core: _core.Simulation) -> None:
        self._hold({name: getattr(core, name) for name in self.__slots__})

    def _hold(self, arrays: dict[str, Array]) -> None:
        for name in self.__slots__:
            object.__setattr__(self, name, arrays[name])
        self.joint_coordinates.flags.writeable = False

    def __copy__(self) -> State:
        return _detached({name: getattr(self, name).copy() for name in self.__slots__})

    def __deepcopy__(self, memo: dict[int, Any]) -> State:
        return memo.setdefault(id(self), self.__copy__())

    def __reduce__(self) -> tuple[Any, ...]:
        return _detached, ({name: getattr(self, name).copy() for name in self.__slots__},)

    def __setattr__(self, name: str, value: ArrayLike) -> None:
        if name not in self.__slots__:
            raise AttributeError(f"the state has no {name}; it has {', '.join(self.__slots__)}")
        if name == "joint_coordinates":
            raise InputError(
                "state.joint_coordinates follow from the poses of the bodies; set simulation.q, or "
                'simulation.set_q({"joint": value}), which moves the bodies'
            )
        view = getattr(self, name)
        try:
            view[...] = value
        except Exception as error:  # NumPy asks the object, which may raise anything
            reason = " ".join(str(error).split())[:200]
            raise InputError(f"state.{name} has the shape {view.shape}: {reason}") from None

    def __repr__(self) -> str:
        return f"amontons.State({len(self.positions)} bodies, {len(self.joint_coordinates)} coordinates)"


def _detached(arrays: dict[str, Array]) -> State:
    """A state that is no view of a simulation."""
    state = object.__new__(State)
    state._hold(arrays)
    return state
