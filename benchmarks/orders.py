"""The order of a step: errors of poses and velocities at four steps, each half of the one before.

    python benchmarks/orders.py [--quick] [--out FOLDER]

The scenes of tests/physics/instants.py, with joints as rows and in coordinates of trees. Errors are those at
the end, beside the limit of the two shortest of six steps by extrapolation. Writes orders.csv, a row per
scene and form with the errors at four steps and the mean order, log2 of the first over the last by three; and
the figure orders.png. Rows of joints leave errors of position below 1e-4 of `Model.length` as they are.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from common import ROOT, arguments, shrink, tracked, with_folders, write_csv

sys.path.insert(0, str(ROOT / "tests" / "physics"))  # where instants is
from instants import MOTIONS, errors

FORMS = {"none": "rows", "auto": "trees"}
UNSOLVED = [("four-bar", "auto")]
"""Redundant rows of loops of trees miss the tolerance here."""
EXACT = 1e-9
"""m, m/s, rad/s"""
Row = dict[str, Any]


def order(errors: np.ndarray) -> float | str:
    """The mean over halved steps; none where all is exact but for the tolerance of solves."""
    return "" if errors.max() < EXACT else math.log2(errors[0] / errors[-1]) / (len(errors) - 1)


def measured(name: str, trees: str, steps: int = 4) -> Row:
    _, duration, longest = MOTIONS[name]
    found = errors(name, trees, steps)
    row: Row = {"scene": name, "joints": FORMS[trees], "duration": duration, "dt": longest}
    for k, what in enumerate(("position", "velocity")):
        row |= {f"{what}_{n}": found[n, k] for n in range(steps)} | {f"{what}_order": order(found[:, k])}
    return row


def draw(rows: list[Row], path: Path) -> None:
    """Errors over the step, rows and trees; a line of order two beside them."""
    figure, panels = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained", sharex=True)
    for axes, what, unit in zip(panels, ("position", "velocity"), ("m", "m/s, rad/s"), strict=True):
        for number, name in enumerate(MOTIONS):
            for form, style in zip(FORMS.values(), ("o-", "s--"), strict=True):
                mine = [r for r in rows if (r["scene"], r["joints"]) == (name, form) and r[f"{what}_order"]]
                for r in mine:
                    axes.plot(
                        [r["dt"] / 2**k for k in range(4)], [r[f"{what}_{k}"] for k in range(4)], style,
                        color=f"C{number}", label=name if form == "rows" else None, markersize=3, linewidth=1,
                    )  # fmt: skip
        steps = [1e-3, 2e-2]
        axes.plot(steps, [20 * h**2 for h in steps], color="0.6", linewidth=1, label="order 2")
        axes.set(xscale="log", yscale="log", xlabel="dt (s)", title=f"error of the {what} ({unit})")
        axes.grid(True, alpha=0.25)
    panels[1].legend(fontsize=6)
    figure.savefig(path, dpi=90)
    plt.close(figure)
    shrink(path)


def main() -> None:
    options = with_folders(arguments(__doc__).parse_args())
    cases = [(name, trees) for name in MOTIONS for trees in FORMS if (name, trees) not in UNSOLVED]
    shown = tracked(cases[::4] if options.quick else cases, "orders")
    rows = [measured(name, trees) for name, trees in shown]
    write_csv(options.out / "orders.csv", rows)
    draw(rows, options.figures / "orders.png")
    for r in rows:
        found = [f"{r[key]:.2f}" if r[key] else "exact" for key in ("position_order", "velocity_order")]
        print(f"orders: {r['scene']}, {r['joints']}: {', '.join(found)}")


if __name__ == "__main__":
    main()
