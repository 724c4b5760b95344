"""Draws the figures of docs/concepts.md into docs/figures: python tools/concept_figures.py [FOLDER].

Where a figure shows motion or a solve, it is one that amontons computes here; nothing is drawn by hand.
"""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import amontons
import matplotlib
import numpy as np
from amontons import Material, ModelBuilder, Simulation, shapes

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

BLUE, RED, GREEN, GREY = "#3b6fb6", "#c0392b", "#2e8b57", "#777777"


def arrow(axes: Axes, start: Sequence[float], end: Sequence[float], colour: str, label: str = "") -> None:
    axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.8})
    if label:
        axes.annotate(label, end, xytext=(4, 4), textcoords="offset points", color=colour)


def bare(axes: Axes) -> None:
    axes.set_aspect("equal")
    axes.axis("off")


def gap() -> Figure:
    """Left, what a gap is; right, a ball that comes down, at three step sizes."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 2.9), layout="constrained", width_ratios=(1, 1.5))
    bare(left)
    left.add_patch(plt.Circle((0, 1.35), 0.8, fc="#dbe6f5", ec=BLUE))
    left.fill_between([-1.6, 1.6], -0.45, 0, color="#e6e6e6")
    left.plot([-1.6, 1.6], [0, 0], color=GREY)
    left.annotate("", (0, 0.55), (0, 0), arrowprops={"arrowstyle": "<->", "color": RED})
    left.text(0.08, 0.2, r"gap $\Phi$", color=RED)
    arrow(left, (-1.2, 0), (-1.2, 0.8), GREEN)
    left.text(-1.6, 0.9, "normal n,\nB to A", color=GREEN)
    left.text(0, 1.35, "A", ha="center", va="center")
    left.text(0, -0.28, "B", ha="center", va="center")
    left.set(xlim=(-1.7, 1.9), ylim=(-0.5, 2.3))

    for dt, colour in ((0.04, RED), (0.02, BLUE), (0.005, GREEN)):
        builder = ModelBuilder()
        builder.add_floor()
        builder.add_body(shape=shapes.Sphere(0.1), mass=1, position=(0, 0, 0.3))
        ball = Simulation(builder.build(), dt=dt)
        times, gaps = [0.0], [0.2]
        while ball.time < 0.3:
            ball.step()
            times.append(ball.time)
            gaps.append(ball.state.positions[0, 2] - 0.1)
        right.plot(times, gaps, "o-", ms=3, lw=1, color=colour, label=f"h = {dt * 1e3:g} ms")
    exact = np.linspace(0, np.sqrt(0.4 / 9.81), 100)
    right.plot(exact, 0.2 - 9.81 / 2 * exact**2, "--", color=GREY, lw=1, label="free fall")
    right.axhline(0, color="k", lw=0.6)
    right.set(xlabel="time (s)", ylabel="gap (m)")
    right.legend(frameon=False)
    return figure


def cones() -> Figure:
    """The impulse in its cone and the velocity, for a contact that is open, sticks, slides."""
    figure, panels = plt.subplots(1, 3, figsize=(8, 2.9), layout="constrained", sharey=True)
    mu = 0.6
    edge = np.array([mu, 1.0])
    cases = (
        ("open: no impulse, u leaves", (0, 0), (0.35, 0.7)),
        ("sticks: x inside, u = 0", (0.3, 1.2), (0, 0)),
        ("slides: x on the edge, against u", tuple(1.15 * edge), (-0.85, 0)),
    )
    for axes, (title, x, u) in zip(panels, cases, strict=True):
        bare(axes)
        axes.fill([0, 1.7 * edge[0], -1.7 * edge[0]], [0, 1.7, 1.7], color="#dbe6f5", ec=BLUE)
        axes.plot([-1.2, 1.2], [0, 0], color=GREY)
        if x != (0, 0):
            arrow(axes, (0, 0), x, BLUE, "x")
        if u != (0, 0):
            arrow(axes, (0, 0), u, RED, "u")
        axes.plot(0, 0, "ko", ms=3)
        axes.set_title(title, fontsize=9)
        axes.set(xlim=(-1.25, 1.25), ylim=(-0.25, 1.8))
    panels[0].text(-0.4, 1.5, r"$|x_t| \leq \mu x_n$", fontsize=8, color=BLUE)
    return figure


def laws() -> Figure:
    """A cube that is launched at 6 m/s, under both laws."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 2.7), layout="constrained")
    for law, colour in (("coulomb", BLUE), ("associated", RED)):
        cube = Simulation(amontons.scenes.sliding_cube(speed=6, mu=0.5), dt=1e-3, law=law)
        seen = []
        cube.run(
            1.5,
            after_step=lambda sim, report, seen=seen: seen.append(
                (sim.time, sim.state.positions[0, 2] - 0.1, sim.state.linear_velocities[0, 0])
            ),
        )
        time, lift, speed = np.array(seen).T
        left.plot(time, 1e3 * lift, color=colour, label=law)
        right.plot(time, speed, color=colour, label=law)
    left.set(xlabel="time (s)", ylabel="lift (mm)")
    right.set(xlabel="time (s)", ylabel="speed (m/s)")
    left.legend(frameon=False)
    return figure


def residual() -> Figure:
    """Left, the natural map of one cone; right, what it is worth: errors against the residual."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.1), layout="constrained")
    bare(left)
    mu = 0.6
    left.fill([0, 2 * mu, -2 * mu], [0, 2, 2], color="#dbe6f5", ec=BLUE)
    x, step = np.array([0.3, 1.2]), np.array([-1.35, 0.35])
    trial = x - step
    foot = np.array([mu, 1.0]) * (mu * trial[0] + trial[1]) / (1 + mu**2)
    arrow(left, x, trial, GREY)
    arrow(left, trial, foot, GREEN)
    arrow(left, foot, x, RED)
    for point, label, offset in (
        (x, "x", (-12, 2)),
        (trial, r"$x - P^{-1} g$", (4, -10)),
        (foot, r"$\Pi_K(x - P^{-1} g)$", (6, 4)),
    ):
        left.plot(*point, "ko", ms=3)
        left.annotate(label, point, xytext=offset, textcoords="offset points")
    left.text(0.05, 1.62, "natural map", color=RED)
    left.set(xlim=(-1.3, 2.6), ylim=(-0.1, 2.1))

    problem = amontons.vi.read_problem("examples/problems/plates.hdf5")
    exact = problem.solve(tolerance=1e-13).u
    seen = []
    for tolerance in 10.0 ** np.arange(-1, -9, -0.5):
        solution = problem.solve(method="apgd", tolerance=tolerance)
        seen.append((solution.residual, abs(solution.u - exact).max()))
    right.loglog(*np.array(seen).T, "o-", color=BLUE, ms=3)
    right.set(xlabel="residual", ylabel="largest error of a velocity (m/s)")
    right.grid(alpha=0.3)
    return figure


def implicit() -> Figure:
    """A box on a floor: a stiff spring in explicit steps, and the step that knows the contact."""
    figure, panels = plt.subplots(1, 2, figsize=(8, 2.8), layout="constrained", sharey=True)
    mass, height = 1.0, 0.05
    for axes, dt in zip(panels, (1e-3, 5e-3), strict=True):
        for stiffness, colour in ((1e4, GREEN), (1e6, RED)):  # N/m
            z, v, path = height, 0.0, [height]
            for _ in range(round(0.4 / dt)):
                force = max(0.0, -stiffness * z - 2 * 0.1 * np.sqrt(stiffness * mass) * v) if z < 0 else 0.0
                v += dt * (force / mass - 9.81)
                z += dt * v
                path.append(z)
            label = f"spring of {stiffness:.0e} N/m, h w = {dt * np.sqrt(stiffness / mass):.1f}"
            axes.plot(dt * np.arange(len(path)), 1e3 * np.array(path), color=colour, lw=1, label=label)
        builder = ModelBuilder()
        builder.add_geom(None, shapes.Plane(), material=Material(friction=0.5))
        builder.add_body(shape=shapes.Box((0.1, 0.1, 0.1)), mass=mass, position=(0, 0, 0.1 + height))
        box = Simulation(builder.build(), dt=dt)
        path = [height]
        box.run(0.4, after_step=lambda sim, report, path=path: path.append(sim.state.positions[0, 2] - 0.1))
        axes.plot(dt * np.arange(len(path)), 1e3 * np.array(path), color=BLUE, lw=2, label="amontons")
        axes.set(title=f"h = {dt * 1e3:g} ms", xlabel="time (s)", ylim=(-15, 130))
        axes.axhline(0, color="k", lw=0.6)
        axes.legend(frameon=False, fontsize=7, loc="upper right")
    panels[0].set_ylabel("gap (mm)")
    return figure


FIGURES = {"gap": gap, "cones": cones, "laws": laws, "residual": residual, "implicit": implicit}


def write(folder: Path, figures: dict[str, Callable[[], Figure]], prefix: str) -> None:
    """Every figure as PREFIX-NAME.svg in the folder."""
    plt.rcParams.update({"font.size": 9, "svg.hashsalt": "amontons", "axes.spines.top": False})
    plt.rcParams["savefig.transparent"] = True
    plt.rcParams["axes.spines.right"] = False
    for name, draw in figures.items():
        figure = draw()
        path = folder / f"{prefix}-{name}.svg"
        figure.savefig(path, metadata={"Date": None})
        plt.close(figure)
        print(path)


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("docs/figures"), FIGURES, "concept")
