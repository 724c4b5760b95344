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
    step, their_step = (digits(beside[ROBOT, engine]["step"], 1e6) for engine in (OURS, OTHER))
    wall = next(row for row in r.simulation if row["name"] == WALL)
    files = r.accuracy("coulomb", 1e-4)
    solved = sum(float(row["residual"]) <= 1e-4 for row in files)
    versions = ", ".join(
        f"{e} {beside[SLOPE, n]['version']}" for e, n in (("amontons", OURS), ("MuJoCo", OTHER))
    )
    lines = [
        f"**{creep} mm/s** creep of a cube at 0.99 of the angle at which it slides; MuJoCo, defaults:"
        f" {theirs} mm/s ([engines]({engines}))",
        f"**{step} µs** per step of a standing robot with four legs; MuJoCo, defaults: {their_step} µs"
        f" ([engines]({engines}); measured with {versions}, {beside[SLOPE, OURS]['date']})",
        f"**{1e3 * float(wall['step']):.0f} ms** per step of {1e3 * float(wall['dt']):.0f} ms of a wall of"
        f" 750 bricks under impact, {float(wall['contacts']):.0f} contacts, on one core, to a residual of"
        f" {float(wall['tolerance']):g} ([benchmarks]({benchmarks}))",
        f"**{solved} of {len(files)}** contact problems of other engines are solved to a residual of 0.0001,"
        f" with Coulomb's law ([benchmarks]({benchmarks}))",
    ]
    return "\n".join(f"- {line}" for line in lines)
