"""A Python of another processor or system in a folder, for tests: Debian's for aarch64, Maven's for Windows.

Nothing is installed: packages are fetched by the package managers of this machine (apt, pip, mvn) and
unpacked below build/foreign. A message says what is missing.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

from import_library import declared, forwarding

ROOT = Path(__file__).resolve().parent.parent
FOREIGN = ROOT / "build" / "foreign"
# Debian's Python 3.11 with what its modules load, and the C++ runtime of NumPy's wheel.
DEBIAN = (
    "libc6", "libgcc-s1", "libstdc++6", "zlib1g", "libexpat1", "libffi8", "libbz2-1.0", "liblzma5",
    "libuuid1", "libssl3", "libcrypt1", "python3.11-minimal", "python3.11", "libpython3.11-minimal",
    "libpython3.11-stdlib",
)  # fmt: skip
# CPython's own build for Windows, as the JavaCPP presets ship it.
WINDOWS_PYTHON = "org.bytedeco:cpython:3.12.1-1.5.10:jar:windows-x86_64"
NEEDED = ("numpy", "scipy", "h5py")
# NumPy 2 calls functions of complex numbers that the C library of wine 8 lacks.
UNDER_WINE = ("numpy<2", "scipy<1.14", "h5py<3.12")


def program(name: str) -> str | None:
    """The path of a program; Debian has wine64 outside the path."""
    return shutil.which(name) or shutil.which(name, path="/usr/lib/wine")


def _run(*command: object, **options: object) -> None:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **options)  # type: ignore[call-overload]
    if done.returncode:
        sys.stderr.write(done.stdout[-3000:] + done.stderr[-3000:])
        sys.exit(f"amontons: {' '.join(map(str, command[:4]))} ... failed with {done.returncode}")


def debian_root(architecture: str) -> Path:
    """Packages of Debian for another processor, unpacked: what qemu takes as the root of libraries (-L)."""
    root = FOREIGN / f"debian-{architecture}"
    if (root / "done").exists():
        return root
    state = FOREIGN / "apt"
    for folder in ("lists/partial", "cache/archives/partial", "packages"):
        (state / folder).mkdir(parents=True, exist_ok=True)
    (state / "status").touch()
    options = [
        f"-oAPT::Architecture={architecture}", f"-oAPT::Architectures={architecture}",
        f"-oDir::State::lists={state}/lists", f"-oDir::Cache={state}/cache",
        f"-oDir::State::status={state}/status",
    ]  # fmt: skip
    _run("apt-get", *options, "update")
    _run("apt-get", *options, "download", *DEBIAN, cwd=state / "packages")
    for package in sorted((state / "packages").glob(f"*_{architecture}.deb")):
        _run("dpkg-deb", "-x", package, root)
    (root / "done").touch()
    return root


def wheels_for(
    platforms: tuple[str, ...], version: str, folder: Path, needed: tuple[str, ...] = NEEDED
) -> None:
    """The packages that amontons needs, for another system, unpacked."""
    if (folder / "numpy").is_dir():
        return
    tags = [part for platform in platforms for part in ("--platform", platform)]
    _run(sys.executable, "-m", "pip", "install", "--quiet", "--only-binary=:all:", "--no-compile", *tags,
         "--python-version", version, "--implementation", "cp", "--target", folder, *needed)  # fmt: skip


def unpack(wheel: Path, folder: Path) -> None:
    """A wheel of amontons, in place of what was there."""
    shutil.rmtree(folder, ignore_errors=True)
    with zipfile.ZipFile(wheel) as file:
        file.extractall(folder)


def write_stable_dll(home: Path, dll: str, zig: Path) -> None:
    """python3.dll, which JavaCPP leaves out: like CPython's, it forwards names to the DLL of the version."""
    made = home / "python3.dll"
    if made.exists():
        return
    source, nothing = home / "python3.def", home / "nothing.c"
    source.write_text(forwarding("python3", dll, *declared(home / "include")))
    nothing.write_text("int amontons_nothing;\n")
    _run(zig, "cc", "-target", "x86_64-windows-gnu", "-shared", "-nostdlib", "-Wl,--no-entry", nothing,
         source, "-o", made)  # fmt: skip


def windows_python(zig: Path) -> tuple[Path, str]:
    """python.exe for wine and its version ("3.14")."""
    folder = FOREIGN / "windows"
    if not (folder / "done").exists():
        jars = FOREIGN / "jars"
        _run("mvn", "-q", "-B", "org.apache.maven.plugins:maven-dependency-plugin:3.6.1:copy",
             f"-Dartifact={WINDOWS_PYTHON}", f"-DoutputDirectory={jars}")  # fmt: skip
        shutil.rmtree(folder, ignore_errors=True)
        for jar in jars.glob("cpython-*.jar"):
            with zipfile.ZipFile(jar) as file:
                file.extractall(folder)
        (folder / "done").touch()
    (home,) = folder.glob("org/bytedeco/cpython/windows-x86_64")
    (dll,) = (d for d in home.glob("python3??.dll"))
    write_stable_dll(home, dll.stem, zig)
    return home / "python.exe", f"3.{dll.stem[7:]}"


def wine_environment(folders: list[Path]) -> dict[str, str]:
    """Of a program under wine that is to find modules in these folders."""
    prefix = FOREIGN / "wine"
    places = ";".join(f"Z:{folder}".replace("/", "\\") for folder in folders)
    kept = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    return {
        **kept, "WINEPREFIX": str(prefix), "WINEDEBUG": "-all", "WINEARCH": "win64", "PYTHONPATH": places,
        "PYTHONDONTWRITEBYTECODE": "1",
    }  # fmt: skip
