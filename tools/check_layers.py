"""Checks that the layers of ARCHITECTURE.md hold, in C++ and in Python; prints every violation.

C++ (include/amontons, src): see layers_cpp.py. bindings may use everything but Eigen.
Python: a module may import its own package and those before it in PACKAGES, wherever in the file the import
stands, and modules import each other without a cycle; what stands below `if TYPE_CHECKING:` does not count.
amontons/__init__.py is the door and may import all up to DOOR.
"""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

from cycles import Graph, find_cycle
from layers_cpp import check_cpp

# Python packages from the bottom up; those in one bracket do not know each other. Modules beside them are
# below all, but for those that only give a package another name.
PACKAGES = [
    ("model", "problem"),
    ("simulation",),
    ("io",),
    ("scenes",),
    ("report", "studies"),
    ("viewer",),
    ("cli", "gym"),
]
ALIASES = {"amontons.shapes": "model", "amontons.__main__": "cli"}
DOOR = "viewer"


def imports(tree: ast.Module, module: str, is_package: bool) -> Iterator[tuple[str, int]]:
    """(imported dotted name, line), inside functions too; `if TYPE_CHECKING:` does not count."""
    package = module.split(".") if is_package else module.split(".")[:-1]

    def visit(node: ast.AST) -> Iterator[tuple[str, int]]:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            for child in node.orelse:
                yield from visit(child)
            return
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            prefix = ".".join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                yield f"{prefix}.{alias.name}", node.lineno
        for child in ast.iter_child_nodes(node):
            yield from visit(child)

    yield from visit(tree)


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


def check_python(root: Path) -> Iterator[str]:
    files = {}
    for file in sorted((root / "python" / "amontons").rglob("*.py")):
        parts = file.relative_to(root / "python").with_suffix("").parts
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    known = {*files, "amontons._core"}  # the compiled module imports nothing of the package
    order = " < ".join(", ".join(packages) for packages in PACKAGES)
    graph: Graph = {}
    for module, file in files.items():
        for name, line in imports(ast.parse(file.read_text()), module, file.name == "__init__.py"):
            if name.split(".")[0] != "amontons":
                continue
            target = name if name in known else name.rpartition(".")[0]
            if target in known and target != module:
                graph.setdefault(module, set()).add(target)
            if not may_import(module, name):
                where = f"{file.relative_to(root)}:{line}"
                yield f"{where}: {module} may not import {name} (packages: {order})"
    if cycle := find_cycle(graph):
        yield "import cycle: " + " -> ".join(cycle)


def violations(root: Path) -> list[str]:
    return [*check_cpp(root), *check_python(root)]


if __name__ == "__main__":
    found = violations(Path(__file__).resolve().parent.parent)
    print("\n".join(found) if found else "layers hold")
    sys.exit(bool(found))
