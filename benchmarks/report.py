"""The Markdown page of a folder of results, and the tables of docs/benchmarks.md.

    python benchmarks/report.py FOLDER [--docs]

Reads the CSV files that the benchmarks wrote and writes README.md beside them; --docs also renews the parts
of docs/benchmarks.md, docs/choosing.md, docs/engine-curves.md, docs/index.md and of the README of the
repository between their markers, and the figures in sentences beside other engines.
"""

from __future__ import annotations

import argparse
import math
import os
from itertools import groupby
from pathlib import Path

from common import ROOT
from reports.engines import (
    budget_table,
    curves,
    deadline_table,
    engine_table,
    growth_table,
    summary_table,
    with_figures,
)
from reports.home import numbers
from reports.targets import PROFILE_KEYS, Results, file_targets, targets
from tables import milliseconds, scientific, table

DOCS = ROOT / "docs" / "benchmarks.md"
README = ROOT / "README.md"
HOME = ROOT / "docs" / "index.md"
CHOOSING = ROOT / "docs" / "choosing.md"
CURVES = ROOT / "docs" / "engine-curves.md"
WITH_FIGURES = (ROOT / "docs" / "engines.md", CURVES, HOME)
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
SHOWN_BESIDE = ("incline-0.99", "plates-1000", "four-bar")
MARKS = {DOCS: "results", README: "measured", CHOOSING: "methods", CURVES: "engines"}
PROFILE = "profile"  # a second part of CHOOSING


def remaining(r: Results) -> str:
    rows = [
        (row["file"], row["law"], scientific(row["tolerance"]), scientific(row["residual"]), row["status"],
         milliseconds(row["time"]))
        for row in r.files if float(row["residual"]) > float(row["tolerance"])
    ]  # fmt: skip
    header = ("file", "law", "tolerance", "residual", "status", "time (ms)")
    return table(header, rows) if rows else "None."


def duel_table(r: Results) -> str:
    return table(
        ("file", "contacts", "amontons (ms)", "residual", "Clarabel (ms)", "residual", "formulation",
         "its tolerance", "ratio"),
        [(d["file"], d["contacts"], milliseconds(d["wall"]), scientific(d["residual"]),
          milliseconds(d["clarabel_time"]), scientific(d["clarabel_residual"]), d["clarabel_form"],
          scientific(d["clarabel_tolerance"]), f"{float(d['ratio']):.2f}") for d in r.duels],
    )  # fmt: skip


def accuracy_table(r: Results) -> str:
    def cell(row: dict[str, str]) -> str:
        return f"{scientific(row['residual'])} in {milliseconds(row['time'])}"

    rows = []
    for file, group in groupby(r.files, key=lambda row: row["file"]):
        runs = list(group)
        difference = next((row["relative_difference"] for row in runs[1:2]), "")
        rows.append((file, runs[0]["contacts"], *map(cell, runs), scientific(difference)))
    header = [
        f"{law} {float(t):.0e}" for law, t in dict.fromkeys((q["law"], q["tolerance"]) for q in r.files)
    ]
    return table(("file", "contacts", *header, "objective"), rows)


def method_table(r: Results, law: str) -> str:
    rows = [
        (row["scene"], row["method"], row["status"], scientific(row["residual"]), row["products"],
         milliseconds(row["time"]), row["products_1e-03"], milliseconds(row["time_1e-03"]),
         row["products_1e-06"], milliseconds(row["time_1e-06"]))
        for row in r.methods if row["law"] == law and row["status"] != "not applicable"
    ]  # fmt: skip
    header = (
        "scene",
        "method",
        "status",
        "residual",
        "products",
        "ms",
        "products to 1e-3",
        "ms",
        "to 1e-6",
        "ms",
    )
    return table(header, rows)


def choosing_table(r: Results, link: str) -> str:
    """What docs/choosing.md shows: how long each method takes to 1e-3 and to 1e-6, by law and scene."""

    def cell(row: dict[str, str] | None) -> str:
        if row is None or row["status"] == "not applicable":
            return ""
        times = [milliseconds(row[key]) or "–" for key in ("time_1e-03", "time_1e-06")]
        return "–" if times == ["–", "–"] else " / ".join(times)

    parts = []
    for law in ("associated", "coulomb"):
        rows = {(m["scene"], m["method"]): m for m in r.methods if m["law"] == law}
        scenes, methods = (list(dict.fromkeys(key[i] for key in rows)) for i in (0, 1))
        body = [(f"`{m}`", *(cell(rows.get((scene, m))) for scene in scenes)) for m in methods]
        parts += [f"**`{law}`**, ms to 1e-3 / to 1e-6:", table(("", *scenes), body)]
    machine = ", ".join(r.environment.get(key, "") for key in ("processor", "compiler"))
    head = f"One core of an {machine}; `make bench` ([all results]({link})). {r.origin('methods.csv')}."
    return "\n\n".join([head, *parts])


def profile_table(r: Results) -> str:
    """Of each half of the corpus how often auto is near the best method; of each method alone, how often."""
    rows = []
    for half in ("tuning", "held-out"):
        part = [row for row in r.profile if row["half"] == half]
        if not part:
            continue
        methods = [key for key in part[0] if key not in (*PROFILE_KEYS, "auto")]
        feasible = [row for row in part if any(row[m] for m in methods)]
        for method in ("auto", *methods):
            ratios = sorted(
                float(row[method]) / min(float(row[m]) for m in methods if row[m])
                if row[method]
                else math.inf
                for row in feasible
            )
            within = [f"{100 * sum(x <= bound for x in ratios) / len(ratios):.0f}" for bound in (1.5, 2, 5)]
            middle = f"{ratios[len(ratios) // 2]:.2f}" if math.isfinite(ratios[len(ratios) // 2]) else "–"
            failed = f"{sum(not row[method] for row in feasible)}"
            rows.append((half, f"`{method}`", f"{len(feasible)}", *within, middle, failed))
    header = ("half", "method", "solves", "within 1.5 (%)", "within 2", "within 5", "median", "not solved")
    return table(header, rows)


def step_table(r: Results) -> str:
    return table(
        ("scene", "law", "tolerance", "method", "residual", "iterations", "products", "ms", "fastest",
         "processor"),
        [(row["scene"], row["law"], scientific(row["tolerance"]), row["used"], scientific(row["residual"]),
          row["iterations"], row["products"], milliseconds(row["wall"]), milliseconds(row["fastest"]),
          milliseconds(row["processor_time"])) for row in r.steps],
    )  # fmt: skip


def kernel_table(r: Results) -> str:
    alone = {(k["contacts"], k["law"]): float(k["ns_per_contact"]) for k in r.kernel if k["threads"] == "1"}
    return table(
        ("contacts", "law", "threads", "ns per contact", "fastest", "GB/s", "triad GB/s", "share",
         "speed-up"),
        [(k["contacts"], k["law"], k["threads"], f"{float(k['ns_per_contact']):.1f}",
          f"{float(k['best_ns']):.1f}", f"{float(k['gb_per_s']):.1f}", f"{float(k['triad_gb_per_s']):.1f}",
          f"{float(k['ratio']):.2f}", f"{alone[k['contacts'], k['law']] / float(k['ns_per_contact']):.2f}")
         for k in r.kernel],
    )  # fmt: skip


def instruction_sets_table(r: Results) -> str:
    """ns per contact of an iteration on one core, with the share of the triad in the same cache."""
    sets = list(dict.fromkeys(row["isa"] for row in r.sets))
    cells = {
        (row["contacts"], row["law"], row["isa"]): f"{float(row['ns_per_contact']):.1f}"
        + (f" ({100 * float(row['near_ratio']):.0f} %)" if row.get("near_ratio") else "")
        for row in r.sets
    }
    problems = dict.fromkeys((row["contacts"], row["law"]) for row in r.sets)
    rows = [(*problem, *(cells[*problem, isa] for isa in sets)) for problem in problems]
    return table(("contacts", "law", *sets), rows)


def share(part: str, whole: str) -> str:
    return f"{100 * float(part) / float(whole):.0f} %"


def more_cores(s: dict[str, str]) -> str:
    one, many = s.get("steps_per_second_one"), s.get("steps_per_second_all")
    return f"{float(many) / float(one):.2f}" if one and many else ""


def scene_table(r: Results) -> str:
    """The simulated scenes, for everyone."""
    return table(
        ("scene", "bodies", "contacts", "joint rows", "h (ms)", "tolerance", "time per step (ms)",
         "real-time factor", "all cores over one", "worst residual"),
        [(s["name"], s["bodies"], f"{float(s['contacts']):.0f}", f"{float(s['joint_rows']):.0f}",
          milliseconds(s["dt"]), f"{float(s['tolerance']):.0e}", milliseconds(s["step"]),
          f"{float(s['real_time_factor']):.2g}", more_cores(s), scientific(s["residual_worst"]))
         for s in r.simulation],
    )  # fmt: skip


def phase_table(r: Results) -> str:
    """Where the time of a step goes, and how well it is solved."""
    return table(
        ("scene", "simulated (s)", "collision", "assembly", "solve", "median step (ms)", "longest (ms)",
         "iterations", "converged", "median residual", "penetration (m)", "joint error (m)"),
        [(s["name"], f"{float(s['simulated']):.3g}", share(s["collision"], s["step"]),
          share(s["assembly"], s["step"]), share(s["solve"], s["step"]), milliseconds(s["step_median"]),
          milliseconds(s["step_longest"]), f"{float(s['iterations']):.0f}",
          f"{s['converged']} of {s['steps']}", scientific(s["residual_median"]),
          scientific(s["penetration"]), scientific(s["joint_error"]))
         for s in r.simulation],
    )  # fmt: skip


def physics_table(r: Results) -> str:
    def limit(row: dict[str, str]) -> str:
        value = float(row["limit"])
        if not math.isfinite(value):
            return ""
        return f"below {value:.2g}" if value >= 0 else f"above {-value:.2g}"

    rows = [
        (row["claim"], row["figure"], f"{float(row['value']):.2g} {row['unit']}".strip(), limit(row),
         "" if not limit(row) else "yes" if row["met"] == "yes" else "**no**")
        for row in r.physics
    ]  # fmt: skip
    return table(("Scene", "Quantity", "Measured", "Bound", "Met"), rows)


def order_table(r: Results) -> str:
    """Errors at the longest and the shortest step, and the mean order."""

    def cells(row: dict[str, str], what: str) -> tuple[str, ...]:
        order = row[f"{what}_order"]
        ends = (f"{float(row[f'{what}_{k}']):.1e}" for k in (0, 3))
        return (*ends, f"{float(order):.2f}" if order else "exact")

    rows = [
        (row["scene"], row["joints"], f"{1e3 * float(row['dt']):g} to {1e3 * float(row['dt']) / 8:g}",
         *cells(row, "position"), *cells(row, "velocity"))
        for row in r.orders
    ]  # fmt: skip
    parts = [(f"{what}, first", "last", "order") for what in ("Position (m)", "Velocity (m/s)")]
    return table(("Scene", "Joints as", "Step (ms)", *parts[0], *parts[1]), rows)


def robot_table(r: Results) -> str:
    """Models of others beside MuJoCo, lengths in mm, times in ms."""

    def cell(row: dict[str, str], key: str, scale: float = 1.0) -> str:
        return f"{scale * float(row[key]):.2g}" if row[key] else ""

    rows = [
        (row["model"], row["outcome"].split(":")[0], row["not_read"],
         f"{row['contacts']} / {row['mujoco_contacts']}", cell(row, "missed_percent"),
         cell(row, "residual"), cell(row, "penetration", 1e3), cell(row, "energy_gain_relative"),
         cell(row, "free", 1e3), cell(row, "free_in_errors"), cell(row, "motion", 1e3),
         cell(row, "joint_error", 1e3), cell(row, "driven_missed_percent"), cell(row, "driven_joint_error"),
         cell(row, "step_median", 1e3), cell(row, "longest_in_medians"),
         f"{cell(row, 'steps_per_second')} / {cell(row, 'mujoco_steps_per_second')}")
        for row in r.robots
    ]  # fmt: skip
    header = ("model", "outcome", "not read", "contacts", "missed %", "residual", "penetration", "gain",
              "free motion", "in errors", "motion", "joints", "driven: missed %", "driven: joints, lengths",
              "median step", "longest, medians", "steps/s")  # fmt: skip
    return table(header, rows)


def rollout_table(r: Results) -> str:
    rows = [
        (row["name"], row["threads"], f"{float(row['steps_per_second']):.0f}",
         f"{1e6 * float(row['processor_per_step']):.1f}") for row in r.rollout
    ]  # fmt: skip
    return table(("", "threads", "steps per second", "processor time per step (us)"), rows)


def studies_table(r: Results) -> str:
    rows = [
        (row["executor"], row["processes"] if int(row["processes"]) else "", row["runs"],
         f"{float(row['wall']):.2f}", f"{float(row['speed']):.2f}") for row in r.studies
    ]  # fmt: skip
    return table(("", "processes", "runs", "time (s)", "speed over the first"), rows)


def broad_phase_table(r: Results) -> str:
    return table(
        ("scene", "bodies", "pairs", "first call (ns per body)", "next (ns per body)"),
        [(row["scene"], row["bodies"], row["pairs"], row["first_ns_per_body"], row["next_ns_per_body"])
         for row in r.broad_phase],
    )  # fmt: skip


def environment_table(r: Results) -> str:
    return table(("", ""), [(key, value) for key, value in r.environment.items()])


def page(r: Results, method: str) -> str:
    """All tables; `method` is the path to the page that explains them."""
    sections = [
        ("Machine and versions", environment_table(r), ()),
        ("Targets", targets(r), ()),
        ("Simulated scenes", f"{scene_table(r)}\n\n{phase_table(r)}", ("simulation.csv",)),
        ("Physics", physics_table(r), ("physics.csv",)),
        ("Order of a step", order_table(r), ("orders.csv",)),
        ("Models of others beside MuJoCo", robot_table(r), ("robots.csv",)),
        ("Many worlds at once", rollout_table(r), ("rollout.csv",)),
        ("Studies", studies_table(r), ("studies.csv",)),
        ("Beside other engines", engine_table(r), ("beside.csv",)),
        ("Growth", growth_table(r), ("growth.csv", "exponents.csv")),
        (
            "Stopped by the clock",
            f"{budget_table(r)}\n\n{deadline_table(r)}",
            ("budgets.csv", "deadlines.csv"),
        ),
        ("auto beside the best method", profile_table(r), ("profile.csv",)),
        ("Time steps, default method", step_table(r), ("steps.csv",)),
        ("Every method, associated", method_table(r, "associated"), ("methods.csv",)),
        ("Every method, coulomb", method_table(r, "coulomb"), ("methods.csv",)),
        ("Files beside Clarabel, to 1e-4", duel_table(r), ("clarabel.csv",)),
        ("Files, residual and time (ms) by law and tolerance", accuracy_table(r), ("files.csv",)),
        ("Files that were not solved", remaining(r), ("files.csv",)),
        ("Contact kernel", kernel_table(r), ("kernel.csv",)),
        ("Contact kernel by instruction set", instruction_sets_table(r), ("instruction_sets.csv",)),
        ("Broad phase", broad_phase_table(r), ("broad_phase.csv",)),
    ]
    head = f"# Results: {r.environment.get('processor', 'unknown processor')}\n\n"
    head += f"Written by `benchmarks/run_all.py`; [what is measured and how to read it]({method}).\n\n"
    return head + "\n".join(
        "\n\n".join([f"## {title}", *filter(None, [r.origin(*names)]), f"{body}\n"])
        for title, body, names in sections
        if body and all(name in r.origins for name in names)
    )


ORDERS = """Errors at the end of a motion at four steps, each half of the one before
([orders.py](../benchmarks/orders.py)). Rows of joints leave errors of position below 1e-4 of `Model.length`,
which have no order. Dashed lines belong to coordinates of trees. The humanoid is of first order: servos go by
the bodies beside the joint, and a foot is light, although it stands.

![Errors of positions and velocities over the step](figures/orders.png)"""


def summary(r: Results, link: str) -> str:
    """What docs/benchmarks.md shows, with a link to the rest."""
    e = r.environment
    lines = [
        f"{e.get('processor', '')}, {e.get('compiler', '')}; [all tables, versions and commands]({link}).",
        targets(r),
    ]
    if r.simulation:
        lines += ["### Simulated scenes", r.origin("simulation.csv"), scene_table(r), phase_table(r)]
    if r.physics:
        lines += ["### Physics", r.origin("physics.csv"), physics_table(r)]
    if r.orders:
        lines += ["### Order of a step", r.origin("orders.csv"), ORDERS, order_table(r)]
    lines += ["### Files that were not solved", r.origin("files.csv"), remaining(r)]
    lines += ["### Time steps", r.origin("steps.csv"), step_table(r)]
    return "\n\n".join(lines)


def measured(r: Results, link: str) -> str:
    """The part of the README: some scenes, and one sentence on the solver alone."""
    e = r.environment
    machine = f"One core of an {e.get('processor', '')}, {e.get('compiler', '')}"
    lines = [f"{machine}; `make bench` ([all results]({link})). {r.origin('simulation.csv', 'files.csv')}."]
    if r.simulation:
        header = ("Scene", "Bodies", "Contacts", "Time step (ms)", "Tolerance", "Time per step (ms)",
                  "Real-time factor")  # fmt: skip
        rows = [
            (SHOWN[s["name"]], s["bodies"], f"{float(s['contacts']):.0f}", milliseconds(s["dt"]),
             f"{float(s['tolerance']):.0e}", milliseconds(s["step"]), f"{float(s['real_time_factor']):.2g}")
            for s in r.simulation if s["name"] in SHOWN
        ]  # fmt: skip
        lines.append(table(header, rows))
    facts = [
        f"{what}: {reached}"
        for what, _, reached, _ in file_targets(r)
        if what.startswith("total time") or (what.startswith("files solved") and what.endswith("coulomb"))
    ]
    if facts:
        lines.append(f"Contact problems of other engines (FCLIB), solver alone: {'; '.join(facts)}.")
    return "\n\n".join(lines)


def renew(document: Path, body: str, mark: str = "") -> None:
    """Replaces what stands between the markers of a document."""
    begin, end = (f"<!-- {mark or MARKS[document]}: {edge} -->" for edge in ("begin", "end"))
    before, rest = document.read_text().split(begin, 1)
    _, after = rest.split(end, 1)
    document.write_text(f"{before}{begin}\n\n{body}\n\n{end}{after}")


def write(folder: Path, *, docs: bool) -> list[Path]:
    """Writes the page of a folder of results and, if asked, the tables of the documentation."""
    results = Results(folder)
    inside = folder.resolve().is_relative_to(ROOT)
    path = folder / "README.md"
    path.write_text(page(results, Path(os.path.relpath(DOCS, folder)).as_posix() if inside else DOCS.name))
    if not docs:
        return [path]
    for document, make in ((DOCS, summary), (README, measured), (CHOOSING, choosing_table), (CURVES, curves)):
        renew(document, make(results, Path(os.path.relpath(path, document.parent)).as_posix()))
    renew(CHOOSING, profile_table(results), PROFILE)
    renew(README, summary_table(results, SHOWN_BESIDE), "beside")
    renew(README, numbers(results, "docs/benchmarks.md", "docs/engines.md"), "numbers")
    renew(HOME, numbers(results, "benchmarks.md", "engines.md"), "numbers")
    for document in WITH_FIGURES:
        document.write_text(with_figures(document.read_text(), results.beside))
    return [path, *MARKS]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--docs", action="store_true", help="renew the tables of the documents too")
    options = parser.parse_args()
    for written in write(options.folder.resolve(), docs=options.docs):
        print(written)
