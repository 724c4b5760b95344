"""Distinguishes actions of a user on the page from values set by the program; and names as the page shows
them.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from ..escapes import visible

Command = Callable[[], None]
Post = Callable[[Command], None]
"""lets the owner of the simulation run a command before it goes on"""


def on_user(handle: Any, call: Callable[[Any], None]) -> None:
    """Call with the new value (None of a button) when a user has changed it, in the order of the events.

    The callback is a coroutine, which the server runs in its own thread: `call` only posts.
    """

    async def changed(event: Any) -> None:
        if event.client is not None:
            call(getattr(event.target, "value", None))

    (handle.on_click if hasattr(handle, "on_click") else handle.on_update)(changed)


def literal(name: str) -> str:
    """A name as code of Markdown, in which nothing else has a meaning: no markup, no HTML, no address."""
    text = visible(name) or " "
    fence = "`" * (1 + max(map(len, re.findall("`+", text)), default=0))
    return f"{fence} {text} {fence}" if text[0] in "` " or text[-1] in "` " else f"{fence}{text}{fence}"
