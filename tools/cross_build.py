"""Compiles the library, the Python modules and the C++ tests for a system that is not this one.

    python tools/cross_build.py TARGET [--targets amontons_modules,amontons_tests] [--jobs N]

TARGET is a row of tools/wheel_targets.py. The compiler is Clang of the PyPI package ziglang, found in the
interpreter that runs this, or in --zig. What is built lies in build/cross/TARGET. Headers of Python are those
of the interpreters in --headers; a Python for Windows has a `pyconfig.h` of its own, and a library that names
what its DLL exports, which is made here.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from import_library import write_import_library
from wheel_targets import TARGETS, Target

ROOT = Path(__file__).resolve().parent.parent
CROSS = ROOT / "build" / "cross"
# As the compiler is asked of every file: zig would add checks of undefined behaviour and of the stack.
FLAGS = "-fno-sanitize=undefined -fno-stack-protector -g0"


def zig_program(python: str = sys.executable) -> Path:
    """The program of the package ziglang in an interpreter; leaves with a message if it is not there."""
    code = "import ziglang, pathlib; print(pathlib.Path(ziglang.__file__).parent / 'zig')"
    found = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False)
    if found.returncode:
        sys.exit(f"amontons: {python} has no ziglang: pip install 'ziglang>=0.13'")
    return Path(found.stdout.strip())


def write_tools(target: Target, zig: Path) -> Path:
    """Scripts named as the programs that they stand for; the folder."""
    folder = CROSS / target.name / "tools"
    folder.mkdir(parents=True, exist_ok=True)
    for name, command in (
        ("c++", f"c++ -target {target.zig} {FLAGS}"),
        ("ar", "ar"),
        ("ranlib", "ranlib"),
        ("dlltool", "dlltool"),
    ):
        script = folder / name
        text = f'#!/bin/sh\nexec "{zig}" {command} "$@"\n'
        if not script.exists() or script.read_text() != text:  # a newer compiler would compile all again
            script.write_text(text)
            script.chmod(0o755)
    return folder


def module_entries(target: Target, headers: Mapping[str, Path], tools: Path) -> list[str]:
    """What CrossModule.cmake asks of AMONTONS_CROSS_MODULES."""
    if target.system != "windows":
        return [f"{name}={folder}" for name, folder in headers.items()]
    entries = []
    for name, folder in headers.items():
        own = CROSS / target.name / f"include-{name}"
        own.mkdir(parents=True, exist_ok=True)
        for header in folder.iterdir():  # all but pyconfig.h, which is found beside its link
            link = own / header.name
            if header.name != "pyconfig.h" and not link.exists():
                link.symlink_to(header)
        write_new(own / "pyconfig.h", (ROOT / "tools" / "pyconfig_windows.h").read_text())
        dll = "python3" if name == "abi3" else "python311"
        library = write_import_library(dll, folder, CROSS / target.name, tools / "dlltool")
        entries.append(f"{name}={own}={library}")
    return entries


def write_new(path: Path, text: str) -> None:
    """Write a file that does not hold this yet; what depends on it is compiled again otherwise."""
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def run(command: Iterable[object], **options: object) -> None:
    """A command whose output is shown."""
    done = subprocess.run([str(c) for c in command], check=False, **options)  # type: ignore[call-overload]
    if done.returncode:
        sys.exit(f"amontons: {' '.join(map(str, list(command)[:4]))} ... failed with {done.returncode}")


def environment() -> dict[str, str]:
    """zig keeps the C++ runtime that it compiles for each target in its cache."""
    cache = str(ROOT / "build" / "wheel" / "zig-cache")
    return {"ZIG_GLOBAL_CACHE_DIR": cache, **os.environ, "CCACHE_COMPILERTYPE": "clang"}


def build(
    target: Target, targets: Iterable[str], headers: Mapping[str, Path], *, zig: Path, source: Path = ROOT,
    python: str = sys.executable, jobs: int = 2, folder: Path | None = None,
) -> Path:  # fmt: skip
    """Configure and compile; the build folder."""
    tools = write_tools(target, zig)
    folder = folder or CROSS / target.name / "build"
    entries = ";".join(module_entries(target, headers, tools))
    run([
        "cmake", "-G", "Ninja", "-S", source, "-B", folder,
        f"-DCMAKE_TOOLCHAIN_FILE={source}/cmake/zig.cmake", f"-DAMONTONS_TARGET={target.zig}",
        f"-DAMONTONS_TOOLS={tools}", f"-DAMONTONS_HOST_PYTHON={python}", f"-DPython_EXECUTABLE={python}",
        "-DAMONTONS_TESTS=ON", "-DCMAKE_BUILD_TYPE=Release",
        *([f"-DAMONTONS_CROSS_MODULES={entries}"] if headers else []),
    ], env=environment(), stdout=subprocess.DEVNULL)  # fmt: skip
    run(["cmake", "--build", folder, "-j", jobs, "--target", *targets], env=environment())
    return folder


def headers_of(python: str) -> Path:
    """The folder of Python.h of an interpreter."""
    code = "import sysconfig; print(sysconfig.get_paths()['include'])"
    folder = Path(
        subprocess.run([python, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
    )
    if not (folder / "Python.h").is_file():
        sys.exit(f"amontons: {python} has no headers (Debian, Ubuntu: apt install python3-dev)")
    return folder


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("target", choices=sorted(TARGETS))
    parser.add_argument("--targets", default="amontons_modules,amontons_tests,amontons_bits")
    parser.add_argument("--headers", action="append", default=[], metavar="abi3=PYTHON",
                        help="whose headers: abi3=python3.12, cp311=python3.11")  # fmt: skip
    parser.add_argument("--zig", type=Path)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    headers = {name: headers_of(python) for name, python in (h.split("=", 1) for h in given.headers)}
    zig = given.zig or zig_program()
    build(TARGETS[given.target], given.targets.split(","), headers, zig=zig, jobs=given.jobs)


if __name__ == "__main__":
    main()
