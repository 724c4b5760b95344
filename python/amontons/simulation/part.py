"""The common base of `Simulation.kinematics` and `Simulation.forces`."""

from __future__ import annotations

from typing import Any

from .. import _core
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
