"""Law, method, tolerance and step of a simulation, changed while it plays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..problem.options import LAWS, methods
from ..simulation.own_method import name_of
from .events import Post, on_user
from .runs import LiveRun

if TYPE_CHECKING:
    import viser

TOLERANCES = tuple(f"1e-{k}" for k in range(2, 13))


def add_solver(server: viser.ViserServer, run: LiveRun, post: Post) -> None:
    """A choice holds from the next step on. An invalid choice gives a message and changes nothing."""
    gui, options = server.gui, run.simulation.options

    def change(name: str, value: Any) -> None:
        post(lambda: run.simulation.change_options(**{name: value}))

    with gui.add_folder("Solver", expand_by_default=False):
        law = gui.add_dropdown("Law", tuple(LAWS), initial_value=str(options["law"]))
        on_user(law, lambda value: change("law", value))
        now = name_of(options["method"])
        listed = methods() if now in methods() else (now, *methods())
        method = gui.add_dropdown("Method", listed, initial_value=now)
        on_user(method, lambda value: change("method", value))
        now = f"{float(options['tolerance']):g}".replace("e-0", "e-")
        now = next((t for t in TOLERANCES if float(t) == float(options["tolerance"])), now)
        known = TOLERANCES if now in TOLERANCES else (now, *TOLERANCES)
        tolerance = gui.add_dropdown("Tolerance", known, initial_value=now)
        on_user(tolerance, lambda value: change("tolerance", float(value)))
        dt = gui.add_number(
            "Step (ms)", 1e3 * run.simulation.dt, min=1e-3, step=1e-3, hint="Simulated time per step"
        )
        on_user(dt, lambda value: change("dt", 1e-3 * float(value)))
