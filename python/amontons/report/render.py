"""Pictures of a simulation as arrays, drawn without a display."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import integer
from ..errors import InputError
from ..guidance import guided
from ..model.model import Model
from ..simulation.simulation import Simulation
from .picture import Picture, View, frame_of

LARGEST = 8192
_last: list[tuple[weakref.ref[Model], View, Picture]] = []
"""The picture drawn last with its model and view: its surfaces serve the next call."""


@guided
def render(
    simulation: Simulation,
    size: tuple[int, int] = (640, 480),
    *,
    azimuth: float = -60.0,
    elevation: float = 20.0,
    target: str | int | Sequence[float] | None = None,
    width: float | None = None,
    distance: float | None = None,
    fixed: str = "glass",
    forces: bool | float = False,
    collision: bool = False,
    joints: bool = False,
) -> NDArray[np.uint8]:
    """Render the present state: (height, width, 3) of red, green and blue, the top row first.

    It needs no display and no graphics card, and gives the same picture on every machine.

    size: width and height (pixels).
    azimuth, elevation: direction to the camera (degrees about z from the x axis; degrees above the horizon).
    target: centre of the picture: a point (m), or a body by name or index; by default the middle of the
        moving bodies.
    width: width of the view at the target (m); by default all moving bodies fit. An outlier does not count:
        a body farther from the middle half of all bodies than three times the spread of that half.
    distance: distance of the camera from the target (m); by default infinite, a parallel projection. With a
        distance and no width, the angle of view is 40 degrees.
    fixed: "glass" draws fixed geometry transparent, "show" draws it opaque, "hide" draws only its planes.
    forces: draw the contact forces of the last step over a pale picture, as lines from the bodies to the
        contact points: green where it sticks, red where it slips. The width of a line is proportional to its
        force, with this factor (m/N); True makes the largest half as wide as a body.
    collision: draw the collision geometry in place of the visual one.
    joints: draw the joints: a pin along the axis of each hinge, a rod from each body to its end of a joint, a
        string between ends that are apart.

    Raises InputError naming the argument.

    >>> picture = render(Simulation(scenes.make("stack")), (320, 240), forces=True)
    >>> picture.shape
    (240, 320, 3)
    """
    columns, rows = _pixels(size)
    shown = fixed, forces, bool(collision), bool(joints)
    view = View(azimuth, elevation, _place(target), width, distance, *shown)
    picture, frame = _picture(_shown(simulation), view), frame_of(simulation, forces=bool(forces))
    return picture.draw(frame, picture.framing([frame], columns / rows), columns, rows)


@guided
def render_view(
    simulation: Simulation,
    size: tuple[int, int] = (640, 480),
    *,
    azimuth: float = -60.0,
    elevation: float = 20.0,
    forces: bool = False,
    collision: bool = False,
) -> dict[str, Any]:
    """The arguments of `render` that hold all that moves now, to keep them for the pictures that follow:
    azimuth, elevation, target (m), width (m), forces (m/N, or False) and collision.

    Raises InputError naming the argument.

    >>> simulation = Simulation(scenes.make("pendulum"))
    >>> fixed = render_view(simulation, (320, 240))  # one view for all pictures that follow
    >>> render(simulation, (320, 240), **fixed).shape
    (240, 320, 3)
    """
    columns, rows = _pixels(size)
    view = View(azimuth, elevation, forces=forces, collision=bool(collision))
    picture, frame = _picture(_shown(simulation), view), frame_of(simulation, forces=forces)
    framing = picture.framing([frame], columns / rows)
    target = framing.target_in(frame)
    return {
        "azimuth": view.azimuth,
        "elevation": view.elevation,
        "target": tuple(target.tolist()),
        "width": framing.width,
        "forces": framing.per_newton or bool(forces),
        "collision": view.collision,
    }


def _place(target: Any) -> Any:
    return target if isinstance(target, str | int | None) else tuple(np.ravel(target).tolist())


def _pixels(size: Any) -> tuple[int, int]:
    if isinstance(size, str) or np.shape(size) != (2,):
        raise InputError(f"size = {size!r}; give (width, height) in pixels")
    columns, rows = (integer("size", value, 1, LARGEST) for value in size)
    return columns, rows


def _shown(simulation: Simulation) -> Model:
    if not isinstance(simulation, Simulation):
        remedy = "give amontons.Simulation(model)" if isinstance(simulation, Model) else "give a Simulation"
        raise InputError(f"simulation is a {type(simulation).__name__}; {remedy}")
    return simulation.model


def _picture(model: Model, view: View) -> Picture:
    if not (_last and _last[0][0]() is model and _last[0][1] == view):
        _last[:] = [(weakref.ref(model), view, Picture(model, view))]
    return _last[0][2]
