"""The command: runs families of cases, prints and writes the table, shrinks what failed.

PYTHONPATH=tools python -m soak [--seed N] [--seconds S | --cases N] [--family NAME ...] [--csv FILE]
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from pathlib import Path

from .families import families
from .runner import Run
from .shrink import shrink
from .table import added, read_csv, rows, show, write_csv

ROOT = Path(__file__).resolve().parents[2]


def main() -> int:
    known = families()
    parser = argparse.ArgumentParser(prog="soak", description=__doc__)
    parser.add_argument("--seed", type=int, help="of all cases; by default the time, and printed")
    parser.add_argument("--cases", type=int, default=10**9, help="of each family, at most")
    parser.add_argument("--seconds", type=float, default=10**9, help="wall clock in all, at most")
    parser.add_argument("--family", action="append", choices=list(known), help="only this one; repeatable")
    parser.add_argument("--jobs", type=int, default=2, help="workers side by side")
    parser.add_argument("--csv", type=Path, help="where the table goes")
    parser.add_argument("--add", action="store_true", help="to the table that is there: one of several runs")
    parser.add_argument("--sanitized", action="store_true", help="the module was built with a sanitizer")
    parser.add_argument("--case", type=int, help="run this one case of one family, and keep its files")
    parser.add_argument("--into", type=Path, help="where shrunk failures go; tests/python/soak keeps them")
    options = parser.parse_args()
    if options.cases >= 10**9 and options.seconds >= 10**9 and options.case is None:
        options.seconds = 120.0
    seed = options.seed if options.seed is not None else int(time.time())
    chosen = [known[name] for name in options.family or known]
    work = ROOT / "out" / "soak" / f"seed-{seed}"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    print(f"soak: seed {seed}, {len(chosen)} families; files in {work}", flush=True)
    with tempfile.TemporaryDirectory(prefix="soak-") as scratch:
        limits = dict(cases=options.cases, seconds=options.seconds, sanitized=options.sanitized)
        before = read_csv(options.csv) if options.csv and options.add else {}

        def progress(run: Run) -> None:
            if options.csv:
                write_csv(options.csv, added(rows(run), before))

        run = Run(chosen, seed, **limits, work=work, scratch=Path(scratch), progress=progress)
        if options.case is not None:
            run.only(chosen[0], options.case)
        else:
            run.go(options.jobs)
        progress(run)
        print(show(rows(run)))
        for first in {(f.family, f.where): f for f in reversed(run.found)}.values():
            print(f"\n{first.family} --seed {seed} --case {first.index}: {first.kind}: {first.where}")
            if options.into:
                print(f"  shrunk to {shrink(known[first.family], first, options.into, run)}")
    return bool(run.found)


if __name__ == "__main__":
    sys.exit(main())
