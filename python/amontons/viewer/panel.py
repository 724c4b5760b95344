"""The controls beside the scene."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from ..escapes import visible
from .events import Post, on_user
from .inspector import Inspector
from .marks import KINDS, Marks
from .plots import Plots
from .runs import LiveRun, ReplayRun, pace
from .solver_panel import add_solver
from .stage import COLLISION, VISUAL, Stage

if TYPE_CHECKING:
    import viser

SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "4")
LATE = 0.9
"""Share of the requested speed below which a run counts as slower."""
PAUSE_BETWEEN = 0.2
"""Texts and plots are renewed no more often (s): they cost more than the scene."""


class Panel:
    """Play, pause, step, speed, reset, what is drawn; below it what its siblings add.

    Callbacks run in the thread of the server: they post commands and touch nothing else.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        run: LiveRun | ReplayRun,
        stage: Stage,
        marks: Marks,
        *,
        post: Post,
        follow: Callable[[bool], None],
    ) -> None:
        self._run, self._post, self._gui, self._server = run, post, server.gui, server
        self._shown_at = 0.0
        self._transport()
        self._drawing(stage, marks, follow)
        self._inspector = Inspector(server, run, post)
        self._plots = Plots(server, run, post)
        if isinstance(run, LiveRun):
            add_solver(server, run, post)

    def show(self) -> None:
        """Bring texts and sliders up to date."""
        run = self._run
        self._show_playing()
        if isinstance(run, ReplayRun) and self._frames.value != run.frame:
            self._frames.value = run.frame
        now = time.perf_counter()
        if run.playing and now - self._shown_at < PAUSE_BETWEEN:
            return
        self._shown_at = now
        self._status.content = f"t = {run.time:.3f} s · {pace_of(run) if run.playing else 'paused'}"
        self._inspector.show()
        self._plots.show()

    def choose(self, body: int | None) -> None:
        """Another body was picked, or none."""
        self._follow.disabled = body is None
        self._inspector.choose(body)

    def tell(self, message: str) -> None:
        """A message on every page."""
        for client in self._server.get_clients().values():
            client.add_notification("amontons", visible(message, "\n"), auto_close_seconds=None, color="red")
        self._show_playing()

    def _show_playing(self) -> None:
        label = "Pause" if self._run.playing else "Play"
        if self._play.label != label:
            self._play.label = label

    def _transport(self) -> None:
        gui, run, post = self._gui, self._run, self._post
        self._status = gui.add_markdown("")
        self._play = gui.add_button("Play")
        step = gui.add_button("Single step" if isinstance(run, LiveRun) else "Next frame")
        reset = gui.add_button("Reset" if isinstance(run, LiveRun) else "To the start")
        speed = gui.add_dropdown("Speed", SPEEDS, initial_value="1", hint="Simulated over real time")

        def toggle() -> None:
            if not run.playing and isinstance(run, ReplayRun) and run.frame == len(run.recording) - 1:
                run.reset()  # played to its end: from the start again
            run.playing = not run.playing

        def one() -> None:
            run.playing = False
            run.step()

        def set_speed(value: str) -> None:
            run.speed = pace(float(value))

        on_user(self._play, lambda _: post(toggle))
        on_user(step, lambda _: post(one))
        on_user(reset, lambda _: post(run.reset))
        on_user(speed, lambda value: post(lambda: set_speed(value)))
        if isinstance(run, ReplayRun):
            self._frames = gui.add_slider("Frame", 0, max(1, len(run.recording) - 1), 1, 0)
            on_user(self._frames, lambda value: post(lambda: run.seek(int(value))))

    def _drawing(self, stage: Stage, marks: Marks, follow: Callable[[bool], None]) -> None:
        gui, post = self._gui, self._post
        with gui.add_folder("View"):
            shapes = gui.add_dropdown("Shapes", (VISUAL, COLLISION), initial_value=VISUAL)
            on_user(shapes, lambda value: post(lambda: stage.show_shapes(value)))
            glass = gui.add_checkbox("See through what is fixed", stage.see_through)
            on_user(glass, lambda value: post(lambda: stage.show_through(value)))
            self._follow = gui.add_checkbox(
                "Follow", False, disabled=True, hint="The eye goes along with the body that is picked"
            )
            on_user(self._follow, lambda value: post(lambda: follow(value)))

            def want(kind: str, wanted: bool) -> None:
                marks.want(kind, wanted)
                if kind == "force network":
                    stage.fade(wanted)

            for kind in KINDS:
                box = gui.add_checkbox(kind.capitalize(), False, hint=HINTS.get(kind))
                on_user(box, lambda value, kind=kind: post(lambda: want(kind, value)))
            scale = gui.add_slider(arrow_label(0.0), -3.0, 3.0, 0.1, 0.0, hint=HINTS["arrows"])

            def scale_arrows(exponent: float) -> None:
                marks.scale_forces(10**exponent)
                scale.label = arrow_label(exponent)

            on_user(scale, lambda value: post(lambda: scale_arrows(float(value))))


def arrow_label(exponent: float) -> str:
    """Label of the slider for arrows: their length relative to the default."""
    return f"Arrow length x{10**exponent:.2g}" if exponent < 1 else f"Arrow length x{10**exponent:.0f}"


def pace_of(run: LiveRun | ReplayRun) -> str:
    """Simulated over real time, and whether that is less than was asked for."""
    late = run.achieved < LATE * run.speed
    slower = "real time" if run.speed == 1 else f"{run.speed:g} x real time"
    return f"slower than {slower} ({run.achieved:.2g}x)" if late else f"{run.achieved:.2f}x real time"


HINTS = {
    "arrows": "The slider is the power of ten: 0 is x1, 1 is x10, -1 is x0.1",
    "contact points": "Green sticks, red slips, blue is open",
    "forces": "On body A of each contact: green sticks, red slips",
    "force network": "Lines between the bodies that touch, as wide as the force is large",
}
