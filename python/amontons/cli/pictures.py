"""How pictures look: the options that `run` and `export` share."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from .common import one_line_errors

if TYPE_CHECKING:
    from ..report.picture import View

PANEL = "Of pictures"


def _option(kind: Any, help: str, metavar: str | None = None) -> Any:
    return Annotated[kind, typer.Option(metavar=metavar, help=help, rich_help_panel=PANEL)]


OPTIONS: dict[str, tuple[Any, Any]] = {
    "azimuth": (_option(float, "Where the eye is, degrees about z from x."), -60.0),
    "elevation": (_option(float, "Where the eye is, degrees above the horizon."), 20.0),
    "target": (
        _option(
            str | None, "What is in the middle: a point (m), or a body, which is followed.", "X,Y,Z|BODY"
        ),
        None,
    ),
    "width": (_option(float | None, "Seen at the target from side to side (m); else all that moves."), None),
    "distance": (_option(float | None, "Of the eye from the target (m); else rays are parallel."), None),
    "fixed": (
        _option(
            str,
            "What is fixed lets what moves shine through, hides it, or is left out.",
            "glass|show|hide",
        ),
        "glass",
    ),
    "forces": (_option(bool, "Draw contact forces as lines, as wide as they are large."), False),
}
"""By name the annotation and the default."""


def pictured(command: Callable[..., None]) -> Callable[..., None]:
    """The command with the options of pictures, which reach it as its argument `view`, a `View`."""
    signature = inspect.signature(command, eval_str=True)
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    options = [
        inspect.Parameter(name, kind, default=default, annotation=annotation)
        for name, (annotation, default) in OPTIONS.items()
    ]
    own = [p for p in signature.parameters.values() if p.name != "view"]

    @functools.wraps(command)
    def with_options(**given: Any) -> None:
        with one_line_errors():
            view = view_of(**{name: given.pop(name) for name in OPTIONS})
        command(**given, view=view)

    with_options.__signature__ = signature.replace(parameters=[*own, *options])  # type: ignore[attr-defined]
    return with_options


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
