"""Pictures of a simulation as arrays, drawn without a display."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import Array, entries, integer, number
from ..errors import InputError
from ..guidance import guided
from ..model.model import Model
from ..simulation.simulation import Simulation

LARGEST = 8192
_last: list[tuple[weakref.ref[Model], tuple[Any, ...], Any]] = []
"""The picture drawn last with its model and view: its triangles serve the next call."""


@guided
def render(
    simulation: Simulation,
    width: int = 640,
    height: int = 480,
    *,
    azimuth: float = -60.0,
    elevation: float = 20.0,
    window: tuple[float, float, float, float] | None = None,
    collision: bool = False,
) -> NDArray[np.uint8]:
    """A picture of the state of now: (height, width, 3) red, green and blue, the highest row first.

    Seen by parallel rays, so that lengths keep their proportions; needs no display and no graphics card, and
    comes out the same everywhere.

    azimuth, elevation: of the eye, degrees about z from the x axis, and above the horizon.
    window: left, right, bottom and top of what is seen, along the picture's axes from the world's origin (m),
        as `render_window` returns it; by default all that moves.
    collision: draw what touches in place of what the model looks like.

    Raises InputError naming the argument.
    """
    for name, size in (("width", width), ("height", height)):
        if integer(name, size, 1) > LARGEST:
            raise _too_large(name, size)
    picture = _picture(_shown(simulation), azimuth, elevation, collision)
    frame = _frame(simulation)
    bounds = picture.bounds([frame]) if window is None else _checked(window)
    return to_bytes(picture.draw(frame, bounds, width, height))


@guided
def render_window(
    simulation: Simulation, *, azimuth: float = -60.0, elevation: float = 20.0, collision: bool = False
) -> tuple[float, float, float, float]:
    """The window of `render` that holds all that moves now, to keep it for the pictures that follow."""
    picture = _picture(_shown(simulation), azimuth, elevation, collision)
    return picture.bounds([_frame(simulation)])


def to_bytes(image: Array) -> NDArray[np.uint8]:
    """Colours from 0 to 1, the lowest row first, as bytes with the highest row first."""
    return np.ascontiguousarray(np.round(255 * image[::-1]).astype(np.uint8))


def _shown(simulation: Simulation) -> Model:
    if not isinstance(simulation, Simulation):
        remedy = "give amontons.Simulation(model)" if isinstance(simulation, Model) else "give a Simulation"
        raise InputError(f"simulation is a {type(simulation).__name__}; {remedy}")
    return simulation.model


def _picture(model: Model, azimuth: float, elevation: float, collision: bool) -> Any:
    from .snapshots import Picture, View  # Matplotlib takes long to import

    key = (number("azimuth", azimuth), number("elevation", elevation), bool(collision))
    if not (_last and _last[0][0]() is model and _last[0][1] == key):
        _last[:] = [(weakref.ref(model), key, Picture(model, View(*key[:2]), collision=key[2]))]
    return _last[0][2]


def _frame(simulation: Simulation) -> Any:
    from .snapshots import Frame

    return Frame(simulation.time, simulation.state.positions, simulation.state.orientations)


def _checked(window: Any) -> tuple[float, float, float, float]:
    left, right, bottom, top = entries("window", window, 4)
    if not (left < right and bottom < top):
        raise InputError(f"window = {tuple(window)}; it must be left < right, bottom < top")
    return left, right, bottom, top


def _too_large(name: str, size: int) -> Exception:

    return InputError(f"{name} = {size}; it must be at most {LARGEST}")
