"""The page and the thread that owns what it shows.

Only the owner touches the simulation: the thread that `Viewer.start` begins, or the one that calls `update`.
Callbacks of the server run in its thread and post what is to be done.
"""

from __future__ import annotations

import atexit
import contextlib
import errno
import html
import io
import os
import queue
import socket
import sys
import threading
import time
import traceback
import webbrowser
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..checks import Array, integer
from ..errors import InputError, SimulationError
from ..escapes import visible
from .events import Command
from .gate import Gate
from .marks import Marks
from .panel import Panel
from .runs import LiveRun, ReplayRun
from .stage import Stage

RATE = 25.0
"""Pictures per second."""
WAIT = 60.0
"""An owner without anything to play looks up this often (s); commands wake it at once."""

MOST_POSTED = 1000
"""Wishes of pages that wait to be obeyed."""


class Viewer:
    """A page that shows a simulation or a recording; made by `amontons.view`."""

    def __init__(
        self,
        run: LiveRun | ReplayRun,
        *,
        title: str,
        host: str,
        port: int,
        allow_origin: Sequence[str] = (),
    ) -> None:
        self.run = run
        self._commands: queue.SimpleQueue[Command] = queue.SimpleQueue()
        self._gate = Gate(host, allow_origin)
        self._server = serve(host, port, title, self._gate)
        self._host = host
        self._closing = False
        self._thread: threading.Thread | None = None
        self._follow: tuple[int, Array] | None = None
        self._last_tick = time.perf_counter()
        self.chosen: int | None = None
        self.stage = Stage(self._server, run.model, pick=self._on_pick, grab=self._on_grab)
        self.stage.frame(run.positions)
        self.marks = Marks(self._server, self.stage.root, run)
        self.panel = Panel(self._server, run, self.stage, self.marks, post=self.post, follow=self.follow)
        self.show()

    @property
    def url(self) -> str:
        """Where the page is, with the token that it asks for."""
        host = "localhost" if self._host in ("0.0.0.0", "::", "127.0.0.1") else self._host
        host = f"[{host}]" if ":" in host else host
        return f"http://{host}:{self._server.get_port()}/?token={self._gate.token}"

    def post(self, command: Command) -> None:
        """Let the owner of the simulation run `command` before it goes on.

        While MOST_POSTED others wait it is dropped: a page may send them faster than anyone obeys.
        """
        if self._commands.qsize() < MOST_POSTED:
            self._commands.put(command)

    def start(self) -> Viewer:
        """Let a thread of its own play; the simulation is its until `close`."""
        self._thread = threading.Thread(target=self._play, name="amontons viewer", daemon=True)
        self._thread.start()
        return self

    def update(self) -> None:
        """Show the simulation as it is now, for a program that steps it by itself.

        `update` carries out the commands of the page (picked, dragged, other options). Shows at most 25
        pictures per
        second of wall clock, and returns at once otherwise.
        """
        if self._thread is not None:
            raise InputError("the viewer plays by itself; open it with play=None to step in your program")
        self._obey(0.0)
        if time.perf_counter() - self._last_tick >= 1 / RATE:
            self._last_tick = time.perf_counter()
            self.show()

    def wait(self) -> None:
        """Until Ctrl-C or `close`."""
        with contextlib.suppress(KeyboardInterrupt):
            while self._thread is not None and self._thread.is_alive():
                self._thread.join(0.5)

    def close(self, wait: float | None = None) -> None:
        """End the page; the simulation is its user's again, in the state that was shown last.

        wait: for the step at hand, at most so long (s); of a step that lasts longer the simulation is not
        given back, and the thread ends with the process.
        """
        if self._closing:
            return
        self._closing = True
        self._commands.put(lambda: None)
        playing = self._thread
        if playing is not None and playing is not threading.current_thread():
            playing.join(wait)
        if isinstance(self.run, LiveRun) and not (playing is not None and playing.is_alive() and wait):
            self.run.close()
        stop(self._server, self._gate)

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _repr_html_(self) -> str:
        """In a notebook, the page in a frame."""
        return f'<iframe src="{html.escape(self.url)}" width="100%" height="560" style="border:0"></iframe>'

    def show(self) -> None:
        """Send the present state to the pages."""
        run = self.run
        positions, orientations = np.array(run.positions), np.array(run.orientations)
        if self._follow is not None:
            body, start = self._follow
            self.stage.follow(positions[body] - start)
        with self._server.atomic():
            self.stage.move(positions, orientations)
            self.marks.show(positions, orientations)
        self.panel.show()

    def choose(self, body: int | None) -> None:
        """Pick a body; None lets it go."""
        self.chosen = body
        self.stage.choose(body)
        self.panel.choose(body)

    def follow(self, wanted: bool) -> None:
        """Let the eye go along with the chosen body, or stay."""
        body = self.chosen
        if wanted and body is not None:  # from where it is seen now
            self._follow = (body, np.array(self.run.positions[body]) - self.stage.offset)
        else:
            self._follow = None

    def _on_pick(self, body: int) -> None:
        self.post(lambda: self.choose(body))

    def _on_grab(self, phase: str, body: int, grabbed: Array, pointer: Array) -> None:
        if not isinstance(self.run, LiveRun):
            return
        spring = self.run.spring

        def start() -> None:
            self.choose(body)
            spring.grab(body, grabbed)
            spring.pull(pointer)

        commands: dict[str, Command] = {
            "start": start,
            "update": lambda: spring.pull(pointer),
            "end": spring.release,
        }
        self.post(commands[phase])

    def _play(self) -> None:
        period = 1 / RATE
        last = time.perf_counter()
        while not self._closing:
            playing = self.run.playing
            until = last + period - time.perf_counter() if playing else WAIT
            changed = self._obey(max(until, 0.0))
            now = time.perf_counter()
            if self._closing:
                return
            if self.run.playing and now - last >= period:
                elapsed = now - last if playing else period  # not what passed while it stood still
                last = now
                self._guarded(lambda elapsed=elapsed: self.run.advance(elapsed, period))
                self._guarded(self.show)
            elif changed and not self.run.playing:
                self._guarded(self.show)
                last = now

    def _obey(self, wait: float) -> bool:
        """Run what was posted; wait for the first so long (s). Whether there was any."""
        changed = False
        with contextlib.suppress(queue.Empty):
            command = self._commands.get(timeout=wait) if wait > 0 else self._commands.get_nowait()
            for _ in range(MOST_POSTED):  # and then a picture, whatever pages send
                changed = True
                self._guarded(command)
                if self._closing:
                    break
                command = self._commands.get_nowait()
        return changed

    def _guarded(self, command: Command) -> None:
        """An error stops the play and is shown on the page; the page stays."""
        try:
            command()
        except (InputError, SimulationError) as error:
            self.run.playing = False
            self.panel.tell(str(error))
        except Exception:  # a fault of ours, or of a user's callback: shown, not swallowed
            self.run.playing = False
            traceback.print_exc()
            self.panel.tell(traceback.format_exc(limit=-1))


def serve(host: str, port: int, title: str, gate: Gate) -> Any:
    """viser's server behind a gate, without what it prints and its button that asks a server elsewhere."""
    try:
        import viser
    except ImportError:
        raise InputError("the viewer needs viser: pip install 'amontons[view]'") from None
    _require_place(host, port)
    gate.title = title
    with contextlib.redirect_stdout(io.StringIO()), gate.guarding():
        server = viser.ViserServer(host=host, port=port, label=visible(title), verbose=False)
    atexit.unregister(server.stop)  # which prints
    if not gate.guards:
        stop(server, gate)
        raise InputError(f"this viser {viser.__version__} serves in an unknown way; install viser>=1.1,<1.2")
    gate.inputs = lambda: server.gui._gui_input_handle_from_uuid
    atexit.register(stop, server, gate)
    server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
    server.gui.main_panel.dock_right()  # beside the scene, not above it
    return server


def stop(server: Any, gate: Gate) -> None:
    """End a server at once, whatever its clients do, and without what it prints."""
    gate.end()
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()
    atexit.unregister(stop)


def _require_place(host: str, port: int) -> None:
    """InputError where no page can be: the server's own thread would fail, and this one wait for it."""
    if integer("port", port, 1) > 65535:
        raise InputError(f"port = {port}; it must be at most 65535")
    try:
        with socket.create_server((host, port), family=_family(host)):
            pass
    except OSError as error:
        if error.errno != errno.EADDRINUSE:  # then the next one is taken
            why = error.strerror or error
            raise InputError(f"host = {host!r}, port = {port}: no page can be there ({why})") from None


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


def open_page(url: str) -> bool:
    """Ask the desktop for a browser; False where there is none."""
    desktop = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if sys.platform not in ("darwin", "win32") and not desktop:
        return False  # a browser of the terminal would take it over
    return webbrowser.open(url)
