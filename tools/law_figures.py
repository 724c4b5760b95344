"""Draws the figures of docs/friction-clearance-ropes.md: python tools/law_figures.py [FOLDER].

Every curve is a simulation that runs here, beside the closed form where there is one.
"""

import math
import sys
from pathlib import Path

import numpy as np
from amontons import Dof, Joint, Material, ModelBuilder, Motor, Simulation, Transform, shapes
from amontons.parts import PathElement
from concept_figures import BLUE, GREEN, GREY, RED, Figure, plt, write

ALONG_Y = (math.sqrt(0.5), math.sqrt(0.5), 0, 0)  # turns the axis of a cylinder into y


def stick_slip_path(law: Material, speed: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Times (s) and places (m) of a block of 2 kg on a belt, held by a spring of 200 N/m."""
    builder = ModelBuilder(gravity=(0, 0, -10))
    builder.add_geom(None, shapes.Plane(), material=law, surface_velocity=(speed, 0, 0))
    body = builder.add_body(
        "block", shape=shapes.Box((0.1, 0.1, 0.1)), mass=2, position=(0, 0, 0.1), material=law
    )
    slides = (Dof("slide", (1, 0, 0), stiffness=200), Dof("slide", (0, 0, 1)))
    builder.add_joint(Joint("rail", body_a=body, dofs=slides, frame_b=Transform((0, 0, 0.1))))
    block = Simulation(builder.build(), dt=1e-3)
    path: list[float] = []
    block.run(3.0, after_step=lambda sim, report: path.append(sim.state.positions[0, 0]))
    return 1e-3 * np.arange(1, len(path) + 1), np.array(path)


def stick_slip() -> Figure:
    """Left, a block on a belt with one and with two coefficients; right, Stribeck's curve of a joint."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 2.9), layout="constrained", width_ratios=(1.5, 1))
    for law, colour, label in (
        (Material(friction=0.3), GREY, "0.3"),
        (Material(friction=0.3, friction_static=0.5), RED, "0.5 at rest, 0.3 in motion"),
        (Material(friction=0.3, friction_static=0.5, stribeck_speed=0.1), BLUE, "the same, 0.1 m/s"),
    ):
        times, path = stick_slip_path(law)
        left.plot(times, 1e3 * path, color=colour, lw=1.2, label=label)
    left.set(xlabel="time (s)", ylabel="spring (mm)", ylim=(0, 75))
    left.legend(frameon=False, fontsize=7, loc="upper right", ncols=3)
    rates = np.linspace(0.02, 2, 25)
    torques = []
    for rate in rates.tolist():
        builder = ModelBuilder(gravity=(0, 0, 0))
        builder.add_body("wheel", mass=1, inertia=(1, 1, 1))
        motor = Motor("velocity", control=rate)
        builder.add_revolute_joint(
            "wheel",
            point=(0, 0, 0),
            axis=(0, 0, 1),
            friction=1,
            friction_static=2,
            stribeck_speed=0.5,
            motor=motor,
        )
        wheel = Simulation(builder.build())
        wheel.run(0.05)
        torques.append(-wheel.forces.joint_efforts["friction"][0])
    right.plot(rates, 1 + np.exp(-((rates / 0.5) ** 2)), color=GREY, lw=1)
    right.plot(rates, torques, "o", ms=3, color=BLUE)
    right.set(xlabel="rate (rad/s)", ylabel="friction (N m)", ylim=(0, 2.2))
    return figure


def ropes() -> Figure:
    """The ratio of tensions of a rope that slips on a drum over the number of turns."""
    figure, axes = plt.subplots(figsize=(5, 2.9), layout="constrained")
    turns = np.linspace(0, 2, 9)
    for friction, colour in ((0.1, BLUE), (0.2, GREEN), (0.3, RED)):
        found = []
        for more in turns.tolist():
            builder = ModelBuilder(gravity=(0, 0, -10))
            grip = friction * (1 + 2 * more) * math.pi
            for name, x, mass in (("load", 0.0, 1.2 * math.exp(grip)), ("tail", 0.4, 1.0)):
                builder.add_body(name, mass=mass, inertia=(1, 1, 1), position=(x, 0, 0))
                builder.add_prismatic_joint(name, axis=(0, 0, 1))
            drum = PathElement(
                "cylinder",
                None,
                Transform((0.2, 0, 1.5), ALONG_Y),
                0.2,
                (0.2, 0, 2),
                friction=friction,
                turns=more,
            )
            ends = [("load", (0.0, 0.0, 0.0)), drum, ("tail", (0.0, 0.0, 0.0))]
            builder.add_tendon("rope", path=ends, limits=(None, 3 + 0.2 * math.pi * (1 + 2 * more)))
            rope = Simulation(builder.build(), dt=1e-3)
            rope.run(0.05)
            tight, slack = rope.forces.tensions("rope")
            found.append(tight / slack)
        axes.semilogy(turns, np.exp(friction * (1 + 2 * turns) * np.pi), color=colour, lw=1)
        axes.semilogy(turns, found, "o", ms=3, color=colour, label=f"mu = {friction:g}")
    axes.set(xlabel="full turns beside half a turn", ylabel="ratio of tensions")
    axes.legend(frameon=False)
    return figure


def clearance() -> Figure:
    """The centre of a shaft in its bearing: let go at rest, and turned by a motor, for two frictions."""
    figure, panels = plt.subplots(1, 2, figsize=(8, 2.9), layout="constrained")
    for axes, motor, title in (
        (panels[0], Motor(), "let go"),
        (panels[1], Motor("velocity", 30.0), "turned"),
    ):
        axes.add_patch(plt.Circle((0, 0), 1, fc="none", ec=GREY))
        for friction, colour in ((0.05, BLUE), (0.5, RED)):
            builder = ModelBuilder(gravity=(0, -10, 0))
            builder.add_body("shaft", mass=2, inertia=(0.01, 0.01, 0.01))
            builder.add_revolute_joint(
                "shaft", point=(0, 0, 0), axis=(0, 0, 1), clearance=1e-3, journal_radius=0.1,
                clearance_friction=friction, motor=motor,
            )  # fmt: skip
            shaft = Simulation(builder.build(), dt=1e-4)
            shaft.q = [0.6e-3, 0.3e-3, 0]
            path = [shaft.q[:2].copy()]
            shaft.run(0.2, after_step=lambda sim, report, path=path: path.append(sim.q[:2].copy()))
            x, y = 1e3 * np.array(path).T
            axes.plot(x, y, color=colour, lw=1, label=f"mu = {friction:g}")
            axes.plot(x[-1], y[-1], "o", ms=4, color=colour)
        axes.set(title=title, aspect="equal", xlabel="mm", ylabel="mm")
        axes.legend(frameon=False, fontsize=7, loc="upper right")
    return figure


FIGURES = {"friction": stick_slip, "ropes": ropes, "clearance": clearance}


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("docs/figures"), FIGURES, "laws")
