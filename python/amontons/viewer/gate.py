"""Who may see the page and what it may say: addresses, a token, and messages that are checked as they come.

viser serves every request at its port and takes every message. A page of another origin can reach that port
from the browser of the user, and by a name that resolves to 127.0.0.1 it even counts as the same origin. So a
request must ask for an address at which the viewer was opened (Host), come from a page of one (Origin, where
there is one) and bring the token: as ?token=..., which leads to the page, or as the first part of the path,
from where the page makes the address of its socket.
"""

from __future__ import annotations

import asyncio
import http
import logging
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from hmac import compare_digest
from secrets import token_urlsafe
from typing import Any
from urllib.parse import parse_qs, urlsplit
from weakref import WeakSet

from ..errors import InputError
from .messages import Refused, checked
from .title import put_title

LOCAL = ("localhost", "127.0.0.1", "[::1]")
EVERYWHERE = ("0.0.0.0", "::", "")
LARGEST = 1 << 20
"""Bytes of a message at most: pages send some hundred."""
MOST_DROPPED = 100
"""Messages of one connection, after which it is closed."""
PATIENCE = 0.2
"""Seconds that a client gets to close its connection."""
HEADERS = {
    "Content-Security-Policy": "frame-src 'none'; object-src 'none'; base-uri 'none'; form-action 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
_patching = threading.Lock()


class _OneLine(logging.Filter):
    """A fault of a connection is one line of the log, without a traceback."""

    def filter(self, record: logging.LogRecord) -> bool:
        record.exc_info = record.exc_text = None
        return True


logger = logging.getLogger(__name__)
logger.addFilter(_OneLine())


class Gate:
    """The token and the addresses of one viewer; `guarding` puts it before the server that starts within."""

    def __init__(self, host: str, allowed: Sequence[str] = ()) -> None:
        """host: where the server listens. allowed: origins beside its own, as "http://name:8080"."""
        self.token = token_urlsafe(16)
        self._host, self._others = host, {origin_of(text) for text in allowed}
        self.title = "amontons"
        """of the page"""
        self._connections: WeakSet[Any] = WeakSet()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._closing = False
        self.inputs: Callable[[], dict[str, Any]] = dict
        """the controls of the page by their identity"""

    @property
    def guards(self) -> bool:
        """Whether a server has started behind it."""
        return self._loop is not None

    @contextmanager
    def guarding(self) -> Iterator[None]:
        """viser has no place for any of this, but starts its server by one function of websockets."""
        import websockets.asyncio.server as module

        real = module.serve

        def serve(handler: Any, *arguments: Any, **options: Any) -> Any:
            if not str(getattr(handler, "__module__", "")).startswith("viser."):
                return real(handler, *arguments, **options)
            self._loop = asyncio.get_running_loop()
            pages = options.pop("process_request")
            own = {
                "process_request": lambda connection, request: self._answer(connection, request, pages),
                "create_connection": self._connection(module.ServerConnection),
                "logger": logger, "max_size": LARGEST, "close_timeout": PATIENCE,
            }  # fmt: skip
            return real(lambda connection: handler(_Heard(connection, self)), *arguments, **(options | own))

        with _patching:
            module.serve = serve  # type: ignore[assignment]
            try:
                yield
            finally:
                module.serve = real  # type: ignore[assignment]

    def end(self) -> None:
        """Drop all connections, whatever their clients do."""
        self._closing = True
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._drop)

    def _drop(self) -> None:
        for connection in list(self._connections):
            connection.transport.abort()

    def _connection(self, base: Any) -> Any:
        gate = self

        class Connection(base):
            def connection_made(self, transport: Any) -> None:
                super().connection_made(transport)
                gate._connections.add(self)
                if gate._closing:
                    transport.abort()

        return Connection

    def _answer(self, connection: Any, request: Any, pages: Callable[[Any, Any], Any]) -> Any:
        """The response to a request; None lets a socket be opened."""
        host, port, *_ = connection.local_address
        if why := self._wrong(request.headers, host, port):
            logger.warning("refused a request to %s", why)
            return connection.respond(http.HTTPStatus.FORBIDDEN, f"This viewer has no page at {why}.\n")
        parts = urlsplit(request.path)
        first, _, rest = parts.path.lstrip("/").partition("/")
        by_query = any(self._is_token(text) for text in parse_qs(parts.query).get("token", ()))
        if not by_query and not self._is_token(first):
            why = "the token is missing; open the address that the viewer printed"
            return connection.respond(http.HTTPStatus.FORBIDDEN, why + "\n")
        if request.headers.get("Upgrade", "").lower() == "websocket":
            return None
        if by_query:
            response = connection.respond(http.HTTPStatus.FOUND, "")
            response.headers["Location"] = f"/{self.token}/"
        else:
            response = pages(connection, replace(request, path="/" + rest))
            put_title(response, self.title)
        for name, value in HEADERS.items():
            response.headers[name] = value
        return response

    def _is_token(self, text: str) -> bool:
        return compare_digest(text.encode(errors="replace"), self.token.encode())

    def _wrong(self, headers: Any, local: str, port: int) -> str:
        """Fault of the address or the origin of a request; "" if there is none."""
        own = self._addresses(local, port)
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        known = own | {urlsplit(origin).netloc for origin in self._others}
        if len(hosts) != 1 or hosts[0].lower() not in known:
            return f"{hosts!r:.200}; --allow-origin adds an address"
        allowed = {f"http://{address}" for address in own} | self._others
        if any(origin.lower() not in allowed for origin in origins):
            return f"{hosts[0]} for a page of {origins!r:.200}; --allow-origin adds one"
        return ""

    def _addresses(self, local: str, port: int) -> set[str]:
        """host:port by which the viewer can be asked for. An address in digits is what no other can claim."""
        digits = f"[{local}]" if ":" in local else local
        names = {digits, f"[{self._host}]" if ":" in self._host else self._host.lower()}
        if self._host in (*EVERYWHERE, "127.0.0.1", "::1", "localhost"):
            names |= set(LOCAL)
        if self._host in EVERYWHERE:
            names |= {socket.gethostname().lower(), socket.getfqdn().lower()}
        return {f"{name}:{port}" for name in names} | (names if port == 80 else set())


class _Heard:
    """A connection of which only messages are heard that a page may send."""

    def __init__(self, connection: Any, gate: Gate) -> None:
        self._connection, self._gate, self._dropped = connection, gate, 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection, name)

    async def recv(self) -> bytes:
        while True:
            raw = await self._connection.recv()
            try:
                return checked(raw, self._gate.inputs())
            except Refused as error:
                logger.warning("dropped a message of a page: %s", error)
                self._dropped += 1
            if self._dropped >= MOST_DROPPED:
                await self._connection.close(1008, "too many messages that no page sends")


def origin_of(text: object) -> str:
    """An origin as browsers write it; InputError if it is none."""
    parts = urlsplit(text) if isinstance(text, str) else None
    try:
        whole = parts is not None and parts.scheme in ("http", "https") and bool(parts.hostname)
        whole = whole and (parts.port or 1) > 0 and parts.path in ("", "/") and not parts.query  # type: ignore[union-attr]
    except ValueError:  # a port that is no number
        whole = False
    if not whole or "@" in str(text) or "*" in str(text):
        raise InputError(f"allow_origin: {text!r:.200} is no origin; write http://NAME:PORT")
    return f"{parts.scheme}://{parts.netloc}".lower()  # type: ignore[union-attr]
