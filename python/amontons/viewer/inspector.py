"""The picked body, and sliders for its joints."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..escapes import visible
from ..model.model import Model
from .events import Post, literal, on_user
from .runs import LiveRun, ReplayRun

if TYPE_CHECKING:
    import viser

STEPS = 500
MOST = 40
"""Sliders of a kind; of a larger model those of the first."""


class Inspector:
    """Name, mass and velocity of the chosen body; sliders of joints and controls."""

    def __init__(self, server: viser.ViserServer, run: LiveRun | ReplayRun, post: Post) -> None:
        self._run, self._post = run, post
        self._chosen: int | None = None
        with server.gui.add_folder("Body"):
            self._text = server.gui.add_markdown("Click a body; drag it to pull it.")
        self._sliders: list[tuple[Any, Callable[[], float]]] = []  # and what they show
        if isinstance(self._run, LiveRun):
            self._joints(server.gui, self._run)
            self._controls(server.gui, self._run)

    def choose(self, body: int | None) -> None:
        """Show this body from now on, or none."""
        self._chosen = body
        self.show()

    def show(self) -> None:
        """Present values."""
        run, body = self._run, self._chosen
        if body is None:
            text = "Click a body; drag it to pull it." if isinstance(run, LiveRun) else "Click a body."
        else:
            part = run.model.bodies[body]
            v, w = run.linear_velocities[body], run.angular_velocities[body]
            rows = {
                "mass": f"{part.mass:.4g} kg" if part.motion == "dynamic" else part.motion,
                "position": vector(run.positions[body], "m"),
                "velocity": f"{vector(v, 'm/s')}, |v| = {np.linalg.norm(v):.3g}",
                "spin": vector(w, "rad/s"),
            }
            if links := [link.name for link in run.model.links if link.body == body]:
                rows["with"] = literal(", ".join(links))
            title = literal(part.name) if part.name else f"body {body}"
            text = f"**{title}**\n\n" + "\n".join(f"- {k}: {t}" for k, t in rows.items())
        if self._text.content != text:
            self._text.content = text
        for slider, shown in self._sliders:  # what a reset, a program or the motion has changed
            value = float(np.clip(shown(), slider.min, slider.max))
            if abs(slider.value - value) > slider.step:
                slider.value = value

    def _joints(self, gui: Any, run: LiveRun) -> None:
        coordinates = [c for c in run.model.coordinates.values() if c.kind in ("hinge", "slide")][:MOST]
        if not coordinates:
            return
        sim = run.simulation
        with gui.add_folder("Joints", expand_by_default=False):
            for c in coordinates:
                low, high = reach(run.model, c.joint, c.dof)
                self._slider(gui, c.name, low, high, lambda entry=c.q.start: sim.q[entry],
                             lambda v, name=c.name: sim.set_q({name: v}))  # fmt: skip

    def _controls(self, gui: Any, run: LiveRun) -> None:
        sim = run.simulation
        if sim.model.control_names:
            with gui.add_folder("Controls"):
                for k, name in enumerate(sim.model.control_names[:MOST]):
                    low, high = control_range(sim.model, k, float(sim.controls[k]))
                    self._slider(gui, name or f"control {k}", low, high, lambda k=k: sim.controls[k],
                                 lambda v, k=k: sim.set_control(k, v))  # fmt: skip

    def _slider(
        self, gui: Any, name: str, low: float, high: float, shown: Callable[[], Any], set_value: Any
    ) -> None:
        """A slider of some hundred round steps that shows a value and sets it."""
        low, high, step = round_steps(low, high)
        value = min(max(float(shown()), low), high)
        slider = gui.add_slider(visible(name), low, high, step, value)
        self._sliders.append((slider, shown))
        post = self._post
        on_user(slider, lambda value: post(lambda: set_value(float(value))))


def reach(model: Model, joint: int, k: int) -> tuple[float, float]:
    """Where a coordinate may be put: within its limits, or half a turn or the model's size either way."""
    dof = model.joints[joint].dofs[k]
    return bounds(dof.lower, dof.upper, math.pi if dof.kind == "hinge" else model.length)


def control_range(model: Model, control: int, now: float) -> tuple[float, float]:
    """Range of a control: that of the coordinate for a position motor."""
    actuator, joint, dof = model.core.controls[control]
    if actuator < 0 and model.joints[joint].dofs[dof].motor.kind == "position":
        return reach(model, joint, dof)
    lower, upper = model.control_limits[control]
    return bounds(lower, upper, 1.0 if actuator >= 0 else max(1.0, 2 * abs(now)))


def bounds(lower: float, upper: float, otherwise: float) -> tuple[float, float]:
    """Limits that a slider can have: where one is infinite, `otherwise`."""
    low = lower if math.isfinite(lower) else min(-otherwise, upper - 2 * otherwise)
    high = upper if math.isfinite(upper) else max(otherwise, low + 2 * otherwise)
    return (low, high) if high > low else (low - 1e-6, low + 1e-6)


def round_steps(low: float, high: float) -> tuple[float, float, float]:
    """Ends and step of a slider whose numbers are short, so that its box does not cut them: 1, 2 or 5 times a
    power of ten, at most STEPS of them, and ends that are multiples of the step within the given ones."""
    least = (high - low) / STEPS
    decade = 10.0 ** math.floor(math.log10(least))
    step = next(decade * k for k in (1, 2, 5, 10) if decade * k >= least * (1 - 1e-9))
    digits = max(0, 1 - math.floor(math.log10(step) + 1e-9))
    first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
    return round(first * step, digits), round(last * step, digits), round(step, digits)


def vector(values: Any, unit: str) -> str:
    return "(" + ", ".join(f"{x:.3g}" for x in values) + f") {unit}"
