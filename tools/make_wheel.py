"""Makes the source distribution and the wheels in dist; tries them in empty environments without a compiler.

    python tools/make_wheel.py --targets TARGET,... [--jobs N] [PYTHON ...]
    python tools/make_wheel.py --try [PYTHON ...]
    python tools/make_wheel.py --compiled BUILD

PYTHON: interpreters to build for and to try with; by default every python3.X on the path. 3.11 gets a wheel
of its own; the oldest that is newer makes the one for 3.12 and all that follow (stable ABI).

With --targets, wheels for the systems of tools/wheel_targets.py, or "all", or "here", are made on this one:
the module is compiled for each (tools/cross_build.py) and takes the place of ours in the wheel of
build/python, which a build of the package by the running interpreter must have made before. The compiler is
Clang of the package ziglang: it links against the symbols of glibc 2.28, so that the wheels run on every
Linux since 2019, and the C++ runtime is inside. Each wheel is then read (tools/inspect_wheel.py), those for
Linux by auditwheel too. The table of what was built goes to build/cross/wheels.md.

With --try, nothing is made: the wheels in dist are tried with each interpreter. With --compiled, one wheel is
made of what a build folder of the running interpreter holds, named for this system alone, and tried in the
same way: a minute for the tests.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

from cross_build import CROSS, build, headers_of, zig_program
from inspect_wheel import HEAD, faults, row
from pack_wheel import pack as pack_wheel
from wheel_tables import clang_version, made_by
from wheel_targets import TARGETS, Target

ROOT = Path(__file__).resolve().parent.parent
WORK, DIST = ROOT / "build" / "wheel", ROOT / "dist"
OLDEST, STABLE = (3, 11), (3, 12)
TOOLS = ["auditwheel>=6.1"]
ZIG = "ziglang>=0.13"


@dataclass(frozen=True)
class Python:
    """An interpreter."""

    path: str
    version: tuple[int, int]
    headers: bool

    @property
    def name(self) -> str:
        return "{}.{}".format(*self.version)


def look(path: str) -> Python | None:
    """The interpreter at a path or of a name; None if it does not run."""
    code = "import os, sys, sysconfig as s; i = s.get_paths()['include']; v = sys.version_info; "
    code += "print(sys.executable, v[0], v[1], int(os.path.exists(os.path.join(i, 'Python.h'))))"
    run = subprocess.run([path, "-c", code], capture_output=True, text=True, check=False)
    if run.returncode:
        return None
    found, major, minor, headers = run.stdout.split()
    return Python(found, (int(major), int(minor)), headers == "1")


def interpreters(wanted: list[str]) -> list[Python]:
    """Those named, or one per version on the path, from the oldest to the newest."""
    names = wanted or [n for n in ("python3", *(f"python3.{k}" for k in range(11, 30))) if shutil.which(n)]
    found: dict[tuple[int, int], Python] = {}
    for name in names:
        python = look(name)
        if python is None or python.version < OLDEST:
            if wanted:
                sys.exit(f"amontons: {name} is no Python 3.{OLDEST[1]} or newer that runs")
        else:
            found.setdefault(python.version, python)
    return [found[version] for version in sorted(found)]


def run(*command: object, **options: object) -> None:
    """A command whose output is shown only if it fails."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **options)  # type: ignore[call-overload]
    if done.returncode:
        sys.stderr.write(done.stdout[-8000:] + done.stderr[-8000:])
        sys.exit(f"amontons: {' '.join(map(str, command[:6]))} ... failed with {done.returncode}")


def environment(python: Python, name: str, *requirements: str) -> Path:
    """A new virtual environment; the folder of its programs."""
    folder = WORK / name
    shutil.rmtree(folder, ignore_errors=True)
    run(python.path, "-m", "venv", folder)
    if requirements:
        run(folder / "bin" / "python", "-m", "pip", "install", "--progress-bar", "off", *requirements)
    return folder / "bin"


def make_sdist(python: Python, requires: list[str]) -> Path:
    """The source distribution."""
    programs = environment(python, "sdist", *requires)
    code = "import sys; from scikit_build_core.build import build_sdist; build_sdist(sys.argv[1])"
    run(programs / "python", "-c", code, DIST, cwd=ROOT)
    return next(DIST.glob("*.tar.gz"))


def pack(build: Path) -> None:
    """The wheel of what is compiled in a build folder of this interpreter, in build/wheel/packed; tried."""
    wheel = wheel_of_build(build)
    python = look(sys.executable)
    assert python is not None
    try_wheel(python, wheel.parent)
    print(f"{wheel.relative_to(ROOT)}: installed and used, without a compiler")


def wheel_of_build(build: Path) -> Path:
    """The wheel of what is compiled in a build folder of this interpreter."""
    packed = WORK / "packed"
    shutil.rmtree(packed, ignore_errors=True)
    run(sys.executable, "-m", "pip", "wheel", "--no-build-isolation", "--no-deps", "-w", packed,
        "--config-settings", f"build-dir={build}", ROOT)  # fmt: skip
    return next(packed.glob("*.whl"))


def headers(pythons: list[Python]) -> dict[str, Path]:
    """Folders of Python.h: the oldest for the stable ABI, and that of 3.11, as far as there are any."""
    stable = [p for p in pythons if p.version >= STABLE and p.headers][:1]
    oldest = [p for p in pythons if p.version == OLDEST and p.headers][:1]
    for wanted, found in (("3.12 or newer", stable), ("3.11", oldest)):
        if not found:
            print(f"no wheels for Python {wanted}: there is none here with its headers; PYTHONS= names one")
    return {name: headers_of(found[0].path) for name, found in (("abi3", stable), ("cp311", oldest)) if found}


def zig_environment(python: Python) -> Path:
    """The compiler and auditwheel; kept, as new headers of the compiler make all objects out of date."""
    programs = WORK / "zig" / "bin"
    code = f"import auditwheel, ziglang, sys; sys.exit(sys.version_info[:2] != {python.version})"
    kept = programs / "python"
    if kept.exists() and subprocess.run([kept, "-c", code], capture_output=True, check=False).returncode == 0:
        return programs
    return environment(python, "zig", ZIG, *TOOLS)


def audited(programs: Path, wheel: Path, target: Target) -> str:
    """The platform that auditwheel finds for a wheel for Linux; for the table."""
    if target.system != "linux":
        return ""
    told = subprocess.run(
        [programs / "auditwheel", "show", wheel], capture_output=True, text=True, check=False
    )
    found = re.search(r'platform\s+tag:\s+"(manylinux_2_\d+)_', told.stdout)
    return f"; auditwheel: {found[1]}" if found else "; auditwheel: no manylinux"


def make_wheels(names: str, pythons: list[Python], jobs: int) -> int:
    """Wheels for other systems, in dist; how many have a fault."""
    here = f"linux-{platform.machine()}"
    targets = {"all": list(TARGETS), "here": [here]}.get(names) or names.split(",")
    if unknown := [name for name in targets if name not in TARGETS]:
        sys.exit(f"amontons: no target {unknown[0]}; there are {', '.join(TARGETS)}")
    builder = look(sys.executable)
    assert builder is not None
    programs = zig_environment(builder)
    zig, rows = zig_program(str(programs / "python")), list(HEAD)
    clang = f"Clang {clang_version(zig)}"
    base, wrong = wheel_of_build(ROOT / "build" / "python"), 0
    DIST.mkdir(exist_ok=True)
    for name in targets:
        target, found = TARGETS[name], headers(pythons)
        built = build(target, ["amontons_modules"], found, zig=zig, jobs=jobs)
        unit = (built / "amontons_fmu.built").read_bytes()
        for python in found:
            module = (built / python / "_core.built").read_bytes()
            wheel = pack_wheel(base, module, unit, target, python, DIST, clang)
            for fault in (found_faults := list(faults(wheel))):
                print(f"{wheel.name}: {fault}", file=sys.stderr)
            wrong += bool(found_faults)
            rows.append(row(wheel, audited(programs, wheel, target)))
            print(f"{wheel.relative_to(ROOT)}  {wheel.stat().st_size / 1e6:.2f} MB", flush=True)
    rows += ["", made_by("make wheels", zig)]
    print("\n".join(["", *rows]))
    (CROSS / "wheels.md").write_text("\n".join([*rows, ""]))
    return wrong


def make_wheels_and_sdist(given: argparse.Namespace, pythons: list[Python]) -> None:
    WORK.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(DIST, ignore_errors=True)
    builder = look(sys.executable)
    assert builder is not None
    archive = make_sdist(builder, project()["build-system"]["requires"])
    print(f"{archive.relative_to(ROOT)}  {archive.stat().st_size / 1e6:.2f} MB", flush=True)
    if wrong := make_wheels(given.targets, pythons, given.jobs):
        sys.exit(f"amontons: {wrong} wheels are not as they should be")


def try_wheel(python: Python, where: Path = DIST) -> None:
    """Install from a folder into an empty environment without a compiler, and use it; then the command."""
    programs = environment(python, f"try-{python.name}")
    nothing = WORK / "nothing"
    nothing.mkdir(exist_ok=True)
    variables = {
        **{k: v for k, v in os.environ.items() if not k.startswith("PYTHON")},
        "PATH": f"{programs}{os.pathsep}{nothing}", "CXX": "false", "CC": "false",
    }  # fmt: skip
    for extra in ("", "cli"):
        wanted = f"amontons[{extra}]=={version()}" if extra else f"amontons=={version()}"
        run(programs / "python", "-m", "pip", "install", "--progress-bar", "off", "--only-binary=:all:",
            "--find-links", where, wanted, env=variables)  # fmt: skip
        run(programs / "python", ROOT / "tools" / "smoke_test.py", extra, env=variables, cwd=nothing)


def version() -> str:
    return str(project()["project"]["version"])


def project() -> dict:  # type: ignore[type-arg]
    return tomllib.loads((ROOT / "pyproject.toml").read_text())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("pythons", nargs="*", metavar="PYTHON")
    parser.add_argument("--compiled", type=Path, metavar="BUILD")
    parser.add_argument("--targets", metavar="TARGET,...", default="all")
    parser.add_argument("--try", dest="only_try", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 2)
    given = parser.parse_args()
    if platform.system() != "Linux":
        sys.exit("amontons: wheels are made on Linux only; elsewhere: pip install .")
    if given.compiled:
        WORK.mkdir(parents=True, exist_ok=True)
        pack(given.compiled)
        return
    pythons = interpreters(given.pythons)
    if given.only_try:
        for python in pythons:
            try_wheel(python)
            print(f"installed and used with Python {python.name}, without a compiler", flush=True)
        return
    make_wheels_and_sdist(given, pythons)


if __name__ == "__main__":
    main()
