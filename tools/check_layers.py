"""Checks that the layers of ARCHITECTURE.md hold, in C++ and in Python; prints every violation.

C++ (include/amontons, src): see layers_cpp.py. bindings may use everything but libraries for sources.
Python: a module may import its own package and those before it in PACKAGES, and modules import each other
without a cycle, wherever in the file an import stands: inside functions and below `if TYPE_CHECKING:` too.
amontons/__init__.py is the door and may import all up to DOOR. For extras see layers_extras.py too.
The scripts of FOLDERS have no layers, but they import each other without a cycle too.
"""

import ast
import itertools
import sys
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from cycles import Graph, find_cycles
from layers_cpp import check_cpp
from layers_extras import CORE_USERS, DOORS, ENGINE, OFFERED, extra_faults

# Python packages from the bottom up; those in one bracket do not know each other. Modules beside them are
# below all, but for those that only give a package another name.
PACKAGES = [
    ("model", "problem"),
    ("simulation",),
    ("io",),
    ("scenes",),
    ("report",),
    ("studies",),
    ("viewer", "device"),
    ("cli", "gym"),
]
ALIASES = {
    "amontons.shapes": "model",
    "amontons.torch": "studies",
    "amontons.jax": "studies",
    "amontons.__main__": "cli",
    "amontons.vi": "viewer",
    "amontons.parts": "viewer",
    "amontons.results": "viewer",
}
DOOR = "viewer"
FOLDERS = ("tools", "benchmarks")


def imports(tree: ast.Module, module: str, is_package: bool) -> Iterator[tuple[str, int]]:
    """(imported dotted name, line) of all imports of a module, wherever they stand."""
    package = module.split(".") if is_package else module.split(".")[:-1]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            prefix = ".".join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                yield f"{prefix}.{alias.name}", node.lineno


def package_of(module: str) -> str:
    """The package of PACKAGES to which a module belongs, "" for one beside them."""
    part = ALIASES.get(module) or module.partition(".")[2].partition(".")[0]
    return part if rank(part) else ""


def rank(package: str) -> int:
    return next((k for k, packages in enumerate(PACKAGES, 1) if package in packages), 0)


def may_import(module: str, other: str) -> bool:
    own, theirs = package_of(module), package_of(other)
    if module == "amontons":
        return rank(theirs) <= rank(DOOR)
    return own == theirs or rank(theirs) < rank(own)


@dataclass(frozen=True)
class Import:
    """An import between two modules of one folder."""

    importer: str
    name: str
    """dotted, of a module or of what a module defines"""
    target: str
    """the module"""
    where: str
    """file and line"""


def imports_below(root: Path, top: str, *, compiled: frozenset[str] = frozenset()) -> Iterator[Import]:
    """All imports of modules below the folder `top`, or of compiled ones, by modules below it."""
    files = {}
    for file in sorted((root / top).rglob("*.py")):
        parts = file.relative_to(root / top).with_suffix("").parts
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    known = files.keys() | compiled
    tops = {module.partition(".")[0] for module in known}
    for module, file in files.items():
        for name, line in imports(ast.parse(file.read_text()), module, file.name == "__init__.py"):
            if name.partition(".")[0] in tops:
                target = name if name in known else name.rpartition(".")[0]
                yield Import(module, name, target, f"{file.relative_to(root)}:{line}")


def cycle_faults(found: list[Import]) -> Iterator[str]:
    graph: Graph = {}
    witness: dict[tuple[str, str], str] = {}
    for one in found:
        if one.target != one.importer:
            graph.setdefault(one.importer, set()).add(one.target)
            witness.setdefault((one.importer, one.target), one.where)
    for cycle in find_cycles(graph):
        steps = "; ".join(f"{witness[pair]} imports {pair[1]}" for pair in itertools.pairwise(cycle))
        yield f"import cycle {' -> '.join(cycle)}: {steps}; move what both need into a third module"


def check_python(
    root: Path, offered: Mapping[str, Collection[str]], core_users: Collection[str]
) -> Iterator[str]:
    # The compiled module imports nothing of the package.
    found = list(imports_below(root, "python", compiled=frozenset(["amontons._core"])))
    order = " < ".join(", ".join(packages) for packages in PACKAGES)
    for one in found:
        if not may_import(one.importer, one.name):
            yield f"{one.where}: {one.importer} may not import {one.name} (packages: {order})"
    modules = {one.importer for one in found} - {*DOORS}
    extras = {module for module in modules if package_of(module) not in ("", *ENGINE)}
    yield from extra_faults(found, extras, offered, core_users)
    yield from cycle_faults(found)
    for folder in FOLDERS:
        yield from cycle_faults(list(imports_below(root, folder)))


def violations(
    root: Path,
    offered: Mapping[str, Collection[str]] = OFFERED,
    core_users: Collection[str] = CORE_USERS.keys(),
) -> list[str]:
    return [*check_cpp(root), *check_python(root, offered, core_users)]


if __name__ == "__main__":
    found = violations(Path(__file__).resolve().parent.parent)
    print("\n".join(found) if found else "layers hold")
    sys.exit(bool(found))
