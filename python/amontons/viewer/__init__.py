"""Simulations, recordings and verdicts on blocks on a page in the browser: `view`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..simulation.simulation import Simulation

if TYPE_CHECKING:
    from ..io.recordings.recording import Recording
    from ..studies.masonry.stability import Stability
    from .viewer import Viewer

HOST, PORT = "127.0.0.1", 8080


def view(
    subject: Simulation | Recording | Stability,
    *,
    play: bool | None = False,
    speed: float = 1.0,
    host: str = HOST,
    port: int = PORT,
    open_browser: bool = False,
    title: str = "amontons",
    allow_origin: Sequence[str] = (),
) -> Viewer:
    """Show a simulation or a recording on a page; its address is `url` of what is returned.

    With a verdict on blocks (`studies.stability`) the page shows the joints, from green where nothing of them
    is used to red where all is, and the force of each.

    play: whether it plays at once. A thread of the viewer then owns the simulation until `close`: do not step
        it meanwhile. None: the program steps, and calls `update` of the viewer between its steps.
    speed: simulated over real time.
    host: where the page can be reached; by default from this machine alone (a tunnel of ssh ends there too).
    port: the first that is tried; the next free one is taken.
    allow_origin: further addresses under which the page may be asked for, as "http://name:port": of a proxy,
        of a tunnel that ends at another port. Only a browser with the token in `url` can open it.
    open_browser: whether a browser is asked to open the page.

    Needs viser: pip install amontons[view]. Raises InputError.
    """
    from ..errors import InputError
    from ..io.recordings.recording import Recording
    from .runs import LiveRun, ReplayRun, pace
    from .viewer import Viewer, open_page

    speed = pace(speed)
    lines = None
    if not isinstance(subject, Simulation | Recording):
        from ..studies.masonry.picture import drawn
        from ..studies.masonry.stability import Stability

        if isinstance(subject, Stability):
            subject, lines = drawn(subject)
    if isinstance(subject, Simulation):
        run: LiveRun | ReplayRun = LiveRun(subject)
    elif isinstance(subject, Recording):
        run = ReplayRun(subject)
    else:
        raise InputError(
            f"there is no view of a {type(subject).__name__}; give a Simulation, a Recording "
            "or a verdict on blocks"
        )
    run.speed = speed
    try:
        viewer = Viewer(run, title=title, host=host, port=port, allow_origin=allow_origin)
    except BaseException:
        if isinstance(run, LiveRun):
            run.close()
        raise
    if lines is not None:
        viewer.marks.show_joints(lines)
    if play is not None:
        run.playing = bool(play)
        viewer.start()
    if open_browser:
        open_page(viewer.url)
    return viewer
