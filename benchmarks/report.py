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
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from statistics import linear_regression, median
from typing import Any

from beside.figure import error, finished, label
from common import ORIGINS, ROOT, read_csv

Row = dict[str, str]
Rows = list[Row]
Spec = str | Callable[[Row], str]
"""A cell: a function of the row, or a column with a format behind a space: one of `format`, "ms" for seconds
in ms, "x1e3" for two digits of the value times 1e3, "~3" for three digits of a number and texts as they
are."""


# Numbers and tables.


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; columns after the first are aligned to the right."""
    lines = ["| " + " | ".join(header) + " |", "|---" + "|--:" * (len(header) - 1) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def milliseconds(seconds: str | float) -> str:
    """Three digits, whole milliseconds from 100 on; nothing for a blank."""
    if seconds == "":
        return ""
    value = 1e3 * float(seconds)
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def power(text: str) -> str:
    """A number with a short power of ten: 1e-6 for 1e-06."""
    return re.sub(r"e([+-])0*(\d)", lambda found: f"e{found[1].strip('+')}{found[2]}", text)


def level(tolerance: str | float) -> str:
    """A power of ten."""
    return power(f"{float(tolerance):.0e}")


def scientific(value: str | float) -> str:
    """Two digits; a power of ten below a hundredth and from a million on."""
    if value == "":
        return ""
    usual = float(value) == 0 or 1e-2 <= abs(float(value)) < 1e6
    return digits(str(value), 1) if usual else power(f"{float(value):.1e}")


def digits(value: str, scale: float) -> str:
    """Two digits, whole numbers from 10 to a million."""
    number = scale * float(value)
    return f"{number:.0f}" if 10 <= number < 1e6 else power(f"{number:.2g}")


def short(value: str, places: int = 3) -> str:
    """A number with so many digits, whole from there to a million; a text as it is."""
    try:
        number = float(value)
    except ValueError:
        return value
    return f"{number:.0f}" if 10**places <= abs(number) < 1e6 else power(f"{number:.{places}g}")


def cell(row: Row, spec: Spec) -> str:
    if callable(spec):
        return spec(row)
    key, _, how = spec.partition(" ")
    value = row[key]
    if not how or value == "":
        return value
    if how in ("ms", ".1e"):
        return milliseconds(value) if how == "ms" else scientific(value)
    if how[0] in "x~":
        return digits(value, float(how[1:])) if how[0] == "x" else short(value, int(how[1:]))
    return power(format(float(value), how))


def view(rows: Iterable[Row], columns: Mapping[str, Spec]) -> str:
    """A table with a line per row: the header of each column, and its cell."""
    return table(tuple(columns), [[cell(row, spec) for spec in columns.values()] for row in rows])


def grouped(rows: Iterable[dict[str, Any]], *keys: str) -> dict[tuple[str, ...], list[dict[str, Any]]]:
    """The rows by their values of these columns, in the order in which they come."""
    groups: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    return groups


class Results:
    """The CSV files of a folder by name, with their origins."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.beside = folder, folder.parent / "beside"
        self.environment = {row["key"]: row["value"] for row in self["environment"]}
        self.origins = {row["table"]: row for at in (folder, self.beside) for row in read_csv(at / ORIGINS)}

    def __getitem__(self, name: str) -> Rows:
        return read_csv((self.beside if name in ("beside", "solvers") else self.folder) / f"{name}.csv")

    def origin(self, *names: str) -> str:
        """The revision, the date and the processor of each of these tables."""
        known = [self.origins[f"{name}.csv"] for name in names if f"{name}.csv" in self.origins]
        columns = ("date", "processor")
        return "; ".join(
            ", ".join((f"`{o['table']}`: revision {o['revision']}", *(o[c] for c in columns if o[c])))
            for o in known
        )


# What was wanted and what was reached.

LARGE = 200  # contacts from which on every file is to be solved faster than by Clarabel
PROFILE_KEYS = ("task", "half", "rows", "law", "tolerance", "warm", "auto", "auto_status", "auto_reason")
Line = tuple[str, str, str, bool]  # what, wanted, reached, whether met


def accuracy(files: Rows, law: str, tolerance: float) -> Rows:
    return [r for r in files if r["law"] == law and float(r["tolerance"]) == tolerance]


def file_targets(r: Results) -> Iterable[Line]:
    files, duels = r["files"], r["clarabel"]
    if not files:
        return
    for law, tolerance, wanted in (
        ("associated", 1e-4, None), ("associated", 1e-8, 50), ("coulomb", 1e-4, 54), ("coulomb", 1e-6, 45),
        ("coulomb", 1e-8, 54),
    ):  # fmt: skip
        rows = accuracy(files, law, tolerance)
        if not rows:
            continue
        solved = sum(float(row["residual"]) <= tolerance for row in rows)
        wanted = wanted or len(rows)
        # The counts that are wanted are out of the 56 files; of a sample, all.
        enough = solved >= min(wanted, len(rows))
        yield (
            f"files solved to {level(tolerance)}, {law}",
            f"{wanted}",
            f"{solved} of {len(rows)}",
            enough,
        )
    both = [accuracy(files, law, 1e-8) for law in ("coulomb", "associated")]
    if all(both):
        theirs, ours = (sum(float(row["time"]) for row in rows) for rows in both)
        yield "time to 1e-8, coulomb over associated", "5", f"{theirs / ours:.1f}", theirs <= 5 * ours
        # A file that is not solved takes the whole of its deadline.
        done = {row["file"] for row in both[0] if float(row["residual"]) <= 1e-8}
        if len(done) < len(both[0]):
            theirs, ours = (sum(float(row["time"]) for row in rows if row["file"] in done) for rows in both)
            what = f"the same, of the {len(done)} files that are solved"
            yield what, "5", f"{theirs / ours:.1f}", theirs <= 5 * ours
    trusted = [
        abs(float(row["relative_difference"])) for row in accuracy(files, "associated", 1e-8)
        if row["relative_difference"] and float(row["reference_error"]) < 1e-8
    ]  # fmt: skip
    if trusted:
        what = f"objective, relative difference on the {len(trusted)} files with a reference to 1e-8"
        yield what, "1e-6", scientific(max(trusted)), max(trusted) <= 1e-6
    if duels:
        ours, theirs = (sum(float(row[key]) for row in duels) for key in ("wall", "clarabel_time"))
        reached = f"{ours / theirs:.2f} ({1e3 * ours:.0f} ms, {1e3 * theirs:.0f} ms)"
        yield "total time to 1e-4 over that of Clarabel", "1", reached, ours <= theirs
        large = [float(row["ratio"]) for row in duels if int(row["contacts"]) >= LARGE]
        if large:
            what = f"the same, worst of the {len(large)} files with {LARGE} contacts or more"
            yield what, "below 1", f"{max(large):.2f}", max(large) < 1


def kernel_targets(r: Results) -> Iterable[Line]:
    """Full iterations on one core: in a cache, and far out of all."""
    for row in (row for row in r["kernel"] if row["threads"] == "1"):
        contacts, time, ratio = int(row["contacts"]), float(row["ns_per_contact"]), float(row["ratio"])
        if contacts < 20000:
            what = f"iteration at {contacts} contacts, {row['law']}, ns per contact"
            yield what, "8", f"{time:.1f}", time <= 8
        elif contacts > 500000:
            what = f"share of triad bandwidth at {contacts} contacts, {row['law']}"
            yield what, "0.9", f"{ratio:.2f}", ratio >= 0.9
    for row in (row for row in r["instruction_sets"] if row["isa"] == "avx2" and row.get("near_ratio")):
        share = float(row["near_ratio"])
        what = f"share of triad bandwidth in the same cache at {row['contacts']} contacts, {row['law']}, AVX2"
        yield what, "0.75", f"{share:.2f}", share >= 0.75


def step_targets(r: Results) -> Iterable[Line]:
    for row in r["steps"]:
        by = "" if row["method"] == "auto" else f", {row['method']}"
        what = f"{row['scene']}, {row['law']}, to {level(row['tolerance'])}{by}"
        met = float(row["wall"]) <= float(row["target"]) and float(row["residual"]) <= float(row["tolerance"])
        yield what, f"{milliseconds(row['target'])} ms", f"{milliseconds(row['wall'])} ms", met


def scene_targets(r: Results) -> Iterable[Line]:
    for row in r["simulation"]:
        wanted, cores = float(row.get("target") or 0), row.get("target_cores")
        told = row["steps_per_second"] if cores == "1" else row.get("steps_per_second_all")
        if wanted and told:
            name, speed = row["name"], float(told)
            where = "one core" if cores == "1" else f"{cores} cores"
            yield f"{name}, steps/s on {where}", f"{wanted:g}", f"{speed:.3g}", speed >= wanted
            converged, steps = int(row["converged"]), int(row["steps"])
            yield f"{name}, steps that converge", "all", f"{converged} of {steps}", converged == steps


def robot_targets(r: Results) -> Iterable[Line]:
    speeds = sorted(
        (float(row["steps_per_second"]) / float(row["mujoco_steps_per_second"]), row["model"])
        for row in r["robots_2ms"]
        if row["steps_per_second"] and row["mujoco_steps_per_second"]
    )
    if speeds:
        middle, (least, slowest) = median(speed for speed, _ in speeds), speeds[0]
        what = f"{len(speeds)} robots at 2 ms, steps/s over MuJoCo's, median"
        yield what, "0.4", f"{middle:.2g}", middle >= 0.4
        yield "the same, slowest", "0.15", f"{least:.2g} ({slowest})", least >= 0.15


def feasible(rows: Rows, half: str) -> tuple[list[str], Rows]:
    """The methods, and the solves of this half of the corpus that one of them does."""
    rows = [row for row in rows if row["half"] == half]
    methods = [key for key in (rows[0] if rows else ()) if key not in PROFILE_KEYS]
    return methods, [row for row in rows if any(row[m] for m in methods)]


def ratio(row: Row, method: str, methods: Sequence[str]) -> float:
    """The time of a method over the best one's; infinite where it fails."""
    return float(row[method]) / min(float(row[m]) for m in methods if row[m]) if row[method] else math.inf


def profile_targets(r: Results) -> Iterable[Line]:
    """auto on problems that it was not tuned on, beside the best single method for each."""
    methods, rows = feasible(r["profile"], "held-out")
    if rows:
        near = sum(ratio(row, "auto", methods) <= 1.5 for row in rows)
        failed = sum(not row["auto"] for row in rows)
        what = "held-out solves within 1.5 of the best method"
        yield what, "100 %", f"{100 * near / len(rows):.0f} %", near == len(rows)
        yield "the same, not solved though a method does", "0", f"{failed}", not failed


def targets(r: Results) -> str:
    """How many targets are met, and a table of the others."""
    parts = (file_targets, step_targets, scene_targets, robot_targets, profile_targets, kernel_targets)
    lines = [line for part in parts for line in part(r)]
    missed = [line[:3] for line in lines if not line[3]]
    count = f"{len(lines) - len(missed)} of {len(lines)} targets are met."
    return f"{count} The others:\n\n{table(('Target', 'Wanted', 'Reached'), missed)}" if missed else count


# docs/benchmarks.md and the README.


def more_cores(s: Row) -> str:
    one, many = s.get("steps_per_second_one"), s.get("steps_per_second_all")
    return f"{float(many) / float(one):.2f}" if one and many else ""


SCENES: dict[str, Spec] = {
    "scene": "name", "bodies": "bodies", "contacts": "contacts .0f", "joint rows": "joint_rows .0f",
    "h (ms)": "dt ms", "tolerance": "tolerance .0e", "time per step (ms)": "step ms",
    "real-time factor": "real_time_factor x1", "all cores over one": more_cores,
    "worst residual": "residual_worst .1e",
}  # fmt: skip
UNSOLVED: dict[str, Spec] = {
    "file": "file", "law": "law", "tolerance": "tolerance .1e", "residual": "residual .1e",
    "status": "status", "time (ms)": "time ms",
}  # fmt: skip
SHOWN = {
    "B1 network": "lattice of 1000 parts on joints",
    "B3 plates 1:100": "stack of 20 plates, masses 1:100",
    "B4 wall under impact": "wall of 750 bricks hit by a ball",
    "B4 wall under impact, 1e-2": "the same wall, larger tolerance",
    "tracked vehicle": "tracked vehicle on loose slabs",
    "hopper": "400 grains in a hopper",
    "10000 spheres": "10000 grains in a box",
}
"""Scenes of the README: the name in simulation.csv, and words for a reader who does not know these names."""
MEASURED: dict[str, Spec] = {
    "Scene": lambda s: SHOWN[s["name"]], "Bodies": "bodies", "Contacts": "contacts .0f",
    "Time step (ms)": "dt ms", "Tolerance": "tolerance .0e", "Time per step (ms)": "step ms",
    "Real-time factor": "real_time_factor x1",
}  # fmt: skip


def missed_bounds(rows: Rows) -> str:
    """The claims of physics.csv that miss their bound, and how many meet it."""

    def limit(row: Row) -> str:
        value = float(row["limit"])
        if not math.isfinite(value):
            return ""
        return f"below {digits(row['limit'], 1)}" if value >= 0 else f"above {digits(row['limit'], -1)}"

    bounded = [row for row in rows if limit(row)]
    missed = [row for row in bounded if row["met"] == "no"]
    table = view(missed, {
        "Scene": "claim", "Quantity": "figure",
        "Measured": lambda row: f"{digits(row['value'], 1)} {row['unit']}".strip(), "Bound": limit,
    })  # fmt: skip
    return f"{len(bounded) - len(missed)} of {len(bounded)} bounds are met. The others:\n\n{table}"


ORDERS = """The mean order over four steps, each half of the one before, of errors at the end of a motion
([orders.py](../benchmarks/orders.py), [errors]({link}/orders.csv)). Rows of joints leave errors of position
below 1e-4 of `Model.length`, which have no order. The humanoid is of first order: the damping of a servo
follows the inertia of the two bodies at its joint, and a foot is light although it stands."""


def orders_table(rows: Rows) -> str:
    """A scene a line: the order of positions and velocities, of joints as rows and in trees."""
    found = {(row["scene"], row["joints"]): row for row in rows}
    lines = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        cells = []
        for form in ("rows", "trees"):
            row = found.get((scene, form))
            for what in ("position_order", "velocity_order"):
                cells.append("" if row is None else f"{float(row[what]):.1f}" if row[what] else "exact")
        lines.append((scene, *cells))
    header = [f"{what}, {form}" for form in ("rows", "trees") for what in ("positions", "velocities")]
    return table(("scene", *header), lines)


def summary(r: Results, link: str) -> str:
    """What docs/benchmarks.md shows; `link` leads to the folder of results."""
    lines = [f"[All tables, versions and commands]({link}/tables.csv). {targets(r)}"]
    if scenes := r["simulation"]:
        lines += ["### Simulated scenes", r.origin("simulation"), view(scenes, SCENES)]
        lines += [f"[Phases, longest steps and overlaps]({link}/simulation.csv) of the same scenes."]
    if physics := r["physics"]:
        what = f"[Lift, creep, forces, bounces, energy]({link}/physics.csv)"
        lines += ["### Physics", r.origin("physics"), f"{what}: {missed_bounds(physics)}"]
    if orders := r["orders"]:
        lines += ["### Order of a step", r.origin("orders"), ORDERS.format(link=link), orders_table(orders)]
    unsolved = [row for row in r["files"] if float(row["residual"]) > float(row["tolerance"])]
    lines += ["### Files that were not solved", r.origin("files")]
    lines += [view(unsolved, UNSOLVED) if unsolved else "None."]
    return "\n\n".join(lines)


def measured(r: Results, link: str) -> str:
    """The part of the README: some scenes, and one sentence on the solver alone."""
    origin = r.origin("simulation", "files")
    lines = [f"One core; `make bench` ([all results]({link}/tables.csv)). {origin}."]
    if scenes := r["simulation"]:
        lines.append(view([s for s in scenes if s["name"] in SHOWN], MEASURED))
    facts = {what: reached for what, _, reached, _ in file_targets(r)}
    solved = [(what, reached) for what, reached in facts.items() if re.fullmatch("files .* coulomb", what)]
    if solved:
        reached = ", ".join(f"{what.split()[3].rstrip(',')}: {count}" for what, count in solved)
        lines.append(
            "Contact problems of other engines (FCLIB), the solver alone, with Coulomb's law, to a residual "
            f"of {reached}."
        )
        lines += [f"With `associated`, the {what} is {t}." for what, t in facts.items() if "Clarabel" in what]
    return "\n\n".join(lines)


# docs/choosing.md.


def choosing_table(r: Results, link: str) -> str:
    """How long each method takes to 1e-3 and to 1e-6, by law and scene."""

    def times(row: Row | None) -> str:
        if row is None or row["status"] == "not applicable":
            return ""
        found = [milliseconds(row[key]) or "–" for key in ("time_1e-03", "time_1e-06")]
        return "–" if found == ["–", "–"] else " / ".join(found)

    parts = [f"One core; `make bench` ([all results]({link}/tables.csv)). {r.origin('methods')}."]
    for law in ("associated", "coulomb"):
        rows = {(m["scene"], m["method"]): m for m in r["methods"] if m["law"] == law}
        scenes, methods = (list(dict.fromkeys(key[i] for key in rows)) for i in (0, 1))
        body = [(f"`{m}`", *(times(rows.get((scene, m))) for scene in scenes)) for m in methods]
        parts += [f"**`{law}`**, ms to 1e-3 / to 1e-6:", table(("", *scenes), body)]
    return "\n\n".join(parts)


def reached(rows: Rows) -> str:
    """For each law and hard scene the methods that reach 1e-3, and 1e-6."""
    lines = []
    for law in ("associated", "coulomb"):
        for scene in ("B3_s10", "B4_s60", "B4_impact+5"):
            mine = [row for row in rows if (row["scene"], row["law"]) == (scene, law)]
            cells = (
                ", ".join(f"`{row['method']}`" for row in mine if row[f"products_{level}"]) or "none"
                for level in ("1e-03", "1e-06")
            )
            lines.append((f"{scene}, `{law}`", *cells))
    return table(("step, law", "1e-3", "1e-6"), lines)


def profile_table(r: Results) -> str:
    """For each half of the corpus, how often auto and each method alone are near the best method."""
    lines, profile = [], r["profile"]
    for half in ("tuning", "held-out"):
        methods, rows = feasible(profile, half)
        for method in ("auto", *methods):
            ratios = sorted(ratio(row, method, methods) for row in rows)
            within = [f"{100 * sum(x <= bound for x in ratios) / len(ratios):.0f}" for bound in (1.5, 2, 5)]
            middle = f"{ratios[len(ratios) // 2]:.2f}" if math.isfinite(ratios[len(ratios) // 2]) else "–"
            failed = f"{sum(not row[method] for row in rows)}"
            lines.append((half, f"`{method}`", f"{len(rows)}", *within, middle, failed))
    header = ("half", "method", "solves", "within 1.5 (%)", "within 2", "within 5", "median", "not solved")
    return table(header, lines)


# Beside other engines: docs/engines.md, docs/engine-curves.md, the README and the home page.

FIGURE = re.compile(r"(\S+) (\S+) <!-- (\S+); ([^;]+); (\w+) -->")
"""A number, its unit, and a comment with scene, engine and column of beside.csv that it is taken from."""
CELL = re.compile(r"(\S+) <!-- (\w+)\.csv: ([^;>]*); (least|most|median|count)(?: ([^>]+?))? -->")
"""A number, and a comment with the table that it is taken from, KEY=VALUE, ... of the rows, and which of
their values is shown, by a Spec; or how many rows there are."""
UNITS = {"mm": 1e3, "mm/s": 1e3, "us": 1e6, "ms": 1e3, "%": 1e2, "times": 1.0, "um": 1e6, "m": 1.0}
SHOWN_BESIDE = ("incline-0.99", "plates-1000", "four-bar")
WALL, ROBOT, SLOPE = "B4 wall under impact", "quadruped", "incline-0.99"
OURS, OTHER = "amontons, 1e-6", "MuJoCo"


def with_figures(text: str, r: Results) -> str:
    """The text with the numbers before such comments as they are in the tables; those of beside.csv are at
    the time step of the scene."""
    known = {(row["scene"], row["engine"]): row for row in r["beside"] if row["steps_per_dt"] == "1"}

    def figure(found: re.Match[str]) -> str:
        _, unit, scene, engine, column = found.groups()
        value = digits(known[scene, engine][column], UNITS[unit])
        return f"{value} {unit} <!-- {scene}; {engine}; {column} -->"

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


def cases_and_families(beside: Rows, only: Sequence[str] = ()) -> tuple[list[str], list[str]]:
    cases = dict.fromkeys(row["case"] for row in beside if not only or row["scene"] in only)
    return list(cases), list(dict.fromkeys(row["family"] for row in beside))


def versions(beside: Rows) -> str:
    """Which versions were measured, and when."""
    found = dict.fromkeys(f"{label(row['family'])} {row['version']}" for row in beside)
    dates = sorted({row["date"] for row in beside})
    return f"Measured with {', '.join(found)}; {' to '.join(dict.fromkeys((dates[0], dates[-1])))}."


def engines_table(beside: Rows, only: Sequence[str]) -> str:
    """An engine a row, two columns for each of a few scenes: the least error and its cost."""
    cases, families = cases_and_families(beside, only)
    lines = [
        (label(family), *(text for case in cases for text in least(beside, case, family)))
        for family in families
    ]
    header = [text for case in cases for text in (f"{case}: error (mm)", "time (ms/s)")]
    return table(("engine", *header), lines)


def summary_table(beside: Rows) -> str:
    """A scene a row, two columns for each engine: the least error and its cost."""
    cases, families = cases_and_families(beside)
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


# docs/decisions/trees.md.

NAMED = {
    "bullet3/kuka_iiwa/model.urdf": "arm (kuka_iiwa)",
    "dm_walkers/humanoid_CMU_V2020.xml": "humanoid of 56 coordinates (CMU)",
    "mujoco/humanoid/22_humanoids.xml": "22 humanoids in a heap",
    "unitree_go1/scene.xml": "quadruped (go1)",
    "shadow_hand/scene_right.xml": "hand (shadow)",
}
"""Models whose times are shown."""
FORMS: dict[str, Spec] = {
    "model": lambda row: NAMED[row["model"]], "rows (us)": "rows x1e6", "trees (us)": "trees x1e6",
    "MuJoCo (us)": "mujoco x1e6", "trees / rows, median step": "trees_to_rows ~2",
    "trees / rows, run": "run_trees_to_rows ~2", "trees / MuJoCo": "trees_to_mujoco ~2",
}  # fmt: skip
LARGE_SCENES: dict[str, Spec] = {
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
    means = (math.exp(sum(math.log(float(row[key])) for row in run) / len(run)) for key in keys)
    names = (f"{len(run)} models with a time of MuJoCo", *(f"{value:.2f}" for value in means))
    shown = view([row for row in rows if row["model"] in NAMED and row["trees"]], FORMS)
    return "{}, geometric mean: {} (median step), {} (run), {} (MuJoCo).\n\n{}".format(*names, shown)


# docs/measured.md.


def errors(row: Row) -> str:
    return f"{float(row['position_percent']):.1f} / {float(row['angle_deg']):.1f}"


def tosses(rows: Rows) -> str:
    """One line for each engine, scale and coefficients; errors over steps per sample."""
    parts = []
    for (scale,), own in grouped(rows, "scale").items():
        lines = []
        for (engine,), mine in grouped(own, "engine").items():
            given = {r["steps_per_sample"]: r for r in mine if r["coefficients"] == "given"}
            held = {r["coefficients"]: r for r in mine}
            fitted = held["fitted, held out"]
            values = (short(fitted[key]) for key in ("friction", "restitution") if fitted[key] != "")
            lines.append([
                engine, *(errors(given[k]) if k in given else "" for k in ("1", "2", "4", "8")),
                errors(held["given, held out"]), errors(fitted), ", ".join(values),
            ])  # fmt: skip
        header = ("engine", "1 step", "2", "4", "8", "given, held out", "fitted, held out", "fitted values")
        title = "Lengths as tracked" if scale == "as tracked" else "Lengths corrected by 2.2 %"
        parts.append(f"{title}, % of the width / deg:\n\n{table(header, lines)}")
    return "\n\n".join([*parts, f"Other coefficients, 1 step, as tracked:\n\n{varied(rows)}"])


def varied(rows: Rows) -> str:
    """Errors of coefficients beside those of the given ones."""
    own = [row for row in rows if row["scale"] == "as tracked" and row["steps_per_sample"] == "1"]
    kinds = [kind for kind in dict.fromkeys(row["coefficients"] for row in own) if "held out" not in kind]
    found = {(row["engine"], row["coefficients"]): errors(row) for row in own}
    engines = dict.fromkeys(row["engine"] for row in own)
    lines = [[engine, *(found.get((engine, kind), "") for kind in kinds)] for engine in engines]
    return table(("engine", *kinds), lines)


GROUPS = {
    "Pos": "positions (m)",
    "Vel": "velocities (m/s)",
    "Rforce": "forces (N)",
    "Rtorque": "torques (N m)",
}


def adams(rows: Rows) -> str:
    """Cases that miss a target: the worst of each group of quantities at each step; and how many meet it."""
    lines = []
    missed = {row["case"] for row in rows if row["met"] == "no"}
    shown = [row for row in rows if row["case"] in missed]
    for (case, dt), group in groupby(shown, key=lambda row: (row["case"], row["dt_ms"])):
        own = list(group)
        line = [case.replace("_", " "), short(dt), short(own[0]["their_step_ms"])]
        for start in GROUPS:
            mine = [r for r in own if r["quantity"].startswith(start)]
            worst = max(mine, key=lambda r: float(r["rms"]), default=None)
            line.append(scientific(worst["rms"]) + " (no)" * (worst["met"] == "no") if worst else "")
        lines.append(line)
    counts = []
    for dt, what in (
        ("5", "5 ms: positions 1e-3 m, reactions 0.1 %"),
        ("0.5", "0.5 ms: Chrono's tolerances"),
    ):
        at = [r for r in rows if short(r["dt_ms"]) == dt and r["met"]]
        for start, name in (("Pos", "positions"), ("Vel", "velocities"), ("R", "reactions")):
            if mine := [r for r in at if r["quantity"].startswith(start)]:
                counts.append([what, name, f"{sum(r['met'] == 'yes' for r in mine)} of {len(mine)}"])
    cases = table(("case", "step (ms)", "theirs (ms)", *GROUPS.values()), lines)
    return f"{cases}\n\n{table(('target', 'quantities', 'met'), counts)}"


IMPACTS: dict[str, Spec] = {
    "law": "law", "inertia": "inertia_over_homogeneous ~3", "friction": "friction ~3",
    "restitution": "restitution ~3", "median error (%)": "median_percent .1f", "mean (%)": "mean_percent .1f",
}  # fmt: skip
DAMPER: dict[str, Spec] = {
    "test": "test", "model": "model", "friction (kN)": lambda r: f"{float(r['friction_N']) / 1e3:.1f}",
    "clearance (mm)": "clearance_mm ~3", "error (%)": "rms_error_percent .0f",
    "scatter of cycles (%)": "scatter_percent .0f",
}  # fmt: skip
ASSEMBLIES: dict[str, Spec] = {
    "assembly": "assembly ~3", "blocks": "blocks ~3", "friction": "friction ~3", "theirs": "theirs ~3",
    "verdict": "verdict ~3", "needs friction, prestressed": "needed_with_prestress ~3",
    "placed freely": "needed ~3", "simulation": "in_time ~3", "rigid contacts": "rigid_in_time ~3",
}  # fmt: skip
CLOSED_FORMS: dict[str, Spec] = {"case": "assembly", "published": "theirs ~4", "ours": "verdict ~4"}
CLEARANCES: dict[str, Spec] = {
    "step (ms)": "step_ms ~4", "touches": "touches ~4", "largest across (mm)": "largest_across_mm ~4",
    "energy lost (%)": "energy_lost_percent ~4", "apart along (mm)": "rms_along_mm ~4",
    "apart across (mm)": "rms_across_mm ~4",
}  # fmt: skip
FOUR_BAR: dict[str, Spec] = {
    "step (ms)": "step_ms ~3", "crank (mrad)": "rms_crank_mrad ~3", "coupler (mrad)": "rms_coupler_mrad ~3",
    "rocker (mrad)": "rms_rocker_mrad ~3", "largest (mrad)": "largest_mrad ~3",
    "deepest in a bearing (mm)": "deepest_mm ~3",
}  # fmt: skip


def masonry(rows: Rows) -> str:
    files, others = ([r for r in rows if bool(r["blocks"]) == wanted] for wanted in (True, False))
    return view(files, ASSEMBLIES) + "\n\n" + view(others, CLOSED_FORMS)


AGAINST: dict[str, Callable[[Rows], str]] = {
    "tosses": tosses, "adams": adams, "impacts": lambda rows: view(rows, IMPACTS),
    "damper": lambda rows: view(rows, DAMPER), "masonry": masonry,
    "clearances": lambda rows: view(rows, CLEARANCES), "four_bar": lambda rows: view(rows, FOUR_BAR),
}  # fmt: skip
"""The parts of docs/measured.md: measured_NAME.csv as a table."""


# Documents.


def renew(document: str, mark: str, body: str) -> None:
    """Replaces what stands between the markers of a document."""
    path = ROOT / document
    begin, end = (f"<!-- {mark}: {edge} -->" for edge in ("begin", "end"))
    before, rest = path.read_text().split(begin, 1)
    _, after = rest.split(end, 1)
    path.write_text(f"{before}{begin}\n\n{body}\n\n{end}{after}")


def documents(r: Results) -> Iterator[tuple[str, str, Callable[[str], str]]]:
    """Each part between markers: the document, the marker, the text by the link to the folder of results."""
    beside = r["beside"]
    yield "README.md", "numbers", lambda link: numbers(r, "docs/benchmarks.md", "docs/engines.md")
    yield "docs/index.md", "numbers", lambda link: numbers(r, "benchmarks.md", "engines.md")
    yield "README.md", "measured", lambda link: measured(r, link)
    yield "README.md", "beside", lambda link: f"{engines_table(beside, SHOWN_BESIDE)}\n\n{versions(beside)}"
    yield "docs/engines.md", "versions", lambda link: versions(beside)
    yield "docs/benchmarks.md", "results", lambda link: summary(r, link)
    yield "docs/engine-curves.md", "engines", lambda link: curves(r, link)
    yield "docs/choosing.md", "methods", lambda link: choosing_table(r, link)
    yield "docs/choosing.md", "reached", lambda link: reached(r["methods"])
    yield "docs/engine-curves.md", "growth", lambda link: growth_words(r["growth"])
    yield "docs/choosing.md", "profile", lambda link: profile_table(r)
    origin = r.origin("robots_forms")
    yield "docs/decisions/trees.md", "forms", lambda link: f"{origin}\n\n{forms(r['robots_forms'])}".strip()
    large = [row for row in r["robots_large"] if row["control"] == "random"]
    origins = r.origin("robots_large")
    yield "docs/decisions/trees.md", "large", lambda link: f"{origins}\n\n{view(large, LARGE_SCENES)}"
    for name, make in AGAINST.items():
        if rows := r[f"measured_{name}"]:
            text = f"{r.origin(f'measured_{name}')}.\n\n{make(rows)}"
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
