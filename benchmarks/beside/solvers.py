"""The same contact problems solved by Siconos and by us: what is solved under our residual, and in what time.

    python -m beside.solvers [--quick] [--only files|steps] [--data FOLDER] [--out FOLDER]

Run it in benchmarks/. The problems are the FCLIB files without bilateral rows, and time steps of the scenes
of this comparison, as our simulation poses them without a start value. --only renews one of both. Siconos is
that of Debian's python3-siconos, or of build/engines/siconos. Every solver is asked for 1e-4, 1e-6 and 1e-8
by its own measure; a tolerance that took too long is not followed by a tighter one. Writes solvers.csv.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import amontons
import numpy as np
import scipy.sparse as sp
from common import RESULTS, Row, arguments, begin, read, read_csv, task_row, tracked, write_csv

from .engine import ENVIRONMENTS, Worker
from .plain import Unsupported
from .scenes import CASES

SOLVERS = ("NSGS", "ADMM", "NSN_AC")
"""Of Siconos: Gauss-Seidel over contacts, ADMM, the nonsmooth Newton method of Alart and Curnier."""
TOLERANCES = (1e-4, 1e-6, 1e-8)
STEPS = (
    ("launch", 20), ("stack", 20), ("plates-100", 20), ("plates-1000", 20), ("cards", 20), ("arch", 20),
    ("wall", 10), ("spheres", 60),
)  # fmt: skip
"""Scene, and the number of the step."""
DEADLINE = 5.0
"""s of one solve"""
QUICK_STRIDE = 14


def interpreter() -> str | None:
    """That has Siconos."""
    for python in (str(ENVIRONMENTS / "siconos" / "bin" / "python"), "/usr/bin/python3"):
        if Path(python).exists():
            found = subprocess.run([python, "-c", "import siconos.numerics"], capture_output=True)
            if found.returncode == 0:
                return python
    return None


class Siconos:
    """Its process, which a solve without end takes with it."""

    def __init__(self, python: str, folder: Path) -> None:
        self.python, self.folder = python, folder
        self.worker = Worker(python, "beside.siconos_worker")
        self.version = self.worker.ask(version=True)["version"]

    def read(self, problem: amontons.vi.Problem) -> None:
        A = problem.A.to_sparse() if hasattr(problem.A, "to_sparse") else problem.A
        matrix = sp.coo_array(A)
        np.savez(
            self.folder / "problem.npz",
            row=matrix.row, col=matrix.col, value=matrix.data, q=problem.b, mu=problem.mu,
        )  # fmt: skip
        self.load()

    def load(self) -> None:
        if not self.worker.lives():
            self.worker = Worker(self.python, "beside.siconos_worker")
        self.worker.ask(problem=str(self.folder / "problem.npz"))

    def error(self, impulses: np.ndarray[Any, Any], tolerance: float) -> float:
        """By Siconos' measure."""
        np.save(self.folder / "judged.npy", impulses)
        found = self.worker.ask(judge=str(self.folder / "judged.npy"), tolerance=tolerance)
        return float(found["error"])

    def solve(self, solver: str, tolerance: float) -> tuple[dict[str, Any], np.ndarray[Any, Any]]:
        out = self.folder / "impulses.npy"
        if not self.worker.lives():
            self.load()
        found = self.worker.ask(patience=DEADLINE, solver=solver, tolerance=tolerance, out=str(out))
        return found, np.load(out)


def files(folder: Path, quick: bool) -> Iterator[tuple[str, amontons.vi.Problem]]:
    for path in sorted((folder / "fclib").glob("*.hdf5"))[:: QUICK_STRIDE if quick else 1]:
        problem = read(path)
        if problem.rows == 3 * problem.contacts:
            yield path.name, problem
        else:
            print(f"solvers: {path.name} has bilateral rows, which these solvers do not take")


def steps(quick: bool) -> Iterator[tuple[str, amontons.vi.Problem]]:
    """Steps of scenes of contacts alone, simulated to 1e-3 so far."""
    by_key = {case.key: case for case in CASES}
    for key, number in STEPS[:2] if quick else STEPS:
        simulation = amontons.Simulation(
            by_key[key].make(), dt=by_key[key].dt, tolerance=1e-3, on_failure="ignore", threads=1
        )
        simulation.run(number * by_key[key].dt)
        yield f"step {number} of {key}", simulation.problem()


def rows_of(name: str, problem: amontons.vi.Problem, siconos: Siconos) -> Iterator[Row]:
    def row(solver: str, tolerance: float, **more: Any) -> Row:
        known = {"contacts": problem.contacts, "tolerance": tolerance, "solved": False, "their_error": ""}
        return task_row(name, solver) | known | more

    siconos.read(problem)
    for tolerance in TOLERANCES:
        s = problem.solve(law="coulomb", tolerance=tolerance, deadline=DEADLINE)
        yield row("amontons", tolerance, time=s.time, error=s.residual, solved=s.residual <= tolerance,
                  their_error=siconos.error(s.x, tolerance),
                  version=amontons.__version__)  # fmt: skip
    for solver in SOLVERS:
        late = False
        for tolerance in TOLERANCES:
            more: Row = {}
            if not late:
                try:
                    more, impulses = siconos.solve(solver, tolerance)
                    more["their_error"] = siconos.error(impulses, tolerance)
                    more["error"] = problem.residual(impulses, law="coulomb")
                except Unsupported:
                    late = True
            yield row(f"Siconos {solver}", tolerance, **more, version=siconos.version)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--only", choices=("files", "steps"), help="renews the rows of these alone")
    options = begin(parser.parse_args(), home=RESULTS / "beside")
    python = interpreter()
    if python is None:
        print("solvers: skipped, Siconos is not installed (python3-siconos)")
        return
    problems: list[tuple[str, amontons.vi.Problem]] = []
    if options.only != "steps":
        problems += files(options.data, options.quick)
    if options.only != "files":
        problems += steps(options.quick)
    path = options.out / "solvers.csv"
    found: dict[tuple[str, str, str], Row] = {}
    if options.only:
        found = {(r["task"], r["method"], f"{float(r['tolerance']):g}"): r for r in read_csv(path)}
    with TemporaryDirectory() as folder:
        siconos = Siconos(python, Path(folder))
        for name, problem in tracked(problems, "solvers"):
            for row in rows_of(name, problem, siconos):
                found[name, row["method"], f"{row['tolerance']:g}"] = row
            write_csv(path, found.values())
        siconos.worker.end()


if __name__ == "__main__":
    main()
