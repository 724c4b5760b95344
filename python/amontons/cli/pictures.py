"""How pictures look: the options that `run` and `export` share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from .options import Options, grouped

if TYPE_CHECKING:
    from ..report.picture import View

PANEL = "Camera and style of pictures"


def _option(kind: Any, help: str, metavar: str | None = None) -> Any:
    return Annotated[kind, typer.Option(metavar=metavar, help=help, rich_help_panel=PANEL)]


OPTIONS: Options = {
    "azimuth": (_option(float, "Azimuth of the camera (degrees about z, from x)."), -60.0),
    "elevation": (_option(float, "Elevation of the camera (degrees above the horizon)."), 20.0),
    "target": (
        _option(
            str | None, "Centre of the picture: a point (m), or a body that the camera follows.", "X,Y,Z|BODY"
        ),
        None,
    ),
    "width": (
        _option(float | None, "Width of the view at the target (m); default: all moving bodies."),
        None,
    ),
    "distance": (
        _option(float | None, "Distance of the camera from the target (m); default: parallel projection."),
        None,
    ),
    "fixed": (
        _option(
            str,
            "Fixed geometry: transparent, opaque, or not drawn.",
            "glass|show|hide",
        ),
        "glass",
    ),
    "forces": (
        _option(bool, "Draw contact forces as lines; their width shows the size of the force."),
        False,
    ),
}


def view_of(*, target: str | None, **options: Any) -> View:
    """The view of the options; InputError names the one that is wrong."""
    from ..report.picture import View

    return View(target=_place(target), **options)


def _place(text: str | None) -> str | tuple[float, ...] | None:
    if text is None or "," not in text:
        return text
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--target {text}: write X,Y,Z in m, or the name of a body") from None


pictured = grouped("view", OPTIONS, view_of)
"""The command with the options of pictures, which reach it as its argument `view`, a `View`."""
