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
from collections.abc import Callable, Iterator
from pathlib import Path

from common import ROOT
from engine_views import curves, growth_words, numbers, versions
from measured_views import AGAINST
from targets import feasible, file_targets, ratio, targets
from views import Results, Row, Rows, Spec, cell, digits, milliseconds, table, view

# docs/benchmarks.md.


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
    lines += ["### Files that were not solved", r.origin("files"), files_solved(r)]
    lines += [view(unsolved, UNSOLVED) if unsolved else "None."]
    return "\n\n".join(lines)


def files_solved(r: Results) -> str:
    """How many contact problems of other engines are solved, and the time beside Clarabel's."""
    facts = {what: found for what, _, found, _ in file_targets(r)}
    solved = [(what, found) for what, found in facts.items() if re.fullmatch("files .* coulomb", what)]
    found = ", ".join(f"{what.split()[3].rstrip(',')}: {count}" for what, count in solved)
    lines = [f"Solved with Coulomb's law, to a residual of {found}."] if solved else []
    lines += [
        f"With `associated`, the {what} is {time}." for what, time in facts.items() if "Clarabel" in what
    ]
    return " ".join(lines)


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


def profile_table(r: Results) -> str:
    """On the held-out half of the corpus, how often auto and each method alone are near the best method."""
    lines = []
    methods, rows = feasible(r["profile"], "held-out")
    for method in ("auto", *methods):
        ratios = sorted(ratio(row, method, methods) for row in rows)
        within = [f"{100 * sum(x <= bound for x in ratios) / len(ratios):.0f}" for bound in (1.5, 2, 5)]
        middle = f"{ratios[len(ratios) // 2]:.2f}" if math.isfinite(ratios[len(ratios) // 2]) else "–"
        failed = f"{sum(not row[method] for row in rows)}"
        lines.append((f"`{method}`", f"{len(rows)}", *within, middle, failed))
    header = ("method", "solves", "within 1.5 (%)", "within 2", "within 5", "median", "not solved")
    return table(header, lines)


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


# Documents.

FIGURE = re.compile(r"(\S+) (\S+) <!-- (\S+); ([^;]+); (\w+) -->")
"""A number, its unit, and a comment with scene, engine and column of beside.csv that it is taken from."""
CELL = re.compile(r"(\S+) <!-- (\w+)\.csv: ([^;>]*); (least|most|median|count)(?: ([^>]+?))? -->")
"""A number, and a comment with the table that it is taken from, KEY=VALUE, ... of the rows, and which of
their values is shown, by a Spec; or how many rows there are."""
UNITS = {"mm": 1e3, "mm/s": 1e3, "us": 1e6, "ms": 1e3, "%": 1e2, "times": 1.0, "um": 1e6, "m": 1.0}


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
    yield "docs/engines.md", "versions", lambda link: versions(beside)
    yield "docs/benchmarks.md", "results", lambda link: summary(r, link)
    yield "docs/engine-curves.md", "engines", lambda link: curves(r, link)
    yield "docs/choosing.md", "methods", lambda link: choosing_table(r, link)
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
