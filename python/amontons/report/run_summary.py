"""Outputs of a run: a summary, a figure and a CSV file of the reports of its steps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import Array
from ..io.files import write_whole
from ..simulation.step_report import REPORTS, TIMINGS, Table, energy
from .complete_files import csv_bytes, save_figure
from .complete_files import title as plain
from .plotting import Axes, plt

PHASES = TIMINGS[:-1]
COLOURS = {"collision": "#56b4e9", "assembly": "#009e73", "solve": "#d55e00", "integration": "#cc79a7"}


def facts(reports: Table, *, dt: float, wall: float, tolerance: float) -> Iterator[tuple[str, str]]:
    """Pairs of name and value; `wall` is the wall clock of the whole run (s)."""
    steps = len(reports)
    if not steps:
        yield "steps", "none"
        return
    simulated = steps * dt
    yield "simulated", f"{simulated:.6g} s in {steps} steps of {dt:g} s"
    yield "wall clock", f"{wall:.3g} s, real-time factor {simulated / wall:.3g}"
    yield "converged", _converged(reports)
    at = int(np.argmax(reports["residual"]))
    yield (
        "residual",
        f"worst {reports['residual'][at]:.1e} at t = {reports['time'][at]:g} s, tolerance {tolerance:g}",
    )
    for name in ("contacts", "iterations"):
        yield name, f"{reports[name].mean():.4g} a step, at most {reports[name].max()}"
    yield "penetration", _largest(reports, "penetration", "m")
    if reports["joint_rows"].any():
        yield (
            "joint error",
            f"{_largest(reports, 'joint_error', 'm')}, {reports['joint_angle_error'].max():.2e} rad",
        )
    total = energy(reports)
    rise = float(np.max(np.diff(total), initial=0.0))
    yield "energy", f"{total[0]:.6g} J to {total[-1]:.6g} J, largest rise in a step {rise:.2e} J"
    if np.any(reports["substeps"] > 1):
        divided = np.count_nonzero(reports["substeps"] > 1)
        yield "substeps", f"{divided} steps in parts, {reports['substeps'].max()} at most"
    spent = reports["total"].sum()
    phases = ", ".join(f"{name} {_share(reports[name].sum(), spent)}" for name in PHASES)
    yield "time", f"{spent:.3g} s in steps: {phases}"


def numbers(reports: Table, *, dt: float, wall: float) -> dict[str, Any]:
    """The same for JSON: seconds, metres, joules."""
    steps = len(reports)
    told: dict[str, Any] = {"steps": steps, "simulated": steps * dt, "wall": wall}
    if not steps:
        return told
    total = energy(reports)
    return told | {
        "real_time_factor": steps * dt / wall,
        "missed": int(np.count_nonzero(~reports["converged"])),
        "worst_residual": reports["residual"].max(),
        **{f"{name}_mean": reports[name].mean() for name in ("contacts", "iterations")},
        **{f"{name}_max": reports[name].max() for name in ("contacts", "iterations", "substeps")},
        **{name: reports[name].max() for name in ("penetration", "joint_error", "joint_angle_error")},
        "energy_first": total[0],
        "energy_last": total[-1],
        "energy_rise": np.max(np.diff(total), initial=0.0),
        "seconds": {name: reports[name].sum() for name in TIMINGS},
    }


def _converged(reports: Table) -> str:
    failed = reports[~reports["converged"]]
    if not len(failed):
        return f"all {len(reports)} steps"
    kinds = ", ".join(f"{count} {status}" for status, count in Counter(failed["status"].tolist()).items())
    return (
        f"{len(reports) - len(failed)} of {len(reports)} steps; {len(failed)} did not ({kinds}), "
        f"the first at t = {failed['time'][0]:g} s"
    )


def _largest(reports: Table, name: str, unit: str) -> str:
    at = int(np.argmax(reports[name]))
    return f"largest {reports[name][at]:.2e} {unit} at t = {reports['time'][at]:g} s"


def _share(part: float, whole: float) -> str:
    return f"{100 * part / whole:.0f} %" if whole > 0 else "0 %"


def write_reports(
    reports: Table, path: Path, *, names: Sequence[str] = (), readings: Sequence[Array] = ()
) -> None:
    """A CSV file with one line per step: its report, then what was measured under these names."""
    columns = REPORTS.names or ()
    header = [*columns, *(f"{name}.signal" if name in columns else name for name in names)]
    measured: Sequence[Sequence[float]] = [row.tolist() for row in readings] or [()] * len(reports)
    rows = ([*report, *values] for report, values in zip(reports.tolist(), measured, strict=True))
    write_whole({path: csv_bytes(header, rows)}, own={path})


def run_figure(reports: Table, path: Path, *, title: str, tolerance: float) -> None:
    """Energy, residual, penetration, joint error, contacts, wall clock and iterations over time (PNG)."""
    figure, panels = plt.subplots(3, 2, figsize=(11, 8.5), sharex=True, layout="constrained")
    figure.suptitle(plain(title), x=0.01, ha="left", fontsize="medium")
    _energy(panels[0, 0], reports)
    _residual(panels[0, 1], reports, tolerance)
    _errors(panels[1, 0], reports)
    _counts(panels[1, 1], reports)
    _phases(panels[2, 0], reports)
    _iterations(panels[2, 1], reports)
    for axes in panels.flat:
        axes.grid(True, linewidth=0.4, alpha=0.5)
    for axes in panels[-1]:
        axes.set_xlabel("simulated time (s)")
    save_figure(figure, path, 110)


def _label(axes: Axes, title: str) -> None:
    axes.set_title(title, loc="left", fontsize="medium")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(frameon=False, fontsize="small")


def _energy(axes: Axes, r: Table) -> None:
    # Heights are measured from the origin, so only changes of potential energy mean something.
    potential = r["potential_energy"] - r["potential_energy"][0]
    axes.plot(r["time"], r["kinetic_energy"], color="#0072b2", linewidth=1, label="kinetic")
    axes.plot(r["time"], potential, color="#009e73", linewidth=1, label="of gravity, from the start")
    if r["spring_energy"].any():
        axes.plot(r["time"], r["spring_energy"], color="#e69f00", linewidth=1, label="of springs")
    total = r["kinetic_energy"] + potential + r["spring_energy"]
    axes.plot(r["time"], total, color="black", linewidth=1.4, label="total")
    _label(axes, "energy (J)")


def _residual(axes: Axes, r: Table, tolerance: float) -> None:
    axes.semilogy(r["time"], np.maximum(r["residual"], 1e-17), color="#d55e00", linewidth=0.8)
    failed = r[~r["converged"]]
    if len(failed):
        axes.semilogy(
            failed["time"], failed["residual"], "x", color="black", markersize=4, label="not converged"
        )
    if tolerance > 0:
        axes.axhline(tolerance, color="black", linewidth=0.6, linestyle=(0, (1, 2)))
    _label(axes, "residual of each step")


def _errors(axes: Axes, r: Table) -> None:
    for name, colour, label in (
        ("penetration", "#0072b2", "penetration"),
        ("joint_error", "#cc79a7", "joint error"),
    ):
        if r[name].any():
            axes.semilogy(
                r["time"], np.where(r[name] > 0, r[name], np.nan), color=colour, linewidth=1, label=label
            )
    _label(axes, "largest penetration and joint error (m)")


def _counts(axes: Axes, r: Table) -> None:
    axes.plot(r["time"], r["contacts"], color="#0072b2", linewidth=1, label="contacts")
    if r["joint_rows"].any():
        axes.plot(r["time"], r["joint_rows"], color="#cc79a7", linewidth=1, label="joint rows")
    axes.set_ylim(bottom=0)
    _label(axes, "contacts")


def _phases(axes: Axes, r: Table) -> None:
    parts = [1e3 * r[name] for name in PHASES]
    axes.stackplot(r["time"], parts, labels=PHASES, colors=[COLOURS[name] for name in PHASES], linewidth=0)
    _label(axes, "wall clock of each step (ms)")


def _iterations(axes: Axes, r: Table) -> None:
    axes.semilogy(
        r["time"], np.maximum(r["products"], 1), color="#009e73", linewidth=0.8, label="products with A"
    )
    axes.semilogy(
        r["time"], np.maximum(r["iterations"], 1), color="#e69f00", linewidth=0.8, label="iterations"
    )
    _label(axes, "iterations of each step")
