"""Messages from a page to the viewer: their kinds, and values that are checked like user input."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ..escapes import visible
from ..ranges import FARTHEST

PHASES = ("start", "update", "end")


class Refused(Exception):
    """Why a message is not heard."""


def checked(raw: object, inputs: Mapping[str, Any]) -> bytes:
    """The message itself, if viser and the viewer can take it; inputs: the controls of the page."""
    import msgspec
    from viser.infra import Message

    if not isinstance(raw, bytes):
        raise Refused("a text")
    try:
        told = msgspec.msgpack.decode(raw)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise Refused(f"{len(raw)} bytes that are no message ({_line(error)})") from None
    kind = told.get("type") if isinstance(told, dict) else None
    check = KINDS.get(kind) if isinstance(kind, str) else None
    if check is None:
        raise Refused(f"the kind {_line(repr(kind))}, which pages do not send")
    check(told, inputs)
    try:
        Message.deserialize(raw)
    except Exception as error:  # fields that are missing, or too many
        raise Refused(f"{kind}: {_line(f'{type(error).__name__}: {error}')}") from None
    return raw


def _control(told: dict[str, Any], inputs: Mapping[str, Any]) -> None:
    """A control has another value: one of its kind, within its range."""
    handle, updates = inputs.get(str(told.get("uuid"))), told.get("updates")
    if handle is None or not isinstance(updates, dict) or list(updates) != ["value"]:
        raise Refused("a change of what is no control")
    value, now = updates["value"], getattr(handle, "value", None)
    options = getattr(handle, "options", None)
    name = _line(getattr(handle, "label", ""))
    if isinstance(now, bool):
        good = isinstance(value, bool)
    elif isinstance(now, str):
        good = isinstance(value, str) and (options is None or value in options)
    else:
        least, most = getattr(handle, "min", None), getattr(handle, "max", None)
        good = (
            _finite(value)
            and (least is None or value >= least - _slack(least))
            and (most is None or value <= most + _slack(most))
        )
    if not good:
        raise Refused(f"{name} = {_line(repr(value))}, which it cannot be")


def _slack(bound: float) -> float:
    """A slider rounds to its steps."""
    return 1e-6 * max(1.0, abs(bound))


def _camera(told: dict[str, Any], inputs: Mapping[str, Any]) -> None:
    for name, count in (("wxyz", 4), ("position", 3), ("look_at", 3), ("up_direction", 3)):
        _numbers(told, name, count)
    for name in ("fov", "near", "far", "image_height", "image_width"):
        if not _finite(told.get(name)):
            raise Refused(f"a camera whose {name} is {_line(repr(told.get(name)))}")


def _click(told: dict[str, Any], inputs: Mapping[str, Any]) -> None:
    index = told.get("instance_index")
    if index is not None and (type(index) is not int or index < 0):
        raise Refused(f"a click on the body {_line(repr(index))}")
    _texts(told)
    for name in ("ray_origin", "ray_direction"):
        _numbers(told, name, 3)
    _numbers(told, "screen_pos", 2)


def _drag(told: dict[str, Any], inputs: Mapping[str, Any]) -> None:
    index = told.get("instance_index")
    if told.get("phase") not in PHASES or (index is not None and (type(index) is not int or index < 0)):
        raise Refused(f"a drag of the body {_line(repr(index))}")
    _texts(told)
    for name in ("start_position", "end_position"):
        _numbers(told, name, 3)
    for name in ("start_screen_pos", "end_screen_pos"):
        _numbers(told, name, 2)


KINDS = {
    "GuiUpdateMessage": _control,
    "ViewerCameraMessage": _camera,
    "SceneNodeClickMessage": _click,
    "SceneNodeDragMessage": _drag,
}
"""Messages of the viewer's page. viser knows more, such as a wish to be shown by a server elsewhere."""


def _texts(told: dict[str, Any]) -> None:
    """The clicked or dragged object, and the action."""
    for name in ("name", "owner", "modifier", "button"):
        value = told.get(name)
        if value is not None and not isinstance(value, str):
            raise Refused(f"{name} = {_line(repr(value))}; it must be a text")


def _numbers(told: dict[str, Any], name: str, count: int) -> None:
    values = told.get(name)
    if not isinstance(values, list | tuple) or len(values) != count or not all(map(_finite, values)):
        raise Refused(f"{name} = {_line(repr(values))}; it must be {count} finite numbers")


def _finite(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return math.isfinite(value) and abs(value) <= FARTHEST


def _line(text: object) -> str:
    return visible(str(text))[:200]
