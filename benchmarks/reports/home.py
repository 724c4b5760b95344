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
        f"A cube at 0.99 of the angle at which it slides **creeps by {creep} mm/s**; MuJoCo, defaults:"
        f" {theirs} mm/s ([engines]({engines})).",
        f"A standing robot with four legs takes **{step} µs per step**; MuJoCo, defaults: {their_step} µs"
        f" ([engines]({engines})). Both lines: {versions}, {beside[SLOPE, OURS]['date']}.",
        f"A wall of 750 bricks under impact, {float(wall['contacts']):.0f} contacts, takes"
        f" **{1e3 * float(wall['step']):.0f} ms per step** of {1e3 * float(wall['dt']):.0f} ms on one core,"
        f" to a residual of {float(wall['tolerance']):g} ([benchmarks]({benchmarks})).",
        f"**{solved} of {len(files)}** contact problems of other engines are solved to a residual of 0.0001,"
        f" with Coulomb's law ([benchmarks]({benchmarks})).",
    ]
    return "\n".join(f"- {line}" for line in lines)
