"""Compiles and links for other systems what most easily fails there: half a minute, for .ci/run.

    python tools/cross_check.py [PYTHON]

With Clang of the PyPI package ziglang, found in PYTHON (by default the interpreter that runs this): for
aarch64 Linux the kernels and the layer base, linked into a shared library; for Windows the sources with a
branch of its own. The C++ runtime is left out, as compiling it takes minutes: what needs it stays undefined
in the shared library. `make wheels` compiles and links everything.
"""

from __future__ import annotations

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from binaries import read
from cross_build import ROOT, environment, zig_program
from wheel_targets import TARGETS

FLAGS = ["-std=c++20", "-O1", "-ffp-contract=off", "-fno-math-errno", "-fPIC", "-Wall", "-Wextra", "-Werror",
         "-Wno-psabi", "-Iinclude", "-Isrc", "-Itests/cpp", "-DAMONTONS_ISA=baseline"]  # fmt: skip
KERNELS = ["src/solvers/linear/body_kernel.isa.cpp"]
BASE = ["src/base/elementary.cpp", "src/base/isa.cpp", "src/base/threads.cpp"]
SOURCES = {"linux-aarch64": [*KERNELS, *BASE], "windows-x86_64": ["src/base/threads.cpp"]}
OUT = ROOT / "build" / "cross" / "check"


def compiled(zig: Path, name: str, source: str) -> Path:
    """The object of a source for a target; leaves with the compiler's words if there are any."""
    made = OUT / f"{name}-{Path(source).stem}.o"
    run([zig, "c++", "-target", TARGETS[name].zig, *FLAGS, "-c", source, "-o", made])
    return made


def run(command: list[object]) -> None:
    done = subprocess.run(
        [str(c) for c in command], cwd=ROOT, env=environment(), capture_output=True, text=True, check=False
    )
    if done.returncode:
        sys.exit(f"amontons: {' '.join(map(str, command[1:5]))} ... failed:\n{done.stderr[-4000:]}")


def main() -> None:
    begin, zig = time.monotonic(), zig_program(*sys.argv[1:2])
    OUT.mkdir(parents=True, exist_ok=True)
    jobs = [(name, source) for name, sources in SOURCES.items() for source in sources]
    with ThreadPoolExecutor(2) as pool:
        objects = dict(zip(jobs, pool.map(lambda job: compiled(zig, *job), jobs), strict=True))
    library = OUT / "libamontons-check.so"
    parts = [made for (name, _), made in objects.items() if name == "linux-aarch64"]
    run([zig, "cc", "-target", TARGETS["linux-aarch64"].zig, "-shared", "-o", library, *parts])
    binary = read(library.read_bytes())
    assert (binary.system, binary.machine) == ("linux", "aarch64"), binary
    print(f"{len(jobs)} sources compiled for {', '.join(SOURCES)}, a library linked for {binary.machine}: "
          f"{time.monotonic() - begin:.0f} s")  # fmt: skip


if __name__ == "__main__":
    main()
