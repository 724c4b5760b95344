"""The tables of docs/measured.md, from the results of measurements.py."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from common import ROOT, read_csv
from report import renew as renew_part
from tables import table

from reports.targets import Results

PAGE = ROOT / "docs" / "measured.md"
Rows = list[dict[str, str]]


def short(value: str, digits: int = 3) -> str:
    """A number with so many digits; a text as it is."""
    try:
        return f"{float(value):.{digits}g}"
    except ValueError:
        return value


def tosses(rows: Rows) -> str:
    """One line for each engine, scale and coefficients; errors over steps per sample."""
    parts = []
    for scale in dict.fromkeys(row["scale"] for row in rows):
        own = [row for row in rows if row["scale"] == scale]
        lines = []
        for engine in dict.fromkeys(row["engine"] for row in own):
            given = {
                r["steps_per_sample"]: r for r in own if (r["engine"], r["coefficients"]) == (engine, "given")
            }
            held = {r["coefficients"]: r for r in own if r["engine"] == engine}
            fitted = held["fitted, held out"]
            coefficients = ", ".join(
                f"{short(fitted[key])}" for key in ("friction", "restitution") if fitted[key] != ""
            )
            lines.append([
                engine, *(errors(given[k]) if k in given else "" for k in ("1", "2", "4", "8")),
                errors(held["given, held out"]), errors(fitted), coefficients,
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
    return table(
        ("engine", *kinds),
        [[engine, *(found.get((engine, kind), "") for kind in kinds)] for engine in engines],
    )


def errors(row: dict[str, str]) -> str:
    return f"{float(row['position_percent']):.1f} / {float(row['angle_deg']):.1f}"


GROUPS = {
    "Pos": "positions (m)",
    "Vel": "velocities (m/s)",
    "Rforce": "forces (N)",
    "Rtorque": "torques (N m)",
}


def adams(rows: Rows) -> str:
    """One line for each step of the cases that miss a target: the worst of each group of quantities."""
    lines = []
    missed = {row["case"] for row in rows if row["met"] == "no"}
    shown = [row for row in rows if row["case"] in missed]
    for (case, dt), group in groupby(shown, key=lambda row: (row["case"], row["dt_ms"])):
        own = list(group)
        line = [case.replace("_", " "), short(dt), short(own[0]["their_step_ms"])]
        for start in GROUPS:
            worst = max(
                (r for r in own if r["quantity"].startswith(start)),
                key=lambda r: float(r["rms"]),
                default=None,
            )
            line.append(
                "" if worst is None else f"{float(worst['rms']):.1e}" + " (no)" * (worst["met"] == "no")
            )
        lines.append(line)
    return table(("case", "step (ms)", "theirs (ms)", *GROUPS.values()), lines) + "\n\n" + adams_counts(rows)


def adams_counts(rows: Rows) -> str:
    lines = []
    for dt, what in (
        ("5", "5 ms: positions 1e-3 m, reactions 0.1 %"),
        ("0.5", "0.5 ms: Chrono's tolerances"),
    ):
        for start, name in (("Pos", "positions"), ("Vel", "velocities"), ("R", "reactions")):
            own = [
                r for r in rows if short(r["dt_ms"]) == dt and r["quantity"].startswith(start) and r["met"]
            ]
            if own:
                lines.append([what, name, f"{sum(r['met'] == 'yes' for r in own)} of {len(own)}"])
    return table(("target", "quantities", "met"), lines)


def impacts(rows: Rows) -> str:
    lines = [
        [r["law"], short(r["inertia_over_homogeneous"]), short(r["friction"]), short(r["restitution"]),
         f"{float(r['median_percent']):.1f}",
         f"{float(r['mean_percent']):.1f}"] for r in rows
    ]  # fmt: skip
    return table(("law", "inertia", "friction", "restitution", "median error (%)", "mean (%)"), lines)


def damper(rows: Rows) -> str:
    lines = [
        [r["test"], r["model"], f"{float(r['friction_N']) / 1e3:.1f}", short(r["play_mm"]),
         f"{float(r['rms_error_percent']):.0f}", f"{float(r['scatter_percent']):.0f}"] for r in rows
    ]  # fmt: skip
    return table(("test", "model", "friction (kN)", "play (mm)", "error (%)", "scatter of cycles (%)"), lines)


def masonry(rows: Rows) -> str:
    files = [r for r in rows if r["blocks"]]
    keys = {
        "assembly": "assembly", "blocks": "blocks", "friction": "friction", "theirs": "theirs",
        "verdict": "verdict", "needed_with_prestress": "needs friction, prestressed",
        "needed": "placed freely", "in_time": "simulation", "rigid_in_time": "rigid contacts",
    }  # fmt: skip
    lines = [[short(r[key], 3) for key in keys] for r in files]
    others = [[r["assembly"], short(r["theirs"], 4), short(r["verdict"], 4)] for r in rows if not r["blocks"]]
    return table(tuple(keys.values()), lines) + "\n\n" + table(("case", "published", "ours"), others)


def clearances(rows: Rows) -> str:
    keys = {
        "step_ms": "step (ms)", "touches": "touches", "largest_across_mm": "largest across (mm)",
        "energy_lost_percent": "energy lost (%)", "rms_along_mm": "apart along (mm)",
        "rms_across_mm": "apart across (mm)",
    }  # fmt: skip
    return table(tuple(keys.values()), [[short(r[key], 4) for key in keys] for r in rows])


def four_bar(rows: Rows) -> str:
    keys = {
        "step_ms": "step (ms)", "rms_crank_mrad": "crank (mrad)", "rms_coupler_mrad": "coupler (mrad)",
        "rms_rocker_mrad": "rocker (mrad)", "largest_mrad": "largest (mrad)",
        "deepest_mm": "deepest in a bearing (mm)",
    }  # fmt: skip
    return table(tuple(keys.values()), [[short(r[key]) for key in keys] for r in rows])


TABLES = {
    "tosses": tosses, "adams": adams, "impacts": impacts, "damper": damper, "masonry": masonry,
    "clearances": clearances, "four_bar": four_bar,
}  # fmt: skip


def renew(folder: Path) -> None:
    """Write the tables of a folder of results between the markers of the page."""
    results = Results(folder)
    for name, make in TABLES.items():
        file = f"measured_{name}.csv"
        if rows := read_csv(folder / file):
            renew_part(PAGE, f"{results.origin(file)}.\n\n{make(rows)}", name)
