"""Renews all tables that the documents quote, and then the documents, in an order of importance.

    python benchmarks/run_all.py [--only PART ...] [--skip PART ...] [--minutes 60] [--list] [--quick]
                                 [--data FOLDER] [--out FOLDER] [--figures FOLDER] [--build FOLDER]

Each part is a process of its own. One that fails, or takes longer than its limit, is named at the end, and
the next one follows. After --minutes no further part begins. Parts that measure time come first: they want an
idle machine. The last ones count or compare motion, so that other programs do not matter to them. Parts that
--list marks "by name" run with --only alone: they take long or need more than this machine has.

The results go to benchmarks/results, the figures to docs/figures, and the documents get what there is. With
--quick, which takes a sample of everything, or without the data, all of it goes to out/bench; with --out to
that folder.
"""

from __future__ import annotations

import os
import subprocess
import sys
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from importlib.metadata import packages_distributions, version
from pathlib import Path
from time import perf_counter

import figures
from amontons.report.health import machine, versions
from common import RESULTS, ROOT, TABLES, Row, arguments, read_csv, with_folders, write_csv
from report import AGAINST, renew_documents
from targets import targets
from views import Results

HERE, BESIDE = Path(__file__).resolve().parent, RESULTS / "beside"
MODULES = ("clarabel", "mujoco")
"""Beside those that the package needs."""
COUNTED = (
    "go1", "fish", "pusher", "domin", "humanoid.xml", "xarm7", "shadow", "suite/quadruped", "swimmer", "ant",
    "in a box", "at rest",
)  # fmt: skip
"""Models of step_work.csv."""


@dataclass(frozen=True)
class Part:
    name: str
    command: tuple[str, ...]
    """words after Python"""
    tables: tuple[str, ...]
    limit: float
    """minutes, after which it is ended"""
    by_name: bool = False
    """it runs with --only alone"""
    home: Path = TABLES
    """where its results are kept"""


def program(name: str, *tables: str, limit: float = 10, words: tuple[str, ...] = ()) -> Part:
    return Part(name, (f"{name}.py", *words), tables or (name,), limit)


PARTS = (
    Part("beside", ("-m", "beside", "--engines", "amontons", "mujoco"), ("beside",), 15, home=BESIDE),
    program("simulation", limit=12),
    program("files", "files", "clarabel"),
    program("steps", "steps", "methods"),
    program("growth", "growth", "stages", limit=25),
    Part("kernel", (), ("kernel", "instruction_sets"), 10),
    program("performance_profile", "profile", limit=20),
    program("budgets"),
    program("calls"),
    program("robots", "robots", "robots_2ms", limit=25),
    Part("forms", ("robots.py", "--trees", "both"), ("robots_forms",), 15),
    Part("fall", ("robots.py", "--fall", "--limit", "15"), ("robots_fall",), 15),
    Part("scenes", ("robots.py", "--trees", "both", "--scenes", "--duration", "0.4", "--limit", "120"),
         ("scenes_forms",), 10),
    Part("large", ("robots.py", "--fall", "--trees", "both", "--limit", "10"), ("robots_large",), 10),
    program("orders"),
    program("measurements", *(f"measured_{name}" for name in AGAINST), limit=20),
    Part("pictures", ("figures.py", "--only", "convergence", "arch"), (), 10),
    program("physics", limit=30),
    Part("step_work", ("step_work.py", "--only", *COUNTED, "--steps", "20"), ("step_work",), 90,
         by_name=True),
    Part("others", ("-m", "beside"), ("beside",), 90, by_name=True, home=BESIDE),
    Part("times", ("-m", "beside", "--renew-times"), ("beside",), 30, by_name=True, home=BESIDE),
    Part("solvers", ("-m", "beside.solvers"), ("solvers",), 60, by_name=True, home=BESIDE),
    Part("sensitivity", ("sensitivity.py", "--starts", "2", "--seconds", "2"), ("sensitivity",), 60,
         by_name=True),
)  # fmt: skip


def cpu_facts() -> Iterator[tuple[str, str]]:
    """Cores and caches, as far as the system tells them."""
    run = subprocess.run(["lscpu"], capture_output=True, text=True) if sys.platform == "linux" else None
    wanted = {"CPU(s)": "cores", "L1d cache": "L1d", "L2 cache": "L2", "L3 cache": "L3"}
    for line in run.stdout.splitlines() if run and run.returncode == 0 else []:
        key, _, value = line.partition(":")
        if key.strip() in wanted:
            yield wanted[key.strip()], value.strip()


def environment() -> list[Row]:
    facts, packages = machine() | dict(cpu_facts()) | versions(), packages_distributions()
    facts |= {name: version(name) for module in MODULES for name in packages.get(module, [])[:1]}
    facts |= {"command": "python benchmarks/run_all.py", "date": date.today().isoformat()}
    return [{"key": key, "value": value} for key, value in facts.items()]


def run_kernel(options: Namespace, limit: float) -> None:
    """The kernel, and once more in the cache of a core by each set of instructions that the processor has."""
    kernel = options.build / "benchmarks" / "contact_kernel"
    if not kernel.exists():
        raise OSError(f"{kernel} is not built: make bench, or the target amontons_benchmarks and --build")
    part = options.out / "kernel.part"

    def run(*words: str, isa: str = "") -> list[dict[str, str]]:
        around = {**os.environ, "AMONTONS_ISA": isa} if isa else None
        subprocess.run([str(kernel), "--csv", str(part), *words], check=True, timeout=limit, env=around)
        return read_csv(part)

    write_csv(options.out / "kernel.csv", run(*["--quick"] * options.quick))
    sets = ("baseline", "avx2", "avx512")
    rows = [row for isa in sets for row in run("--quick", "--threads", "1", isa=isa) if row["isa"] == isa]
    part.unlink()
    write_csv(options.out / "instruction_sets.csv", rows)


def run_part(part: Part, options: Namespace, limit: float) -> None:
    """OSError or SubprocessError where it fails."""
    if not part.command:
        return run_kernel(options, limit)
    out = part.home if options.complete else options.out
    words = ["--figures", options.figures]
    if part.tables:
        words += ["--data", options.data, "--out", out, *["--quick"] * options.quick]
    # In a process of its own: it binds itself to one core, which the kernel's threads must not be.
    subprocess.run([sys.executable, *part.command, *map(str, words)], cwd=HERE, check=True, timeout=limit)
    return None


def chosen(options: Namespace) -> list[Part]:
    parts = [p for p in PARTS if (p.name in options.only if options.only else not p.by_name)]
    return [p for p in parts if p.name not in options.skip]


def run_parts(parts: list[Part], options: Namespace) -> list[str]:
    """What failed, or was not begun, and why."""
    start, failed = perf_counter(), []
    for k, part in enumerate(parts):
        begun = perf_counter()
        if begun - start > 60 * options.minutes:
            return [*failed, *(f"{p.name} (not begun after {options.minutes:g} min)" for p in parts[k:])]
        print(f"== {part.name}", flush=True)
        try:
            run_part(part, options, 60 * part.limit)
        except (OSError, subprocess.SubprocessError) as error:
            failed.append(f"{part.name} ({error})")
            print(f"run_all: {failed[-1]}", flush=True)
        print(f"== {part.name}: {(perf_counter() - begun) / 60:.1f} min", flush=True)
    return failed


def main() -> int:
    parser = arguments(__doc__)
    names = [part.name for part in PARTS]
    parser.add_argument("--only", nargs="+", choices=names, default=[], metavar="PART")
    parser.add_argument("--skip", nargs="+", choices=names, default=[], metavar="PART")
    parser.add_argument("--minutes", type=float, default=60.0, help="begin no part after these (default: 60)")
    parser.add_argument("--list", action="store_true", help="the parts and their tables, and nothing else")
    parser.add_argument("--build", type=Path, default=ROOT / "build" / "python", help="CMake's build folder")
    options = parser.parse_args()
    if options.list:
        for part in PARTS:
            tables = ", ".join(f"{table}.csv" for table in part.tables)
            print(f"{part.name}: {tables}" + ", by name" * part.by_name)
        return 0
    with_folders(options)
    options.data, options.out = options.data.resolve(), options.out.resolve()
    options.figures, options.build = options.figures.resolve(), options.build.resolve()
    start = perf_counter()
    write_csv(options.out / "environment.csv", environment())
    failed = run_parts(chosen(options), options)
    try:
        figures.draw(options.out, options.figures)
    except (KeyError, IndexError, ValueError) as error:
        failed.append(f"figures ({error!r})")
    if options.complete:
        failed += renew_documents(options.out)
    print(targets(Results(options.out)))
    print(f"{perf_counter() - start:.0f} s in all", *(f"FAILED: {line}" for line in failed), sep="\n")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
