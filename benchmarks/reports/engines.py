"""The tables of docs/engines.md and docs/engine-curves.md, and the figures in their sentences."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from statistics import median
from typing import Protocol

from beside.figure import error, finished, label
from tables import digits, milliseconds, scientific, table

Rows = list[dict[str, str]]
FIGURE = re.compile(r"(\S+) (\S+) <!-- (\S+) \| ([^|]+) \| (\w+) -->")
"""A number, its unit, and a comment with scene, engine and column of beside.csv that it is taken from."""
UNITS = {"mm": 1e3, "mm/s": 1e3, "us": 1e6, "ms": 1e3, "%": 1e2, "times": 1.0, "um": 1e6, "m": 1.0}


class Results(Protocol):
    """The rows of the CSV files of these tables."""

    beside: Rows
    solvers: Rows
    growth: Rows
    exponents: Rows
    deadlines: Rows
    budgets: Rows

    def origin(self, *names: str) -> str: ...


def with_figures(text: str, rows: Rows) -> str:
    """The text with the numbers before such comments as they are in the rows, at the time step of the
    scene."""
    known = {(r["scene"], r["engine"]): r for r in rows if r["steps_per_dt"] == "1"}

    def renewed(found: re.Match[str]) -> str:
        _, unit, scene, engine, column = found.groups()
        value = digits(known[scene, engine][column], UNITS[unit])
        return f"{value} {unit} <!-- {scene} | {engine} | {column} -->"

    return FIGURE.sub(renewed, text)


def engine_table(r: Results) -> str:
    """All engines on the same scenes at the time step of each; blank is what a scene does not have or ask
    for."""

    def cell(row: dict[str, str], key: str, scale: float) -> str:
        return digits(row[key], scale) if row[key] != "" else ""

    def end(row: dict[str, str]) -> str:
        if row["lost"] == "True":
            return "lost"
        return "" if row["complete"] == "True" else f"{row['steps']} steps"

    rows = [
        (row["case"], row["engine"], digits(row["dt"], 1e3), digits(row["step"], 1e6),
         cell(row, "penetration", 1e3), cell(row, "creep", 1e3), cell(row, "lift", 1e3), cell(row, "law", 1),
         cell(row, "joint_error", 1e3), cell(row, "energy_rise", 1), cell(row, "energy_drift", 1e2),
         cell(row, "restored", 1e3), cell(row, "repeated", 1e3), cell(row, "deviation", 1e3),
         cell(row, "measured", 1e3), end(row))
        for row in r.beside if row["steps_per_dt"] == "1"
    ]  # fmt: skip
    header = ("scene", "engine", "h (ms)", "us a step", "overlap (mm)", "creep (mm/s)", "lift (mm)", "law",
              "joint gap (mm)", "energy rises (J)", "drifts (%)", "restored (mm)", "repeated (mm)",
              "deviates (mm)", "from measured (mm)", "ended")  # fmt: skip
    return table(header, rows)


def best(rows: Sequence[dict[str, str]]) -> dict[str, str] | None:
    """The finished row with the least error; the cheaper one of two that are below 1 nm."""
    done = [row for row in rows if finished(row)]
    return min(done, key=lambda row: (max(error(row), 1e-9), float(row["cost"])), default=None)


def summary_table(r: Results, only: Sequence[str] = ()) -> str:
    """A scene a row, an engine a column: the least error over its settings and steps, and its cost."""
    families = list(dict.fromkeys(row["family"] for row in r.beside))
    lines = []
    for case in dict.fromkeys(row["case"] for row in r.beside if not only or row["scene"] in only):
        cells = [case]
        for family in families:
            mine = [row for row in r.beside if (row["case"], row["family"]) == (case, family)]
            found = best(mine)
            if found is None:
                cells.append("not finished" if mine else "")
                continue
            off = error(found)
            cells.append(("< 1e-6" if off < 1e-9 else "inf" if math.isinf(off) else digits(str(off), 1e3))
                         + f"; {digits(found['cost'], 1e3)}")  # fmt: skip
        lines.append(cells)
    return table(("scene: error (mm); ms per simulated second", *map(label, families)), lines)


def settings_table(r: Results) -> str:
    """What each engine was given, and the page of its manual."""
    rows = {
        row["engine"]: (row["engine"], row["version"],
                        f"`{row['options']}`" if row["options"] else "defaults",
                        f"[{row['engine'].partition(',')[0]}]({row['manual']})")
        for row in r.beside
    }  # fmt: skip
    return table(("setting", "version", "options", "manual"), list(rows.values()))


def solver_table(r: Results) -> str:
    """A solver and a tolerance a line, for files and steps: the problems solved by each measure, and the time
    over ours."""
    ours = {(row["file"], row["tolerance"]): row for row in r.solvers if row["solver"] == "amontons"}
    lines = []

    def group(row: dict[str, str]) -> tuple[str, str, str]:
        kind = "steps" if row["file"].startswith("step ") else "files"
        return kind, row["solver"], row["tolerance"]

    for kind, solver, tolerance in dict.fromkeys(map(group, r.solvers)):
        mine = [row for row in r.solvers if group(row) == (kind, solver, tolerance)]
        answered = [row for row in mine if row["time"]]
        by_ours, by_theirs = (
            sum(float(row[key]) <= float(tolerance) for row in answered) for key in ("residual", "error")
        )
        ratios = [
            float(row["time"]) / float(ours[row["file"], tolerance]["time"])
            for row in answered
            if row["solved"] == ours[row["file"], tolerance]["solved"] == "True"
        ]
        faster = sum(ratio < 1 for ratio in ratios)
        lines.append((kind, solver, scientific(tolerance), f"{len(mine)}", f"{by_ours}", f"{by_theirs}",
                      f"{len(mine) - len(answered)}", digits(str(median(ratios)), 1) if ratios else "",
                      f"{faster} of {len(ratios)}"))  # fmt: skip
    header = ("problems of", "solver", "asked for", "problems", "solved, by our residual",
              "solved, by Siconos' error", "without answer", "median time over ours",
              "faster than ours")  # fmt: skip
    return table(header, lines)


def load(r: Results) -> str:
    """On what machine the times were measured, and what ran beside."""
    machines = ", ".join(dict.fromkeys(row["machine"] for row in r.beside))
    loads = [float(row["load"]) for row in r.beside]
    programs = f"{median(loads):.2g} programs at work (median), {max(loads):.2g} at most"
    return f"Times: one core of an {machines}; {programs}. On an idle machine it is one or two."


def growth_table(r: Results) -> str:
    """A line per family and engine: ms a step by size, and the exponent."""
    exponents = {(row["family"], row["engine"]): float(row["exponent"]) for row in r.exponents}
    groups: dict[tuple[str, str], list[str]] = {}
    for row in r.growth:
        cells = groups.setdefault((row["family"], row["engine"]), [])
        if row["step"] != "":
            cells.append(f"{float(row['size']):g}: {milliseconds(row['step'])}")
    rows = [
        (family, engine, ", ".join(cells), f"{exponents[family, engine]:.2f}")
        for (family, engine), cells in groups.items()
    ]
    return table(("family", "engine", "size: ms a step", "exponent"), rows)


def exponent_table(r: Results) -> str:
    """A line per family, a column per engine: the slope of log(time) over log(size)."""
    found = {(row["family"], row["engine"]): f"{float(row['exponent']):z.2f}" for row in r.exponents}
    engines = list(dict.fromkeys(engine for _, engine in found))
    families = dict.fromkeys(family for family, _ in found)
    rows = [(family, *(found.get((family, engine), "") for engine in engines)) for family in families]
    return table(("family", *engines), rows)


def late(row: dict[str, str]) -> tuple[str, str, str]:
    """The limit, how many ended in time, and how late the last one was."""
    return milliseconds(row["limit"]), f"{row['in_time']} of {row['times']}", digits(row["late_worst"], 1e3)


def budget_table(r: Results) -> str:
    rows = [
        (row["scene"], *late(row), row["most_contacts"], digits(row["iterations_median"], 1),
         scientific(row["residual_median"]), digits(row["penetration"], 1e3), digits(row["joint_gap"], 1e3),
         digits(row["energy_gain"], 1), row["unbalanced"])
        for row in r.budgets
    ]  # fmt: skip
    header = ("scene", "a step has (ms)", "in time", "latest (ms)", "contacts", "iterations",
              "median residual", "overlap (mm)", "joints apart (mm)", "energy gained (J)",
              "such steps")  # fmt: skip
    return table(header, rows)


def deadline_table(r: Results) -> str:
    """Of each method: all that ended in time, and the latest, over both laws."""
    groups: dict[tuple[str, str, str], list[dict[str, str]]] = {}
    for row in r.deadlines:
        groups.setdefault((row["problem"], row["method"], row["limit"]), []).append(row)
    rows = []
    for (problem, method, limit), laws in groups.items():
        in_time, times = (sum(int(row[key]) for row in laws) for key in ("in_time", "times"))
        latest = max((row["late_worst"] for row in laws), key=float)
        residuals = ", ".join(scientific(row["residual"]) for row in laws)
        rows.append((problem, f"`{method}`", milliseconds(limit), f"{in_time} of {times}",
                     digits(latest, 1e3), residuals))  # fmt: skip
    header = (
        "problem",
        "method",
        "a solve has (ms)",
        "in time",
        "latest (ms)",
        "residuals, associated and coulomb",
    )
    return table(header, rows)


def curves(r: Results, link: str) -> str:
    """What docs/engine-curves.md shows."""
    parts = ["## Least error of each engine", r.origin("beside.csv"), load(r), summary_table(r)]
    parts += ["## Settings", settings_table(r)]
    if r.solvers:
        parts += ["## Solvers, table", r.origin("solvers.csv"), solver_table(r)]
    parts += ["## Growth, table", r.origin("growth.csv", "exponents.csv"), exponent_table(r)]
    parts += [f"[Times of a step by size]({link}#growth)."]
    if r.budgets:
        parts += ["## Stopped by the clock, table", r.origin("budgets.csv"), budget_table(r)]
    parts += [f"[All rows]({link})."]
    return "\n\n".join(parts)
