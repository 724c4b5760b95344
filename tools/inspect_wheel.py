"""Checks a wheel by reading it: name and tags, size, the libraries that its module loads, the oldest system.

    python tools/inspect_wheel.py dist/*.whl

auditwheel, delocate and delvewheel do this on the systems that they are for; here all three are read on any.
Prints a table with a row for each wheel; exit status 1 and the faults if there are any.
"""

from __future__ import annotations

import base64
import hashlib
import re
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

from binaries import Binary, read
from wheel_targets import MOST_BYTES, PYTHONS, TARGETS, Target, tag

# What every system of the kind has: glibc and its parts, libSystem, the DLLs of Windows 10 and its C library.
ALLOWED = {
    "linux": re.compile(r"lib(c|m|dl|rt|pthread)\.so\.\d|ld-linux-[\w-]+\.so\.\d"),
    "macos": re.compile(r"/usr/lib/lib(System\.B|c\+\+\.1|c\+\+abi)\.dylib"),
    "windows": re.compile(
        r"(kernel32|ntdll|advapi32|python3|python311|api-ms-win-[\w-]+)\.dll", re.IGNORECASE
    ),
}
# Of a folder in which somebody built it: no such file is on the machine of the user.
FOLDERS = re.compile(rb"/(?:home|root|Users|build|work|tmp)/[\w.+-]+/[\w./+-]+|[A-Z]:\\Users\\[\w\\.]+")


def wheel_of(name: str) -> tuple[str, Target] | None:
    """The Python ("abi3", "cp311") and the target that the name of a wheel says."""
    tags = name.removesuffix(".whl").split("-", 2)[-1]
    for target in TARGETS.values():
        for python in PYTHONS:
            if tags == tag(target, python):
                return python, target
    return None


def faults(path: Path) -> Iterator[str]:
    """All that is wrong with a wheel."""
    found = wheel_of(path.name)
    if found is None:
        yield "the tags in the name are none of the table in tools/wheel_targets.py"
        return
    python, target = found
    if path.stat().st_size > MOST_BYTES:
        yield f"{path.stat().st_size / 1e6:.1f} MB, more than {MOST_BYTES / 1e6:.0f} MB"
    with zipfile.ZipFile(path) as wheel:
        names = wheel.namelist()
        (info,) = {n.split("/")[0] for n in names if n.split("/")[0].endswith(".dist-info")}
        told = wheel.read(f"{info}/WHEEL").decode()
        if f"Tag: {tag(target, python)}\n" not in told or "Root-Is-Purelib: false\n" not in told:
            yield "WHEEL has other tags than the name"
        yield from _record_faults(wheel, info)
        modules = [n for n in names if n.endswith((".so", ".pyd", ".dll", ".dylib"))]
        wanted = {f"amontons/{target.module(python)}", f"amontons/{target.unit}"}
        if set(modules) != wanted or len(modules) != 2:
            yield f"has the modules {modules}, not {sorted(wanted)}"
        for name in modules:
            if name.startswith("amontons/_core"):
                yield from module_faults(wheel.read(name), target, python)
            else:
                yield from library_faults(wheel.read(name), target)


def _record_faults(wheel: zipfile.ZipFile, info: str) -> Iterator[str]:
    listed = {}
    for line in wheel.read(f"{info}/RECORD").decode().splitlines():
        name, said, _ = line.rsplit(",", 2)
        listed[name] = said
    for name in set(wheel.namelist()) ^ set(listed):
        yield f"{name} is in one of the wheel and its RECORD only"
    for name, said in listed.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(wheel.read(name)).digest()).rstrip(b"=").decode()
        if said and said != f"sha256={digest}":
            yield f"{name} has another hash than RECORD says"


def module_faults(data: bytes, target: Target, python: str) -> Iterator[str]:
    """What is wrong with an extension module for a system."""
    yield from library_faults(data, target, python)
    begin = {"linux": b"PyInit__core", "macos": b"_PyInit__core", "windows": b"PyInit__core"}[target.system]
    if begin not in data:
        yield "has no PyInit__core"


def library_faults(data: bytes, target: Target, python: str | None = None) -> Iterator[str]:
    """What is wrong with a library; `python` is that of a module, or None if it loads no Python."""
    try:
        binary = read(data)
    except ValueError as error:
        yield f"the module {error}"
        return
    if (binary.system, binary.machine) != (target.system, target.machine):
        yield f"the module is for {binary.system} on {binary.machine}"
        return
    for library in binary.libraries:
        if not ALLOWED[target.system].fullmatch(library):
            yield f"loads {library}, which not every {target.system} has"
    yield from _system_faults(binary, target, python)
    for folder in binary.search:
        yield f"looks for libraries in {folder}"
    own = str(Path(__file__).resolve().parent.parent).encode()
    for found in sorted({*FOLDERS.findall(data), *re.findall(re.escape(own), data)}):
        yield f"names {found.decode(errors='replace')}, a place where it was built"


def _system_faults(binary: Binary, target: Target, python: str | None) -> Iterator[str]:
    """The oldest system, and what only one of them asks for."""
    if target.system == "windows":
        dll = "python3.dll" if python == "abi3" else "python311.dll"
        if python and dll not in [library.lower() for library in binary.libraries]:
            yield f"does not load {dll}"
        return
    most = target.zig.split("gnu.")[-1] if target.system == "linux" else target.zig.split("macos.")[-1]
    if _numbers(binary.oldest) > _numbers(most):
        what = "glibc" if target.system == "linux" else "macOS"
        yield f"asks for {what} {binary.oldest}, newer than {most}"
    if target.system == "macos" and target.machine == "aarch64" and not binary.signed:
        yield "has no signature, without which Apple silicon loads nothing"


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split(".") if part)


HEAD = ("| File | MB | Oldest system | Loads | Inspected as |", "|---|--:|---|---|---|")
FORMATS = {"linux": "ELF", "macos": "Mach-O", "windows": "PE"}


def row(path: Path, also: str = "") -> str:
    """A wheel without faults in the table of HEAD; `also` says what else inspected it."""
    with zipfile.ZipFile(path) as wheel:
        (module,) = (
            n for n in wheel.namelist() if n.startswith("amontons/_core.") and n.endswith((".so", ".pyd"))
        )
        binary = read(wheel.read(module))
    names = [Path(name).name for name in binary.libraries]
    crt = [name for name in names if name.startswith("api-ms-win-crt")]
    loads = [name for name in names if name not in crt] + ["api-ms-win-crt-*"] * bool(crt)
    found = wheel_of(path.name)
    oldest = found[1].oldest if found else ""
    if binary.system == "linux":
        oldest += f" (asks for {binary.oldest})"
    read_as = f"{FORMATS[binary.system]}{also}"
    return f"| `{path.name}` | {path.stat().st_size / 1e6:.2f} | {oldest} | {', '.join(loads)} | {read_as} |"


def main() -> int:
    paths = [Path(a) for a in sys.argv[1:]]
    if not paths:
        sys.exit("amontons: name wheels, as in: python tools/inspect_wheel.py dist/*.whl")
    wrong = 0
    print("\n".join(HEAD))
    for path in paths:
        found = list(faults(path))
        print(row(path) if not found else f"| `{path.name}` | {'; '.join(found)} | | | |", flush=True)
        wrong += bool(found)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
