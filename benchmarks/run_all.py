"""Runs every benchmark in turn and writes its results as CSV files.

    python benchmarks/run_all.py [--quick] [--data FOLDER] [--out FOLDER] [--figures FOLDER] [--build FOLDER]

The results go to benchmarks/results/processor, the figures to docs/figures, and the documents get the new
tables. With --quick, which takes a sample of everything, or without the data, all of it
goes to out/bench; with --out to that folder.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
from collections.abc import Iterator
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter

import report
from common import ROOT, arguments, processor, read_csv, with_folders, write_csv

HERE = Path(__file__).resolve().parent
PARTS = (
    "files",
    "steps",
    "simulation",
    "physics",
    "orders",
    "measurements",
    "robots",
    "rollout",
    "studies",
    "growth",
    "deadlines",
    "performance_profile",
    "viewer",
)
PROGRAMS = {"contact_kernel": "kernel.csv", "broad_phase": "broad_phase.csv"}
PACKAGES = ("amontons", "clarabel", "mujoco-core", "numpy", "scipy", "h5py")


def compiler(build: Path) -> str:
    """Name and version of the compiler that made the build folder."""
    found = sorted(build.glob("CMakeFiles/*/CMakeCXXCompiler.cmake"))
    text = found[-1].read_text() if found else ""
    identity = re.search(r'CMAKE_CXX_COMPILER_ID "(\w+)"', text)
    number = re.search(r'CMAKE_CXX_COMPILER_VERSION "([\d.]+)"', text)
    return f"{identity[1]} {number[1]}" if identity and number else "unknown"


def cpu_facts() -> Iterator[tuple[str, str]]:
    """Cores and caches, as far as the system tells them."""
    run = subprocess.run(["lscpu"], capture_output=True, text=True) if sys.platform == "linux" else None
    wanted = {"CPU(s)": "cores", "L1d cache": "L1d", "L2 cache": "L2", "L3 cache": "L3"}
    for line in run.stdout.splitlines() if run and run.returncode == 0 else []:
        key, _, value = line.partition(":")
        if key.strip() in wanted:
            yield wanted[key.strip()], value.strip()


def package_version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def environment(build: Path, command: str) -> list[dict[str, str]]:
    facts = {"processor": processor(), **dict(cpu_facts())}
    facts |= {"system": f"{platform.system()} {platform.machine()}", "compiler": compiler(build)}
    facts |= {"Python": platform.python_version(), **{name: package_version(name) for name in PACKAGES}}
    facts |= {"command": command, "date": date.today().isoformat()}
    return [{"key": key, "value": value} for key, value in facts.items()]


def run_program(name: str, build: Path, out: Path, quick: bool) -> int:
    """Runs a C++ benchmark, if it is built; its exit code."""
    program, table = build / "benchmarks" / name, out / PROGRAMS[name]
    if not program.exists():
        print(
            f"{name}: skipped, {program} is not built; build the CMake target amontons_benchmarks "
            "(make bench does) or name its build folder with --build"
        )
        return 0
    command = [program, "--csv", table, *(["--quick"] if quick else [])]
    code = subprocess.run([str(word) for word in command]).returncode
    if not code:
        write_csv(table, read_csv(table))  # with its revision
    return code


def run_instruction_sets(build: Path, out: Path) -> int:
    """The kernel in the cache of a core by each set that the processor has, as instruction_sets.csv."""
    program, part = build / "benchmarks" / "contact_kernel", out / "instruction_sets.part"
    if not program.exists():
        return 0  # run_program has told
    rows = []
    for isa in ("baseline", "avx2", "avx512"):
        command = [str(program), "--quick", "--threads", "1", "--csv", str(part)]
        code = subprocess.run(command, env={**os.environ, "AMONTONS_ISA": isa}).returncode
        if code:
            return code
        rows += [row for row in read_csv(part) if row["isa"] == isa]
    part.unlink()
    write_csv(out / "instruction_sets.csv", rows)
    return 0


def main() -> int:
    parser = arguments(__doc__)
    parser.add_argument("--build", type=Path, default=ROOT / "build" / "python", help="CMake's build folder")
    options = with_folders(parser.parse_args())
    folders = ["--data", options.data, "--out", options.out, "--figures", options.figures]
    passed = [str(word) for word in folders] + (["--quick"] if options.quick else [])
    start, failed = perf_counter(), []
    # Each part in a process of its own: it binds itself to one core, which the kernel's threads must not be.
    for part in PARTS:
        if subprocess.run([sys.executable, str(HERE / f"{part}.py"), *passed]).returncode:
            failed.append(part)
    for name in PROGRAMS:
        if run_program(name, options.build, options.out, options.quick):
            failed.append(name)
    if run_instruction_sets(options.build, options.out):
        failed.append("instruction sets")
    command = (
        "make bench" if options.complete else "python benchmarks/run_all.py" + " --quick" * options.quick
    )
    write_csv(options.out / "environment.csv", environment(options.build, command))
    if options.complete and not failed:
        report.renew_documents(options.out.resolve())
    print(report.targets(report.Results(options.out)))
    print(f"{perf_counter() - start:.0f} s in all" + (f"; FAILED: {', '.join(failed)}" if failed else ""))
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
