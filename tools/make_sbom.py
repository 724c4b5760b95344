"""Writes which projects are compiled into the module amontons._core, as CycloneDX JSON.

    python tools/make_sbom.py --module FILE --include FOLDER [--include FOLDER ...]
                              [--runtime libc++|libstdc++] [--compiler "ID VERSION"] [--system NAME] -o FILE

CMake calls it after it has linked the module; the file goes into `amontons-VERSION.dist-info/sboms` of the
wheel (PEP 770). Versions are read from the headers that were compiled. The C++ runtime counts as a part where
the module does not name it as a shared library. The file has no date and no random number: the same build
gives the same bytes. For a wheel of another system, `with_other_module` changes the bill of a wheel made here
(tools/pack_wheel.py). Standard library only.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Part:
    """A project of which headers or sources are compiled into the module."""

    name: str
    licence: str  # SPDX
    purl: str  # package URL without version
    header: str  # the file that tells the version, below one of the include folders
    macros: tuple[str, ...]  # whose numbers make the version


PARTS = (
    Part("nanobind", "BSD-3-Clause", "pkg:pypi/nanobind", "nanobind/nanobind.h",
         ("NB_VERSION_MAJOR", "NB_VERSION_MINOR", "NB_VERSION_PATCH")),
    Part("robin-map", "MIT", "pkg:github/Tessil/robin-map", "tsl/robin_growth_policy.h",
         ("TSL_RH_VERSION_MAJOR", "TSL_RH_VERSION_MINOR", "TSL_RH_VERSION_PATCH")),
    Part("eigen", "MPL-2.0", "pkg:generic/eigen", "Eigen/src/Core/util/Macros.h",
         ("EIGEN_WORLD_VERSION", "EIGEN_MAJOR_VERSION", "EIGEN_MINOR_VERSION")),
    Part("nlohmann-json", "MIT", "pkg:github/nlohmann/json", "nlohmann/detail/abi_macros.hpp",
         ("NLOHMANN_JSON_VERSION_MAJOR", "NLOHMANN_JSON_VERSION_MINOR", "NLOHMANN_JSON_VERSION_PATCH")),
)  # fmt: skip
RUNTIMES = {
    "libc++": ("Apache-2.0 WITH LLVM-exception", (b"libc++.so", b"libc++.1.dylib", b"libc++.dll")),
    "libstdc++": (
        "GPL-3.0-or-later WITH GCC-exception-3.1",
        (b"libstdc++.so", b"libstdc++.6.dylib", b"libstdc++-6.dll"),
    ),
}


def version_of(part: Part, folders: list[Path]) -> str:
    """The version that the header of a part states; ends the program if no folder has the header."""
    for folder in folders:
        header = folder / part.header
        if header.is_file():
            text = header.read_text(encoding="utf-8", errors="replace")
            found = [re.search(rf"#define\s+{macro}\s+(\d+)", text) for macro in part.macros]
            if all(found):
                return ".".join(number[1] for number in found if number)
    sys.exit(f"amontons: no version of {part.name}: {part.header} is in none of the folders of --include")


def component(name: str, licence: str, version: str, purl: str) -> dict[str, Any]:
    single = " " not in licence
    stated = {"license": {"id": licence}} if single else {"expression": licence}
    whole = f"{purl}@{version}" if version else purl
    told = {"version": version} if version else {}
    return {"type": "library", "bom-ref": whole, "name": name, **told, "licenses": [stated], "purl": whole}


def inside(module: bytes, runtime: str) -> bool:
    """Whether the C++ runtime is a part of the module: no shared library of its name is loaded."""
    return not any(name in module for name in RUNTIMES[runtime][1])


def runtime_parts(module: bytes, runtime: str, compiler: str, system: str) -> list[dict[str, Any]]:
    """What the compiler adds to a module."""
    parts = []
    if runtime and inside(module, runtime):
        version = compiler.rpartition(" ")[2]
        parts.append(component(runtime, RUNTIMES[runtime][0], version, f"pkg:generic/{runtime}"))
    if system == "Windows":
        parts.append(component("mingw-w64", "ZPL-2.1", "", "pkg:generic/mingw-w64"))
    return parts


def bill(module: Path, folders: list[Path], runtime: str, compiler: str, system: str) -> dict[str, Any]:
    """The bill of materials as CycloneDX 1.6."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    parts = [component(p.name, p.licence, version_of(p, folders), p.purl) for p in PARTS]
    parts += runtime_parts(module.read_bytes(), runtime, compiler, system)
    own = component(project["name"], project["license"], project["version"], f"pkg:pypi/{project['name']}")
    return _assembled(own, parts, compiler, system)


def with_other_module(
    base: dict[str, Any], module: bytes, runtime: str, compiler: str, system: str
) -> dict[str, Any]:
    """The bill of a wheel, for the same sources compiled for another system by another compiler."""
    parts = [p for p in base["components"] if p["name"] not in (*RUNTIMES, "mingw-w64")]
    parts += runtime_parts(module, runtime, compiler, system)
    return _assembled(base["metadata"]["component"], parts, compiler, system)


def _assembled(
    own: dict[str, Any], parts: list[dict[str, Any]], compiler: str, system: str
) -> dict[str, Any]:
    return {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "component": own,
            "properties": [
                {"name": "amontons:compiler", "value": compiler},
                {"name": "amontons:system", "value": system},
            ],
        },
        "components": parts,
        "dependencies": [{"ref": own["bom-ref"], "dependsOn": [p["bom-ref"] for p in parts]}],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--module", type=Path, required=True)
    parser.add_argument("--include", type=Path, action="append", required=True)
    parser.add_argument("--runtime", choices=("", *RUNTIMES), default="")
    parser.add_argument("--compiler", default="")
    parser.add_argument("--system", default="")
    parser.add_argument("-o", "--output", type=Path, required=True)
    given = parser.parse_args()
    made = bill(given.module, given.include, given.runtime, given.compiler, given.system)
    given.output.write_text(json.dumps(made, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
