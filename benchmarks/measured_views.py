"""Views of the tables beside measurements: docs/measured.md."""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby

from views import Row, Rows, Spec, grouped, scientific, short, table, view


def errors(row: Row) -> str:
    return f"{float(row['position_percent']):.1f} / {float(row['angle_deg']):.1f}"


def tosses(rows: Rows) -> str:
    """One line for each engine and its coefficients; errors over steps per sample, lengths as tracked."""
    lines = []
    tracked = [row for row in rows if row["scale"] == "as tracked"]
    for (engine,), mine in grouped(tracked, "engine").items():
        given = {r["steps_per_sample"]: r for r in mine if r["coefficients"] == "given"}
        held = {r["coefficients"]: r for r in mine}
        fitted = held["fitted, held out"]
        values = (short(fitted[key]) for key in ("friction", "restitution") if fitted[key] != "")
        lines.append([
            engine, *(errors(given[k]) if k in given else "" for k in ("1", "2", "4", "8")),
            errors(held["given, held out"]), errors(fitted), ", ".join(values),
        ])  # fmt: skip
    header = ("engine", "1 step", "2", "4", "8", "given, held out", "fitted, held out", "fitted values")
    return (
        f"Lengths as tracked, % of the width / deg:\n\n{table(header, lines)}\n\n{corrected(rows)}\n\n"
        f"Other coefficients, 1 step, as tracked:\n\n{varied(rows)}"
    )


def corrected(rows: Rows) -> str:
    """How far corrected lengths change the error of an engine with the given coefficients."""
    found = {
        (row["scale"] == "as tracked", row["engine"], row["steps_per_sample"]): float(row["position_percent"])
        for row in rows
        if row["coefficients"] == "given"
    }
    changes = [value - found[True, *key] for (tracked, *key), value in found.items() if not tracked]
    span = f"{min(changes):.1f} to {max(changes):.1f} %"
    return f"Lengths corrected by 2.2 % change an error by {span} of the width."


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
