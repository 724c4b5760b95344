"""The four figures of the home page and of the README, from the tables of results."""

from __future__ import annotations

from tables import digits
from reports.targets import Results

WALL, ROBOT, SLOPE = "B4 wall under impact", "quadruped", "incline-0.99"
OURS, OTHER = "amontons, 1e-6", "MuJoCo"


def numbers(r: Results, benchmarks: str, engines: str) -> str:
    """A list of four; the links lead to the pages on benchmarks and on engines."""
    beside = {(row["scene"], row["engine"]): row for row in r.beside if row["steps_per_dt"] == "1"}
    creep, theirs = (digits(beside[SLOPE, engine]["creep"], 1e3) for engine in (OURS, OTHER))
    step = digits(beside[ROBOT, OURS]["step"], 1e6)
    wall = next(row for row in r.simulation if row["name"] == WALL)
    files = r.accuracy("coulomb", 1e-4)
    solved = sum(float(row["residual"]) <= 1e-4 for row in files)
    lines = [
        f"**{creep} mm/s** creep of a cube at 0.99 of its angle of friction; MuJoCo, defaults: {theirs} mm/s"
        f" ([engines]({engines}))",
        f"**{solved} of {len(files)}** contact problems of other engines solved to 1e-4, exact friction"
        f" ([benchmarks]({benchmarks}))",
        f"**{1e3 * float(wall['step']):.0f} ms** a step of the wall under impact, with"
        f" {float(wall['contacts']):.0f} contacts, on one core",
        f"**{step} us** a step of a robot with four legs on the ground ([models]({engines}))",
    ]
    return "\n".join(f"- {line}" for line in lines)
