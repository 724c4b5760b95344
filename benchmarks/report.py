"""The tables of the documents, views of the CSV files of a folder of results.

    python benchmarks/report.py FOLDER [--docs]

Prints what was wanted and reached. --docs renews the parts between markers (`documents`), and the numbers in
sentences that a comment follows: `FIGURE` of beside.csv, `CELL` of any table.
"""

from __future__ import annotations

import argparse
import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from statistics import geometric_mean, linear_regression, median
from typing import Any

from common import ROOT
from figures import error, finished, label
from targets import accuracy, file_targets, half_profile, targets
from views import Columns, Results, Rows, by_task, cell, digits, grouped, pivot, short, table, view

View = Callable[[Rows], str]


def runs(r: Results) -> dict[tuple[str, str], dict[str, str]]:
    """Rows of beside.csv by scene and engine, at the time step of the scene."""
    return {(row["task"], row["method"]): row for row in r["beside"] if row["steps_per_dt"] == "1"}


def numbers(r: Results, benchmarks: str, engines: str) -> str:
    """The four figures of the home page and of the README; the links lead to the pages of these names."""
    rows = runs(r)
    slope, robot = ([rows[s, e] for e in (OURS, OTHER)] for s in ("incline-0.99", "quadruped"))
    creep, theirs = (digits(row["creep"], 1e3) for row in slope)
    step, their_step = (digits(row["time"], 1e6) for row in robot)
    names = ", ".join(f"{label(row['family'])} {row['version']}" for row in slope)
    wall = next(row for row in r["simulation"] if row["task"] == "B4 wall under impact")
    files = accuracy(r["files"], "coulomb", 1e-4)
    solved = sum(float(row["error"]) <= 1e-4 for row in files)
    return f"""- **{creep} mm/s** creep of a cube at 0.99 of the angle at which it slides; MuJoCo, defaults: \
{theirs} mm/s ([engines]({engines}))
- **{step} µs** per step of a robot with four legs that falls; MuJoCo, defaults: {their_step} µs \
([engines]({engines}); measured with {names}, {slope[0]["date"]})
- **{1e3 * float(wall["time"]):.0f} ms** per step of {1e3 * float(wall["dt"]):.0f} ms of a wall of 750 \
bricks under impact, {float(wall["contacts"]):.0f} contacts, on one core, to a residual of \
{float(wall["tolerance"]):g} ([benchmarks]({benchmarks}))
- **{solved} of {len(files)}** contact problems of other engines are solved to a residual of 0.0001, with \
Coulomb's law ([benchmarks]({benchmarks}))"""


# docs/benchmarks.md.

SCENES: Columns = {
    "scene": "task", "bodies": "bodies", "contacts": "contacts .0f", "joint rows": "joint_rows .0f",
    "h (ms)": "dt ms", "tolerance": "tolerance .0e", "time per step (ms)": "time ms",
    "real-time factor": "real_time_factor x1",
    "all cores over one": lambda row: speedup(row), "worst residual": "error .1e",
}  # fmt: skip
UNSOLVED: Columns = {
    "file": "task", "law": "law", "tolerance": "tolerance .1e", "residual": "error .1e",
    "status": "status", "time (ms)": "time ms",
}  # fmt: skip
BOUNDS: Columns = {
    "Scene": "claim", "Quantity": "figure",
    "Measured": lambda row: f"{digits(row['value'])} {row['unit']}".strip(),
    "Bound": lambda row: f"below {digits(row['limit'])}" if float(row["limit"]) >= 0
    else f"above {digits(row['limit'], -1)}",
}  # fmt: skip
ORDERS = """The mean order over four steps, each half of the one before, of errors at the end of a motion
([orders.py](../benchmarks/orders.py), [errors]({link}/orders.csv)). Rows of joints leave errors of position
below 1e-4 of `Model.length`, which have no order. The humanoid is of first order: the damping of a servo
follows the inertia of the two bodies at its joint, and a foot is light although it stands."""


def speedup(row: dict[str, str]) -> str:
    many, one = (row.get(f"steps_per_second_{cores}") for cores in ("all", "one"))
    return f"{float(many) / float(one):.2f}" if one and many else ""


def orders(rows: Rows) -> list[str]:
    return [f"{float(value):.1f}" if value else "exact" for value in
            (rows[0]["position_order"], rows[0]["velocity_order"])]  # fmt: skip


def summary(r: Results, link: str) -> str:
    """What docs/benchmarks.md shows; `link` leads to the folder of results."""
    lines = [f"[All tables, versions and commands]({link}/tables.csv). {targets(r)}"]
    if scenes := r["simulation"]:
        lines += ["### Simulated scenes", r.origin("simulation"), view(scenes, SCENES)]
        lines += [f"[Phases, longest steps and overlaps]({link}/simulation.csv) of the same scenes."]
    if bounded := [row for row in r["physics"] if math.isfinite(float(row["limit"]))]:
        missed = [row for row in bounded if row["met"] == "no"]
        count = f"{len(bounded) - len(missed)} of {len(bounded)} bounds are met. The others:"
        what = f"[Lift, creep, forces, bounces, energy]({link}/physics.csv): {count}"
        lines += ["### Physics", r.origin("physics"), what, view(missed, BOUNDS)]
    if found := r["orders"]:
        lines += ["### Order of a step", r.origin("orders"), ORDERS.format(link=link)]
        heads = lambda form: (f"positions, {form}", f"velocities, {form}")  # noqa: E731
        lines += [pivot(found, "scene", "joints", orders, "scene", heads)]
    unsolved = [row for row in r["files"] if float(row["error"]) > float(row["tolerance"])]
    lines += ["### Files that were not solved", r.origin("files"), files_solved(r)]
    return "\n\n".join([*lines, view(unsolved, UNSOLVED) if unsolved else "None."])


def files_solved(r: Results) -> str:
    """How many contact problems of other engines are solved, and the time beside Clarabel's."""
    facts = {what: found for what, _, found, _ in file_targets(r)}
    found = [f"{what.split()[3].rstrip(',')}: {count}" for what, count in facts.items()
             if re.fullmatch("files .* coulomb", what)]  # fmt: skip
    lines = [f"Solved with Coulomb's law, to a residual of {', '.join(found)}."] if found else []
    times = [(what, time) for what, time in facts.items() if "Clarabel" in what]
    lines += [f"With `associated`, the {what} is {time}." for what, time in times]
    return " ".join(lines)


# docs/choosing.md.


def methods(r: Results, link: str) -> str:
    """How long each method takes to 1e-3 and to 1e-6, by law and scene."""

    def times(rows: Rows) -> list[str]:
        if rows[0]["status"] == "not applicable":
            return [""]
        found = [cell(rows[0], f"time_{to} ms") or "–" for to in ("1e-03", "1e-06")]
        return ["–" if found == ["–", "–"] else " / ".join(found)]

    parts = [f"One core; `make bench` ([all results]({link}/tables.csv)). {r.origin('methods')}."]
    for law in ("associated", "coulomb"):
        rows = [row | {"name": f"`{row['method']}`"} for row in r["methods"] if row["law"] == law]
        parts += [f"**`{law}`**, ms to 1e-3 / to 1e-6:", pivot(rows, "name", "task", times)]
    return "\n\n".join(parts)


def profile(rows: Rows, half: str = "held-out") -> str:
    """On a half of the corpus, how often auto and each method alone are near the best method."""
    lines = []
    for method, found in sorted(half_profile(rows, half).items(), key=lambda one: one[0] != "auto"):
        ratios = sorted(found) or [math.nan]
        within = [f"{100 * sum(x <= bound for x in ratios) / len(ratios):.0f}" for bound in (1.5, 2, 5)]
        middle = f"{ratios[len(ratios) // 2]:.2f}" if math.isfinite(ratios[len(ratios) // 2]) else "–"
        lines.append((f"`{method}`", f"{len(found)}", *within, middle, f"{sum(map(math.isinf, found))}"))
    header = ("method", "solves", "within 1.5 (%)", "within 2", "within 5", "median", "not solved")
    return table(header, lines)


# docs/engine-curves.md.

OURS, LOOSE, OTHER = "amontons, 1e-6", "amontons, 1e-3", "MuJoCo"
SETTINGS: Columns = {
    "setting, with its manual": lambda row: f"[{row['method']}]({row['manual']})", "version": "version",
    "options": lambda row: f"`{row['options']}`" if row["options"] else "defaults",
}  # fmt: skip
"""What each engine was given, and the page of its manual."""
BUDGETS: Columns = {
    "scene": "scene", "a step has (ms)": "limit ms",
    "in time": lambda row: f"{row['in_time']} of {row['times']}", "latest (ms)": "late_worst x1e3",
    "contacts": "most_contacts", "iterations": "iterations_median x1",
    "median residual": "residual_median .1e", "overlap (mm)": "penetration x1e3",
    "joints apart (mm)": "joint_gap x1e3", "energy gained (J)": "energy_gain x1", "such steps": "unbalanced",
}  # fmt: skip
LARGER = {
    "wall, rows": "rows of a wall", "plates 1:100": "number of plates",
    "chain, links": "links of a chain", "spheres in a box": "number of spheres",
}  # fmt: skip


def least(rows: Rows) -> tuple[str, str]:
    """The least error (mm) of an engine in a scene over its settings and steps, and its cost (ms/s); the
    cheaper one of two that are below 1 nm."""
    done = [row for row in rows if finished(row)]
    found = min(done, key=lambda row: (max(error(row), 1e-9), float(row["cost"])), default=None)
    if found is None:
        return "not finished", ""
    off = error(found)
    shown = "< 1e-6" if off < 1e-9 else "inf" if math.isinf(off) else digits(off, 1e3)
    # A blank: the scene has no answer.
    return shown if found["error"] else "", digits(found["cost"], 1e3)


def versions(beside: Rows) -> str:
    found = dict.fromkeys(f"{label(row['family'])} {row['version']}" for row in beside)
    dates = sorted({row["date"] for row in beside})
    return f"Measured with {', '.join(found)}; {' to '.join(dict.fromkeys((dates[0], dates[-1])))}."


def load(beside: Rows) -> str:
    """On what machine the times were measured, and what ran beside."""
    machines = ", ".join(dict.fromkeys(row["machine"] for row in beside))
    loads = [float(row["load"]) for row in beside]
    programs = f"{median(loads):.2g} programs at work (median), {max(loads):.2g} at most"
    return f"Times: one core of an {machines}; {programs}. On an idle machine it is one or two."


def solvers(rows: Rows) -> str:
    """A solver a line, for files and steps, a number per tolerance: the problems solved by each measure, and
    the time over ours where both solve."""
    times = by_task(r | {"task": r["task"] + r["tolerance"]} for r in rows if r["solved"] == "True")
    kinds = [{"kind": "steps" if row["task"].startswith("step ") else "files", **row} for row in rows]
    lines = []
    for (kind, solver), own in grouped(kinds, "kind", "method").items():
        cells = []
        for (tolerance,), mine in grouped(own, "tolerance").items():
            answered = [row for row in mine if row["time"]]
            by_ours, by_theirs = (
                sum(float(r[key]) <= float(tolerance) for r in answered) for key in ("error", "their_error")
            )
            solved = [times.get(row["task"] + tolerance, {}) for row in mine]
            ratios = [t[solver] / t["amontons"] for t in solved if {solver, "amontons"} <= t.keys()]
            middle = digits(median(ratios)) if ratios else "-"
            faster = f"{sum(ratio < 1 for ratio in ratios)} of {len(ratios)}"
            cells.append((f"{by_ours}", f"{by_theirs}", f"{len(mine) - len(answered)}", middle, faster))
        lines.append((f"{len(mine)} {kind}", solver, *map(", ".join, zip(*cells, strict=True))))
    header = ("problems", "solver", "solved, by our residual", "solved, by Siconos' error", "without answer",
              "median time over ours", "faster than ours")  # fmt: skip
    return table(header, lines)


def exponent(rows: Iterable[Mapping[str, Any]]) -> float:
    """The slope of log(time of a step) over log(size) by least squares."""
    points = [(math.log(float(r["size"])), math.log(float(r["time"]))) for r in rows if r["time"] != ""]
    return linear_regression(*zip(*points, strict=True)).slope if len(points) > 1 else math.nan


def growth_words(rows: Rows) -> str:
    """Which engine grows faster between the smallest and the largest size that both have; where 1e-3 costs
    more than 1e-6 at the largest size."""
    faster: dict[str, list[str]] = {"MuJoCo": [], "amontons": []}
    dearer = []
    for family, words in LARGER.items():
        sizes = by_task([row for row in rows if row["task"] == family], "size").values()
        ratios = [times[OTHER] / times[OURS] for times in sizes if {OURS, OTHER} <= times.keys()]
        faster["MuJoCo" if ratios[-1] > ratios[0] else "amontons"].append(words)
        loose = [times[LOOSE] > times[OURS] for times in sizes if {OURS, LOOSE} <= times.keys()]
        dearer += [words] * loose[-1]
    grow = "; ".join(f"{engine} with {', '.join(words)}" for engine, words in faster.items() if words)
    more = f" A step to 1e-3 takes longer than one to 1e-6 at the largest size of {', '.join(dearer)}."
    return f"The time grows faster than that of the other engine: {grow}.{more * bool(dearer)}"


def curves(r: Results, link: str) -> str:
    beside = r["beside"]
    settings = list({row["method"]: row for row in beside}.values())
    errors = pivot(beside, "case", "family", least, "scene: error, time per simulated second",
                   lambda family: (f"{label(family)} (mm)", "(ms/s)"))  # fmt: skip
    parts = ["## Least error of each engine", r.origin("beside"), load(beside), errors]
    parts += ["## Settings", view(settings, SETTINGS)]
    if rows := r["solvers"]:
        asked = "Numbers are for 1e-4, 1e-6 and 1e-8."
        parts += ["## Solvers, table", f"{r.origin('solvers')}. {asked}", solvers(rows)]
    slopes = pivot(r["growth"], "task", "method", lambda rows: [f"{exponent(rows):z.2f}"], "family")
    parts += ["## Growth, table", r.origin("growth"), slopes]
    parts += [f"[Times of a step by size]({link}/growth.csv)."]
    if budgets := r["budgets"]:
        parts += ["## Stopped by the clock, table", r.origin("budgets"), view(budgets, BUDGETS)]
    return "\n\n".join([*parts, f"[All rows]({link}/tables.csv)."])


# docs/decisions/trees.md.

NAMED = {
    "bullet3/kuka_iiwa/model.urdf": "arm (kuka_iiwa)",
    "dm_walkers/humanoid_CMU_V2020.xml": "humanoid of 56 coordinates (CMU)",
    "mujoco/humanoid/22_humanoids.xml": "22 humanoids in a heap",
    "unitree_go1/scene.xml": "quadruped (go1)",
    "shadow_hand/scene_right.xml": "hand (shadow)",
}
"""Models whose times are shown."""
FORMS: Columns = {
    "model": lambda row: NAMED[row["model"]], "rows (us)": "rows x1e6", "trees (us)": "trees x1e6",
    "MuJoCo (us)": "mujoco x1e6", "trees / rows, median step": "trees_to_rows ~2",
    "trees / rows, run": "run_trees_to_rows ~2", "trees / MuJoCo": "trees_to_mujoco ~2",
}  # fmt: skip
LARGE_SCENES: Columns = {
    "scene, random control": "case",
    "joints": lambda row: "trees" if row["trees"] == "auto" else "rows",
    "step (us)": "step x1e6", "factorisations": "factorizations_mean x1", "products": "products_mean x1",
    "missed": lambda row: f"{row['missed']} of {row['steps']}",
}  # fmt: skip


def forms(rows: Rows) -> str:
    """Steps of some robots with joints as rows and in trees, and the geometric mean over all."""
    if not rows:
        return "Measured by `make bench ONLY=forms`."
    run = [row for row in rows if row["trees_to_mujoco"]]
    keys = ("trees_to_rows", "run_trees_to_rows", "trees_to_mujoco")
    step, whole, mujoco = (f"{geometric_mean(float(row[key]) for row in run):.2f}" for key in keys)
    shown = view([row for row in rows if row["model"] in NAMED and row["trees"]], FORMS)
    return (f"{len(run)} models with a time of MuJoCo, geometric mean: {step} (median step), {whole} (run), "
            f"{mujoco} (MuJoCo).\n\n{shown}")  # fmt: skip


# docs/measured.md.

GROUPS = {"Pos": "positions (m)", "Vel": "velocities (m/s)", "Rforce": "forces (N)",
          "Rtorque": "torques (N m)"}  # fmt: skip
COUNTED = (("5", "5 ms: positions 1e-3 m, reactions 0.1 %"), ("0.5", "0.5 ms: Chrono's tolerances"))
IMPACTS: Columns = {
    "law": "law", "inertia": "inertia_over_homogeneous ~3", "friction": "friction ~3",
    "restitution": "restitution ~3", "median error (%)": "median_percent .1f", "mean (%)": "mean_percent .1f",
}  # fmt: skip
DAMPER: Columns = {
    "test": "test", "model": "model", "friction (kN)": lambda r: f"{float(r['friction_N']) / 1e3:.1f}",
    "clearance (mm)": "clearance_mm ~3", "error (%)": "rms_error_percent .0f",
    "scatter of cycles (%)": "scatter_percent .0f",
}  # fmt: skip
ASSEMBLIES: Columns = {
    "assembly": "assembly ~3", "blocks": "blocks ~3", "friction": "friction ~3", "theirs": "theirs ~3",
    "verdict": "verdict ~3", "needs friction, prestressed": "needed_with_prestress ~3",
    "placed freely": "needed ~3", "simulation": "in_time ~3", "rigid contacts": "rigid_in_time ~3",
}  # fmt: skip
CLOSED_FORMS: Columns = {"case": "assembly", "published": "theirs ~4", "ours": "verdict ~4"}
CLEARANCES: Columns = {
    "step (ms)": "step_ms ~4", "touches": "touches ~4", "largest across (mm)": "largest_across_mm ~4",
    "energy lost (%)": "energy_lost_percent ~4", "apart along (mm)": "rms_along_mm ~4",
    "apart across (mm)": "rms_across_mm ~4",
}  # fmt: skip
FOUR_BAR: Columns = {
    "step (ms)": "step_ms ~3", "crank (mrad)": "rms_crank_mrad ~3", "coupler (mrad)": "rms_coupler_mrad ~3",
    "rocker (mrad)": "rms_rocker_mrad ~3", "largest (mrad)": "largest_mrad ~3",
    "deepest in a bearing (mm)": "deepest_mm ~3",
}  # fmt: skip


def errors(rows: Rows) -> list[str]:
    return [f"{float(rows[0]['position_percent']):.1f} / {float(rows[0]['angle_deg']):.1f}"]


def tosses(rows: Rows) -> str:
    """Errors over steps per sample and of fitted coefficients, lengths as tracked; how far corrected lengths
    change the error of an engine with the given coefficients; errors of other coefficients."""
    tracked = [row for row in rows if row["scale"] == "as tracked"]
    given = {(row["scale"] == "as tracked", row["engine"], row["steps_per_sample"]):
             float(row["position_percent"]) for row in rows if row["coefficients"] == "given"}  # fmt: skip
    lines = []
    for (engine,), mine in grouped(tracked, "engine").items():
        steps = {row["steps_per_sample"]: [row] for row in mine if row["coefficients"] == "given"}
        held, fitted = ([row for row in mine if row["coefficients"] == f"{kind}, held out"]
                        for kind in ("given", "fitted"))  # fmt: skip
        over = [errors(steps[count])[0] if count in steps else "" for count in ("1", "2", "4", "8")]
        values = (short(fitted[0][key]) for key in ("friction", "restitution") if fitted[0][key])
        lines.append([engine, *over, *errors(held), *errors(fitted), ", ".join(values)])
    header = ("engine", "1 step", "2", "4", "8", "given, held out", "fitted, held out", "fitted values")
    changes = [value - given[True, *key] for (own, *key), value in given.items() if not own]
    varied = [row for row in tracked if row["steps_per_sample"] == "1" and "held" not in row["coefficients"]]
    return (
        f"Lengths as tracked, % of the width / deg:\n\n{table(header, lines)}\n\nLengths corrected by 2.2 % "
        f"change an error by {min(changes):.1f} to {max(changes):.1f} % of the width.\n\nOther coefficients, "
        f"1 step, as tracked:\n\n{pivot(varied, 'engine', 'coefficients', errors, 'engine')}"
    )


def adams(rows: Rows) -> str:
    """Cases that miss a target: the worst of each group of quantities at each step; and how many meet it."""

    def of(mine: Rows, start: str) -> Rows:
        return [row for row in mine if row["quantity"].startswith(start)]

    def worst(mine: Rows) -> str:
        row = max(mine, key=lambda row: float(row["rms"]), default=None)
        return cell(row, "rms .1e") + " (no)" * (row["met"] == "no") if row else ""

    missed = {row["case"] for row in rows if row["met"] == "no"}
    lines = [
        [case.replace("_", " "), short(dt), short(theirs), *(worst(of(mine, s)) for s in GROUPS)]
        for (case, dt, theirs), mine in grouped(rows, "case", "dt_ms", "their_step_ms").items()
        if case in missed
    ]
    counts = [
        [what, name, f"{sum(r['met'] == 'yes' for r in mine)} of {len(mine)}"]
        for dt, what in COUNTED
        for start, name in (("Pos", "positions"), ("Vel", "velocities"), ("R", "reactions"))
        if (mine := [r for r in of(rows, start) if short(r["dt_ms"]) == dt and r["met"]])
    ]
    cases = table(("case", "step (ms)", "theirs (ms)", *GROUPS.values()), lines)
    return f"{cases}\n\n{table(('target', 'quantities', 'met'), counts)}"


def masonry(rows: Rows) -> str:
    files, others = ([r for r in rows if bool(r["blocks"]) == wanted] for wanted in (True, False))
    return view(files, ASSEMBLIES) + "\n\n" + view(others, CLOSED_FORMS)


AGAINST: dict[str, View] = {
    "tosses": tosses, "adams": adams, "masonry": masonry, "impacts": partial(view, columns=IMPACTS),
    "damper": partial(view, columns=DAMPER), "clearances": partial(view, columns=CLEARANCES),
    "four_bar": partial(view, columns=FOUR_BAR),
}  # fmt: skip
"""The parts of docs/measured.md: measured_NAME.csv as a table."""

# Documents.

FIGURE = re.compile(r"(\S+) (\S+) <!-- (\S+); ([^;]+); (\w+) -->")
"""A number, its unit, and a comment with scene, engine and column of beside.csv that it is taken from."""
CELL = re.compile(r"(\S+) <!-- (\w+)\.csv: ([^;>]*); (least|most|median|count)(?: ([^>]+?))? -->")
"""A number, and a comment with the table that it is taken from, KEY=VALUE, ... of the rows, and which of
their values is shown, by a Spec; or how many rows there are."""
UNITS = {"mm": 1e3, "mm/s": 1e3, "us": 1e6, "ms": 1e3, "%": 1e2, "times": 1.0, "um": 1e6, "m": 1.0}


def with_figures(text: str, r: Results) -> str:
    """The text with the numbers before such comments as they are in the tables."""
    known = runs(r)

    def figure(found: re.Match[str]) -> str:
        number, unit, scene, engine, column = found.groups()
        return digits(known[scene, engine][column], UNITS[unit]) + found.group()[len(number) :]

    def cell_of(found: re.Match[str]) -> str:
        number, name, keys, which, spec = found.groups()
        return f"{chosen(r[name], keys, which, spec)}{found.group()[len(number) :]}"

    return CELL.sub(cell_of, FIGURE.sub(figure, text))


def chosen(rows: Rows, keys: str, which: str, spec: str | None) -> str:
    """The least, the most or the (lower) median value of the rows that have these values, or their number."""
    wanted = dict(key.split("=", 1) for key in keys.split(", ") if key)
    rows = [row for row in rows if all(row[key] == value for key, value in wanted.items())]
    if which == "count" or spec is None:
        return f"{len(rows)}"
    rows = sorted((row for row in rows if row[spec.split()[0]]), key=lambda row: float(row[spec.split()[0]]))
    place = {"least": 0, "median": (len(rows) - 1) // 2, "most": -1}[which]
    return cell(rows[place], spec)


def renew(document: str, mark: str, body: str) -> None:
    path = ROOT / document
    begin, end = (f"<!-- {mark}: {edge} -->" for edge in ("begin", "end"))
    before, rest = path.read_text().split(begin, 1)
    _, after = rest.split(end, 1)
    path.write_text(f"{before}{begin}\n\n{body}\n\n{end}{after}")


def documents(r: Results) -> Iterator[tuple[str, str, Callable[[str], str]]]:
    """Each part between markers: the document, the marker, the text by the link to the folder of results."""

    def of(name: str, make: View, behind: str = "") -> str:
        return f"{r.origin(name)}{behind}\n\n{make(r[name])}".strip()

    def large(rows: Rows) -> str:
        return view([row for row in rows if row["control"] == "random"], LARGE_SCENES)

    yield "README.md", "numbers", lambda link: numbers(r, "docs/benchmarks.md", "docs/engines.md")
    yield "docs/index.md", "numbers", lambda link: numbers(r, "benchmarks.md", "engines.md")
    yield "docs/engines.md", "versions", lambda link: versions(r["beside"])
    yield "docs/benchmarks.md", "results", lambda link: summary(r, link)
    yield "docs/engine-curves.md", "engines", lambda link: curves(r, link)
    yield "docs/choosing.md", "methods", lambda link: methods(r, link)
    yield "docs/engine-curves.md", "growth", lambda link: growth_words(r["growth"])
    yield "docs/choosing.md", "profile", lambda link: profile(r["profile"])
    yield "docs/decisions/trees.md", "forms", lambda link: of("robots_forms", forms)
    yield "docs/decisions/trees.md", "large", lambda link: of("robots_large", large)
    for name, make in AGAINST.items():
        if r[f"measured_{name}"]:
            text = of(f"measured_{name}", make, ".")
            yield "docs/measured.md", name, lambda link, text=text: text


def pages() -> list[Path]:
    """All that may have numbers of tables in its sentences."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def renew_documents(folder: Path) -> list[str]:
    """Writes the tables of a folder of results into all documents; returns what cannot be made of them."""
    r, failed = Results(folder), []
    for document, mark, make in documents(r):
        link = Path(os.path.relpath(folder, (ROOT / document).parent)).as_posix()
        try:
            renew(document, mark, make(link))
        except (KeyError, IndexError, ValueError, StopIteration) as error:
            failed.append(f"{document}, {mark}: {error!r}")
    for path in pages():
        try:
            path.write_text(with_figures(path.read_text(), r))
        except (KeyError, IndexError) as error:
            failed.append(f"{path.name}: {error!r}")
    return failed


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--docs", action="store_true", help="renew the tables of the documents")
    options = parser.parse_args()
    print(targets(Results(options.folder)))
    if options.docs:
        print(*renew_documents(options.folder.resolve()), sep="\n")
