"""Every method and `auto` on the corpus of `corpus.py`: the performance profile.

    python benchmarks/performance_profile.py [--quick] [--corpus FOLDER] [--half tuning|held-out|both]
        [--methods NAME ...] [--limit S] [--every N] [--only PART ...] [--out FOLDER]

Each step is solved four times: to four tolerances, cold and warm, under both laws. A method has `--limit`
seconds of processor time for each, less where another one has been ten times faster. Writes profile.csv (a
row per solve and method, auto last, with a time if it succeeds); figures.py draws it. A corpus that is not
there is made first, with the robots of the data folder.

Times are seconds: of short solves the shortest of several runs, of long ones the processor time.
"""

from __future__ import annotations

import argparse
import signal
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import amontons
import numpy as np
from common import SAMPLE, Row, arguments, begin, fill, task_row
from corpus import FOLDER, QUICK, Step, held_out, load, sequences, write
from report import profile

METHODS = ("apgd", "p-spg-fb", "interior-point", "newton", "gauss-seidel", "cg")
TOLERANCES = (1e-2, 1e-3, 1e-6, 1e-8)
SHORT, REPEATS = 0.02, 4
"""Solves below SHORT (s) are run so often again, and the shortest counts."""
LONG = 2e-3
"""From here on (s) processor time counts, where it is the shorter: other work on the machine does not."""
SLOWER = 10.0
"""What takes so many times the best time is stopped."""
LEAST = 0.02
"""s, given to every method."""


@dataclass(frozen=True)
class Task:
    step: Step
    law: str
    tolerance: float
    warm: bool

    @property
    def name(self) -> str:
        return f"{self.step.name}, {self.law}, {self.tolerance:g}, {'warm' if self.warm else 'cold'}"


def tasks(steps: Iterable[Step]) -> Iterator[Task]:
    """Four of each step: every tolerance once, each law and each start twice, in turns."""
    for i, step in enumerate(steps):
        frictional = any("riction" in type(cone).__name__ for cone in step.cones)
        for k, tolerance in enumerate(TOLERANCES):
            law = "coulomb" if frictional and (k // 2 + i // 2) % 2 else "associated"
            yield Task(step, law, tolerance, bool((k + i) % 2 and step.x0.any()))


def stop_now(signum: int, frame: object) -> None:
    """What Ctrl-C does: the solve ends with its best x."""
    raise KeyboardInterrupt


def run(problem: amontons.vi.Problem, task: Task, method: str, limit: float) -> tuple[float, float, str, str]:
    """Time (s), residual, status and reason of one solve, within `limit` s of processor time."""
    options = {"law": task.law, "tolerance": task.tolerance, "x0": task.step.x0 if task.warm else None}
    times: list[float] = []
    try:
        for _ in range(1 + REPEATS):
            signal.setitimer(signal.ITIMER_PROF, limit)
            before = process_time()
            try:
                solution = problem.solve(method=method, **options)
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
            busy = process_time() - before
            times.append(min(busy, solution.time) if busy > LONG else solution.time)
            if sum(times) > REPEATS * SHORT:
                break
    except amontons.InputError:
        return np.inf, np.inf, "refused", ""
    except KeyboardInterrupt:  # that came after the last look at it
        return np.inf, np.inf, "interrupted", ""
    return max(min(times), 1e-6), solution.residual, solution.status, solution.reason


def measure(task: Task, methods: Sequence[str], limit: float) -> Iterator[Row]:
    """A row per method, without a time where it fails; `auto` comes last and has the whole limit."""
    known = {
        "half": "held-out" if held_out(task.step.sequence) else "tuning", "rows": len(task.step.b),
        "law": task.law, "tolerance": task.tolerance, "warm": task.warm,
    }  # fmt: skip
    best, problem = np.inf, task.step.problem()
    for method in [*methods, "auto"]:
        # A method that is not the best has not to finish; that auto does is what is asked.
        allowed = 4 * limit if method == "auto" else min(limit, max(LEAST, SLOWER * best))
        time, error, status, reason = run(problem, task, method, allowed)
        solved = (time, error) if status == "converged" else ("", "")
        best = min(best, time if status == "converged" else np.inf)
        yield task_row(task.name, method, *solved) | known | {"status": status, "reason": reason}


def corpus_of(options: argparse.Namespace) -> Path:
    """The folder of the corpus; made where it is not there, one of --corpus of the sequences of --only."""
    folder: Path = options.corpus or (SAMPLE / "corpus" if options.quick else FOLDER)
    if not any(folder.glob("*.pickle")):
        chosen = sequences(options.data / "robots")
        if options.corpus and options.only:
            chosen = [s for s in chosen if any(part in s.name for part in options.only)]
        elif options.quick:
            chosen = chosen[::QUICK]
        write(folder, chosen)
    return folder


def parsed() -> argparse.Namespace:
    parser = arguments(__doc__)
    parser.add_argument("--corpus", type=Path, help="folder of the corpus (default: out/corpus)")
    parser.add_argument("--half", choices=("tuning", "held-out", "both"), default="both")
    parser.add_argument("--methods", nargs="*", default=list(METHODS))
    parser.add_argument("--limit", type=float, help="s of processor time per solve (default: 0.5)")
    parser.add_argument("--every", type=int, help="take every so many step (default: 6)")
    parser.add_argument("--only", nargs="*", default=[], help="steps whose names contain one of these")
    options = parser.parse_args()
    part = (options.corpus, options.half != "both", options.only, options.every, options.limit)
    begin(options, sample=any(part))
    options.every = options.every or (10 if options.quick else 6)
    options.limit = options.limit or (0.3 if options.quick else 0.5)
    return options


def main() -> None:
    options = parsed()
    signal.signal(signal.SIGPROF, stop_now)
    warnings.simplefilter("ignore")
    steps = list(load(corpus_of(options)))[:: options.every]
    wanted = [
        task
        for task in tasks(steps)
        if (options.half == "both" or (options.half == "held-out") == held_out(task.step.sequence))
        and (not options.only or any(part in task.step.name for part in options.only))
    ]
    given = options.methods, options.limit
    table = fill(options.out / "profile.csv", wanted, lambda task: measure(task, *given))
    for half in ("tuning", "held-out"):
        print(f"{half}:\n{profile(table, half)}")


if __name__ == "__main__":
    main()
