"""Runs what was built for other systems: aarch64 Linux by qemu, Windows by wine. `make wheels-test`.

    python tools/wheels_test.py [--targets TARGET,...] [--parts bits,cpp,python] [--log FILE] [PYTHON ...]

bits: amontons_bits of each target on the regression scenes, on one and three threads, and on the instruction
sets that this processor has; all must agree. cpp: the C++ tests, and examples/cpp with the installed library.
python: the wheel in dist with a Python of that system: tools/smoke_test.py, then the bits of
tests/physics/bits.py, then the examples. On the system of this machine, each PYTHON instead installs the
wheel into an empty environment (make_wheel.py --try). macOS is compiled, linked and read only: nothing here
runs it. What is missing on this machine is said.

Programs are compiled first where they are not (tools/cross_build.py). The log goes to build/cross/tests.md:
Markdown tables of the runs and of the equal bits, which RELEASING.md has copies of.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import foreign
import same_bits
from cross_build import CROSS, ROOT, build, environment, run, write_tools, zig_program
from make_wheel import interpreters
from wheel_tables import made_by
from wheel_targets import TARGETS, Target, tag

DIST = ROOT / "dist"
RUNS = ("linux-x86_64", "linux-aarch64", "windows-x86_64")
THREADS = ("1", "3")
EXAMPLES = ("falling_boxes", "sliding_block", "door", "conveyor", "own_matrix")  # what NumPy alone can run
LONGEST = 3600.0
"""Seconds of one run."""


@dataclass
class Outcome:
    """A line of the log."""

    target: str
    what: str
    passed: bool
    told: str
    seconds: float


def runner(target: Target) -> tuple[list[str], dict[str, str]] | None:
    """What a program of the target is started by, and its environment; None where that is missing."""
    if target.system == "macos":
        return None
    if not target.runner:
        return [], dict(os.environ)
    program = foreign.program(target.runner[0])
    if program is None:
        return None
    if target.system == "windows":
        return [program], foreign.wine_environment([])
    return [program, "-L", str(foreign.debian_root("arm64"))], dict(os.environ)


def log_of(target: Target, what: str) -> Path:
    """Where the output of a run goes."""
    return CROSS / target.name / f"{re.sub(r'[^a-z0-9]+', '-', what.lower())}.log"


def started(target: Target, what: str, command: list[object], env: dict[str, str], cwd: Path) -> Outcome:
    """A run, and the last line that it printed."""
    begin = time.monotonic()
    try:
        run = subprocess.run(
            [str(c) for c in command], env=env, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, errors="replace", check=False, timeout=LONGEST,
        )  # fmt: skip
        code, text = run.returncode, run.stdout
    except subprocess.TimeoutExpired:
        code, text = 1, f"still running after {LONGEST:.0f} s"
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    log_of(target, what).write_text(text)
    told = lines[-1][:120] if lines else ""
    outcome = Outcome(target.name, what, code == 0, told, time.monotonic() - begin)
    word = "passed" if outcome.passed else "FAILED"
    print(f"{target.name}: {what}: {word}, {outcome.seconds:.0f} s: {told}", flush=True)
    return outcome


def instruction_sets(target: Target) -> list[str]:
    """Those of the kernels that the processor can run; emulators of others run the baseline."""
    from bits import sets_of_the_processor  # tests/physics, where same_bits.write has put it on the path

    return sets_of_the_processor() if target.machine == "x86_64" else ["baseline"]


def bits(target: Target, built: Path, scenes: Path) -> Iterator[Outcome]:
    """Hashes of each instruction set, in files that same_bits.py compares."""
    how = runner(target)
    if how is None:
        return
    command, env = how
    hashes, found = CROSS / "bits" / f"{target.name}.txt", []
    for isa in instruction_sets(target):
        program = built / "tests" / "cpp" / target.program("amontons_bits")
        wish = {**env, "AMONTONS_ISA": isa}
        what = f"bits of {isa}"
        yield started(target, what, [*command, program, scenes, *THREADS], wish, ROOT)
        lines = log_of(target, what).read_text().splitlines()
        found += [line for line in lines if line.count(" ") == 4 and f" {isa} " in line]
        hashes.write_text("\n".join([*found, ""]))


def cpp(target: Target, built: Path, zig: Path) -> Iterator[Outcome]:
    """The C++ tests, in one process, then a program that uses the installed library."""
    how = runner(target)
    if how is None:
        return
    program = built / "tests" / "cpp" / target.program("amontons_tests")
    yield started(target, "C++ tests", [*how[0], program], how[1], CROSS / target.name)
    yield started(
        target, "example cpp/knock", [*how[0], example(target, built, zig)], how[1], CROSS / target.name
    )


def example(target: Target, built: Path, zig: Path) -> Path:
    """The program of examples/cpp, compiled as a project of its own."""
    prefix, folder = CROSS / target.name / "prefix", CROSS / target.name / "example"
    run(
        ["cmake", "--install", built, "--component", "development", "--prefix", prefix],
        stdout=subprocess.DEVNULL,
    )
    run([
        "cmake", "-G", "Ninja", "-S", ROOT / "examples" / "cpp", "-B", folder,
        f"-DCMAKE_TOOLCHAIN_FILE={ROOT}/cmake/zig.cmake", f"-DAMONTONS_TARGET={target.zig}",
        f"-DAMONTONS_TOOLS={write_tools(target, zig)}", f"-Damontons_ROOT={prefix}",
        "-DCMAKE_BUILD_TYPE=Release",
    ], env=environment(), stdout=subprocess.DEVNULL)  # fmt: skip
    run(["cmake", "--build", folder], env=environment(), stdout=subprocess.DEVNULL)
    return folder / target.program("knock")


def python(target: Target, pythons: list[str], zig: Path, scenes: Path) -> Iterator[Outcome]:
    """The wheel in dist with a Python of the target."""
    if not target.runner:
        for found in interpreters(pythons):
            what = f"wheel in an empty environment, Python {found.name}"
            command = [sys.executable, ROOT / "tools" / "make_wheel.py", "--try", found.path]
            yield started(target, what, command, dict(os.environ), ROOT)
        return
    found = python_of(target, zig)
    if found is None:
        return
    command, env, site = found
    (wheel,) = DIST.glob(f"*-{tag(target, site)}.whl")
    foreign.unpack(wheel, place_of(target))
    folder = CROSS / target.name / "run"
    folder.mkdir(exist_ok=True)
    yield started(
        target,
        f"smoke test of the wheel, {version_of(command, env)}",
        [*command, ROOT / "tools" / "smoke_test.py", "library"],
        env,
        folder,
    )
    rows = [ROOT / "tests" / "physics" / "bits.py", "--print", "--threads", "1", "--models", scenes]
    theirs = started(target, "regression rows", [*command, *rows], env, folder)
    yield theirs
    ours = subprocess.run([sys.executable, *map(str, rows)], capture_output=True, text=True, check=True)
    same = ours.stdout.strip() in log_of(target, "regression rows").read_text()
    yield Outcome(target.name, "regression rows have the bits of x86-64 Linux", same, "", 0)
    for name in EXAMPLES:
        yield started(target, f"example {name}", [*command, ROOT / "examples" / f"{name}.py"], env, folder)


def version_of(command: list[str], env: dict[str, str]) -> str:
    """Name and version of an interpreter."""
    run = subprocess.run([*command, "--version"], env=env, capture_output=True, text=True, check=False)
    return run.stdout.strip() or "Python"


def place_of(target: Target) -> Path:
    """Where the wheel is unpacked."""
    return CROSS / target.name / "site-packages"


def python_of(target: Target, zig: Path) -> tuple[list[str], dict[str, str], str] | None:
    """How to start it, its environment, and whether it takes the wheel of "abi3" or "cp311"."""
    how = runner(target)
    place = place_of(target)
    if how is None:
        return None
    if target.system == "windows":
        if not foreign.program("mvn"):
            print(f"{target.name}: no Maven here to fetch a Python for Windows")
            return None
        program, version = foreign.windows_python(zig)
        site = foreign.FOREIGN / "site-windows"
        foreign.wheels_for(("win_amd64",), version, site, foreign.UNDER_WINE)
        return [*how[0], str(program)], foreign.wine_environment([place, site]), "abi3"
    site = foreign.FOREIGN / "site-arm64"
    platforms = tuple(f"manylinux_2_{minor}_aarch64" for minor in (28, 27, 17)) + ("manylinux2014_aarch64",)
    foreign.wheels_for(platforms, "3.11", site)
    root = foreign.debian_root("arm64")
    env = {**how[1], "PYTHONPATH": f"{place}{os.pathsep}{site}", "PYTHONDONTWRITEBYTECODE": "1"}
    return [*how[0], str(root / "usr" / "bin" / "python3.11")], env, "cp311"


def runs_table(outcomes: list[Outcome]) -> list[str]:
    """Markdown with a row for each run, and one for each system that nothing ran."""
    lines = ["| System | Run | How | Result | s |", "|---|---|---|---|--:|"]
    for o in outcomes:
        told = o.told.replace("|", "/")
        word = "passed" if o.passed else f"**failed**: {told}"
        lines.append(f"| {o.target} | {o.what} | {TARGETS[o.target].how} | {word} | {o.seconds:.0f} |")
    for name, target in TARGETS.items():
        if runner(target) is None:
            lines.append(f"| {name} | - | never run | linked and inspected only | - |")
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("pythons", nargs="*", metavar="PYTHON")
    parser.add_argument("--targets", default=",".join(RUNS))
    parser.add_argument("--parts", default="bits,cpp,python")
    parser.add_argument("--log", type=Path, default=CROSS / "tests.md")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 2)
    parser.add_argument("--built", action="store_true", help="run what is there, compile nothing")
    given = parser.parse_args()
    parts, outcomes = given.parts.split(","), []
    scenes = CROSS / "scenes"
    (CROSS / "bits").mkdir(parents=True, exist_ok=True)
    same_bits.write(scenes)
    zig = zig_program(str(ROOT / "build" / "wheel" / "zig" / "bin" / "python"))
    for name in given.targets.split(","):
        target = TARGETS[name]
        if runner(target) is None:
            print(f"{name}: nothing here runs it ({', '.join(target.runner) or 'no emulator of macOS'})")
            continue
        built = CROSS / name / "build"
        if not given.built:
            programs = [f"amontons_{p}" for p, part in (("bits", "bits"), ("tests", "cpp")) if part in parts]
            build(target, programs, {}, zig=zig, jobs=given.jobs)
        if "bits" in parts:
            outcomes += bits(target, built, scenes)
        if "cpp" in parts:
            outcomes += cpp(target, built, zig)
        if "python" in parts:
            outcomes += python(target, given.pythons, zig, scenes)
    tables, same = ["", *runs_table(outcomes)], True
    if "bits" in parts:
        found = same_bits.columns(sorted((CROSS / "bits").glob("*.txt")))
        lines, same = same_bits.table(found)
        tables += ["", *same_bits.summary(found), "", *lines]
    tables += ["", made_by("make wheels-test", zig), ""]
    print("\n".join(tables))
    given.log.write_text("\n".join(tables[1:]))
    return 0 if same and all(o.passed for o in outcomes) else 1


if __name__ == "__main__":
    sys.exit(main())
