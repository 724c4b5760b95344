"""The figures of the P-SPG-FB paper (Tasora, WSCG 2013), with the scenes and methods of this library.

    python benchmarks/paper_figures.py [--quick] [--law LAW] [--deadline SECONDS] [--out FOLDER]

Objective of P-SPG-FB as published, residual of every method on B1 to B4, cost against size and mass ratio,
pictures of the wall: PNG and CSV files and a page in one folder, by default out/paper. At full size it takes
several minutes.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

from common import ROOT, progress
from paper.cases import FULL, QUICK
from paper.page import reproduce, steps


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="small scenes, to see that everything runs")
    parser.add_argument("--law", choices=("associated", "coulomb"), default="associated")
    parser.add_argument("--deadline", type=float, help="wall clock per method and problem (s), by default 10")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "paper")
    options = parser.parse_args(words)
    plan = QUICK if options.quick else FULL
    if options.deadline is not None:
        shorter = min(plan.sweep_deadline, options.deadline)
        plan = replace(plan, deadline=options.deadline, sweep_deadline=shorter)
    options.out.mkdir(parents=True, exist_ok=True)
    told = [word for word in words if word not in ("--out", str(options.out))]
    command = shlex.join(["python", "benchmarks/paper_figures.py", *told])
    with progress() as bar:
        task = bar.add_task("paper", total=steps(plan), item="")
        made = reproduce(
            plan,
            options.out,
            law=options.law,
            command=command,
            before=lambda what: bar.update(task, advance=1, item=what),
        )
    for path in made:
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
