"""Views of the tables beside other engines: docs/engines.md, docs/engine-curves.md, the first pages."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from statistics import linear_regression, median
from typing import Any

from beside.figure import error, finished, label
from targets import accuracy
from views import Results, Row, Rows, Spec, digits, grouped, table, view

WALL, ROBOT, SLOPE = "B4 wall under impact", "quadruped", "incline-0.99"
OURS, OTHER = "amontons, 1e-6", "MuJoCo"


def numbers(r: Results, benchmarks: str, engines: str) -> str:
    """The four figures of the home page and of the README; the links lead to the pages of these names."""
    beside = {(row["scene"], row["engine"]): row for row in r["beside"] if row["steps_per_dt"] == "1"}
    creep, theirs = (digits(beside[SLOPE, engine]["creep"], 1e3) for engine in (OURS, OTHER))
    step, their_step = (digits(beside[ROBOT, engine]["step"], 1e6) for engine in (OURS, OTHER))
    wall = next(row for row in r["simulation"] if row["name"] == WALL)
    files = accuracy(r["files"], "coulomb", 1e-4)
    solved = sum(float(row["residual"]) <= 1e-4 for row in files)
    versions = ", ".join(
        f"{e} {beside[SLOPE, n]['version']}" for e, n in (("amontons", OURS), ("MuJoCo", OTHER))
    )
    lines = [
        f"**{creep} mm/s** creep of a cube at 0.99 of the angle at which it slides; MuJoCo, defaults:"
        f" {theirs} mm/s ([engines]({engines}))",
        f"**{step} µs** per step of a robot with four legs that falls; MuJoCo, defaults: {their_step} µs"
        f" ([engines]({engines}); measured with {versions}, {beside[SLOPE, OURS]['date']})",
        f"**{1e3 * float(wall['step']):.0f} ms** per step of {1e3 * float(wall['dt']):.0f} ms of a wall of"
        f" 750 bricks under impact, {float(wall['contacts']):.0f} contacts, on one core, to a residual of"
        f" {float(wall['tolerance']):g} ([benchmarks]({benchmarks}))",
        f"**{solved} of {len(files)}** contact problems of other engines are solved to a residual of 0.0001,"
        f" with Coulomb's law ([benchmarks]({benchmarks}))",
    ]
    return "\n".join(f"- {line}" for line in lines)


def best(rows: Rows) -> Row | None:
    """The finished row with the least error; the cheaper one of two that are below 1 nm."""
    done = [row for row in rows if finished(row)]
    return min(done, key=lambda row: (max(error(row), 1e-9), float(row["cost"])), default=None)


def least(beside: Rows, case: str, family: str) -> tuple[str, str]:
    """The least error (mm) of an engine in a scene over its settings and steps, and its cost (ms/s)."""
    mine = [row for row in beside if (row["case"], row["family"]) == (case, family)]
    found = best(mine)
    if found is None:
        return "not finished" if mine else "", ""
    off = error(found)
    shown = "< 1e-6" if off < 1e-9 else "inf" if math.isinf(off) else digits(str(off), 1e3)
    if str(found["off"]) == "":  # the scene has no answer
        shown = ""
    return shown, digits(found["cost"], 1e3)


def versions(beside: Rows) -> str:
    """Which versions were measured, and when."""
    found = dict.fromkeys(f"{label(row['family'])} {row['version']}" for row in beside)
    dates = sorted({row["date"] for row in beside})
    return f"Measured with {', '.join(found)}; {' to '.join(dict.fromkeys((dates[0], dates[-1])))}."


def summary_table(beside: Rows) -> str:
    """A scene a row, two columns for each engine: the least error and its cost."""
    cases, families = (list(dict.fromkeys(row[key] for row in beside)) for key in ("case", "family"))
    lines = [(case, *(text for family in families for text in least(beside, case, family))) for case in cases]
    header = [text for family in families for text in (f"{label(family)} (mm)", "(ms/s)")]
    return table(("scene: error, time per simulated second", *header), lines)


SETTINGS: dict[str, Spec] = {
    "setting, with its manual": lambda row: f"[{row['engine']}]({row['manual']})", "version": "version",
    "options": lambda row: f"`{row['options']}`" if row["options"] else "defaults",
}  # fmt: skip
"""What each engine was given, and the page of its manual."""


def solver_table(rows: Rows) -> str:
    """A solver a line, for files and steps, a number per tolerance: the problems solved by each measure, and
    the time over ours where both solve."""
    ours = {(row["file"], row["tolerance"]): row for row in rows if row["solver"] == "amontons"}
    kinds = [{"kind": "steps" if row["file"].startswith("step ") else "files", **row} for row in rows]
    lines = []
    for (kind, solver), own in grouped(kinds, "kind", "solver").items():
        cells = []
        for (tolerance,), mine in grouped(own, "tolerance").items():
            answered = [row for row in mine if row["time"]]
            by_ours, by_theirs = (
                sum(float(row[key]) <= float(tolerance) for row in answered) for key in ("residual", "error")
            )
            ratios = [
                float(row["time"]) / float(ours[row["file"], tolerance]["time"])
                for row in answered
                if row["solved"] == ours[row["file"], tolerance]["solved"] == "True"
            ]
            middle = digits(str(median(ratios)), 1) if ratios else "-"
            faster = f"{sum(ratio < 1 for ratio in ratios)} of {len(ratios)}"
            cells.append((f"{by_ours}", f"{by_theirs}", f"{len(mine) - len(answered)}", middle, faster))
        lines.append((f"{len(mine)} {kind}", solver, *map(", ".join, zip(*cells, strict=True))))
    header = ("problems", "solver", "solved, by our residual", "solved, by Siconos' error", "without answer",
              "median time over ours", "faster than ours")  # fmt: skip
    return table(header, lines)


def load(beside: Rows) -> str:
    """On what machine the times were measured, and what ran beside."""
    machines = ", ".join(dict.fromkeys(row["machine"] for row in beside))
    loads = [float(row["load"]) for row in beside]
    programs = f"{median(loads):.2g} programs at work (median), {max(loads):.2g} at most"
    return f"Times: one core of an {machines}; {programs}. On an idle machine it is one or two."


def exponent(rows: Iterable[Mapping[str, Any]]) -> float:
    """The slope of log(time of a step) over log(size) by least squares."""
    points = [(math.log(float(r["size"])), math.log(float(r["step"]))) for r in rows if r["step"] != ""]
    return linear_regression(*zip(*points, strict=True)).slope if len(points) > 1 else math.nan


LARGER = {
    "wall, rows": "rows of a wall", "plates 1:100": "number of plates",
    "chain, links": "links of a chain", "spheres in a box": "number of spheres",
}  # fmt: skip


def growth_words(rows: Rows) -> str:
    """Which engine grows faster between the smallest and the largest size that both have; where 1e-3 costs
    more than 1e-6 at the largest size."""
    times: dict[tuple[str, str], dict[float, float]] = {}
    for row in rows:
        if row["step"]:
            times.setdefault((row["family"], row["engine"]), {})[float(row["size"])] = float(row["step"])
    faster: dict[str, list[str]] = {"MuJoCo": [], "amontons": []}
    dearer = []
    for family, words in LARGER.items():
        loose, ours, theirs = (times[family, name] for name in ("amontons, 1e-3", OURS, OTHER))
        sizes = sorted(ours.keys() & theirs.keys())
        ratios = [theirs[size] / ours[size] for size in (sizes[0], sizes[-1])]
        faster["MuJoCo" if ratios[1] > ratios[0] else "amontons"].append(words)
        largest = max(loose.keys() & ours.keys())
        if loose[largest] > ours[largest]:
            dearer.append(words)
    grow = "; ".join(f"{engine} with {', '.join(words)}" for engine, words in faster.items() if words)
    more = (
        f" A step to 1e-3 takes longer than one to 1e-6 at the largest size of {', '.join(dearer)}."
        if dearer
        else ""
    )
    return f"The time grows faster than that of the other engine: {grow}.{more}"


def growth_table(r: Results) -> str:
    """A line per family, a column per engine: the exponent of the time of a step over the size."""
    found = {key: f"{exponent(rows):z.2f}" for key, rows in grouped(r["growth"], "family", "engine").items()}
    families, engines = (list(dict.fromkeys(names)) for names in zip(*found, strict=True))
    rows = [(family, *(found.get((family, engine), "") for engine in engines)) for family in families]
    return table(("family", *engines), rows)


BUDGETS: dict[str, Spec] = {
    "scene": "scene", "a step has (ms)": "limit ms",
    "in time": lambda row: f"{row['in_time']} of {row['times']}", "latest (ms)": "late_worst x1e3",
    "contacts": "most_contacts", "iterations": "iterations_median x1",
    "median residual": "residual_median .1e", "overlap (mm)": "penetration x1e3",
    "joints apart (mm)": "joint_gap x1e3", "energy gained (J)": "energy_gain x1", "such steps": "unbalanced",
}  # fmt: skip


def curves(r: Results, link: str) -> str:
    """What docs/engine-curves.md shows."""
    beside = r["beside"]
    settings = list({row["engine"]: row for row in beside}.values())
    parts = ["## Least error of each engine", r.origin("beside"), load(beside), summary_table(beside)]
    parts += ["## Settings", view(settings, SETTINGS)]
    if solvers := r["solvers"]:
        asked = "Numbers are for 1e-4, 1e-6 and 1e-8."
        parts += ["## Solvers, table", f"{r.origin('solvers')}. {asked}", solver_table(solvers)]
    parts += ["## Growth, table", r.origin("growth"), growth_table(r)]
    parts += [f"[Times of a step by size]({link}/growth.csv)."]
    if budgets := r["budgets"]:
        parts += ["## Stopped by the clock, table", r.origin("budgets"), view(budgets, BUDGETS)]
    return "\n\n".join([*parts, f"[All rows]({link}/tables.csv)."])
