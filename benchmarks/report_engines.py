"""The tables of docs/engines.md: beside other engines, growth, stopped by the clock."""

from __future__ import annotations

from typing import Protocol

from tables import digits, milliseconds, scientific, table

Rows = list[dict[str, str]]


class Results(Protocol):
    """The rows of the CSV files of these tables."""

    engines: Rows
    growth: Rows
    exponents: Rows
    deadlines: Rows
    budgets: Rows

    def origin(self, *names: str) -> str: ...


def engine_table(r: Results) -> str:
    """Other engines on the same scenes; blank is what a scene does not have or does not ask for."""

    def cell(row: dict[str, str], key: str, scale: float) -> str:
        return digits(row[key], scale) if row[key] != "" else ""

    def end(row: dict[str, str]) -> str:
        if row["lost"] == "True":
            return "lost"
        return "" if row["complete"] == "True" else f"{row['steps']} steps"

    rows = [
        (row["case"], row["engine"], digits(row["dt"], 1e3), digits(row["step"], 1e6), cell(row, "ratio", 1),
         cell(row, "penetration", 1e3), cell(row, "creep", 1e3), cell(row, "joint_error", 1e3),
         cell(row, "energy_rise", 1), cell(row, "energy_drift", 1e2), end(row))
        for row in r.engines
    ]  # fmt: skip
    header = ("scene", "engine", "h (ms)", "us a step", "over MuJoCo", "overlap (mm)", "creep (mm/s)",
              "joint gap (mm)", "energy rises (J)", "drifts (%)", "ended")  # fmt: skip
    return table(header, rows)


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


def beside(r: Results, link: str) -> str:
    """What docs/engines.md shows."""
    parts = ["## Other engines", r.origin("engines.csv"), engine_table(r)]
    parts += ["## Growth", r.origin("growth.csv", "exponents.csv"), growth_table(r)]
    if r.budgets:
        parts += ["## Stopped by the clock", r.origin("budgets.csv"), budget_table(r)]
    parts += [f"[The rest]({link})."]
    return "\n\n".join(parts)
