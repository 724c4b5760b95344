"""What is picked, and sliders for what moves it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.model import Model
from .events import on_user
from .runs import LiveRun

if TYPE_CHECKING:
    import viser

    from .viewer import Viewer

MOST = 40
"""Sliders of a kind; of a larger model those of the first."""


class Inspector:
    """Name, mass and velocity of the chosen body; sliders of joints and controls."""

    def __init__(self, server: viser.ViserServer, viewer: Viewer) -> None:
        self._viewer, self._run = viewer, viewer.run
        with server.gui.add_folder("Body"):
            self._text = server.gui.add_markdown("Click a body; drag it to pull it.")
        self._sliders: list[tuple[Any, int]] = []  # of joints, with the entry of q
        if isinstance(self._run, LiveRun):
            self._joints(server.gui, self._run)
            self._controls(server.gui, self._run)

    def show(self) -> None:
        """Values of now."""
        run, body = self._run, self._viewer.chosen
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
            text = f"**{part.name or f'body {body}'}**\n\n" + "\n".join(
                f"- {k}: {t}" for k, t in rows.items()
            )
        if self._text.content != text:
            self._text.content = text
        if self._sliders and isinstance(run, LiveRun):
            q = run.simulation.q
            for slider, entry in self._sliders:
                value = float(np.clip(q[entry], slider.min, slider.max))
                if abs(slider.value - value) > slider.step:
                    slider.value = value

    def _joints(self, gui: Any, run: LiveRun) -> None:
        coordinates = [c for c in run.model.coordinates.values() if c.kind in ("hinge", "slide")][:MOST]
        if not coordinates:
            return
        q = run.simulation.q
        with gui.add_folder("Joints", expand_by_default=False):
            for c in coordinates:
                dof = run.model.joints[c.joint].dofs[c.dof]
                low, high = bounds(dof.lower, dof.upper, math.pi if c.kind == "hinge" else run.model.length)
                slider = add_slider(gui, c.name, low, high, float(q[c.q][0]))
                self._sliders.append((slider, c.q.start))
                _on_slide(self._viewer, slider, lambda v, name=c.name: run.simulation.set_q({name: v}))

    def _controls(self, gui: Any, run: LiveRun) -> None:
        sim = run.simulation
        if sim.model.actuators:
            with gui.add_folder("Controls"):
                for k, drive in enumerate(sim.model.actuators[:MOST]):
                    low, high = bounds(drive.lower_control, drive.upper_control, 1.0)
                    slider = add_slider(gui, drive.name or f"actuator {k}", low, high, float(sim.controls[k]))
                    _on_slide(self._viewer, slider, lambda v, k=k: sim.set_control(k, v))
        if motors := list(motors_of(sim.model))[:MOST]:
            with gui.add_folder("Motors"):
                for name, joint, dof in motors:
                    target = float(sim.state.targets[sim.model.dof_index(joint, dof)])
                    reach = max(1.0, 2 * abs(target))
                    slider = add_slider(gui, name, -reach, reach, target)
                    _on_slide(
                        self._viewer, slider, lambda v, joint=joint, dof=dof: sim.set_target(joint, v, dof)
                    )


def motors_of(model: Model) -> Any:
    """(name, joint, dof) of every degree of freedom with a motor."""
    for j, joint in enumerate(model.joints):
        for k, dof in enumerate(joint.dofs):
            if dof.motor.kind != "none":
                yield (dof.name or joint.name or f"joint {j}") + f" ({dof.motor.kind})", j, k


def bounds(lower: float, upper: float, otherwise: float) -> tuple[float, float]:
    """Limits that a slider can have: where one is infinite, `otherwise`."""
    low = lower if math.isfinite(lower) else min(-otherwise, upper - 2 * otherwise)
    high = upper if math.isfinite(upper) else max(otherwise, low + 2 * otherwise)
    return (low, high) if high > low else (low - 1e-6, low + 1e-6)


def add_slider(gui: Any, name: str, low: float, high: float, value: float) -> Any:
    """With a thousand steps."""
    return gui.add_slider(name, low, high, (high - low) / 1000, min(max(value, low), high))


def vector(values: Any, unit: str) -> str:
    return "(" + ", ".join(f"{x:.3g}" for x in values) + f") {unit}"


def _on_slide(viewer: Viewer, slider: Any, set_value: Any) -> None:
    on_user(slider, lambda value: viewer.post(lambda: set_value(float(value))))
