"""The common base of `Simulation.kinematics` and `Simulation.forces`."""

from __future__ import annotations

from typing import Any

from .. import _core
from ..checks import suggestion
from ..model.model import Model


class Part:
    """A view of a simulation: it has no state of its own, and tells the present one."""

    def __init__(self, simulation: Any) -> None:
        self._simulation = simulation

    @property
    def _core(self) -> _core.Simulation:
        core: _core.Simulation = self._simulation._core  # a new one after `change_options`
        return core

    @property
    def _model(self) -> Model:
        model: Model = self._simulation._model
        return model

    def __repr__(self) -> str:
        return f"{type(self).__name__} of {self._simulation!r}"


def no_attribute(simulation: object, name: str, parts: tuple[type[Part], ...]) -> AttributeError:
    """The error for a name that a simulation lacks; those of earlier versions say where they are now."""
    if name == "view":
        return AttributeError("simulation.view() is now amontons.view(simulation)")
    for part in parts:
        if not name.startswith("_") and hasattr(part, name):
            return AttributeError(f"simulation.{name} is now simulation.{part.__name__.lower()}.{name}")
    return AttributeError(f"a simulation has no attribute {name!r}{suggestion(name, dir(simulation))}")
